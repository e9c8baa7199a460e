"""How often `feeler robot classify` is right when it says how sure it is, on robots held out.

Thirty surrogate robots of seed 424242, which no choice has seen, feel the paper's thirty touches.
Beside: what is called unlike any touch, of noise, drift, taps beside and objects never trained on.

    python benchmarks/reliability.py        # writes docs/images/reliability.png, prints the numbers
"""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler.decoding.clouds import measure_calibration
from feeler.plotting import style
from feeler.robot import (
    align_recordings,
    draw_robots,
    make_classifier,
    make_robot,
    make_touches,
    touch_robots,
)
from feeler.robot.recording import Recording
from feeler.stimulus import Ball, Box, make_feature

SEED, ROBOTS, STRANGERS = 424242, 30, 5
OBJECTS = {
    "ball of 1 mm": Ball(radius=1.0),
    "ball of 2 mm": Ball(radius=2.0),
    "ball of 8 mm": Ball(radius=8.0),
    "ball of 12 mm": Ball(radius=12.0),
    "ball of 20 mm": Ball(radius=20.0),
    "box of 1.5 mm": Box(half_width=1.5, half_height=1.5),
    "box of 10 mm": Box(half_width=10.0, half_height=4.0),
    "box of 20 mm": Box(half_width=20.0, half_height=20.0),
    "triangle of 4 mm": make_feature("triangle", 4.0),
}


def take(read):
    """Whole tensors and their labels, of several robots."""
    values = np.concatenate([touches.values for touches in read])
    labels = [label for touches in read for label in touches.labels]
    felt = np.isfinite(values).all(axis=(1, 2))
    return values[felt], [label for label, seen in zip(labels, felt, strict=True) if seen]


def make_untouched(rng):
    """Recordings without any touch, by name: white noise and random walks."""
    antenna, made = make_robot(), {}
    for sd in (0.005, 0.02, 0.1):
        made[f"white noise of {sd:g} rad"] = sd * rng.standard_normal((200, 8, 1800))
    for sd in (0.0005, 0.002, 0.008):
        made[f"drift of {sd:g} rad/√ms"] = np.cumsum(rng.normal(0, sd, (200, 8, 2000)), axis=2)
    for name, values in made.items():
        time = np.arange(values.shape[2], dtype=float)
        read = [Recording(time=time, values=one) for one in values]
        yield name, align_recordings(read, antenna)


def draw(table, error, path):
    """The reliability diagram: share right against the probability that was said."""
    with style():
        figure = Figure(figsize=(4.2, 3.6), layout="constrained")
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], "k:", lw=1, label="as sure as right")
        seen = table[:, 2] > 0
        axes.plot(table[seen, 0], table[seen, 1], "o-", label=f"held-out robots, ECE {error:.3f}")
        for said, share, count in table[seen]:
            axes.annotate(f"{count:.0f}", (said, share), (6, -9), textcoords="offset points")
        axes.set(xlabel="probability of the answer", ylabel="share right", xlim=(0, 1), ylim=(0, 1))
        axes.legend(loc="upper left")
        figure.savefig(path, dpi=150)


def main():
    """Measure, print and draw."""
    reader = make_classifier()
    values, labels = take(touch_robots(draw_robots(1.0, ROBOTS, SEED), trials=make_touches()))
    chance = reader.predict_proba(values)
    answers = [reader.classes_[k] for k in chance.argmax(axis=1)]
    right = np.array([one == true for one, true in zip(answers, labels, strict=True)])
    error, table = measure_calibration(chance.max(axis=1), right)
    print(f"{right.size} touches, {right.mean():.1%} right, ECE {error:.3f}")
    print(f"mean probability where right {chance.max(axis=1)[right].mean():.2f},", end=" ")
    print(f"where wrong {chance.max(axis=1)[~right].mean():.2f}")
    print(f"false alarms {np.mean(reader.measure_strangeness(values) > 1):.1%}")
    draw(table, error, Path(__file__).parents[1] / "docs/images/reliability.png")
    strange = list(make_untouched(np.random.default_rng(5)))
    robots = draw_robots(1.0, STRANGERS, 777)
    beside = make_touches(locations=(0.2, 0.3, 0.35))
    kinds = {"taps beside, at 0.2 to 0.35": beside}
    kinds |= {name: make_touches(features=[one]) for name, one in OBJECTS.items()}
    for name, trials in kinds.items():
        read = touch_robots(robots, trials=trials)
        strange.append((name, np.concatenate([touches.values for touches in read])))
    for name, given in strange:
        felt = given[np.isfinite(given).all(axis=(1, 2))]
        share = np.mean(reader.measure_strangeness(felt) > 1)
        quiet = len(given) - len(felt)
        print(f"{name:28} {len(given):4d}: {quiet:3d} no contact, unlike all {share:.1%} of others")


if __name__ == "__main__":
    main()
