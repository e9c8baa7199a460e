"""What a classifier learns from: touches of surrogate robots, and of strangers beside them."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna
from feeler.decoding.clouds import CloudReader, Others
from feeler.decoding.decoder import StreamDecoder
from feeler.errors import InvalidInput
from feeler.progress import show_progress
from feeler.records.checked import checked
from feeler.robot.preset import make_robot
from feeler.robot.reality import Touches, touch_robots
from feeler.robot.surrogate import make_surrogate
from feeler.robot.touches import Label, make_touches
from feeler.stimulus import Box, Feature, Outline, Trial

_ROBOTS = 24  # [C] surrogate robots whose touches a reader learns
_SIZES = (0.2, 6.0)  # [C] of a stranger, over the size of the object in whose place it is met
_TOGETHER = 4  # [C] robots that are simulated between two marks of progress
_CORNERS = 16  # [C] of an ellipse


@dataclass(frozen=True, kw_only=True, eq=False)
class Lessons:
    """Touches of surrogate robots.

    Attributes
    ----------
    known : list[Touches]
        By robot; the touches to be told apart.
    strangers : list[Touches]
        By further robots; the same touches, of other things.
    """

    known: list[Touches]
    strangers: list[Touches]

    def gather(self) -> tuple[np.ndarray, list, np.ndarray, Others]:
        """Aligned tensors with contact, their labels and robots, and the strangers."""
        values, labels, robots = _gather(self.known)
        others, names, _ = _gather(self.strangers)
        return values, labels, robots, (others, [name[1:] for name in names])

    def watch(self, decoder: StreamDecoder) -> StreamDecoder:
        """Let a decoder say while a touch goes on whether it is unlike any of these."""
        motions, labels, robots = zip(*_list_motions(self.known), strict=True)
        others, names, _ = zip(*_list_motions(self.strangers), strict=True)
        kinds = [name[1:] for name in names]
        return decoder.watch(motions, labels, robots, (others, kinds))


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
def draw_lessons(
    antenna: Antenna | None = None,
    trials: Sequence[Trial] | None = None,
    *,
    robots: Annotated[int, "> 0"] = _ROBOTS,
    seed: Annotated[int, "≥ 0"] = 0,
    **how: Any,
) -> Lessons:
    """Touches of ``robots`` surrogate robots, and of half as many others that touch strangers.

    Strangers are boxes and ellipses of random sizes and roundings in the place of each object.
    ``how`` goes to :func:`touch_robots`.
    """
    antenna = make_robot() if antenna is None else antenna
    trials = make_touches() if trials is None else list(trials)
    half = (robots + 1) // 2
    children = np.random.SeedSequence([seed, robots]).spawn(robots + half)
    drawn = [
        make_surrogate(np.random.default_rng(child), nominal=antenna) for child in children
    ]
    felt: list[Touches] = []
    with show_progress(None, "surrogate robots") as advance:
        while len(felt) < len(drawn):
            k = len(felt)
            several = drawn[k : min(k + _TOGETHER, robots)] if k < robots else drawn[k : k + 1]
            met = trials if k < robots else _replace_objects(trials, children[k])
            felt += touch_robots(several, trials=met, antenna=antenna, **how)
            advance(len(felt), len(drawn))
    return Lessons(known=felt[:robots], strangers=felt[robots:])


def _replace_objects(trials: Sequence[Trial], seed: np.random.SeedSequence) -> list[Trial]:
    rng = np.random.default_rng(seed.spawn(1)[0])
    return [replace(trial, feature=_draw_stranger(trial.feature, rng)) for trial in trials]


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


@checked
def make_classifier(
    antenna: Antenna | None = None,
    trials: Sequence[Trial] | None = None,
    *,
    robots: Annotated[int, "> 0"] = _ROBOTS,
    seed: Annotated[int, "≥ 0"] = 0,
    lessons: Lessons | None = None,
    **how: Any,
) -> CloudReader:
    """A reader of any antenna's touches, trained on the touches of surrogate robots around it.

    Its probabilities are calibrated on robots that it did not learn, at one reality gap; what your
    robot's own gap is, they cannot know. ``measure_strangeness`` says what is unlike any touch of
    ``trials``. The paper's classifier is :class:`feeler.decoding.TransferClassifier`. ``lessons``
    are those of :func:`draw_lessons`, which else are drawn with the other words.
    """
    if lessons is None:
        lessons = draw_lessons(antenna, trials, robots=robots, seed=seed, **how)
    values, labels, groups, strangers = lessons.gather()
    if len({*labels}) < 2:
        raise InvalidInput(
            "there is nothing to tell apart: all touches that were felt are of one object, place"
            " and speed. Give two or more of one of them."
        )
    try:
        return CloudReader().fit(values, labels, groups, strangers)
    except np.linalg.LinAlgError as error:
        raise InvalidInput(
            f"{len(lessons.known)} surrogate robots are too few to learn from: with one held out"
            " they must still differ. Ask for 3 or more; 24 are usual."
        ) from error
