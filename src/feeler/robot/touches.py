"""Simulated touches of the robotic antenna, and the paper's comparison with them."""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.execute import Executor
from feeler.objects import Ball, Box, Feature, Trial
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.robot.description import make_robot
from feeler.tensors.transforms import rectify
from feeler.validation import Seed, checked

# Touches of the robotic antenna in simulation: the paper's grid, and angles over time.

ROBOT_SPEEDS = (0.270, 0.135, 0.027)  # [P] mm/ms = m/s
ROBOT_LOCATIONS = (
    0.5,
    0.6,
    0.7,
    0.8,
    0.9,
)  # [C] five from middle to tip [P], as for the insect; the last is "the tip"
_SIZE = 4.0  # [C] mm; radius of the ball, half-width and half-height of the box
ROBOT_LEAD = 20.0  # [C] ms before contact, enough to see the resting level
_TAIL = 400.0  # [C] ms kept after contact can last
_SWEEP = (
    60.0,
    -40.0,
)  # [C] mm; how far a feature moves before the antenna slips off: at 0.5 L, and per length beyond
INTERVAL = 1.0  # [P] ms
_ALIKE = 1.35  # ratio of durations up to which touches are simulated on one clock

Label = tuple[str, float, float]
"""A class: feature, location, speed."""


@checked
def make_touches(
    *,
    features: Sequence[Feature] | None = None,
    locations: Sequence[float] = ROBOT_LOCATIONS,
    speeds: Sequence[float] = ROBOT_SPEEDS,
    size: float = _SIZE,
    friction: float = 1.0,
) -> list[Trial]:
    """Every feature at every location and speed.

    By default the paper's ball and box of ``size``, 30 touches.
    """
    if features is None:
        features = (Ball(radius=size), Box(half_width=size, half_height=size))
    return [
        Trial(
            feature=feature, location=location, speed=speed, lead=ROBOT_LEAD, friction=friction
        )
        for speed in speeds
        for location in locations
        for feature in features
    ]


@checked
def get_label(trial: Trial) -> Label:
    """The class of a trial."""
    return trial.name, trial.location, trial.speed


def choose_duration(trial: Trial, reach: float = 1.0) -> float:
    """Time [ms] after which a touch has let go and rung for about 400 ms.

    ``reach`` is the antenna's length over that of the paper's robot.
    """
    sweep = reach * max(_SWEEP[0] + _SWEEP[1] * (trial.location - 0.5), 0.0)
    return float(np.ceil(trial.lead + sweep / trial.speed + _TAIL))


@checked
def simulate_touches(antenna: Antenna, trials: Sequence[Trial], **how: Any) -> list[np.ndarray]:
    """Hinge angles (hinge, time) [rad] of each trial at 1 kHz.

    Durations differ, see :func:`choose_duration`.

    ``how`` may hold ``duration`` [ms] or ``reach`` (see :func:`choose_duration`) and,
    as for :func:`feeler.touch`, ``engine``, ``timestep``, ``workers``, ``executor``.
    """
    return simulate_pairs([(antenna, trial) for trial in trials], **how)


@checked
def simulate_pairs(
    pairs: Sequence[tuple[Antenna, Trial]],
    *,
    duration: float | None = None,
    reach: float = 1.0,
    timestep: float | None = None,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    executor: Executor | None = None,
) -> list[np.ndarray]:
    """As :func:`simulate_touches`, each trial with an antenna of its own.

    Touches of like durations run together.

    Raises
    ------
    SimulationDiverged
        The first touch that left the finite numbers.
    """
    from feeler.physics.run import expect_motions, simulate
    from feeler.physics.scene import Clock, make_scene

    durations = [duration or choose_duration(trial, reach) for _, trial in pairs]
    motions: list[np.ndarray] = [np.empty(0)] * len(pairs)
    for group in _group(durations):
        scenes = [make_scene(*pairs[i]) for i in group]
        step = choose_timestep(timestep, engine, *(scene.contact for scene in scenes))
        clock = Clock(
            duration=max(durations[i] for i in group), sample_interval=INTERVAL, timestep=step
        )
        results = simulate(scenes, clock, engine=engine, workers=workers, executor=executor)
        for i, motion in zip(group, expect_motions(results), strict=True):
            motions[i] = np.ascontiguousarray(motion.angle[: round(durations[i] / INTERVAL)].T)
    return motions


def _group(durations: Sequence[float]) -> list[list[int]]:
    """Numbers of the touches whose durations are alike enough to share a clock."""
    groups: list[list[int]] = []
    for i in np.argsort(durations, kind="stable"):
        if groups and durations[i] <= _ALIKE * durations[groups[-1][0]]:
            groups[-1].append(int(i))
        else:
            groups.append([int(i)])
    return groups


