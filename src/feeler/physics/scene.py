"""Scenes: what an engine simulates, in no engine's words, and the clock of a run."""

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from feeler.antenna.segments import Antenna, to_matrix, to_vector
from feeler.errors import InvalidInput
from feeler.objects.bodies import Object, make_object
from feeler.objects.meshes import list_solids
from feeler.objects.motion import BaseMotion, Flow, Vector, lift
from feeler.objects.trials import Trial
from feeler.physics.contact import Contact, get_contact

# The clock of a run: duration, samples and steps that fit each other.

MAX_SAMPLES = 10_000_000
MAX_STEPS = 10_000_000_000  # [C] of one run or command: hours even of the smallest antenna


@dataclass(frozen=True, kw_only=True)
class Clock:
    """Sample k is the state after k · ``steps_per_sample`` steps; sample 0 is the initial state.
    All in ms.
    """

    duration: float
    sample_interval: float = 1.0
    timestep: float

    def __post_init__(self) -> None:
        for name in ("duration", "sample_interval", "timestep"):
            value = getattr(self, name)
            number = isinstance(value, int | float | np.number)
            if not (number and np.isfinite(value) and value > 0):
                raise InvalidInput(f"{name} must be finite and > 0 ms, got {value!r}.")
        count = np.ceil(self.duration / self.sample_interval - 1e-9) + 0.0
        if not 1 <= count <= MAX_SAMPLES:
            raise InvalidInput(
                f"duration {self.duration:g} ms at one sample per {self.sample_interval:g} ms gives"
                f" {count:.8g} samples; allowed are 1 to {MAX_SAMPLES}."
            )
        if self.duration / self.timestep > MAX_STEPS:
            raise InvalidInput(
                f"duration {self.duration:g} ms takes {self.duration / self.timestep:.3g} timesteps"
                f" of {self.timestep:g} ms; allowed are {MAX_STEPS:.0e}."
            )
        ratio = self.sample_interval / self.timestep
        if round(ratio) < 1 or abs(ratio - round(ratio)) > 1e-6 * ratio:
            raise InvalidInput(
                f"sample_interval must be a whole number of timesteps, got {self.sample_interval:g}"
                f" ms / {self.timestep:g} ms = {ratio:g}. Choose for example"
                f" timestep={self.sample_interval / max(1, round(ratio)):g}."
            )

    @cached_property
    def n_samples(self) -> int:
        """Samples in [0, duration)."""
        return int(np.ceil(self.duration / self.sample_interval - 1e-9))

    @cached_property
    def steps_per_sample(self) -> int:
        """Steps between samples."""
        return round(self.sample_interval / self.timestep)

    @property
    def time(self) -> np.ndarray:
        """Sample times (sample,) [ms], from 0."""
        return np.arange(self.n_samples) * self.sample_interval


# A scene: what an engine simulates, in no engine's words.


