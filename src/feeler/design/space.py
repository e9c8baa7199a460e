"""Space: antennas near one that is given, described by a few numbers."""

from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from scipy.interpolate import CubicSpline

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Ge, Gt, Record

_Positive = Annotated[float, Gt(0)]
_Range = tuple[_Positive, _Positive]


@dataclass(frozen=True, kw_only=True, eq=False)
class Design:
    """A point of a space: an antenna, and how fast to touch with it (None: as the task says)."""

    antenna: Antenna
    speed: float | None = None


class Space(Record):
    """Antennas x ↦ log-factors on a reference's stiffness, damping, length, radius; sensors; speed.

    Stiffness and damping have values at knots spread evenly over the segments, between which the
    logarithm of the factor is a natural cubic spline: 0 knots leave the profile, 1 scales it, 2
    give the exponential family (of an exponential reference), as many as hinges free each hinge.
    All entries of x are 0 at the reference; ±1 is each bound. In space the factors are those of
    both planes of bending; torsion stays the reference's.

    Attributes
    ----------
    stiffness : int
        Knots.
    damping : int
        Knots.
    span : float
        The greatest factor on stiffness and damping at a knot, either way.
    length : Range
        Least and greatest factor on all segment lengths; mass goes with it.
    radius : Range
        Of the collision radius.
    warp : float
        Sensors at shares (j / (m − 1))^w of the hinges, w from 1/warp to warp; 1: they stay.
    speed : Range | None
        Slowest and fastest touch [m/s]; None: the task's.
    held : Literal[nothing, total, tip]
        The reference's compliance that every antenna has, too; see :func:`match_compliance`.

    Raises
    ------
    InvalidInput
        No freedom at all, or a range that does not hold the reference.
    """

    reference: Antenna
    stiffness: Annotated[int, Ge(0)] = 2
    damping: Annotated[int, Ge(0)] = 2
    span: Annotated[float, Gt(1)] = 100.0
    length: _Range = (1.0, 1.0)
    radius: _Range = (1.0, 1.0)
    warp: Annotated[float, Ge(1)] = 1.0
    speed: _Range | None = None
    held: Literal["nothing", "total", "tip"] = "nothing"

    def _check(self) -> None:
        n = self.reference.n_segments
        if max(self.stiffness, self.damping) > n:
            raise InvalidInput(
                f"stiffness and damping must have 0 to {n} knots, one per hinge."
            )
        for name in ("length", "radius"):
            low, high = getattr(self, name)
            if not low <= 1 <= high:
                raise InvalidInput(
                    f"{name} must be factors (low ≤ 1, high ≥ 1), got {getattr(self, name)}."
                )
        if self.speed is not None and self.speed[0] >= self.speed[1]:
            raise InvalidInput(f"speed must be a range 0 < low < high [m/s], got {self.speed}.")
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

    def build(self, x: Annotated[np.ndarray, "parameter"]) -> Design:
        """The design at x, entries beyond ±1 taken at the bound."""
        base, n = self.reference, self.reference.n_segments
        knots = [self.stiffness, self.stiffness + self.damping]
        *logs, rest = np.split(np.clip(np.asarray(x, dtype=float), -1.0, 1.0), knots)
        part = dict(zip(self.names[knots[1] :], rest, strict=True))
        changes: dict[str, Any] = {}
        for name, at in zip(("stiffness", "damping"), logs, strict=True):
            factor = np.exp(np.log(self.span) * make_basis(n, len(at)) @ at)
            rows = getattr(base, name)
            changes[name] = _put_bending(rows, list_bending(rows) * factor)
        if self.held != "nothing":
            changes["stiffness"] = match_compliance(changes["stiffness"], base, self.held)
        grow = np.exp(_scale(part.get("length"), self.length))
        changes["segment_length"] = base.segment_length * grow
        changes["segment_mass"] = base.segment_mass * grow
        changes["radius"] = base.radius * np.exp(_scale(part.get("radius"), self.radius))
        if "warp" in part:
            changes["sensors"] = place_sensors(
                n, base.sensors.size, float(self.warp ** part["warp"])
            )
        speed = None
        if self.speed is not None:
            speed = float(np.exp(np.interp(part["speed"], (-1, 1), np.log(self.speed))))
        return Design(antenna=base.replace(**changes, name="design"), speed=speed)


@checked
def match_compliance(
    shape: Annotated[np.ndarray, "... segment"],
    reference: Antenna,
    held: Literal["total", "tip"] = "total",
) -> np.ndarray:
    """Stiffness of this shape, scaled so that one compliance is the reference's.

    ``held`` is the ``total`` Σ 1/k_n, or that of the ``tip`` under a force, Σ (L − s_n)² / k_n with
    s_n the place of hinge n. In space it is the sum of both planes of bending, and torsion is not
    scaled.
    """
    shape, arm = np.asarray(shape, float), reference.length - reference.hinge_position
    if shape.shape != reference.stiffness.shape or not np.all(shape > 0):
        raise InvalidInput(
            f"shape must be a stiffness > 0 for each of the {arm.size} segments of the reference"
            f" {reference.stiffness.shape}, got shape {shape.shape}."
        )
    weight = arm**2 if held == "tip" else np.ones_like(arm)
    bent, known = list_bending(shape), list_bending(reference.stiffness)
    return _put_bending(shape, bent * np.sum(weight / bent) / np.sum(weight / known))


def list_bending(rows: np.ndarray) -> np.ndarray:
    """What a hinge has for bending, without torsion: (plane, segment), in the plane (segment,)."""
    return rows if rows.ndim == 1 else rows[:2]


def _put_bending(rows: np.ndarray, bent: np.ndarray) -> np.ndarray:
    """The rows with others for bending, and that of torsion as it is."""
    return bent if rows.ndim == 1 else np.concatenate([bent, rows[2:]])


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


def _scale(value: Any, ends: _Range) -> float:
    """A log-factor: 0 at the reference, the ends' at ±1."""
    return (
        0.0
        if value is None
        else float(np.interp(value, (-1, 0, 1), (np.log(ends[0]), 0.0, np.log(ends[1]))))
    )
