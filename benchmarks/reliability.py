"""How often `feeler robot classify` is right when it says how sure it is, on robots held out.

Thirty surrogate robots of a seed that no choice has seen feel the paper's thirty touches. Beside:
what is called unlike any touch, of noise, drift, taps beside, and of a family of objects that was
declared before any result. The last column is of a classifier that knows place and speed, was shown
touches of the very object by other robots, and raises as many false alarms: where even that one
misses an object, its touches lie among those that are known.

    python benchmarks/reliability.py        # writes docs/images/reliability.png, prints the numbers
    python benchmarks/reliability.py stream # what is said while touches go on
    python benchmarks/reliability.py wires  # one to three dead sensors of ten
    python benchmarks/reliability.py wires  # one to three dead sensors of ten
"""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure

from feeler.decoding.observers import StudentTClassifier
from feeler.objects import Ball, Box, Outline, make_feature
from feeler.plotting import style
from feeler.robot import (
    align_recordings,
    draw_robots,
    draw_training_set,
    load_robot,
    make_classifier,
    make_decoder,
    make_robot,
    make_touches,
    touch_robots,
)
from feeler.robot.description import write_robot
from feeler.robot.recordings import Recording

SEED, ROBOTS = 20261125, 30
STRANGERS, SHOWN = 12, 4  # robots that feel each object; parts of which one is held out in turn
SIZES = (1.0, 2.0, 8.0, 12.0, 20.0)
ALARM = 0.05
STREAM_SEED, STREAM_ROBOTS, STREAM_NOISE = 20261201, 4, 40


def make_hexagon(size):
    """A regular hexagon of that radius."""
    angle = np.arange(6) * np.pi / 3
    corners = size * np.column_stack([np.cos(angle), np.sin(angle)])
    return Outline(vertices=corners, name=f"hexagon {size:g}")


def make_family():
    """Objects that are never trained on; half of the shapes are none of the strangers' either."""
    made = {}
    for size in SIZES:
        made[f"ball {size:g}"] = Ball(radius=size)
        made[f"box {size:g}"] = Box(half_width=size, half_height=size)
        made[f"triangle {size:g}"] = make_feature("triangle", size)
        made[f"hexagon {size:g}"] = make_hexagon(size)
    return made | {"triangle 4": make_feature("triangle", 4.0), "hexagon 4": make_hexagon(4.0)}


def take(read):
    """Tensors with contact, their labels, robots, and how many touches there were."""
    values = np.concatenate([touches.values for touches in read])
    labels = [label for touches in read for label in touches.labels]
    robots = np.repeat(np.arange(len(read)), [len(touches.labels) for touches in read])
    felt = np.isfinite(values).all(axis=(1, 2))
    kept = [label for label, seen in zip(labels, felt, strict=True) if seen]
    return values[felt], kept, robots[felt], len(values)


def make_untouched(rng):
    """Recordings without any touch, by name: white noise and random walks."""
    antenna, made = make_robot(), {}
    for sd in (0.005, 0.02, 0.1):
        made[f"white noise of {sd:g} rad"] = sd * rng.standard_normal((100, 8, 1800))
    for sd in (0.0005, 0.002, 0.008):
        made[f"drift of {sd:g} rad/√ms"] = np.cumsum(rng.normal(0, sd, (100, 8, 2000)), axis=2)
    for name, values in made.items():
        time = np.arange(values.shape[2], dtype=float)
        read = [Recording(time=time, values=one) for one in values]
        yield name, align_recordings(read, antenna)


def list_places(labels):
    """What a touch is beside its object."""
    return np.array([f"{location:g} {speed:g}" for _, location, speed in labels])


def locate(classifier, values):
    """Tensors as the classifier has them: among components in which each class is round."""
    return classifier._place(classifier._flatten(values))


