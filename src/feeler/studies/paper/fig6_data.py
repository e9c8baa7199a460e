"""What Figs. 6 and S7 show: transfer from simulation to a robotic antenna, here a surrogate robot.

The paper's recordings of the real robot were never published. ``fig6`` draws what is computed here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from feeler.decoding.decoder import StreamDecoder
from feeler.decoding.early import EarlyAccuracy, measure_early_accuracy
from feeler.decoding.transfer import TransferClassifier, TransferScore
from feeler.robot import (
    Recording,
    RobotFit,
    SensorCalibration,
    Surrogate,
    Touches,
    draw_robots,
    fit_factors,
    make_posture,
    make_robot,
    make_touches,
    make_training,
    measure_transfer,
    repair,
    simulate_release,
    sweep_shots,
    touch_robots,
)
from feeler.studies.paper.context import Context
from feeler.studies.scale import Scale

RELEASE = 2000.0  # ms
MOMENTS = (0, 20, 50, 100, 200, 400, 800, 1500)  # ms since contact


@dataclass(frozen=True, kw_only=True, eq=False)
class Fig6Data:
    """What Fig. 6, Fig. S7 and Movie S4 show."""

    training: Touches
    """The simulated set: 30 classes."""
    touches: Touches
    """The six tip contacts of the first surrogate robot at one reality gap."""
    calibration: SensorCalibration
    """Capacitance to angle of that robot; surrogate."""
    raw: Recording
    """Capacitance of the slow ball contact at the tip; surrogate."""
    release: Recording
    """Angles after a release; surrogate."""
    fit: RobotFit
    """p1 and p2 fitted to that release."""
    simulated_release: np.ndarray
    """Angles (hinge, time) of the fitted model after the same release."""
    score: TransferScore
    """All surrogate robots at one reality gap."""
    sizes: tuple[float, ...]
    by_size: tuple[TransferScore, ...]
    variants: tuple[int, ...]
    by_variants: tuple[TransferScore, ...]
    """Domain randomisation: trained on the nominal model and this many random ones, at one reality
    gap.
    """
    shots: tuple[int, ...]
    by_shots: tuple[TransferScore, ...]
    """Few-shot: trained with k touches of the robot itself per tip contact, at one reality gap."""
    early: EarlyAccuracy
    """Streaming decoder on the surrogate robots at one reality gap."""


def compute(effort: Scale, *, seed: int = 0) -> Fig6Data:
    """Train on simulations, test on surrogate robots; ``effort`` sets how many."""
    training = make_training()
    classifier = TransferClassifier(random_state=seed).fit(training.values, training.labels)
    robots = {size: draw_robots(size, effort.robots, seed) for size in effort.gaps}
    read = {size: touch_robots(group) for size, group in robots.items()}
    varied = (
        make_training(n_variants=1, rng=np.random.default_rng([seed, 1]))
        if effort.variants
        else None
    )
    by_size = tuple(measure_transfer(classifier, read[size]) for size in effort.gaps)
    raw, release, fit, simulated = _compute_examples(robots[1.0][0])
    return Fig6Data(
        training=training,
        touches=read[1.0][0],
        calibration=robots[1.0][0].calibration,
        raw=raw,
        release=release,
        fit=fit,
        simulated_release=simulated,
        score=by_size[effort.gaps.index(1.0)],
        sizes=effort.gaps,
        by_size=by_size,
        variants=effort.variants,
        by_variants=tuple(
            _score_variants(n, varied, read[1.0], seed)
            for n in effort.variants
            if varied is not None
        ),
        shots=effort.shots,
        by_shots=tuple(_score_shots(training, effort, seed)),
        early=_measure_early(training, varied, read[1.0]),
    )


def _compute_examples(robot: Surrogate) -> tuple[Recording, Recording, RobotFit, np.ndarray]:
    """Raw readouts of a slow ball, a recorded release, and the factors fitted to it."""
    slow_ball = make_touches(locations=(0.9,), speeds=(0.027,))[0]
    raw = robot.touch([slow_ball])[0]
    posture = np.zeros(robot.antenna.n_segments)
    posture[-8:] = make_posture(make_robot())
    motion = simulate_release(robot.antenna, posture + robot.antenna.rest_angle, RELEASE)
    recorded = robot.record(motion).to_angles(robot.calibration, outside="extend")
    release = repair(recorded, gaps="bridge")
    fit = fit_factors(release)
    rest = release.values[:, -500:].mean(axis=1)
    simulated = simulate_release(fit.antenna, release.values[:, 0] - rest, RELEASE)
    return raw, replace(release, values=release.values - rest[:, None]), fit, simulated


def _score_variants(
    n_variants: int, varied: Touches, read: Sequence[Touches], seed: int
) -> TransferScore:
    training = varied
    if n_variants > 1:
        training = make_training(
            n_variants=n_variants, rng=np.random.default_rng([seed, n_variants])
        )
    copies = max(2, 10 // (1 + n_variants))  # about as many training tensors as without variants
    classifier = TransferClassifier(n_copies=copies, random_state=seed).fit(
        training.values, training.labels
    )
    return measure_transfer(classifier, read)


def _score_shots(training: Touches, effort: Scale, seed: int) -> list[TransferScore]:
    if not effort.shots:
        return []
    return sweep_shots(training, effort.shots, draw_robots(1.0, effort.shot_robots, seed + 1))


def _measure_early(
    training: Touches, varied: Touches | None, read: Sequence[Touches]
) -> EarlyAccuracy:
    decoder = StreamDecoder().fit(training.motions, training.labels)
    if varied is not None:
        others = varied.take(np.arange(len(training.labels), len(varied.labels)))
        decoder.temper(others.motions, others.labels)
    motions = [motion for touches in read for motion in touches.motions]
    return measure_early_accuracy(
        decoder, motions, [label for t in read for label in t.labels], MOMENTS
    )


@lru_cache(maxsize=1)
def load(context: Context) -> Fig6Data:
    """What this run shows, computed once for Figs. 6 and S7."""
    return compute(context.effort, seed=context.seed)
