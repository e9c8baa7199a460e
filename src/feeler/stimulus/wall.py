"""The wall: a wide-field feature."""

from dataclasses import dataclass
from typing import ClassVar

from feeler.stimulus.feature import Feature

REACH = 1e3  # mm; half extent of the box that stands for a face without end


@dataclass(frozen=True, kw_only=True, eq=False)
class Wall(Feature):
    """A wide-field feature: a straight face without end, perpendicular to its motion unless turned."""

    kind: ClassVar[str] = "wall"
    rounding: ClassVar[float] = 0.0
    symmetric: ClassVar[bool] = True
    wide: ClassVar[bool] = True
    unbounded: ClassVar[bool] = True

    def make_parts(self) -> list:
        """A box so large that its other faces are never met."""
        return [[(0.0, -REACH), (0.0, REACH), (-2 * REACH, REACH), (-2 * REACH, -REACH)]]
