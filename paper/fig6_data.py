"""What Figs. 6 and S7 show: transfer from simulation to a robotic antenna, here a surrogate robot.

The paper's recordings of the real robot were never published. ``fig6`` draws what is computed here.
"""

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np
import xarray as xr

from feeler.analysis import compute_dispersion
from feeler.antenna import Antenna
from feeler.decoding import Relative, compute_sweep
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
    simulate_touches,
    sweep_shots,
    touch_robots,
)
from feeler.robot.touches import ROBOT_SPEEDS
from feeler.tensors import rectify
from paper.cache import keep
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
    return keep("robot", compute, context.effort, seed=context.seed, engine=context.engine)


# The eight-segment model, compared by speed and by stiffness profile as the insect's is.

_PROFILES = ("exponential", "linear", "uniform")
# [C] exponential control: stiffness of hinge 8 over hinge 1; the insect's 1e-5 leaves no tip here
_TIP_SHARE = 0.1
_DURATION = 2600.0  # ms, the longest slow touch
_STRIDE = 4  # every fourth sample is kept: nothing in the motion is faster than 100 Hz


def make_profiles() -> dict[str, Antenna]:
    """The robot, whose widths fall linearly, and two controls.

    All have the same compliance Σ 1/k_n and the same damping time c/k.
    """
    linear = make_robot()
    steps = np.linspace(0, 1, linear.n_segments)
    shapes = {
        "exponential": _TIP_SHARE**steps,
        "linear": linear.stiffness,
        "uniform": np.ones(linear.n_segments),
    }
    time = linear.damping[0] / linear.stiffness[0]
    profiles = {}
    for name in _PROFILES:
        stiffness = shapes[name] * np.sum(1 / shapes[name]) / np.sum(1 / linear.stiffness)
        profiles[name] = linear.replace(
            stiffness=stiffness, damping=time * stiffness, name=f"robot {name}"
        )
    return profiles


def touch_robot(antenna: Antenna, speed: float, engine: str = DEFAULT_ENGINE) -> np.ndarray:
    """Rectified tensors (trial, sensor, time) [rad], 4 ms apart, of the ten touches at a speed.

    All have one duration; they are not aligned.
    """
    motions = simulate_touches(
        antenna, make_touches(speeds=[speed]), duration=_DURATION, engine=engine
    )
    return rectify(np.stack(motions)[:, :, ::_STRIDE])


def compute_comparison(
    *, n_repeats: int = 3, random_state: int = 0, engine: str = DEFAULT_ENGINE
) -> dict[str, dict]:
    """Dispersion and accuracy by speed (the robot) and by profile (slow touches).

    Returns
    -------
    dict
        ``speed`` and ``profile``: each group's name → ``pearson``, ``ssim``, ``mse``, ``nmi``
        (closest match, averaged: :class:`~feeler.analysis.Interval` over the ten touches) and
        ``accuracy`` (10 classes, LDA, noise of 20 % of each tensor's maximum on raw tensors).
    """
    profiles = make_profiles()
    speeds = {f"{s:g} m/s": touch_robot(profiles["linear"], s, engine) for s in ROBOT_SPEEDS}
    slow = {
        name: speeds[f"{ROBOT_SPEEDS[-1]:g} m/s"]
        if name == "linear"
        else touch_robot(antenna, ROBOT_SPEEDS[-1], engine)
        for name, antenna in profiles.items()
    }
    return {
        "speed": _compare_groups(speeds, n_repeats, random_state),
        "profile": _compare_groups(slow, n_repeats, random_state),
    }


def _compare_groups(
    groups: dict[str, np.ndarray], n_repeats: int, random_state: int
) -> dict[str, dict]:
    names = np.repeat(list(groups), [len(tensors) for tensors in groups.values()])
    dispersion = compute_dispersion(np.concatenate(list(groups.values())), list(names))
    classes = [f"{trial.name} {trial.location:g}" for trial in make_touches()[:10]]
    result = {}
    for name, tensors in groups.items():
        sweep = compute_sweep(
            tensors,
            classes,
            ratios=(0.2,),
            n_repeats=n_repeats,
            noise=Relative(),
            random_state=random_state,
        )
        averages = {index: average[name] for index, average in dispersion.average.items()}
        result[name] = {**averages, "accuracy": float(sweep.noisy.mean())}
    return result