@checked
def compute_tip(antenna: Antenna, angle: Annotated[np.ndarray, "... hinge time"]) -> np.ndarray:
    """Tip's sideways position (…, time) [mm] from hinge angles (…, hinge, time).

    Touches are aligned on it.

    Angles of the sensed hinges alone count the others as straight.
    """
    length = antenna.segment_length
    if np.shape(angle)[-2:-1] == (antenna.sensors.size,):
        length = np.add.reduceat(length, antenna.sensors - 1)
    elif np.shape(angle)[-2:-1] != (antenna.n_segments,):
        raise InvalidInput(
            f"angle needs the {antenna.n_segments} hinges of the antenna, or its"
            f" {antenna.sensors.size} sensors, as (…, hinge, time), got shape {np.shape(angle)}."
        )
    heading = np.cumsum(np.nan_to_num(angle), axis=-2)
    return np.einsum("n,...nt->...t", length, np.sin(heading))


@checked
def find_direction(tip: Annotated[np.ndarray, "time"]) -> int:
    """The way that a touch pushes the tip, given its trace (time,) [mm] from rest: 1, or −1 for an
    object from the other side than in :func:`make_touches`; 0 for no motion.

    The sign of the first deflection that is more than half of the greatest: an antenna swings back
    by up to as much, but later.
    """
    size = np.abs(np.nan_to_num(tip))
    first = int(np.argmax(size > 0.5 * size.max(initial=0.0))) if size.any() else None
    return 0 if first is None else int(np.sign(tip[first]))


# The eight-segment model in the paper's comparison of speeds and stiffness profiles.

_PROFILES = ("exponential", "linear", "constant")
# [C] exponential control: stiffness of hinge 8 over hinge 1; the insect's 1e-5 leaves no tip here
_TIP_SHARE = 0.1
_DURATION = 2600.0  # ms, the longest slow touch
_STRIDE = 4  # every fourth sample is kept: nothing in the motion is faster than 100 Hz


@checked
def make_profiles() -> dict[str, Antenna]:
    """The robot, whose widths fall linearly, and two controls.

    All have the same compliance Σ 1/k_n and the same damping time c/k.
    """
    linear = make_robot()
    steps = np.linspace(0, 1, linear.n_segments)
    shapes = {
        "exponential": _TIP_SHARE**steps,
        "linear": linear.stiffness,
        "constant": np.ones(linear.n_segments),
    }
    time = linear.damping[0] / linear.stiffness[0]
    profiles = {}
    for name in _PROFILES:
        stiffness = shapes[name] * np.sum(1 / shapes[name]) / np.sum(1 / linear.stiffness)
        profiles[name] = linear.replace(
            stiffness=stiffness, damping=time * stiffness, name=f"robot {name}"
        )
    return profiles


def simulate_comparison(
    antenna: Antenna, *, speeds: Sequence[float] = ROBOT_SPEEDS, engine: str = DEFAULT_ENGINE
) -> tuple[np.ndarray, list[Trial]]:
    """Rectified tensors (trial, sensor, time) [rad], 4 ms apart, and their trials: 10 per speed.

    All have one duration; they are not aligned.
    """
    trials = make_touches(speeds=speeds, locations=ROBOT_LOCATIONS)
    motions = simulate_touches(antenna, trials, duration=_DURATION, engine=engine)
    return rectify(np.stack(motions)[:, :, ::_STRIDE]), trials


@checked
def compute_comparison(
    *, n_repeats: int = 3, random_state: Seed = 0, engine: str = DEFAULT_ENGINE
) -> dict[str, dict]:
    """Dispersion and accuracy by speed (the robot) and by profile (slow touches).

    Tensors are rectified as those of the 140-link model.

    Returns
    -------
    dict
        ``speed`` and ``profile``: each group's name → ``pearson``, ``ssim``, ``mse``, ``nmi``
        (closest match, averaged: :class:`~feeler.analysis.Interval` over the ten touches) and
        ``accuracy`` (10 classes, LDA, noise of 20 % of each tensor's maximum on raw tensors).
    """
    profiles = make_profiles()
    robot, trials = simulate_comparison(profiles["linear"], engine=engine)
    speeds = np.array([trial.speed for trial in trials])
    slow = {
        name: simulate_comparison(profiles[name], speeds=ROBOT_SPEEDS[-1:], engine=engine)[0]
        for name in ("exponential", "constant")
    }
    slow["linear"] = robot[speeds == ROBOT_SPEEDS[-1]]
    labels = [get_label(trial)[:2] for trial in trials]
    by_speed = _compare(
        {f"{s:g} m/s": robot[speeds == s] for s in ROBOT_SPEEDS},
        labels[:10],
        n_repeats,
        random_state,
    )
    by_profile = _compare(
        {name: slow[name] for name in _PROFILES}, labels[:10], n_repeats, random_state
    )
    return {"speed": by_speed, "profile": by_profile}


def _compare(
    groups: dict[str, np.ndarray], labels: list[tuple], n_repeats: int, random_state: int
) -> dict:
    from feeler.analysis import compute_dispersion
    from feeler.decoding import Relative, compute_sweep

    names = np.repeat(list(groups), [len(tensors) for tensors in groups.values()])
    dispersion = compute_dispersion(np.concatenate(list(groups.values())), list(names))
    classes = [f"{feature} {location:g}" for feature, location in labels]
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
