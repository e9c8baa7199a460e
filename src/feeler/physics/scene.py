"""A scene: what an engine simulates, in no engine's words."""

from dataclasses import dataclass, field

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.stimulus.feature import Feature
from feeler.stimulus.placement import place
from feeler.stimulus.trial import Trial


@dataclass(frozen=True, kw_only=True)
class Contact:
    """Softness of contact in MuJoCo's terms; fixed on purpose, because MuJoCo's defaults assume SI units.

    Checked for tunnelling at the default and 0.02 ms: over 30 of the paper's touches (0.06 to 0.6 m/s) the antenna sinks into
    an object by at most 0.020 mm, against a collision radius of 0.225 mm (docs/convergence.md).

    ``solref`` = (time constant [ms], damping ratio); ``solimp`` = (d_min, d_max, width [mm], midpoint, power).
    """

    solref: tuple[float, float] = (0.2, 1.0)
    solimp: tuple[float, float, float, float, float] = (0.9, 0.95, 0.001, 0.5, 2.0)

    def __post_init__(self) -> None:
        if not (np.all(np.isfinite(self.solref)) and min(self.solref) > 0):
            raise InvalidInput(
                f"solref must be two positive numbers (time constant [ms], damping ratio), got {self.solref}."
            )
        low, high, width, midpoint, power = self.solimp
        if not (0 < low <= high < 1 and width > 0 and 0 < midpoint < 1 and power >= 1):
            raise InvalidInput(
                f"solimp must be (0 < d_min ≤ d_max < 1, width > 0, 0 < midpoint < 1, power ≥ 1), got {self.solimp}."
            )

    def check_timestep(self, timestep: float) -> None:
        """Refuse a timestep above half the time constant, where MuJoCo would silently soften the contact."""
        limit = self.solref[0] / 2
        if timestep > limit * (1 + 1e-9):
            raise InvalidInput(
                f"timestep {timestep:g} ms is too large for the contact's time constant of {self.solref[0]:g} ms; "
                f"use at most {limit:g} ms, or a softer Contact."
            )


@dataclass(frozen=True, kw_only=True)
class Path:
    """How an object moves: constant ``velocity`` (leg, 2) [mm/ms] until each ``end`` (leg,) [ms], the last for ever."""

    velocity: tuple[tuple[float, float], ...]
    end: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        if len(self.end) != len(self.velocity) - 1 or np.any(np.diff(self.end) <= 0):
            raise InvalidInput("a Path needs one rising end time fewer than it has velocities.")


@dataclass(frozen=True, kw_only=True, eq=False)
class Scene:
    """An antenna clamped at the origin, and at most one object that moves on a prescribed path.

    The antenna's angle and velocity start at ``angle`` [rad] (default: at rest) and ``velocity`` [rad/ms]. Segment n
    points along (sin φ, cos φ), φ = ``base_angle`` + Σ angles up to n.
    """

    antenna: Antenna
    feature: Feature | None = None
    origin: tuple[float, float] = (0.0, 0.0)
    """Feature frame's origin at time 0 [mm]."""
    forward: tuple[float, float] = (1.0, 0.0)
    """Unit first axis of the feature frame; it does not turn."""
    path: Path = Path(velocity=((0.0, 0.0),))
    friction: float = 1.0
    contact: Contact = field(default_factory=Contact)
    base_angle: float = 0.0
    angle: np.ndarray | None = None
    velocity: np.ndarray | None = None
    label: str = ""

    @property
    def initial_angle(self) -> np.ndarray:
        """Angles (segment,) at time 0 [rad]."""
        return self.antenna.rest_angle if self.angle is None else np.asarray(self.angle, dtype=float)

    @property
    def initial_velocity(self) -> np.ndarray:
        """Angular velocities (segment,) at time 0 [rad/ms]."""
        n = self.antenna.n_segments
        return np.zeros(n) if self.velocity is None else np.asarray(self.velocity, dtype=float)


@dataclass(frozen=True, kw_only=True, eq=False)
class Motion:
    """What an engine gives back, sampled: ``time`` (sample,) [ms], ``angle`` and ``velocity`` (sample, segment) [rad,
    rad/ms], ``force`` (sample, 2) [N], the total contact force on the antenna at the sample."""

    time: np.ndarray
    angle: np.ndarray
    velocity: np.ndarray
    force: np.ndarray


def make_scene(antenna: Antenna, trial: Trial, contact: Contact | None = None) -> Scene:
    """The scene of one trial."""
    placement = place(antenna, trial)
    return Scene(
        antenna=antenna,
        feature=trial.shape,
        origin=tuple(placement.origin),
        forward=tuple(placement.forward),
        path=Path(velocity=(tuple(placement.velocity),)),
        friction=trial.friction,
        contact=contact or Contact(),
        label=trial.label,
    )
