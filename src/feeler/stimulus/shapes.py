"""Ball, peg, box and triangle."""

from typing import Any, ClassVar

from feeler.stimulus.feature import Feature


class _Disc(Feature):
    """What is a disc in the plane: a point grown by its radius."""

    radius: float
    symmetric: ClassVar[bool] = True

    @property
    def rounding(self) -> float:
        """The radius [mm]: the core is a point, or in space an axis."""
        return self.radius

    def make_parts(self) -> list:
        """The one point in the plane, which is set back by the radius."""
        return [[(0.0, 0.0)]]


class Ball(_Disc):
    """A ball (in the plane: a disc): a point grown by its radius.

    Attributes
    ----------
    radius : float
        Radius [mm], > 0.
    """

    kind: ClassVar[str] = "ball"


class Peg(_Disc):
    """A peg: a cylinder with round ends, upright on the plane, in which it is a disc.

    In space its axis is the third of its frame, at right angles to the way it moves; the ends
    matter where the antenna reaches beyond ``half_length``.

    Attributes
    ----------
    radius : float
        Radius [mm], > 0.
    half_length : float
        Half the length of the cylinder, without its round ends [mm], > 0.
    """

    half_length: float = 20.0
    kind: ClassVar[str] = "peg"

    @property
    def half_depth(self) -> float:
        """Half the core's extent along the third axis [mm]."""
        return self.half_length


class Prism(Feature):
    """A shape with corners in the plane; in space an upright prism over it.

    Attributes
    ----------
    half_length : float
        Half the prism's length along the third axis of its frame [mm], > 0; read in space only.
    """

    half_length: float = 20.0

    @property
    def half_depth(self) -> float:
        """Half the core's extent along the third axis [mm]."""
        return self.half_length

    def to_plain(self) -> dict[str, Any]:
        """The plain data, without a length that nobody gave."""
        plain = super().to_plain()
        return {k: v for k, v in plain.items() if k != "half_length" or v != Prism.half_length}


class Box(Prism):
    """A box whose face leads; its outer half-width is ``half_width + rounding``.

    Attributes
    ----------
    half_width : float
        Half the core's extent across the motion [mm], > 0.
    half_height : float
        Half the core's extent along the motion [mm], > 0.
    rounding : float
        Radius [mm] of the edges, added outside the core, ≥ 0.
    """

    half_width: float
    half_height: float
    rounding: float = 0.0
    kind: ClassVar[str] = "box"
    symmetric: ClassVar[bool] = True

    def make_parts(self) -> list:
        """The core's corners."""
        w, h = self.half_width, 2.0 * self.half_height
        return [[(0.0, -w), (0.0, w), (-h, w), (-h, -w)]]


class Triangle(Prism):
    """A triangle whose vertex leads; its outer half-width is ``half_width + rounding``.

    Attributes
    ----------
    half_width : float
        Half the core's base, across the motion [mm], > 0.
    half_height : float | None
        Half the core's height, along the motion [mm], > 0; default: ``half_width``.
    rounding : float
        Radius [mm] of the edges, added outside the core, ≥ 0.
    """

    half_width: float
    half_height: float | None = None
    rounding: float = 0.0
    kind: ClassVar[str] = "triangle"
    symmetric: ClassVar[bool] = True

    def _check(self) -> None:
        if self.half_height is None:
            vars(self)["half_height"] = self.half_width
        super()._check()

    def make_parts(self) -> list:
        """The core's corners, the leading one first."""
        assert self.half_height is not None  # _check has filled it
        w, h = self.half_width, 2.0 * self.half_height
        return [[(0.0, 0.0), (-h, w), (-h, -w)]]
