"""A wall in motion: sliding past at constant distance (Fig. 3C), and coming nearer without stopping
(Fig. 3D).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import xarray as xr

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.execute import Executor
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.run import Result, expect_motions, simulate
from feeler.physics.scene import Clock, Motion, Scene
from feeler.records import Gt
from feeler.tensors.schema import make_motion_tensors
from feeler.validation import checked
from feeler.wall.approach import DISTANCES, Approach, Posture, approach, make_wall_scene

_SPEED = (
    0.3  # mm/ms; [P] the paper's medium speed, and within the running speeds of wall following
)
_SLIDE_DURATION = 200.0  # [C] ms
# [C] mm; nearer is at the wall: between force and none an antenna trembles by some 0.001 mm
_CLEARANCE = 0.05


@dataclass(frozen=True, kw_only=True, eq=False)
class WallTouch:
    """Simulated motions of antennae beside a moving wall; all share one clock.

    Attributes
    ----------
    antenna : Antenna
        The antenna with its slack shape.
    distance : np.ndarray
        Distance (motion, sample) of the wall from the base [mm].
    speed : float
        [mm/ms]
    """

    antenna: Antenna
    posture: Posture
    motions: tuple[Motion, ...]
    distance: np.ndarray
    speed: float

    @property
    def base_angle(self) -> float:
        """Heading of the base [rad], negative on the left."""
        return self.posture.sign * self.posture.base_angle

    @property
    def points(self) -> np.ndarray:
        """Base, hinges and tip (motion, sample, segment + 1, 2) [mm]."""
        return np.stack(
            [
                self.antenna.shape(motion.angle, base_angle=self.base_angle)
                for motion in self.motions
            ]
        )

    @property
    def contact(self) -> np.ndarray:
        """Whether (motion, sample) the antenna is at the wall."""
        radius = np.append(self.antenna.radius, self.antenna.radius[-1])
        return (self.posture.sign * self.points[..., 0] + radius).max(
            axis=2
        ) > self.distance - _CLEARANCE

    @property
    def inverted(self) -> np.ndarray:
        """Whether (motion, sample) it is an inverted J: at the wall, tip pointing backward."""
        tip = self.base_angle + np.stack([motion.angle.sum(axis=1) for motion in self.motions])
        return self.contact & (np.cos(tip) < 0)

    def make_dataset(self, *, relative: bool = True) -> xr.Dataset:
        """The tactile tensors by the data contract; ``relative``: hinge angles beyond the slack
        shape.

        ``size`` is infinite (a wall), ``location`` the share of the length at which a straight
        antenna would meet the wall, the extra coordinate ``distance`` the wall's first distance
        [mm].
        """
        antenna = self.antenna
        hinge = antenna.sensors - 1
        angle = np.stack(
            [
                motion.angle - (antenna.rest_angle if relative else 0.0)
                for motion in self.motions
            ]
        )
        n = len(self.motions)
        location = self.distance[:, 0] / np.sin(self.posture.base_angle) / antenna.length
        dataset = make_motion_tensors(
            antenna,
            self.motions,
            angle=angle[:, :, hinge].transpose(0, 2, 1),
            trials={
                "feature": ["wall"] * n,
                "size": [np.inf] * n,
                "location": location,
                "speed": [self.speed] * n,
                "antenna": [antenna.name] * n,
                "source": ["simulation"] * n,
                "seed": [0] * n,
            },
            tip=self.points[:, :, -1],
            attrs={"configuration": {"posture": self.posture.to_plain(), "relative": relative}},
        )
        return dataset.assign_coords(distance=("trial", self.distance[:, 0], {"units": "mm"}))


@checked
def slide(
    antenna: Antenna,
    posture: Posture | None = None,
    distances: Sequence[float] = DISTANCES[2::4],
    *,
    speed: Annotated[float, Gt(0)] = _SPEED,
    duration: Annotated[float, Gt(0)] = _SLIDE_DURATION,
    timestep: float | None = None,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    executor: Executor | None = None,
) -> WallTouch:
    """Let a wall slide backward past the body at constant distances, as when the body runs along it
    (Fig. 3C).

    Each motion starts from the quasi-static equilibrium at its distance, farthest first.
    ``engine``, ``timestep``, ``workers`` and ``executor`` as for :func:`feeler.touch`.
    """
    posture = posture or Posture()
    sweep = approach(antenna, posture, distances)
    scenes = [_begin(sweep, k, (0.0, -speed)) for k in range(len(sweep.distance))]
    step = choose_timestep(timestep, engine, scenes[0].contact)
    clock = Clock(duration=duration, timestep=step)
    motions = simulate(scenes, clock, engine=engine, workers=workers, executor=executor)
    return _collect(
        sweep, motions, np.repeat(sweep.distance[:, None], clock.n_samples, axis=1), speed
    )


@checked
def drive(
    antenna: Antenna,
    posture: Posture | None = None,
    *,
    far: float = DISTANCES[0],
    near: float = DISTANCES[-1],
    speed: Annotated[float, Gt(0)] = 0.06,
    timestep: float | None = None,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    executor: Executor | None = None,
) -> WallTouch:
    """Let a wall come from ``far`` to ``near`` [mm] without stopping (Fig. 3D), one motion.

    ``speed`` [mm/ms], by default the paper's slow exploration speed; the rest as for :func:`slide`.
    """
    posture = posture or Posture()
    if not 0 < near < far:
        raise InvalidInput(
            f"the wall must come from far to near with 0 < near < far, got far={far:g},"
            f" near={near:g} mm."
        )
    duration = (far - near) / speed
    sweep = approach(antenna, posture, [far])
    scenes = [_begin(sweep, 0, (-posture.sign * speed, 0.0))]
    step = choose_timestep(timestep, engine, scenes[0].contact)
    clock = Clock(duration=duration, timestep=step)
    motions = simulate(scenes, clock, engine=engine, workers=workers, executor=executor)
    return _collect(sweep, motions, far - speed * clock.time[None, :], speed)


def _begin(sweep: Approach, step: int, velocity: tuple[float, float]) -> Scene:
    """The scene that goes on from one equilibrium."""
    return make_wall_scene(
        sweep.antenna,
        sweep.posture,
        sweep.distance[step],
        velocity=velocity,
        angle=sweep.angle[step],
    )


def _collect(
    sweep: Approach, motions: Sequence[Result | None], distance: np.ndarray, speed: float
) -> WallTouch:
    return WallTouch(
        antenna=sweep.antenna,
        posture=sweep.posture,
        motions=tuple(expect_motions(motions)),
        distance=distance,
        speed=speed,
    )
