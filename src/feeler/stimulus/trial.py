"""A trial: one feature meets the antenna at one place, with one speed, from one side."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.frozen import Frozen
from feeler.stimulus.base import BaseMotion, read_base
from feeler.stimulus.convex import trace_rim
from feeler.stimulus.feature import SHAPES, Feature, make_feature
from feeler.svg import make_picture

SIDES = ("left", "right")
FRICTION = 1.0  # [D] fits the published video best
LEAD = 5.0  # [C] ms before contact


@dataclass(frozen=True, kw_only=True, eq=False)
class Trial(Frozen):
    """One touch, as data.

    The feature starts clear of the antenna, its foremost point meets the antenna's surface at
    ``location`` exactly ``lead`` ms after time 0, and it moves on at constant velocity. Where the
    base moves, the antenna is taken to be carried unbent until then. Plain data, as ``to_plain``
    gives it, makes the same trial: ``Trial(**plain)``.

    Raises
    ------
    InvalidInput
        A field outside its range; the message names it.
    """

    feature: Feature
    """What touches: Ball, Box, Triangle, Outline, Wall, or any shape that was registered."""
    location: float
    """Where, as a fraction of the antenna's length from the base, in (0, 1]."""
    speed: float
    """How fast the feature moves [m/s = mm/ms], > 0."""
    lead: float = LEAD
    """Time before contact [ms], > 0."""
    approach: float = 90.0
    """Angle between the motion and the antenna's base-to-tip direction at the location [degrees],
    in (0, 180).
    """
    side: str = "left"
    """The side the feature comes from: ``left`` moves towards +x (angles positive), ``right`` is
    its mirror image.
    """
    friction: float = FRICTION
    """Coefficient of sliding friction, ≥ 0."""
    base: BaseMotion | None = None
    """How the antenna's base moves, given for the side ``left``; default: it is clamped."""
    name: str = ""
    """What the object is called; default: the feature's name."""

    def __post_init__(self) -> None:
        if isinstance(self.feature, Mapping):
            object.__setattr__(self, "feature", make_feature(self.feature))
        if not isinstance(self.feature, Feature):
            raise InvalidInput(
                f"Trial.feature must be a {', '.join(SHAPES)}, got {str(self.feature)[:80]!r}."
            )
        if not isinstance(self.side, str) or self.side not in SIDES:
            raise InvalidInput(
                f"Trial.side must be one of {', '.join(SIDES)}, got {str(self.side)[:40]!r}."
            )
        self._check("location", 0.0, 1.0, "a fraction of the length in (0, 1]", upper_open=False)
        self._check("speed", 0.0, np.inf, "> 0 m/s")
        self._check("lead", 0.0, np.inf, "> 0 ms")
        self._check("approach", 0.0, 180.0, "within (0, 180) degrees, 90 is perpendicular")
        self._check("friction", 0.0, np.inf, "≥ 0", lower_open=False)
        object.__setattr__(self, "base", read_base(self.base))
        if not isinstance(self.name, str):
            raise InvalidInput(f"Trial.name must be text, got {str(self.name)[:40]!r}.")
        object.__setattr__(self, "name", self.name or self.feature.name)

    def _check(
        self, name: str, low: float, high: float, allowed: str, *, lower_open=True, upper_open=True
    ) -> None:
        value = getattr(self, name)
        try:
            number = float(value)
        except (TypeError, ValueError):
            raise InvalidInput(
                f"Trial.{name} must be a number {allowed}, got {str(value)[:40]!r}."
            ) from None
        above = number > low if lower_open else number >= low
        below = number < high if upper_open else number <= high
        if not (np.isfinite(number) and above and below):
            raise InvalidInput(f"Trial.{name} must be {allowed}, got {value}.")
        object.__setattr__(self, name, number)

    @property
    def shape(self) -> Feature:
        """The feature as it meets the antenna: from the right, it is mirrored with everything else."""
        return self.feature.mirror() if self.side == "right" else self.feature

    @property
    def base_motion(self) -> BaseMotion | None:
        """The base's motion as it happens: from the right, it is mirrored with everything else."""
        return self.base.mirror() if self.base and self.side == "right" else self.base

    @property
    def label(self) -> str:
        """One readable line for messages and titles."""
        return (
            f"{self.feature.name} {self.feature.size:g} mm at {self.location:g} L,"
            f" {self.speed:g} m/s"
        )

    def _repr_html_(self) -> str:
        """The feature on its way to a stretch of an antenna that points up."""
        reach = 3 * self.feature.size if np.isfinite(self.feature.size) else 10.0
        turn = np.radians(self.approach) * (1.0 if self.side == "left" else -1.0)
        forward = np.array([np.sin(turn), np.cos(turn)])
        frame = np.stack([forward, [-forward[1], forward[0]]])
        rims = [
            trace_rim(part, self.feature.rounding).clip(-reach, reach) for part in self.shape.parts
        ]
        way = np.array([[0.0, 0.0], 0.3 * reach * forward]) - 0.4 * reach * forward
        antenna = np.array([[0.0, -reach], [0.0, reach]])
        return make_picture(
            self.label,
            [(antenna, 0.45), (way, 0.0)],
            [rim @ frame - 0.4 * reach * forward for rim in rims],
        )


@checked
def make_grid(
    features: list[Feature], locations: list[float], speeds: list[float], **fields: Any
) -> list[Trial]:
    """Every feature at every location and speed, speeds slowest to change; other Trial fields
    shared.
    """
    return [
        Trial(feature=feature, location=location, speed=speed, **fields)
        for speed in speeds
        for location in locations
        for feature in features
    ]
