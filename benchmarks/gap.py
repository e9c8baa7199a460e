"""Which part of the surrogate robots' reality gap costs what, and what training with whole
surrogates gives back.

    python benchmarks/gap.py

Writes benchmarks/results/gap.json; docs/guide/robot.md quotes it.
"""

import json
from pathlib import Path

from kept import write_kept

from feeler.decoding.transfer import TransferClassifier
from feeler.robot import (
    Gap,
    draw_robots,
    make_touches,
    make_training,
    measure_transfer,
    touch_robots,
)

N_ROBOTS, SEED = 20, 0
QUIET = 4e-5  # rad: a channel that repeats one value to the last bit counts as broken
MECHANICS = ("stiffness", "stiffness_each", "damping", "mass", "length", "rest_angle", "play")
TOUCH = ("location", "speed", "size", "approach", "friction")
SINGLE = ("play", "noise", "drift", "gain", "crosstalk", "hysteresis", "bend", "dropped")
PARTS = {
    "nothing": (),
    "everything": tuple(vars(Gap())),
    "all mechanics": MECHANICS,
    "all of the touch": TOUCH,
    "all sensing": tuple(name for name in vars(Gap()) if name not in MECHANICS + TOUCH),
    **{name: (name,) for name in SINGLE},
}


def describe(score) -> dict[str, list[float]]:
    return {
        what: [round(float(value), 3) for value in score.share(what)]
        for what in ("all", "feature", "top2")
    }


def main() -> None:
    training, tested = make_training(), touch_robots(draw_robots(1.0, N_ROBOTS, SEED))
    classifier, found = TransferClassifier().fit(training.values, training.labels), {}
    for name, entries in PARTS.items():
        gap = {"noise": QUIET} | {entry: getattr(Gap(), entry) for entry in entries}
        alone = Gap(**dict.fromkeys(vars(Gap()), 0.0) | gap)
        robots = draw_robots(1.0, N_ROBOTS, SEED, gap=alone)
        found[name] = describe(measure_transfer(classifier, touch_robots(robots)))
    for count in (2, 5):
        joined = training
        for touches in touch_robots(draw_robots(1.0, count, SEED + 1), trials=make_touches()):
            joined = joined.join(touches)
        joined = joined.take(joined.touched.nonzero()[0])
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
