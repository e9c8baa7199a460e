"""Which part of the surrogate robots' reality gap costs what, and what training with whole
surrogates gives back.

    python benchmarks/gap.py

Writes benchmarks/results/gap.json; docs/guide/robot.md quotes it. `feeler robot gap` measures the
first part for any robot.
"""

import json
from pathlib import Path

from kept import write_kept

from feeler.decoding.transfer import TransferClassifier
from feeler.robot import (
    add_robots,
    draw_robots,
    make_training,
    measure_parts,
    measure_transfer,
    touch_robots,
)

N_ROBOTS, SEED = 20, 0


def describe(score) -> dict[str, list[float]]:
    return {
        what: [round(float(value), 3) for value in score.share(what)]
        for what in ("all", "feature", "top2")
    }


def main() -> None:
    found = {
        name: describe(score)
        for name, score in measure_parts(n_robots=N_ROBOTS, seed=SEED).items()
    }
    training, tested = make_training(), touch_robots(draw_robots(1.0, N_ROBOTS, SEED))
    for count in (2, 5):
        joined = add_robots(training, draw_robots(1.0, count, SEED + 1))
        score = measure_transfer(TransferClassifier().fit(joined.values, joined.labels), tested)
        found[f"trained with {count} whole surrogates"] = describe(score)
    for name, shares in found.items():
        print(f"{name:18} {shares}")
    data = {
        "robots": N_ROBOTS,
        "contacts": 6 * N_ROBOTS,
        "shares_with_95_percent_interval": found,
    }
    path = Path(__file__).parent / "results" / "gap.json"
    write_kept(path, json.dumps(data, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