@dataclass(frozen=True, kw_only=True)
class Path:
    """How an object moves: constant ``velocity`` (leg, 2) [mm/ms] until each ``end`` (leg,) [ms],
    the last for ever.
    """

    velocity: tuple[Vector, ...]
    end: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if len(self.end) != len(self.velocity) - 1 or np.any(np.diff(self.end) <= 0):
            raise InvalidInput("a Path needs one rising end time fewer than it has velocities.")


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """An antenna on a base, and objects; both move as they are told to.

    The antenna's angle and velocity start at ``angle`` [rad] (default: at rest) and ``velocity``
    [rad/ms]. Segment n points along (sin φ, cos φ), φ = heading of the base + Σ angles up to n.

    Attributes
    ----------
    paths : tuple[Path | None, ...]
        For each object that has one, what it does instead of going on with its velocity.
    gravity : tuple[float, float] | tuple[float, float, float]
        [mm/ms²]; 9.81e-3 on the ground. [D] Tests of this scale run without.
    base : tuple[float, ...]
        Place [mm] and heading [rad] of the base, on top of which its motion comes; in space place
        and rotation vector. An antenna in space lifts all that is given in the plane.
    base_motion : BaseMotion | None
        How the base moves; default: not at all.
    flow : Flow | None
        What drags an antenna in space along.
    """

    antenna: Antenna
    objects: tuple[Object, ...] = ()
    paths: tuple[Path | None, ...] = ()
    contact: Contact = field(default_factory=get_contact)
    gravity: Vector = (0.0, 0.0)
    base: tuple[float, ...] = (0.0, 0.0, 0.0)
    base_motion: BaseMotion | None = None
    flow: Flow | None = None
    angle: np.ndarray | None = None
    velocity: np.ndarray | None = None
    label: str = ""

    def __post_init__(self) -> None:
        if self.antenna.spatial:
            vars(self).update(self._lift())
            return
        moved = self.base_motion is not None and self.base_motion.spatial
        wide = [o.name for o in self.objects if o.spatial]
        if self.flow is not None:
            raise InvalidInput(
                f"flow drags antennae in space only, and {self.antenna.name!r} lies in the plane:"
                " leave flow= out, or give stiffness a row for each plane."
            )
        for item in self.objects:
            if item.feature.only_in_space:
                raise InvalidInput(
                    f"the {item.feature.kind} {item.name!r} is a solid in space, but"
                    f" {self.antenna.name!r} lies in the plane: use an outline, or an antenna in"
                    " space: antenna.unflatten()."
                )
        if wide or moved or len(self.gravity) == 3:
            what = wide[0] if wide else "base" if moved else "gravity"
            raise InvalidInput(
                f"{what!r} has three numbers for a place or a rotation, but {self.antenna.name!r}"
                " lies in the plane: give two, or an antenna in space (a row of stiffness for each"
                " plane)."
            )

    def _lift(self) -> dict[str, Any]:
        """What is given in the plane, in space."""
        if any(self.paths):
            raise InvalidInput("paths of objects lie in the plane; in space use velocity=.")
        for item in self.objects:
            list_solids(item.feature)
        x, y, *rest = self.base
        base = self.base if len(rest) == 4 else (x, y, 0.0, 0.0, 0.0, -rest[0])
        return {
            "objects": tuple(item.lift() for item in self.objects),
            "gravity": lift(self.gravity),
            "base": base,
            "base_motion": self.base_motion and self.base_motion.lift(),
        }

    @property
    def timed_contact(self) -> Contact:
        """The contact that a timestep must follow; the default one where nothing is touched."""
        return self.contact if self.objects else get_contact()

    @property
    def initial_angle(self) -> np.ndarray:
        """Angles (segment,) at time 0 [rad]."""
        return (
            self.antenna.rest_angle
            if self.angle is None
            else np.asarray(self.angle, dtype=float)
        )

    @property
    def initial_velocity(self) -> np.ndarray:
        """Angular velocities (segment,) at time 0 [rad/ms]."""
        if self.velocity is None:
            return np.zeros(self.antenna.rest_angle.shape)
        return np.asarray(self.velocity, dtype=float)

    @property
    def base_pose(self) -> np.ndarray:
        """Place [mm] and heading [rad] (3,) of the base at time 0; in space place and rotation
        vector (6,).
        """
        if self.antenna.spatial and self.base_motion is not None:
            moved, own = self.base_motion.compute_pose(np.zeros(1))[0], np.asarray(self.base)
            turned = to_vector(to_matrix(moved[3:]) @ to_matrix(own[3:]))
            return np.concatenate([own[:3] + moved[:3], turned])
        moved = (
            self.base_motion.compute_pose(np.zeros(1))[0]
            if self.base_motion is not None
            else 0.0
        )
        return np.asarray(self.base) + moved

    @property
    def base_velocity(self) -> tuple[float, ...]:
        """Rates x, y [mm/ms] and turn [rad/ms] of the base at time 0; the antenna moves along. In
        space velocity and angular velocity (6,).
        """
        still = (0.0,) * len(self.base)
        return still if self.base_motion is None else self.base_motion.compute_rate()

    @property
    def speed(self) -> float:
        """The greatest speed [mm/ms] at which an object and the base are told to close in.

        A turn counts with the distance between object and base, up to the antenna's length, and
        that of an object with its extent.
        """
        fastest = 0.0
        for o, item in enumerate(self.objects):
            path = self.paths[o] if self.paths else None
            legs = [item.velocity] if path is None else path.velocity
            dims = len(item.place)
            own = float(np.linalg.norm(item.turn)) * min(item.extent, self.antenna.length)
            gap = np.asarray(item.place) - self.base_pose[:dims]
            far = min(float(np.hypot.reduce(gap)), self.antenna.length)
            for rate in self._list_base_rates():
                apart = np.hypot.reduce((np.asarray(legs) - rate[:dims]).T).max()
                turning = float(np.hypot.reduce(rate[dims:]))
                fastest = max(fastest, float(apart) + own + turning * far)
        return fastest

    def _list_base_rates(self) -> np.ndarray:
        """Rates (·, 3) of the base, from sample to sample of a recorded path."""
        motion = self.base_motion
        if motion is None or motion.time is None or motion.pose is None:
            return np.array([self.base_velocity])
        return np.diff(motion.pose, axis=0) / np.diff(motion.time)[:, None]

    @property
    def follows(self) -> bool:
        """Whether the base follows a recorded path."""
        return self.base_motion is not None and self.base_motion.time is not None

    @property
    def guided(self) -> bool:
        """Whether its base follows a path or its objects have paths, which no command gives."""
        return bool(self.paths) or self.follows

    def compute_drive(self, first: int, n_steps: int, timestep: float) -> np.ndarray:
        """Velocity (step, 3; in space 6) of a base on a recorded path at the end of each step, so
        that it is in place after each.
        """
        assert self.base_motion is not None
        pose = self.base_motion.compute_pose(timestep * np.arange(first, first + n_steps + 1))
        rate = np.diff(pose, axis=0) / timestep
        if self.antenna.spatial:
            turned = to_matrix(pose[:, 3:])
            change = turned[1:] @ np.swapaxes(turned[:-1], 1, 2)
            rate[:, 3:] = to_vector(change) / timestep
        return rate


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """What an engine gives back, sampled; forces are those of the step that led to the sample.

    Attributes
    ----------
    time : np.ndarray
        (sample,) [ms].
    angle : np.ndarray
        (sample, segment) [rad]; in space (sample, plane, segment).
    velocity : np.ndarray
        Likewise [rad/ms].
    force : np.ndarray
        Total contact force on the antenna (sample, 2) [N].
    base : np.ndarray
        Place [mm] and heading [rad] of the base (sample, 3).
    base_force : np.ndarray
        Force of the base on the antenna (sample, 2) [N].
    base_moment : np.ndarray
        Moment of the base on the antenna (sample,) [N·mm].
    contact_place : np.ndarray
        Centre of pressure along the antenna as a share of its length (sample,), NaN without
        contact.
    work : np.ndarray
        Work done on the antenna since time 0 by its base and by all objects (sample, 2) [µJ].
    sink : np.ndarray
        How deep contacts have sunk at most since time 0 (sample,), over the smaller radius.
    timestep : float
        [ms]
    error : float
        Greatest error over the peak, as step doubling estimates it; NaN where it was not asked for.
    """

    time: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    base: np.ndarray
    base_force: np.ndarray
    base_moment: np.ndarray
    contact_place: np.ndarray
    work: np.ndarray
    sink: np.ndarray
    timestep: float
    error: float = float("nan")


def make_scene(
    antenna: Antenna,
    trial: Trial,
    contact: Contact | str | None = None,
    flow: Flow | None = None,
) -> Scene:
    """The scene of one trial."""
    return Scene(
        antenna=antenna,
        objects=(make_object(antenna, trial),),
        contact=get_contact(contact, antenna),
        base_motion=trial.base_motion,
        flow=flow,
        label=trial.label,
    )
