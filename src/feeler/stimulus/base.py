"""How an antenna's base moves: at constant velocity, or along a recorded path."""

import math
from collections.abc import Mapping
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.record import Record

LATE = 1e-9  # ms; how far beyond its end a path may be asked for


class BaseMotion(Record):
    """The base as a function of time.

    Either it moves with constant ``velocity`` and ``turn`` from its place at the origin, and the
    antenna moves with it from the start; or it follows ``pose`` given at ``time``, with a cubic
    spline through the samples (twice continuously differentiable, not-a-knot ends), so that forces
    have no jumps.

    Attributes
    ----------
    velocity : tuple[float, float]
        [mm/ms]
    turn : float
        [rad/ms], positive from +y towards +x, as angles are.
    time : Annotated[np.ndarray, sample] | None
        (sample,) [ms], from 0.
    pose : Annotated[np.ndarray, sample 3] | None
        x, y [mm] and heading [rad] of the base (sample, 3).

    Raises
    ------
    InvalidInput
        Numbers that are not finite, times that do not rise from 0, fewer than four samples, or both
        ways at once.
    """

    velocity: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    time: Annotated[np.ndarray, "sample"] | None = None
    pose: Annotated[np.ndarray, "sample 3"] | None = None

    def _check(self) -> None:
        if self.time is None and self.pose is None:
            return
        if any(self.velocity) or self.turn:
            raise InvalidInput(
                "a BaseMotion has either a velocity and a turn or a path (time and pose), not both."
            )
        count = [0 if part is None else len(part) for part in (self.time, self.pose)]
        if self.time is None or count[0] != count[1] or count[0] < 4:
            raise InvalidInput(
                "a recorded path needs time (sample,) and pose (sample, 3: x, y, heading) of at"
                f" least four samples, got {count[0]} and {count[1]}."
            )
        if self.time[0] != 0 or not np.all(np.diff(self.time) > 0):
            raise InvalidInput("BaseMotion.time must rise from 0 ms.")

    def compute_pose(self, time: np.ndarray) -> np.ndarray:
        """x, y [mm] and heading [rad] (time, 3) at times [ms].

        Raises
        ------
        InvalidInput
            A time after the end of the recorded path.
        """
        time = np.asarray(time, dtype=float)
        if self.time is None:
            return time[:, None] * [*self.velocity, self.turn]
        if time.max(initial=0.0) > self.time[-1] + LATE:
            raise InvalidInput(
                f"the base's recorded path ends at {self.time[-1]:g} ms, but {time.max():g} ms are"
                " asked for. Use a shorter duration, or record longer."
            )
        return self._spline(time)

    def compute_rate(self) -> tuple[float, float, float]:
        """Velocity x, y [mm/ms] and turn rate [rad/ms] at time 0."""
        if self.time is None:
            return *self.velocity, self.turn
        vx, vy, turn = self._spline(0.0, 1)
        return float(vx), float(vy), float(turn)

    def mirror(self) -> "BaseMotion":
        """The mirror image about the y axis."""
        if self.time is None or self.pose is None:
            return BaseMotion(velocity=(-self.velocity[0], self.velocity[1]), turn=-self.turn)
        return BaseMotion(time=self.time, pose=self.pose * np.array([-1.0, 1.0, -1.0]))

    @cached_property
    def _spline(self) -> Any:
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.time, self.pose)


def read_base(value: object) -> BaseMotion | None:
    """A base motion, also from its plain data; None where the base stays where it is."""
    if value is not None and not isinstance(value, BaseMotion | Mapping):
        raise InvalidInput(f"base must be a BaseMotion or None, got {str(value)[:40]!r}.")
    base = None if value is None else BaseMotion.from_plain(value)
    return None if base == BaseMotion() else base


def check_number(value: Any, name: str) -> float:
    """The value as a finite float."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = math.nan
    if not math.isfinite(number):
        raise InvalidInput(f"{name} must be a finite number, got {str(value)[:40]!r}.")
    return number


def check_vector(value: Any, name: str) -> tuple[float, float]:
    """The value as two finite floats."""
    try:
        x, y = map(float, value)
    except (TypeError, ValueError):
        x = y = np.nan
    if not np.isfinite([x, y]).all():
        raise InvalidInput(f"{name} must be two finite numbers (x, y), got {str(value)[:40]!r}.")
    return x, y
