"""How an antenna's base moves, and a flow that drags an antenna along."""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from feeler.antenna.segments import find_rate
from feeler.errors import InvalidInput
from feeler.records import Ge, Record, Unit
from feeler.validation import is_array

# How an antenna's base moves: at constant velocity, or along a recorded path.

Vector = tuple[float, float] | tuple[float, float, float]
"""In the plane or in space."""
_LATE = 1e-9  # ms; how far beyond its end a path may be asked for


class BaseMotion(Record):
    """The base as a function of time.

    Either it moves with constant ``velocity`` and ``turn`` from its place at the origin, and the
    antenna moves with it from the start; or it follows ``pose`` given at ``time``, with a cubic
    spline through the samples (twice continuously differentiable, not-a-knot ends), so that forces
    have no jumps.

    An antenna in space takes either kind: of three numbers for a place and for a rotation, or of
    those in the plane.

    Attributes
    ----------
    velocity : tuple[float, float] | tuple[float, float, float]
        [mm/ms]
    turn : float | tuple[float, float, float]
        [rad/ms], positive from +y towards +x, as angles are; in space the angular velocity.
    time : Annotated[np.ndarray, sample] | None
        (sample,) [ms], from 0.
    pose : Annotated[np.ndarray, sample pose] | None
        x, y [mm] and heading [rad] of the base (sample, 3); in space x, y, z and its rotation
        vector [rad] (sample, 6).

    Raises
    ------
    InvalidInput
        Numbers that are not finite, times that do not rise from 0, fewer than four samples, or both
        ways at once.
    """

    velocity: Vector = (0.0, 0.0)
    turn: float | tuple[float, float, float] = 0.0
    time: Annotated[np.ndarray, "sample"] | None = None
    pose: Annotated[np.ndarray, "sample pose"] | None = None

    def _check(self) -> None:
        if self.time is None and self.pose is None:
            return
        if any(self.velocity) or np.any(self.turn):
            raise InvalidInput(
                "a BaseMotion has either a velocity and a turn or a path (time and pose), not both."
            )
        count = [0 if part is None else len(part) for part in (self.time, self.pose)]
        if self.time is None or count[0] != count[1] or count[0] < 4:
            raise InvalidInput(
                "a recorded path needs time (sample,) and pose (sample, 3: x, y, heading) of at"
                f" least four samples, got {count[0]} and {count[1]}."
            )
        if self.pose is not None and self.pose.shape[1] not in (3, 6):
            raise InvalidInput(
                "BaseMotion.pose must be (sample, 3: x, y, heading), or in space (sample, 6: x, y,"
                f" z and a rotation vector), got shape {self.pose.shape}."
            )
        if self.time[0] != 0 or not np.all(np.diff(self.time) > 0):
            raise InvalidInput("BaseMotion.time must rise from 0 ms.")

    @property
    def spatial(self) -> bool:
        """Whether it moves in space, or is written as if it did."""
        wide = self.pose is not None and self.pose.shape[1] == 6
        return wide or len(self.velocity) == 3 or np.ndim(self.turn) == 1

    def lift(self) -> "BaseMotion":
        """The same motion in space."""
        if self.pose is None:
            return BaseMotion(velocity=lift(self.velocity), turn=lift_turn(self.turn))
        if self.spatial:
            return self
        x, y, heading = self.pose.T
        flat = np.zeros_like(x)
        pose = np.stack([x, y, flat, flat, flat, -heading], axis=1)
        return BaseMotion(time=self.time, pose=pose)

    def compute_pose(self, time: np.ndarray) -> np.ndarray:
        """x, y [mm] and heading [rad] (time, 3) at times [ms]; in space (time, 6).

        Raises
        ------
        InvalidInput
            A time after the end of the recorded path.
        """
        time = np.asarray(time, dtype=float)
        if self.time is None:
            return time[:, None] * np.hstack([self.velocity, self.turn])
        if time.max(initial=0.0) > self.time[-1] + _LATE:
            raise InvalidInput(
                f"the base's recorded path ends at {self.time[-1]:g} ms, but {time.max():g} ms are"
                " asked for. Use a shorter duration, or record longer."
            )
        return self._spline(time)

    def compute_rate(self) -> tuple[float, ...]:
        """Velocity x, y [mm/ms] and turn rate [rad/ms] at time 0; in space velocity and angular
        velocity (6,).
        """
        if self.time is None:
            return tuple(np.hstack([self.velocity, self.turn]).tolist())
        rate = self._spline(0.0, 1)
        if self.spatial:
            rate = np.concatenate([rate[:3], find_rate(self._spline(0.0)[3:], rate[3:])])
        return tuple(rate.tolist())

    def mirror(self) -> "BaseMotion":
        """The mirror image about the y axis; in space about its plane with z."""
        if self.spatial:
            image, own = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0]), self.lift()
            if own.pose is not None:
                return own.replace(pose=own.pose * image)
            rate = image * np.hstack([own.velocity, own.turn])
            return BaseMotion(velocity=tuple(rate[:3]), turn=tuple(rate[3:]))
        if self.time is None or self.pose is None:
            turn = -float(self.turn)  # type: ignore[arg-type]  # a number in the plane
            return BaseMotion(velocity=(-self.velocity[0], self.velocity[1]), turn=turn)
        return BaseMotion(time=self.time, pose=self.pose * np.array([-1.0, 1.0, -1.0]))

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.time, self.pose)


