"""What Figs. 6 and S7 show: transfer from simulation to a robotic antenna, here a surrogate robot.

The paper's recordings of the real robot were never published. ``fig6`` draws what is computed here.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import xarray as xr

from feeler.decoding.streams import StreamDecoder, measure_early_accuracy
from feeler.decoding.transfer import TransferClassifier, TransferScore
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.robot import (
    Recording,
    RobotFit,
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
from paper.context import Context
from paper.scale import Scale

_RELEASE = 2000.0  # ms
_MOMENTS = (0, 20, 50, 100, 200, 400, 800, 1500)  # ms since contact


def compute(effort: Scale, *, seed: int = 0, engine: str = DEFAULT_ENGINE) -> SimpleNamespace:
    """Train on simulations, test on surrogate robots; ``effort`` sets how many.

    Returns
    -------
    SimpleNamespace
        ``training``: the simulated set, 30 classes. Of the first surrogate robot at one reality
        gap: ``touches``, its six tip contacts; ``calibration``, capacitance to angle; ``raw``,
        capacitance of the slow ball contact at the tip; ``release``, angles after a release;
        ``fit``, p1 and p2 fitted to that; ``simulated_release``, angles (hinge, time) of the fitted
        model. Of all surrogate robots: ``by_size`` scores for each reality gap of ``sizes``; at one
        gap ``score``, ``by_variants`` trained on the nominal model and as many random ones
        (``variants``), ``by_shots`` trained with as many touches of the robot itself (``shots``),
        and ``early``, the streaming decoder.
    """
    training = make_training(engine=engine)
    classifier = TransferClassifier(random_state=seed).fit(training.values, training.labels)
    robots = {size: draw_robots(size, effort.robots, seed) for size in effort.gaps}
    read = {size: touch_robots(group, engine=engine) for size, group in robots.items()}
    varied = (
        make_training(n_variants=1, rng=np.random.default_rng([seed, 1]), engine=engine)
        if effort.variants
        else None
    )
    by_size = tuple(measure_transfer(classifier, read[size]) for size in effort.gaps)
    raw, release, fit, simulated = _compute_examples(robots[1.0][0], engine)
    return SimpleNamespace(
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
            _score_variants(n, varied, read[1.0], seed, engine)
            for n in effort.variants
            if varied is not None
        ),
        shots=effort.shots,
        by_shots=tuple(_score_shots(training, effort, seed, engine)),
        early=_measure_early(training, varied, read[1.0]),
    )


def _compute_examples(
    robot: Surrogate, engine: str
) -> tuple[Recording, Recording, RobotFit, np.ndarray]:
    """Raw readouts of a slow ball, a recorded release, and the factors fitted to it."""
    slow_ball = make_touches(locations=(0.9,), speeds=(0.027,))[0]
    raw = robot.touch([slow_ball], engine=engine)[0]
    posture = np.zeros(robot.antenna.n_segments)
    posture[-8:] = make_posture(make_robot())
    start = posture + robot.antenna.rest_angle
    motion = simulate_release(robot.antenna, start, _RELEASE, engine=engine)
    recorded = robot.record(motion).to_angles(robot.calibration, outside="extend")
    release = repair(recorded, gaps="bridge")
    fit = fit_factors(release, engine=engine)
    rest = release.values[:, -500:].mean(axis=1)
    start = release.values[:, 0] - rest
    simulated = simulate_release(fit.antenna, start, _RELEASE, engine=engine)
    return raw, replace(release, values=release.values - rest[:, None]), fit, simulated


def _score_variants(
    n_variants: int, varied: Touches, read: Sequence[Touches], seed: int, engine: str
) -> TransferScore:
    training = varied
    if n_variants > 1:
        training = make_training(
            n_variants=n_variants, rng=np.random.default_rng([seed, n_variants]), engine=engine
        )
    copies = max(
        2, 10 // (1 + n_variants)
    )  # about as many training tensors as without variants
    classifier = TransferClassifier(n_copies=copies, random_state=seed).fit(
        training.values, training.labels
    )
    return measure_transfer(classifier, read)


def _score_shots(
    training: Touches, effort: Scale, seed: int, engine: str
) -> list[TransferScore]:
    if not effort.shots:
        return []
    robots = draw_robots(1.0, effort.shot_robots, seed + 1)
    return sweep_shots(training, effort.shots, robots, engine=engine)


def _measure_early(
    training: Touches, varied: Touches | None, read: Sequence[Touches]
) -> xr.Dataset:
    decoder = StreamDecoder().fit(training.motions, training.labels)
    if varied is not None:
        others = varied.take(np.arange(len(training.labels), len(varied.labels)))
        decoder.temper(others.motions, others.labels)
    motions = [motion for touches in read for motion in touches.motions]
    return measure_early_accuracy(
        decoder, motions, [label for t in read for label in t.labels], _MOMENTS
    )


@lru_cache(maxsize=1)
def load(context: Context) -> SimpleNamespace:
    """What this run shows, computed once for Figs. 6 and S7."""
    return compute(context.effort, seed=context.seed, engine=context.engine)
