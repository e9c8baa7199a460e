"""Which part of the surrogate robots' reality gap costs what: each part alone at full size, the others absent.

    python benchmarks/gap.py

Writes benchmarks/results/gap.json; docs/guide/robot.md quotes it.
"""

import json
from dataclasses import fields
from pathlib import Path

from feeler.decoding.transfer import TransferClassifier
from feeler.robot import Gap, add_robots, draw_robots, make_training, measure_transfer, touch_robots

N_ROBOTS, SEED = 20, 0
MECHANICS = ("stiffness", "stiffness_each", "damping", "mass", "length", "rest_angle", "play")
TOUCH = ("location", "speed", "size", "approach", "friction")
SENSING = tuple(entry.name for entry in fields(Gap) if entry.name not in MECHANICS + TOUCH)
PARTS = {
    "everything": MECHANICS + TOUCH + SENSING,
    "mechanics alone": MECHANICS,
    "touch alone": TOUCH,
    "sensing alone": SENSING,
    **{f"{name} alone": (name,) for name in ("noise", "drift", "gain", "crosstalk")},
}


def keep(names: tuple[str, ...]) -> Gap:
    """One reality gap with only these entries."""
    full = Gap()
    return Gap(**{entry.name: getattr(full, entry.name) if entry.name in names else 0.0 for entry in fields(Gap)})


def describe(score) -> dict[str, list[float]]:
    return {what: [round(float(value), 3) for value in score.share(what)] for what in ("all", "feature", "top2")}


def main() -> None:
    training = make_training()
    classifier = TransferClassifier().fit(training.values, training.labels)
    found = {}
    for name, names in PARTS.items():
        robots = draw_robots(1.0, N_ROBOTS, SEED, gap=keep(names))
        found[name] = describe(measure_transfer(classifier, touch_robots(robots)))
        print(f"{name:18} {found[name]}", flush=True)
    tested = touch_robots(draw_robots(1.0, N_ROBOTS, SEED))
    for count in (2, 5):
        joined = add_robots(training, draw_robots(1.0, count, SEED + 1))
        score = measure_transfer(TransferClassifier().fit(joined.values, joined.labels), tested)
        found[f"trained with {count} whole surrogates"] = describe(score)
        print(f"with {count} surrogates {describe(score)}", flush=True)
    data = {"robots": N_ROBOTS, "contacts": 6 * N_ROBOTS, "shares_with_95_percent_interval": found}
    path = Path(__file__).parent / "results" / "gap.json"
    path.write_text(json.dumps(data, indent=1, sort_keys=True) + "\n")


if __name__ == "__main__":
    main()
