"""How an antenna meets a wall: angle, pre-bend, friction and side, each an unstated choice with its
reason.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput

READINGS = ("midline", "total")
PREBENDS = ("rest", "placed", "rotation", "none")
SIDES = ("left", "right")


@dataclass(frozen=True, kw_only=True)
class Posture:
    """An antenna held at its base, bent into an inverted J (tip pointing backward), beside a wall
    parallel to the body.

    The body looks along +y, the antenna's base is the origin, the wall's face is the line x =
    distance (right side) or x = −distance (left). The defaults were fixed before any R² was
    computed; docs/guide/wall.md gives the reasons.

    Raises
    ------
    InvalidInput
        A field outside its range; the message names it.
    """

    inter_antennal_angle: float = 30.0
    """[P] about 30 degrees, in (0, 90]."""
    reading: str = "midline"
    """``midline``: each antenna is that far from the midline [B: Camhi & Johnson 1999]; ``total``:
    half of it each.
    """
    prebend: str = "rest"
    """``rest``: the J is the antenna's slack shape; ``placed``: a straight antenna laid in a J and
    released; ``rotation``: a straight antenna that points backward is turned forward along the wall
    by its base; ``none``: no J, a straight antenna whose tip bends forward along the wall [C]."""
    hook_share: float = 0.25
    """Share of the length that the slack hook takes, in (0, 1], of constant curvature; the rest is
    straight [C].
    """
    tip_heading: float = 180.0
    """Heading of the slack tip [degrees], 180 is straight backward, in (90, 180] [C]."""
    fold_radius: float = 2.0
    """Radius [mm] of the fold in which a ``placed`` antenna is laid, > 0 [C]."""
    friction: float = 0.3
    """Coefficient of friction of the wall, ≥ 0 [C]."""
    side: str = "right"
    """Side of the body on which wall and antenna are: ``right`` or its mirror image ``left``."""

    def __post_init__(self) -> None:
        for name, valid in (("reading", READINGS), ("prebend", PREBENDS), ("side", SIDES)):
            if getattr(self, name) not in valid:
                raise InvalidInput(
                    f"Posture.{name} must be one of {', '.join(valid)}, got"
                    f" {getattr(self, name)!r}."
                )
        self._check("inter_antennal_angle", 0.0, 90.0, "in (0, 90] degrees")
        self._check("hook_share", 0.0, 1.0, "a fraction of the length in (0, 1]")
        self._check("tip_heading", 90.0, 180.0, "in (90, 180] degrees")
        self._check("fold_radius", 0.0, np.inf, "> 0 mm")
        if not (np.isfinite(self.friction) and self.friction >= 0):
            raise InvalidInput(f"Posture.friction must be finite and ≥ 0, got {self.friction}.")

    def _check(self, name: str, low: float, high: float, allowed: str) -> None:
        value = getattr(self, name)
        if not (np.isfinite(value) and low < value <= high):
            raise InvalidInput(f"Posture.{name} must be {allowed}, got {value}.")

    @property
    def base_angle(self) -> float:
        """Heading of the antenna's base from the midline, towards the wall [rad]."""
        return float(np.radians(self.inter_antennal_angle)) / (
            2.0 if self.reading == "total" else 1.0
        )

    @property
    def sign(self) -> float:
        """+1 on the right, −1 on the left."""
        return 1.0 if self.side == "right" else -1.0

    def replace(self, **changes: Any) -> "Posture":
        """The same posture with some fields changed, validated again."""
        return replace(self, **changes)

    def bend(self, antenna: Antenna) -> Antenna:
        """The antenna with the slack shape of this posture, as seen on the right side.

        With ``rest``, hook angles are added to whatever rest angles the antenna has: the hook has
        constant curvature.
        """
        if self.prebend != "rest":
            return antenna
        length = antenna.segment_length
        share = np.where(
            antenna.hinge_position >= (1 - self.hook_share) * antenna.length, length, 0.0
        )
        if not share.any():
            share[-1] = 1.0  # a hook shorter than the last segment sits in its hinge
        turn = np.radians(self.tip_heading) - self.base_angle
        return antenna.replace(rest_angle=antenna.rest_angle + turn * share / share.sum())

    def reach(self, antenna: Antenna) -> float:
        """Greatest distance [mm] at which the antenna, slack and bent as it is, touches the wall."""
        return measure_reach(self.bend(antenna), self.base_angle)

    def lay(self, antenna: Antenna, distance: float) -> np.ndarray:
        """Headings (segment,) of a fold: straight to the wall, an arc of ``fold_radius``, straight
        back along it.
        """
        near = (
            distance
            - float(antenna.radius.max())
            - self.fold_radius * (1 + np.cos(self.base_angle))
        )
        start = max(near, 0.0) / np.sin(self.base_angle)
        middle = antenna.hinge_position + antenna.segment_length / 2
        return self.base_angle + np.clip(
            (middle - start) / self.fold_radius, 0.0, np.pi - self.base_angle
        )


def measure_reach(antenna: Antenna, base_angle: float) -> float:
    """How far [mm] the surface of an antenna in its slack shape extends to the right of its base."""
    thick = np.maximum(
        np.append(antenna.radius, 0.0), np.append(0.0, antenna.radius)
    )  # of the segments at a node
    return float(np.max(antenna.shape(base_angle=base_angle)[:, 0] + thick))
