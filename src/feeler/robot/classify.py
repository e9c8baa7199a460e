"""Touches of surrogate robots: the reality gap measured, training sets, and the classification of
one recording.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from annotated_types import Len

from feeler.antenna import Antenna
from feeler.decoding.classifiers import NO_CONTACT
from feeler.decoding.observers import Others, StudentTClassifier
from feeler.decoding.streams import StreamDecoder
from feeler.decoding.transfer import (
    AFTER,
    BEFORE,
    LABEL_PARTS,
    MIN_DEFLECTION,
    TransferClassifier,
    TransferScore,
    align,
    find_direction,
    find_first_peak,
    score_transfer,
)
from feeler.errors import InvalidInput
from feeler.objects import Box, Feature, Outline, Trial
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.progress import Advance, show_progress
from feeler.renamed import rename_arguments
from feeler.robot.description import (
    ROBOT_SPEEDS,
    Label,
    compute_tip,
    get_label,
    list_lengths,
    make_robot,
    make_touches,
    simulate_pairs,
    simulate_touches,
)
from feeler.robot.recordings import Recording
from feeler.robot.surrogate import (
    Gap,
    Surrogate,
    draw_antenna,
    draw_trial,
    make_surrogate,
    make_tip_touches,
)
from feeler.validation import Count, Seed, checked

# The reality gap, measured: transfer against its size, and what closes it.


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Touches:
    """Aligned touches (trial, sensor, time) with their labels and recordings.

    Attributes
    ----------
    values : np.ndarray
        Tensors (trial, sensor, time) [rad]; NaN in trials without contact.
    antenna : Antenna
        The nominal model, whose lengths give the tip's trace.
    motions : tuple[np.ndarray, ...]
        Angles (sensor, time) before alignment, from rest, of any durations.
    """

    values: Annotated[np.ndarray, "trial hinge sample"]
    labels: tuple[Label, ...]
    antenna: Antenna
    motions: tuple[np.ndarray, ...]
    recordings: tuple[Recording, ...] = ()

    @property
    def before(self) -> int:
        """Samples kept before the peak."""
        return self.values.shape[2] - AFTER

    @property
    def touched(self) -> np.ndarray:
        """(trial,) whether there was contact."""
        return ~np.isnan(self.values).all(axis=(1, 2))

    def take(self, index: np.ndarray) -> "Touches":
        """The touches with these numbers."""
        index = np.asarray(index, dtype=int)
        return Touches(
            values=self.values[index],
            labels=tuple(self.labels[i] for i in index),
            antenna=self.antenna,
            motions=tuple(self.motions[i] for i in index),
            recordings=tuple(self.recordings[i] for i in index) if self.recordings else (),
        )

    def join(self, other: "Touches") -> "Touches":
        """These touches, then the others."""
        return Touches(
            values=np.concatenate([self.values, other.values]),
            labels=self.labels + other.labels,
            antenna=self.antenna,
            motions=self.motions + other.motions,
        )


@checked
def make_training(
    antenna: Antenna | None = None,
    trials: Sequence[Trial] | None = None,
    *,
    n_variants: Seed = 0,
    gap: Gap | None = None,
    rng: np.random.Generator | None = None,
    **how: Any,
) -> Touches:
    """Simulate the training set: the nominal model, and ``n_variants`` drawn at random.

    The variants are domain randomisation: each draws an antenna and every touch with differences of
    size ``gap`` (default one reality gap), without the sensing faults, and all keep the nominal
    labels. ``how`` may hold ``engine``, ``timestep``, ``workers`` and ``executor``, as for
    :func:`feeler.touch`.
    """
    antenna = make_robot() if antenna is None else antenna
    trials = make_touches() if trials is None else list(trials)
    motions = _simulate(antenna, trials, n_variants, gap, rng, how)
    labels = tuple(get_label(trial) for trial in trials) * (1 + n_variants)
    touches = Touches(
        values=_align(antenna, motions, choose_before(antenna, trials)),
        labels=labels,
        antenna=antenna,
        motions=tuple(motions),
    )
    return touches.take(np.flatnonzero(touches.touched))


def _simulate(
    antenna: Antenna,
    trials: list[Trial],
    n_variants: int,
    gap: Gap | None,
    rng: np.random.Generator | None,
    how: dict,
) -> list[np.ndarray]:
    """Angles (sensor, time) from rest: the nominal model's touches, then each variant's."""
    how = {"reach": antenna.length / make_robot().length, **how}
    motions = simulate_touches(antenna, trials, **how)
    if n_variants:
        if rng is None:
            raise InvalidInput(f"{n_variants} variants are drawn at random, which needs rng=.")
        size = Gap() if gap is None else gap
        variants = [draw_antenna(antenna, size, rng) for _ in range(n_variants)]
        pairs = [
            (variant, draw_trial(trial, size, rng)) for variant in variants for trial in trials
        ]
        motions += simulate_pairs(pairs, **how)
    sensed = [motion[antenna.sensors - 1] for motion in motions]
    return [motion - motion[:, :1] for motion in sensed]


@checked
def choose_before(antenna: Antenna, trials: Annotated[Sequence[Trial], Len(1)]) -> int:
    """Samples to keep before the peak.

    The paper's window, longer where slower touches or a longer antenna need it.
    """
    slowest = min(trial.speed for trial in trials)
    return math.ceil(
        BEFORE * max(1.0, antenna.length / make_robot().length * ROBOT_SPEEDS[-1] / slowest)
    )


def _read(
    surrogate: Surrogate, trials: Sequence[Trial], raw: Sequence[Recording], antenna: Antenna
) -> Touches:
    recordings = tuple(surrogate.read_angles(recording) for recording in raw)
    return Touches(
        values=_align(
            antenna,
            [recording.values for recording in recordings],
            choose_before(antenna, trials),
        ),
        labels=tuple(get_label(trial) for trial in trials),
        antenna=antenna,
        motions=tuple(recording.values for recording in recordings),
        recordings=recordings,
    )


@checked
def align_recordings(
    recordings: Sequence[Recording], antenna: Antenna | None = None, *, before: int = BEFORE
) -> np.ndarray:
    """Align repaired angle recordings as :func:`make_training` aligned the simulated touches.

    A touch whose tip first goes to the negative side is mirrored, all channels times −1.
    ``before`` is ``Touches.before`` of the training set.
    """
    return _align(
        make_robot() if antenna is None else antenna,
        [recording.values for recording in recordings],
        before,
    )


def _align(antenna: Antenna, motions: Sequence[np.ndarray], before: int) -> np.ndarray:
    """Touches of the other side as their mirror images."""
    tips = [compute_tip(antenna, motion) for motion in motions]
    ways = [-1.0 if find_direction(tip) < 0 else 1.0 for tip in tips]
    return align(
        [way * motion for way, motion in zip(ways, motions, strict=True)],
        [way * tip for way, tip in zip(ways, tips, strict=True)],
        before=before,
    )


@checked
def make_decoder(
    antenna: Antenna | None = None,
    trials: Sequence[Trial] | None = None,
    *,
    threshold: float = 0.9,
    seed: Seed = 0,
    **how: Any,
) -> StreamDecoder:
    """A streaming decoder of the nominal model's touches.

    It is tempered on a model and touches drawn at random.

    Antenna and trials are those of :func:`make_training`, as are the words in ``how``.
    """
    antenna = make_robot() if antenna is None else antenna
    trials = make_touches() if trials is None else list(trials)
    motions = _simulate(antenna, trials, 1, None, np.random.default_rng([seed, 1]), how)
    labels, n = [get_label(trial) for trial in trials], len(trials)
    return (
        StreamDecoder(
            threshold=threshold,
            window=StreamDecoder().window + choose_before(antenna, trials) - BEFORE,
            lengths=tuple(list_lengths(antenna)),
        )
        .fit(motions[:n], labels)
        .temper(motions[n:], labels)
    )


@checked
def draw_robots(
    size: float,
    n_robots: Count,
    seed: Seed,
    *,
    gap: Gap | None = None,
    nominal: Antenna | None = None,
) -> list[Surrogate]:
    """Surrogate robots around ``nominal`` at a reality gap of ``size``; one seed, same robots."""
    gap = (Gap() if gap is None else gap).scaled(size)
    children = np.random.SeedSequence([seed, round(1000 * size)]).spawn(n_robots)
    return [
        make_surrogate(
            np.random.default_rng(child),
            nominal=nominal,
            gap=gap,
            name=f"surrogate-{size:g}-{k}",
        )
        for k, child in enumerate(children)
    ]


@checked
def touch_robots(
    robots: Sequence[Surrogate],
    repeats: Count = 1,
    *,
    trials: Sequence[Trial] | None = None,
    antenna: Antenna | None = None,
    **how: Any,
) -> list[Touches]:
    """The six tip contacts of each robot, or other ``trials``, ``repeats`` times.

    All robots are simulated together; ``how`` may hold engine, timestep and workers.
    """
    antenna = make_robot() if antenna is None else antenna
    trials = make_tip_touches(repeats) if trials is None else list(trials) * repeats
    pairs = [pair for robot in robots for pair in robot.carry_out(trials)]
    motions = iter(simulate_pairs(pairs, reach=antenna.length / make_robot().length, **how))
    read = []
    for robot in robots:
        raw = [robot.record(next(motions), trial) for trial in trials]
        read.append(_read(robot, trials, raw, antenna))
    return read


@checked
def measure_transfer(
    classifier: TransferClassifier, read: Annotated[Sequence[Touches], Len(1)]
) -> TransferScore:
    """Score touches that were read from robots, all together."""
    values = np.concatenate([touches.values for touches in read])
    return score_transfer(
        classifier, values, [label for touches in read for label in touches.labels]
    )


@checked
def sweep_shots(
    training: Touches,
    shots: Annotated[Sequence[int], Len(1)],
    robots: Annotated[Sequence[Surrogate], Len(1)],
    *,
    n_tests: int = 1,
    engine: str = DEFAULT_ENGINE,
) -> list[TransferScore]:
    """Transfer after k touches of the robot itself, per tip contact, have joined the training set.

    Each robot is touched max(shots) + ``n_tests`` times in each of the six ways; the last
    ``n_tests`` are the test, the first k join the training, so no touch is in both.
    """
    most = max(shots)
    read = touch_robots(robots, most + n_tests, engine=engine)
    scores = []
    for k in shots:
        parts = [_score_shots(training, touches, k, most) for touches in read]
        scores.append(
            TransferScore(
                correct={
                    what: sum(one.correct[what] for one in parts) for what in parts[0].correct
                },
                total=sum(one.total for one in parts),
                predicted=[label for one in parts for label in one.predicted],
                true=[label for one in parts for label in one.true],
            )
        )
    return scores


def _score_shots(training: Touches, touches: Touches, k: int, most: int) -> TransferScore:
    per_round = len(make_tip_touches())
    shown = np.arange(k * per_round)
    known = touches.take(shown[touches.touched[shown]])
    tested = touches.take(np.arange(most * per_round, len(touches.labels)))
    joined = training.join(known) if k else training
    return score_transfer(
        TransferClassifier().fit(joined.values, joined.labels), tested.values, tested.labels
    )


# What a classifier learns from: touches of surrogate robots, and of unknown beside them.

_ROBOTS = 24  # [C] surrogate robots whose touches a classifier learns
_SIZES = (0.2, 6.0)  # [C] of a stranger, over the size of the object in whose place it is met
_TOGETHER = 4  # [C] robots that are simulated between two marks of progress
_CORNERS = 16  # [C] of an ellipse


@dataclass(frozen=True, kw_only=True, eq=False)
class TrainingSet:
    """Touches of surrogate robots.

    Attributes
    ----------
    known : list[Touches]
        By robot; the touches to be discriminated.
    unknown : list[Touches]
        By further robots; the same touches, of other things.
    """

    known: list[Touches]
    unknown: list[Touches]

    def gather(self) -> tuple[np.ndarray, list, np.ndarray, Others]:
        """Aligned tensors with contact, their labels and robots, and the unknown."""
        values, labels, robots = _gather(self.known)
        others, names, _ = _gather(self.unknown)
        return values, labels, robots, (others, [name[1:] for name in names])

    def watch(self, decoder: StreamDecoder) -> StreamDecoder:
        """Let a decoder say while a touch goes on whether it is unlike any of these."""
        motions, labels, robots = zip(*_list_motions(self.known), strict=True)
        others, names, _ = zip(*_list_motions(self.unknown), strict=True)
        return decoder.watch(motions, labels, robots, (others, [name[1:] for name in names]))


def _gather(touched: Sequence[Touches]) -> tuple[np.ndarray, list, np.ndarray]:
    felt = np.concatenate([touches.touched for touches in touched])
    values = np.concatenate([touches.values for touches in touched])[felt]
    labels = [label for touches in touched for label in touches.labels]
    robots = np.repeat(np.arange(len(touched)), [len(touches.labels) for touches in touched])
    return (
        values,
        [label for label, seen in zip(labels, felt, strict=True) if seen],
        robots[felt],
    )


def _list_motions(touched: Sequence[Touches]) -> Iterator[tuple[np.ndarray, Label, int]]:
    for k, touches in enumerate(touched):
        for motion, label in zip(touches.motions, touches.labels, strict=True):
            yield motion, label, k


@checked
def draw_training_set(
    antenna: Antenna | None = None,
    trials: Sequence[Trial] | None = None,
    *,
    robots: Count = _ROBOTS,
    seed: Seed = 0,
    gap: Gap | None = None,
    progress: Advance | None = None,
    **how: Any,
) -> TrainingSet:
    """Touches of ``robots`` surrogate robots, and of half as many others that touch unknown.

    Strangers are boxes and ellipses of random sizes and roundings in the place of each object.
    ``gap`` is how far the robots may differ from the antenna, ``progress`` is called with (done,
    total) robots, and ``how`` goes to :func:`touch_robots`.
    """
    antenna = make_robot() if antenna is None else antenna
    trials = make_touches() if trials is None else list(trials)
    half = (robots + 1) // 2
    children = np.random.SeedSequence([seed, robots]).spawn(robots + half)
    drawn = [
        make_surrogate(np.random.default_rng(child), nominal=antenna, gap=gap)
        for child in children
    ]
    felt: list[Touches] = []
    with show_progress(progress, "surrogate robots") as advance:
        while len(felt) < len(drawn):
            k = len(felt)
            several = drawn[k : min(k + _TOGETHER, robots)] if k < robots else drawn[k : k + 1]
            rng = np.random.default_rng(children[k].spawn(1)[0])
            met = (
                trials
                if k < robots
                else [
                    replace(trial, feature=_draw_stranger(trial.feature, rng))
                    for trial in trials
                ]
            )
            felt += touch_robots(several, trials=met, antenna=antenna, **how)
            advance(len(felt), len(drawn))
    return TrainingSet(known=felt[:robots], unknown=felt[robots:])


def _draw_stranger(feature: Feature, rng: np.random.Generator) -> Feature:
    """Something else in the place of an object: a box with round edges, or an ellipse."""
    wide, high = feature.size * np.exp(rng.uniform(np.log(_SIZES[0]), np.log(_SIZES[1]), 2))
    share = rng.uniform(0, 0.99)
    if rng.random() < 0.5:
        angle = 2 * np.pi * (np.arange(_CORNERS) + 0.5) / _CORNERS
        corners = np.column_stack([high * np.cos(angle), wide * np.sin(angle)])
        return Outline(vertices=corners, name="stranger")
    core, rounding = 1 - share, share * min(wide, high)
    return Box(
        half_width=core * wide, half_height=core * high, rounding=rounding, name="stranger"
    )


@rename_arguments(lessons="training")
@checked
def make_classifier(
    antenna: Antenna | None = None,
    trials: Sequence[Trial] | None = None,
    *,
    robots: Count = _ROBOTS,
    seed: Seed = 0,
    training: TrainingSet | None = None,
    **how: Any,
) -> StudentTClassifier:
    """A classifier of any antenna's touches, trained on the touches of surrogate robots around it.

    Its probabilities are calibrated on robots that it did not learn, at one reality gap; what your
    robot's own gap is, they cannot know. ``measure_strangeness`` says what is unlike any touch of
    ``trials``. The paper's classifier is :class:`feeler.decoding.TransferClassifier`. ``training``
    are those of :func:`draw_training_set`, which else are drawn with the other words.
    """
    if training is None:
        training = draw_training_set(antenna, trials, robots=robots, seed=seed, **how)
    values, labels, groups, unknown = training.gather()
    if len({*labels}) < 2:
        raise InvalidInput(
            "there is nothing to discriminate: all touches that were felt are of one object, place"
            " and speed. Give two or more of one of them."
        )
    try:
        return StudentTClassifier().fit(values, labels, groups, unknown)
    except np.linalg.LinAlgError as error:
        raise InvalidInput(
            f"{len(training.known)} surrogate robots are too few to learn from: with one held out"
            " they must still differ. Ask for 3 or more; 24 are usual."
        ) from error


# What a classifier says of one recording, how sure it is, and what the recording's notes say.

_REST = 0.2  # [C] of a touch's peak, below which the tip is at rest again


@dataclass(frozen=True, kw_only=True)
class Answer:
    """The best label, the runner-up, and how they compare with the notes.

    Attributes
    ----------
    probability : float
        Of ``label``; NaN without contact.
    truth : dict[str, str | float]
        Those parts of the label that the recording's notes hold.
    known : bool
        Whether the truth, as far as it is noted, is among the classes.
    strangeness : float
        Squared distance to the nearest class over the limit; > 1: unlike any touch that was
        learned.
    missing : str
        What of the recording is not there or was not judged, in words; empty where nothing is.
    without : tuple[int, ...]
        Numbers of the sensors, from 1 at the base, that have no value: the others were judged.
    mirrored : bool
        Whether the tip went to the negative side first, so that the recording's mirror image was
        judged.
    probabilities : dict[Label, float]
        Of every class; empty without contact.
    """

    label: Label
    probability: float
    runner_up: Label | None
    runner_up_probability: float
    truth: dict[str, str | float]
    known: bool
    strangeness: float = 0.0
    missing: str = ""
    without: tuple[int, ...] = ()
    mirrored: bool = False
    probabilities: dict[Label, float] = field(default_factory=dict)

    @property
    def strange(self) -> bool:
        """Whether the touch is unlike all that were learned."""
        return self.strangeness > 1

    @property
    def right(self) -> dict[str, bool]:
        """Part → whether it agrees with the notes."""
        return {
            part: _agree(self.label[LABEL_PARTS.index(part)], value)
            for part, value in self.truth.items()
        }

    @property
    def verdict(self) -> str:
        """Whether the notes agree: right, or which parts are wrong; empty without notes."""
        wrong = [part for part, right in self.right.items() if not right]
        return f"wrong: {', '.join(wrong)}" if wrong else "right" * bool(self.truth)

    @property
    def remarks(self) -> list[str]:
        """What must be known beside it: mirrored, cut short, without some sensors."""
        said = ["bent to the negative side: judged by its mirror image"] * self.mirrored
        said += [self.missing] if self.missing else []
        gone = ", ".join(map(str, self.without))
        return said + (
            [f"judged without sensor {gone}, which gave no usable value"] if gone else []
        )

    def __str__(self) -> str:
        words = name_touch(self.label)
        if self.strange:
            words = (
                f"unlike any touch I know ({self.strangeness:.3g} × the limit); nearest {words}"
            )
        elif self.runner_up is not None:
            words += (
                f" ({self.probability:.0%}); then {name_touch(self.runner_up)}"
                f" ({self.runner_up_probability:.0%})"
            )
        words = "\n  ".join([words, *self.remarks])
        if not self.truth:
            return words
        verdict = self.verdict.replace("wrong", "WRONG")
        return f"{words}\n  {name_notes(self.truth)}: {verdict}" + (
            "" if self.known else " (no such class was trained)"
        )

    def to_plain(self) -> dict[str, Any]:
        """As JSON; None stands where there was no contact."""
        return {
            "label": describe_touch(self.label),
            "probability": None if np.isnan(self.probability) else self.probability,
            "runner_up": None if self.runner_up is None else describe_touch(self.runner_up),
            "runner_up_probability": None
            if self.runner_up is None
            else self.runner_up_probability,
            "unlike_all": self.strange,
            "strangeness": self.strangeness,
            "missing": self.missing,
            "without": list(self.without),
            "mirrored": self.mirrored,
            "truth": self.truth,
            "right": self.right,
            "known": self.known,
        }


def count_after_peak(recording: Recording, antenna: Antenna) -> int:
    """Samples after the tip's first peak; −1 where there is no peak yet."""
    tip = compute_tip(antenna, recording.values)
    peak = find_first_peak(-tip if find_direction(tip) < 0 else tip)
    return tip.size - peak - 1 if peak >= 0 else -1


