"""An object: a feature somewhere in the world, moving as it is told to."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.stimulus.feature import Feature


@dataclass(frozen=True, kw_only=True)
class Object:
    """A feature with a place and a motion; nothing that it touches can slow it.

    Raises
    ------
    InvalidInput
        No feature, numbers that are not finite, or a negative friction.
    """

    feature: Feature
    """What it is."""
    place: tuple[float, float] = (0.0, 0.0)
    """Its frame's origin at time 0 [mm]."""
    forward: tuple[float, float] = (1.0, 0.0)
    """Unit vector: the first axis of its frame at time 0."""
    velocity: tuple[float, float] = (0.0, 0.0)
    """[mm/ms]"""
    turn: float = 0.0
    """Turn rate about the frame's origin [rad/ms], positive from +y towards +x, as angles are."""
    friction: float = 1.0
    """Coefficient of sliding friction, ≥ 0."""
    name: str = ""
    """What it is called among the objects of a scene; default: the feature's name."""

    def __post_init__(self) -> None:
        if not isinstance(self.feature, Feature):
            raise InvalidInput(f"Object.feature must be a feature such as Ball(radius=1.5), got {self.feature!r}.")
        for name in ("place", "forward", "velocity"):
            object.__setattr__(self, name, check_vector(getattr(self, name), f"Object.{name}"))
        for name in ("turn", "friction"):
            object.__setattr__(self, name, check_number(getattr(self, name), f"Object.{name}"))
        size = np.hypot(*self.forward)
        if abs(size - 1) > 1e-6:
            raise InvalidInput(f"Object.forward must be a unit vector, got {self.forward} of length {size:g}.")
        if self.friction < 0:
            raise InvalidInput(f"Object.friction must be ≥ 0, got {self.friction}.")
        object.__setattr__(self, "name", self.name or self.feature.name)

    def replace(self, **changes: Any) -> "Object":
        """The same object with some fields changed, validated again."""
        return replace(self, **changes)


def check_number(value: Any, name: str) -> float:
    """The value as a finite float."""
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = np.nan
    if not np.isfinite(number):
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
