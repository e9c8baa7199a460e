"""A shape that the package does not know; who registers it takes it out again."""

from dataclasses import dataclass
from typing import ClassVar

from feeler.objects import Feature


@dataclass(frozen=True, kw_only=True, eq=False)
class Capsule(Feature):
    """A segment across the motion, grown."""

    half_length: float
    rounding: float
    kind: ClassVar[str] = "capsule"
    symmetric: ClassVar[bool] = True

    def make_parts(self):
        return [[(0.0, -self.half_length), (0.0, self.half_length)]]