def measure_detectable(classifier, known, strange):
    """Share of an object's touches that a classifier finds which was shown it, too."""
    place = {"k": locate(classifier, known[0]), "s": locate(classifier, strange[0])}
    at, met = list_places(known[1]), list_places(strange[1])
    means, along = classifier._means @ classifier._round.T, classifier._others._along
    own = list_places(classifier.classes_)
    found = total = 0
    for part in range(SHOWN):
        held = strange[2] % SHOWN == part
        for one in np.unique(met[~held]):
            taught, asked = ~held & (met == one), held & (met == one)
            middle, rivals = place["s"][taught].mean(axis=0), means[own == one]
            base = rivals[np.argmin(((rivals - middle) ** 2).sum(axis=1))]
            target = base + along @ (along.T @ (middle - base))

            def score(z, rivals=rivals, target=target):
                nearest = ((z[:, None] - rivals) ** 2).sum(axis=2).min(axis=1)
                return nearest - ((z - target) ** 2).sum(axis=1)

            limit = np.quantile(score(place["k"][at == one]), 1 - ALARM)
            found += np.sum(score(place["s"][asked]) > limit)
            total += asked.sum()
    return found / total


def draw(table, error, path):
    """The reliability diagram: share right against the probability that was said."""
    with style():
        figure = Figure(figsize=(4.2, 3.6), layout="constrained")
        axes = figure.subplots()
        axes.plot([0, 1], [0, 1], "k:", lw=1, label="as sure as right")
        seen = table[:, 2] > 0
        axes.plot(
            table[seen, 0], table[seen, 1], "o-", label=f"held-out robots, ECE {error:.3f}"
        )
        for said, share, count in table[seen]:
            axes.annotate(f"{count:.0f}", (said, share), (6, -9), textcoords="offset points")
        axes.set(
            xlabel="probability of the answer", ylabel="share right", xlim=(0, 1), ylim=(0, 1)
        )
        axes.legend(loc="upper left")
        figure.savefig(path, dpi=150)


def measure_calibration(
    probability: np.ndarray, right: np.ndarray, bins: int = 10
) -> tuple[float, np.ndarray]:
    """Expected calibration error of answers, and the reliability diagram behind it.

    Parameters
    ----------
    probability, right
        Of each answer (trial,): its probability, and whether it was right.
    bins
        Of equal width between 0 and 1.

    Returns
    -------
    error
        Mean of |share right − mean probability| over the bins, weighed by their answers.
    table
        (bin, 3) mean probability, share right and number of answers; NaN where there is none.
    """
    probability, right = np.asarray(probability, dtype=float), np.asarray(right, dtype=bool)
    place = np.minimum((probability * bins).astype(int), bins - 1)
    table = np.full((bins, 3), np.nan)
    table[:, 2] = np.bincount(place, minlength=bins)
    for k in np.unique(place):
        table[k, :2] = probability[place == k].mean(), right[place == k].mean()
    gaps = np.nan_to_num(np.abs(table[:, 1] - table[:, 0]))
    return float(np.average(gaps, weights=table[:, 2])), table


def judge_known(classifier, known):
    """Print how right and how sure answers to known touches are, and draw it."""
    chance = classifier.predict_proba(known[0])
    answers = [classifier.classes_[k] for k in chance.argmax(axis=1)]
    right = np.array([one == true for one, true in zip(answers, known[1], strict=True)])
    error, table = measure_calibration(chance.max(axis=1), right)
    print(f"{right.size} touches, {right.mean():.1%} right, ECE {error:.3f}")
    print(f"mean probability where right {chance.max(axis=1)[right].mean():.2f},", end=" ")
    print(f"where wrong {chance.max(axis=1)[~right].mean():.2f}")
    print(f"false alarms {np.mean(classifier.measure_strangeness(known[0]) > 1):.1%}")
    draw(table, error, Path(__file__).parents[1] / "docs/images/reliability.png")


def main():
    """Measure, print and draw."""
    classifier = make_classifier()
    known = take(touch_robots(draw_robots(1.0, ROBOTS, SEED), trials=make_touches()))
    judge_known(classifier, known)
    for name, given in make_untouched(np.random.default_rng(77)):
        felt = given[np.isfinite(given).all(axis=(1, 2))]
        say(name, classifier, felt, len(given))
    beside = make_touches(locations=(0.2, 0.3, 0.35))
    values, _, _, count = take(touch_robots(draw_robots(1.0, 5, 777), trials=beside))
    say("taps beside, at 0.2 to 0.35", classifier, values, count)
    for number, (name, one) in enumerate(make_family().items()):
        robots = draw_robots(1.0, STRANGERS, 500_000 + number)
        strange = take(touch_robots(robots, trials=make_touches(features=[one])))
        say(
            name,
            classifier,
            strange[0],
            strange[3],
            measure_detectable(classifier, known, strange),
        )