def judge_recording(
    classifier: StudentTClassifier, recording: Recording, antenna: Antenna, before: int = BEFORE
) -> tuple[Answer, np.ndarray]:
    """The answer to a repaired recording of angles from rest, and its aligned tensor.

    A recording that ends early is judged on the samples that it holds; the answer says what is
    missing. One that ends before the tip's first peak is aligned on its largest deflection. One
    whose tip first goes to the negative side is judged by its mirror image, and its tensor is that.
    One with sensors that have no value at all is judged by the others.
    """
    tip, values = compute_tip(antenna, recording.values), recording.values
    mirrored = find_direction(tip) < 0
    if mirrored:
        tip, values = -tip, -values
    peak = find_first_peak(tip)
    early = peak < 0 and np.nanmax(tip, initial=0.0) >= MIN_DEFLECTION
    if early:
        peak = int(np.nanargmax(tip))
    held = tip.size - peak - 1 if peak >= 0 else AFTER
    tensor = align([values], [tip], before=before, peaks=[peak])[0]
    until = None if held >= AFTER else float(before + max(held, 1))
    missing = ""
    if until is not None:
        missing = f"{AFTER} ms after the first peak are needed; here {held}"
        missing += ", and no peak: the largest deflection stands for it" if early else ""
    elif again := _find_next_touch(tip, peak):
        missing = f"the tip is pushed again {again - peak} ms after its first peak: not judged"
    # The answer to one aligned tensor (sensor, time), of which the samples before until
    # [ms] count; notes are Recording.labels.
    probability = classifier.predict_proba(tensor[None], until)[0]
    felt = bool(np.isfinite(probability).all())
    best = np.argsort(-probability, kind="stable")[:2]
    ranked = [classifier.classes_[k] for k in best] if felt else [NO_CONTACT]
    truth = {part: recording.labels[part] for part in LABEL_PARTS if part in recording.labels}
    known = any(
        all(_agree(label[LABEL_PARTS.index(p)], v) for p, v in truth.items())
        for label in classifier.classes_
    )
    answer = Answer(
        label=ranked[0],
        probability=float(probability[best[0]]) if felt else float("nan"),
        runner_up=ranked[1] if felt else None,
        runner_up_probability=float(probability[best[1]]) if felt else float("nan"),
        truth=truth,
        known=known,
        strangeness=float(classifier.measure_strangeness(tensor[None], until)[0])
        if felt
        else 0.0,
        missing=missing
        if felt
        else f"the tip moves by {np.nanmax(np.abs(tip), initial=0.0):.2g} mm, less than"
        f" {MIN_DEFLECTION:g} mm",
        probabilities=dict(zip(classifier.classes_, map(float, probability), strict=True))
        if felt
        else {},
    )
    gone = np.flatnonzero(~np.isfinite(values).any(axis=1)) + 1
    without = tuple(map(int, gone)) if answer.label != NO_CONTACT else ()
    mirrored = mirrored and answer.label != NO_CONTACT
    return replace(answer, mirrored=mirrored, without=without), tensor