def lift(vector: Sequence[float]) -> tuple[float, float, float]:
    """A vector in space, of two numbers or three."""
    x, y, *z = vector
    return float(x), float(y), float(z[0]) if z else 0.0


def lift_turn(turn: float | Sequence[float]) -> tuple[float, float, float]:
    """An angular velocity in space, also of a turn rate in the plane."""
    return lift(turn) if isinstance(turn, Sequence) else (0.0, 0.0, 0.0 - turn)


def read_base(value: object) -> BaseMotion | None:
    """A base motion, also from its plain data; None where the base stays where it is."""
    if value is not None and not isinstance(value, BaseMotion | Mapping):
        raise InvalidInput(f"base must be a BaseMotion or None, got {str(value)[:40]!r}.")
    base = None if value is None else BaseMotion.from_plain(value)
    return None if base == BaseMotion() else base


def check_number(value: Any, name: str) -> float:
    """The value as a finite float; a text that looks like a number is none."""
    numbers = _read_numbers(value)
    if numbers.ndim or not np.isfinite(numbers):
        raise InvalidInput(f"{name} must be a finite number, got {str(value)[:40]!r}.")
    return float(numbers)


def check_vector(value: Any, name: str, sizes: tuple[int, ...] = (2,)) -> Any:
    """The value as two finite floats, or as many as one of ``sizes`` says."""
    numbers = _read_numbers(value)
    if numbers.ndim != 1 or numbers.size not in sizes or not np.isfinite(numbers).all():
        words = " or ".join(_COUNTS[size] for size in sizes)
        raise InvalidInput(f"{name} must be {words}, got {str(value)[:40]!r}.")
    return tuple(numbers.tolist())


def _read_numbers(value: Any) -> np.ndarray:
    found = np.asarray(value if is_array(value) else np.nan)
    return found.astype(float) if found.dtype.kind in "iuf" else np.array(np.nan)


_COUNTS = {2: "two finite numbers (x, y)", 3: "three finite numbers (x, y, z)"}


# A flow that drags an antenna in space along.


class Flow(Record):
    """A steady, even flow; its drag on an antenna is linear in their relative velocity.

    Force per length f = −c⊥ (v − u)⊥ − c∥ (v − u)∥, across the segment and along it. Of a slender
    body of radius r and length L in a fluid of viscosity μ at low Reynolds numbers
    c⊥ ≈ 4πμ/(ln(L/r) + ½) and c∥ about half of that (Cox 1970, J. Fluid Mech. 44: 791); μ is 1.8e-8
    N·ms/mm² in air and 1e-6 in water.

    Attributes
    ----------
    drag : float
        c⊥ [N·ms/mm²], ≥ 0.
    along : float | None
        c∥ [N·ms/mm²], ≥ 0; default: half of ``drag``.
    velocity : tuple[float, float, float]
        u [mm/ms].
    """

    drag: Annotated[float, Ge(0), Unit("N·ms/mm²")]
    along: Annotated[float, Ge(0), Unit("N·ms/mm²")] | None = None
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def _check(self) -> None:
        if self.along is None:
            vars(self)["along"] = self.drag / 2
