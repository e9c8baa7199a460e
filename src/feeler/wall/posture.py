"""How an antenna meets a wall: angle, pre-bend, friction and side, each an unstated choice with its
reason.
"""

from typing import Annotated, Literal

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.records.record import Ge, Gt, Le, Record, Unit


class Posture(Record):
    """An antenna held at its base, bent into an inverted J (tip pointing backward), beside a wall
    parallel to the body.

    The body looks along +y, the antenna's base is the origin, the wall's face is the line x =
    distance (right side) or x = −distance (left). The defaults were fixed before any R² was
    computed; docs/guide/wall.md gives the reasons.

    Attributes
    ----------
    inter_antennal_angle : float
        [P] about 30 degrees, in (0, 90].
    reading : Literal[midline, total]
        ``midline``: each antenna is that far from the midline [B: Camhi & Johnson 1999]; ``total``:
        half of it each.
    prebend : Literal[rest, placed, rotation, none]
        ``rest``: the J is the antenna's slack shape; ``placed``: a straight antenna laid in a J and
        released; ``rotation``: a straight antenna that points backward is turned forward along the
        wall by its base; ``none``: no J, a straight antenna whose tip bends forward along the wall
        [C].
    hook_share : float
        Share of the length that the slack hook takes, in (0, 1], of constant curvature; the rest is
        straight [C].
    tip_heading : float
        Heading of the slack tip [degrees], above 90; 180 is straight backward, and the most. A
        choice [C].
    fold_radius : float
        Radius [mm] of the fold in which a ``placed`` antenna is laid, > 0 [C].
    friction : float
        Coefficient of friction of the wall, ≥ 0 [C].
    side : Literal[left, right]
        Side of the body on which wall and antenna are: ``right`` or its mirror image ``left``.
    """

    inter_antennal_angle: Annotated[float, Gt(0), Le(90), Unit("degrees")] = 30.0
    reading: Literal["midline", "total"] = "midline"
    prebend: Literal["rest", "placed", "rotation", "none"] = "rest"
    hook_share: Annotated[float, Gt(0), Le(1)] = 0.25
    tip_heading: Annotated[float, Gt(90), Le(180), Unit("degrees")] = 180.0
    fold_radius: Annotated[float, Gt(0), Unit("mm")] = 2.0
    friction: Annotated[float, Ge(0)] = 0.3
    side: Literal["left", "right"] = "right"

    @property
    def base_angle(self) -> float:
        """Heading of the antenna's base from the midline, towards the wall [rad]."""
        angle = float(np.radians(self.inter_antennal_angle))
        return angle / 2 if self.reading == "total" else angle

    @property
    def sign(self) -> float:
        """+1 on the right, −1 on the left."""
        return 1.0 if self.side == "right" else -1.0

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
        """Greatest distance [mm] at which the antenna, slack and bent as it is, touches the
        wall.
        """
        return measure_reach(self.bend(antenna), self.base_angle)

    def lay(self, antenna: Antenna, distance: float) -> np.ndarray:
        """Headings (segment,) of a fold: straight to the wall, an arc of ``fold_radius``, straight
        back along it.
        """
        base, fold = self.base_angle, self.fold_radius
        near = distance - float(antenna.radius.max()) - fold * (1 + np.cos(base))
        start = max(near, 0.0) / np.sin(base)
        middle = antenna.hinge_position + antenna.segment_length / 2
        return base + np.clip((middle - start) / fold, 0.0, np.pi - base)


def measure_reach(antenna: Antenna, base_angle: float) -> float:
    """How far [mm] the surface of an antenna in its slack shape extends to the right of its
    base.
    """
    # a node is as thick as the thicker of its two segments
    thick = np.maximum(np.append(antenna.radius, 0.0), np.append(0.0, antenna.radius))
    return float(np.max(antenna.shape(base_angle=base_angle)[:, 0] + thick))