def say(name, classifier, felt, count, shown=None):
    """One line: what is called unlike all, of the recordings with contact."""
    share = np.mean(classifier.measure_strangeness(felt) > 1)
    more = "" if shown is None else f"; by a classifier shown it {shown:.1%}"
    print(f"{name:28} {count:4d}: {count - len(felt):3d} without a peak, {share:.1%}{more}")


def stream():
    """What a stream says while recordings go on: how many it notices, calls unlike all, and names
    with certainty without ever calling them so; and when it first calls them so.
    """
    lessons, touches = draw_training_set(), make_touches()
    decoder = lessons.watch(make_decoder())
    for name, values in make_untouched(np.random.default_rng(STREAM_SEED)):
        say_stream(decoder, name, values[:STREAM_NOISE])
    kinds = {"known touches": touches, "taps beside": make_touches(locations=(0.2, 0.3, 0.35))}
    kinds |= {name: make_touches(features=[one]) for name, one in make_family().items()}
    for number, (name, trials) in enumerate(kinds.items()):
        count = ROBOTS if name == "known touches" else STREAM_ROBOTS
        read = touch_robots(draw_robots(1.0, count, STREAM_SEED + number), trials=trials)
        say_stream(decoder, name, [motion for one in read for motion in one.motions])


def say_stream(decoder, name, motions):
    """One line on recordings (sensor, time) of a kind."""
    found = [listen(decoder, motion) for motion in motions]
    felt = [one for one in found if one is not None]
    strange = [when for when, _ in felt if np.isfinite(when)]
    named = sum(sure and not np.isfinite(when) for when, sure in felt)
    when = f", first after {np.median(strange):.0f} ms" if strange else ""
    print(
        f"{name:28} {len(found):4d}: {len(felt):4d} noticed, {len(strange) / max(len(felt), 1):.1%}"
        f" unlike all, {named / max(len(felt), 1):.1%} named{when}",
        flush=True,
    )


def listen(decoder, motion):
    """Time since contact when a touch is first called strange (inf: never), and whether its last
    answer is a decided one; None where no contact is noticed.
    """
    states = [state for state in decoder.replay(motion) if state.since_contact >= 0]
    if not states:
        return None
    strange = [state.since_contact for state in states if state.strange]
    return (strange or [np.inf])[0], states[-1].probability >= decoder.threshold


def wires(copies=12, draws=8):
    """Accuracy with dead sensors of ten, on robots left out in turn: of a classifier fitted to the
    other sensors, and of one trained on touches of which one to three, drawn at random, were 0.
    """
    with TemporaryDirectory() as folder:
        write_robot(Path(folder) / "robot.toml", 10)
        antenna = load_robot(Path(folder) / "robot.toml").antenna
    trials = make_touches(locations=(0.5, 0.7, 0.9), speeds=(0.1, 0.27))
    values, labels, robots, others = draw_training_set(antenna, trials).gather()
    others, labels = (np.asarray(others[0]), others[1]), np.array([*map(str, labels)])
    rng, right = np.random.default_rng(1), {}
    dead = [rng.choice(10, count, replace=False) for count in (1, 2, 3) for _ in range(draws)]

    def silence(touches):
        """Each touch, and copies of it without one to three sensors."""
        touches = np.tile(touches, (copies + 1, 1, 1))
        for touch in touches[len(touches) // (copies + 1) :]:
            touch[rng.choice(10, rng.integers(1, 4), replace=False)] = 0
        return touches

    for held in (robots % 4 == fold for fold in range(4)):
        taught = StudentTClassifier().fit(values[~held], labels[~held], robots[~held], others)
        dropped = StudentTClassifier().fit(
            silence(values[~held]),
            np.tile(labels[~held], copies + 1),
            np.tile(robots[~held], copies + 1),
            (silence(others[0]), others[1] * (copies + 1)),
        )
        for gone in dead:
            for name, reader, value in (("fitted", taught, np.nan), ("dropped", dropped, 0.0)):
                asked = values[held].copy()
                asked[:, gone] = value
                share = np.mean(reader.predict(asked) == labels[held])
                right.setdefault((name, len(gone)), []).append(share)
    for (name, count), shares in sorted(right.items()):
        print(f"{name} {count} of 10: {np.mean(shares):.1%}")


if __name__ == "__main__":
    stream() if "stream" in sys.argv else wires() if "wires" in sys.argv else main()
