"""Space: antennas near one that is given, described by a few numbers."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import CubicSpline

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput

Range = tuple[float, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """A point of a space: an antenna, and how fast to touch with it (None: as the task says)."""

    antenna: Antenna
    speed: float | None = None


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class Space:
    """Antennas x ↦ log-factors on a reference's stiffness, damping, length, radius; sensors; speed.

    Stiffness and damping have values at knots spread evenly over the segments, between which the
    logarithm of the factor is a natural cubic spline: 0 knots leave the profile, 1 scales it, 2
    give the exponential family (of an exponential reference), as many as hinges free each hinge.
    All entries of x are 0 at the reference; ±1 is each bound.

    Raises
    ------
    InvalidInput
        No freedom at all, or a range that does not hold the reference.
    """

    reference: Antenna
    stiffness: int = 2
    """Knots."""
    damping: int = 2
    """Knots."""
    span: float = 100.0
    """The greatest factor on stiffness and damping at a knot, either way."""
    length: Range = (1.0, 1.0)
    """Least and greatest factor on all segment lengths; mass goes with it."""
    radius: Range = (1.0, 1.0)
    """Of the collision radius."""
    warp: float = 1.0
    """Sensors at shares (j / (m − 1))^w of the hinges, w from 1/warp to warp; 1: they stay."""
    speed: Range | None = None
    """Slowest and fastest touch [m/s]; None: the task's."""

    def __post_init__(self) -> None:
        n = self.reference.n_segments
        for name in ("stiffness", "damping"):
            if not 0 <= getattr(self, name) <= n:
                raise InvalidInput(
                    f"{name} must have 0 to {n} knots (one per hinge), got {getattr(self, name)}."
                )
        for name in ("length", "radius"):
            low, high = getattr(self, name)
            if not 0 < low <= 1 <= high < np.inf:
                raise InvalidInput(
                    f"{name} must be factors (low ≤ 1, high ≥ 1), got {getattr(self, name)}."
                )
        if self.speed is not None and not 0 < self.speed[0] < self.speed[1] < np.inf:
            raise InvalidInput(f"speed must be a range 0 < low < high [m/s], got {self.speed}.")
        if not (1 < self.span < np.inf and 1 <= self.warp < np.inf):
            raise InvalidInput(f"span must be > 1 and warp ≥ 1, got {self.span} and {self.warp}.")
        if not self.names:
            raise InvalidInput(
                "this space has no freedom: give stiffness or damping knots, or a range of length,"
                " radius, warp or speed."
            )

    @property
    def names(self) -> list[str]:
        """What each number of x changes."""
        ends = [name for name in ("length", "radius") if getattr(self, name) != (1.0, 1.0)]
        ends += ["warp"] * (self.warp > 1) + ["speed"] * (self.speed is not None)
        knots = [
            f"{what} {k + 1}"
            for what in ("stiffness", "damping")
            for k in range(getattr(self, what))
        ]
        return knots + ends

    def list_parts(self, x: np.ndarray) -> dict[str, np.ndarray]:
        """x cut into what belongs to stiffness, damping and each other name."""
        cut = np.split(np.asarray(x, dtype=float), np.cumsum([self.stiffness, self.damping]))
        return {"stiffness": cut[0], "damping": cut[1]} | dict(
            zip(self.names[len(cut[0]) + len(cut[1]) :], cut[2], strict=True)
        )

    def build(self, x: Annotated[np.ndarray, "parameter"]) -> Design:
        """The design at x, entries beyond ±1 taken at the bound."""
        part = self.list_parts(np.clip(x, -1.0, 1.0))
        base, n = self.reference, self.reference.n_segments
        grow = np.exp(_scale(part.get("length"), self.length))
        changes: dict[str, Any] = {
            name: (
                getattr(base, name)
                * np.exp(np.log(self.span) * make_basis(n, getattr(self, name)) @ part[name])
            )
            for name in ("stiffness", "damping")
        }
        changes["segment_length"], changes["segment_mass"] = (
            base.segment_length * grow,
            base.segment_mass * grow,
        )
        changes["radius"] = base.radius * np.exp(_scale(part.get("radius"), self.radius))
        if "warp" in part:
            changes["sensors"] = place_sensors(
                n, base.sensors.size, float(self.warp ** part["warp"])
            )
        speed = None
        if self.speed is not None:
            speed = float(np.exp(np.interp(part["speed"], (-1, 1), np.log(self.speed))))
        return Design(antenna=base.replace(**changes, name="design"), speed=speed)

    def pull_back(self, x: np.ndarray, gradient: dict[str, np.ndarray]) -> np.ndarray:
        """∂/∂x from the derivatives with respect to each hinge's stiffness and damping (segment,)."""
        if len(self.names) > self.stiffness + self.damping:
            raise InvalidInput(
                "gradients know stiffness and damping only; leave length, radius, warp and speed as"
                " they are."
            )
        antenna, n = self.build(x).antenna, self.reference.n_segments
        parts = [
            np.log(self.span)
            * make_basis(n, getattr(self, name)).T
            @ (getattr(antenna, name) * gradient[name])
            for name in ("stiffness", "damping")
        ]
        return np.concatenate(parts)


def make_basis(n_segments: int, knots: int) -> np.ndarray:
    """Values (segment, knot) of the natural cubic splines that are 1 at one knot and 0 at the
    others.
    """
    if knots < 2:
        return np.ones((n_segments, knots))
    if knots == n_segments:
        return np.eye(n_segments)
    places = np.linspace(0, n_segments - 1, knots)
    return CubicSpline(places, np.eye(knots), bc_type="natural")(np.arange(n_segments))


def place_sensors(n_segments: int, count: int, warp: float) -> np.ndarray:
    """``count`` hinge numbers at shares (j / (count − 1))^warp; where two fall together the next
    free one to the tip.
    """
    wanted = 1 + np.round((n_segments - 1) * np.linspace(0, 1, count) ** warp).astype(int)
    for j in range(1, count):
        wanted[j] = max(wanted[j], wanted[j - 1] + 1)
    for j in range(count - 1, -1, -1):
        wanted[j] = min(wanted[j], n_segments - (count - 1 - j))
    return wanted


def _scale(value: Any, ends: Range) -> float:
    """A log-factor: 0 at the reference, the ends' at ±1."""
    return (
        0.0
        if value is None
        else float(np.interp(value, (-1, 0, 1), (np.log(ends[0]), 0.0, np.log(ends[1]))))
    )
