"""Simulated touches of the robotic antenna."""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np

from feeler.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.execute import Executor
from feeler.objects import Ball, Box, Feature, Trial
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.validation import checked

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
Joints = tuple[str, ...]
"""Names of channels, or patterns as of a shell, from base to tip."""


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


def _choose_duration(trial: Trial, reach: float = 1.0) -> float:
    """Time [ms] after which a touch has let go and rung for about 400 ms.

    ``reach`` is the antenna's length over that of the paper's robot.
    """
    sweep = reach * max(_SWEEP[0] + _SWEEP[1] * (trial.location - 0.5), 0.0)
    return float(np.ceil(trial.lead + sweep / trial.speed + _TAIL))


@checked
def simulate_touches(antenna: Antenna, trials: Sequence[Trial], **how: Any) -> list[np.ndarray]:
    """Hinge angles (hinge, time) [rad] of each trial at 1 kHz.

    Durations differ, see :func:`_choose_duration`.

    ``how`` may hold ``duration`` [ms] or ``reach`` (see :func:`_choose_duration`) and,
    as for :func:`feeler.touch`, ``engine``, ``timestep``, ``workers``, ``executor``.
    """
    return _simulate_pairs([(antenna, trial) for trial in trials], **how)


@checked
def _simulate_pairs(
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
    SimulationDivergedError
        The first touch that left the finite numbers.
    """
    from feeler.physics.run import expect_motions, simulate
    from feeler.physics.scene import Clock, make_scene

    durations = [duration or _choose_duration(trial, reach) for _, trial in pairs]
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
def _list_lengths(antenna: Antenna) -> np.ndarray:
    """Lengths (sensor,) [mm] of an antenna from each sensor to the next, of the last to the tip."""
    return np.add.reduceat(antenna.segment_length, antenna.sensors - 1)


@checked
def compute_tip(antenna: Antenna, angle: Annotated[np.ndarray, "... hinge time"]) -> np.ndarray:
    """Tip's sideways position (…, time) [mm] from hinge angles (…, hinge, time).

    Touches are aligned on it.

    Angles of the sensed hinges alone count the others as straight.
    """
    length = antenna.segment_length
    if np.shape(angle)[-2:-1] == (antenna.sensors.size,):
        length = _list_lengths(antenna)
    elif np.shape(angle)[-2:-1] != (antenna.n_segments,):
        raise InvalidInput(
            f"angle needs the {antenna.n_segments} hinges of the antenna, or its"
            f" {antenna.sensors.size} sensors, as (…, hinge, time), got shape {np.shape(angle)}."
        )
    heading = np.cumsum(np.nan_to_num(angle), axis=-2)
    return np.einsum("n,...nt->...t", length, np.sin(heading))
