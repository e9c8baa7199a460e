"""A trial: one feature meets the antenna at one place, with one speed, from one side."""

from typing import Annotated, Any, Literal

import numpy as np

from feeler.records.checked import checked
from feeler.records.record import Ge, Gt, Le, Lt, Record, Unit
from feeler.records.shown import make_picture
from feeler.stimulus.base import BaseMotion, read_base
from feeler.stimulus.convex import trace_rim
from feeler.stimulus.feature import Feature

FRICTION = 1.0  # [D] fits the published video best
LEAD = 5.0  # [C] ms before contact


class Trial(Record):
    """One touch, as data.

    The feature starts clear of the antenna, its foremost point meets the antenna's surface at
    ``location`` exactly ``lead`` ms after time 0, and it moves on at constant velocity. Where the
    base moves, the antenna is taken to be carried unbent until then. Plain data, as ``to_plain``
    gives it, makes the same trial: ``Trial(**plain)``.

    Attributes
    ----------
    feature : Feature
        What touches: Ball, Box, Triangle, Outline, Wall, or any shape that was registered.
    location : float
        Where, as a fraction of the antenna's length from the base.
    speed : float
        How fast the feature moves [m/s = mm/ms].
    lead : float
        Time before contact [ms].
    approach : float
        Angle between the motion and the antenna's base-to-tip direction at the location [degrees];
        90 is perpendicular.
    azimuth : float
        Of an antenna in space: angle by which the whole approach is turned about the touched
        segment [degrees], 0 as in the plane; at 90 what comes from the left moves towards z.
    side : Literal[left, right]
        The side the feature comes from: ``left`` moves towards +x (angles positive), ``right`` is
        its mirror image.
    friction : float
        Coefficient of sliding friction.
    base : BaseMotion | None
        How the antenna's base moves, given for the side ``left``; default: it is clamped.
    name : str
        What the object is called; default: the feature's name.

    Raises
    ------
    InvalidInput
        A field outside its range; the message names it.
    """

    feature: Feature
    location: Annotated[float, Gt(0), Le(1), "a fraction of the length"]
    speed: Annotated[float, Gt(0), Unit("m/s")]
    lead: Annotated[float, Gt(0), Unit("ms")] = LEAD
    approach: Annotated[float, Gt(0), Lt(180), Unit("degrees"), "90 is perpendicular"] = 90.0
    azimuth: Annotated[float, Ge(-360), Le(360), Unit("degrees")] = 0.0
    side: Literal["left", "right"] = "left"
    friction: Annotated[float, Ge(0)] = FRICTION
    base: BaseMotion | None = None
    name: str = ""

    def _check(self) -> None:
        vars(self)["base"] = read_base(self.base)
        vars(self)["name"] = self.name or self.feature.name

    def to_plain(self) -> dict[str, Any]:
        """The trial as plain data; an azimuth of 0 is left out, as in the plane there is none."""
        return {k: v for k, v in super().to_plain().items() if k != "azimuth" or v}

    @property
    def shape(self) -> Feature:
        """The feature as it meets the antenna: mirrored where it comes from the right."""
        return self.feature.mirror() if self.side == "right" else self.feature

    @property
    def base_motion(self) -> BaseMotion | None:
        """The base's motion as it happens: from the right, it is mirrored with everything else."""
        return self.base.mirror() if self.base and self.side == "right" else self.base

    @property
    def label(self) -> str:
        """One readable line for messages and titles."""
        size = f" {self.feature.size:g} mm" if np.isfinite(self.feature.size) else ""
        return f"{self.feature.name}{size} at {self.location:g} L, {self.speed:g} m/s"

    def _repr_html_(self) -> str:
        """The feature on its way to a stretch of an antenna that points up."""
        reach = 3 * self.feature.size if np.isfinite(self.feature.size) else 10.0
        turn = np.radians(self.approach) * (1.0 if self.side == "left" else -1.0)
        forward = np.array([np.sin(turn), np.cos(turn)])
        frame = np.stack([forward, [-forward[1], forward[0]]])
        rims = [
            trace_rim(part, self.feature.rounding).clip(-reach, reach)
            for part in self.shape.parts
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