def _find_next_touch(tip: np.ndarray, peak: int) -> int:
    """The sample at which the tip leaves its rest again after a touch with this peak; 0: none."""
    pushed: Any = (
        np.flatnonzero(np.abs(tip[peak:]) > _REST * tip[peak]) + peak if peak >= 0 else []
    )
    again = [b for a, b in pairwise(pushed) if b - a > AFTER / 2]
    strong = again and np.nanmax(np.abs(tip[again[0] :])) > 0.5 * tip[peak]
    return int(again[0]) if strong else 0


def name_notes(labels: Mapping[str, str | float]) -> str:
    """What a recording's notes say of its touch, in words; empty where they say nothing."""
    known = [(part, labels[part]) for part in LABEL_PARTS if part in labels]
    noted = [
        f"{part} {value}" if isinstance(value, str) else f"{part} {value:g}"
        for part, value in known
    ]
    return f"the notes say {', '.join(noted)}" if noted else ""


def name_touch(label: Label) -> str:
    """A label in words."""
    feature, location, speed = label
    return (
        feature
        if feature == NO_CONTACT[0]
        else f"{feature} at {location:g} of the length, {speed:g} m/s"
    )


def _agree(found: str | float, noted: str | float) -> bool:
    if isinstance(found, str) or isinstance(noted, str):
        return found == noted
    return bool(np.isclose(found, noted, rtol=1e-6))


def describe_touch(label: Label) -> dict[str, str | float | None]:
    """A label as JSON."""
    feature, location, speed = (None if value != value else value for value in label)
    return {"feature": feature, "location": location, "speed": speed}
