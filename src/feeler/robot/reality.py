"""The reality gap measured: transfer against its size, and what closes it."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from annotated_types import Len

from feeler.antenna import Antenna
from feeler.decoding.streams import StreamDecoder
from feeler.decoding.transfer import (
    AFTER,
    BEFORE,
    TransferClassifier,
    TransferScore,
    align,
    find_direction,
    score_transfer,
)
from feeler.errors import InvalidInput
from feeler.objects import Trial
from feeler.physics.engine import DEFAULT_ENGINE
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
