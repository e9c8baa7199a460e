"""Outlines: any simple polygon as a feature."""

import os
from typing import Annotated, ClassVar

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.record import freeze
from feeler.stimulus.convex import measure_area, split_convex
from feeler.stimulus.feature import digest_numbers
from feeler.stimulus.shapes import Prism

MAX_CORNERS = 1000  # [C]
_FARTHEST = 1e6  # [C] mm; whatever an antenna meets is nearer than a kilometre


class Outline(Prism):
    """Any simple polygon, grown by ``rounding``; without a name it is called after its corners.

    Attributes
    ----------
    vertices : np.ndarray
        Corners (corner, 2) [mm] in a frame whose first axis points the way it moves; kept
        counter-clockwise, foremost at 0.
    rounding : float
        Distance [mm] by which the polygon is grown, ≥ 0.

    Raises
    ------
    InvalidInput
        Corners that are no pairs of finite numbers, fewer than 3 or more than 1000, repeated, on
        one line, or in an order in which edges cross.
    """

    vertices: Annotated[np.ndarray, "corner 2"]
    rounding: float = 0.0
    kind: ClassVar[str] = "outline"

    def _check(self) -> None:
        if not 3 <= len(self.vertices) <= MAX_CORNERS:
            raise InvalidInput(
                f"Outline.vertices must be 3 to {MAX_CORNERS} points (corner, 2), got"
                f" {len(self.vertices)}."
            )
        if np.abs(self.vertices).max() > _FARTHEST:
            raise InvalidInput(
                f"Outline.vertices must lie within {_FARTHEST:g} mm, got"
                f" {np.abs(self.vertices).max():g} mm. Which unit has the drawing?"
            )
        corners = self.vertices + 0.0  # no −0: equal outlines have equal names
        _check_simple(corners)
        if measure_area(corners) < 0:
            corners = corners[::-1]
        vars(self)["vertices"] = freeze(corners - [corners[:, 0].max(), 0.0])
        super()._check()

    @classmethod
    def from_file(
        cls,
        path: str | os.PathLike,
        *,
        width: float | None = None,
        scale: float | None = None,
        which: int | str | None = None,
        tolerance: float = 0.01,
        rounding: float = 0.0,
        name: str = "",
    ) -> "Outline":
        """The closed path in an SVG, DXF or CSV file.

        The drawing moves to the right of its page: its x axis becomes the first, up becomes left.
        SVG and DXF drawings are centred across the motion; the two columns of a CSV file are taken
        as they are, as x and y in mm.

        Parameters
        ----------
        width
            Extent across the motion that the outline shall have [mm]; needed where the file says no
            unit.
        scale
            In place of ``width``: how long one unit of the drawing is [mm].
        which
            Id or number (from 0) of the path, where the file holds several closed ones.
        tolerance
            How far the corners' polygon may lie from a curve [mm], > 0.
        rounding, name
            As in ``Outline``.

        Raises
        ------
        InvalidInput
            No such file, not of its format, no closed path, several, no unit, or a path that is no
            simple outline.
        MissingExtra
            SVG and DXF files need ``pip install 'feeler[outlines]'``.
        """
        from feeler.stimulus.drawing import read_outline

        corners = read_outline(path, width=width, scale=scale, which=which, tolerance=tolerance)
        return cls(vertices=corners, rounding=rounding, name=name)

    def make_name(self) -> str:
        """``outline`` and six digits that stand for the corners and the rounding."""
        return f"outline {digest_numbers(self.vertices, self.rounding)}"

    def make_parts(self) -> list[np.ndarray]:
        """Convex polygons that together fill the outline."""
        return split_convex(self.vertices)


def _check_simple(corners: np.ndarray) -> None:
    """Raise where two edges meet other than at their shared corner, or the polygon has no area."""
    start, end = corners, np.roll(corners, -1, axis=0)
    n = len(corners)
    extent = np.ptp(corners, axis=0).max()
    if np.any(np.abs(end - start).max(axis=1) <= 1e-9 * extent):
        raise InvalidInput(
            "Outline.vertices repeats a corner; give each corner once (the last joins the first)."
        )
    for i in range(n):
        others = np.array([j for j in range(i + 2, n) if (j + 1) % n != i], dtype=int)
        if others.size and np.any(_cross(start[i], end[i], start[others], end[others])):
            raise InvalidInput(
                f"Outline is self-intersecting: the edge from corner {i + 1} crosses another. Order"
                " the corners around the rim."
            )
    if abs(measure_area(corners)) < 1e-9 * extent**2:
        raise InvalidInput(
            "Outline has no area; give at least three corners that are not on one line."
        )


def _cross(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Whether segment a–b meets each segment c–d (touching counts)."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return np.sign(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1])
            - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
        )

    def within(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        low, high = np.minimum(p, q), np.maximum(p, q)
        return np.all((low <= r) & (r <= high), axis=-1)

    ac, ad, ca, cb = side(a, b, c), side(a, b, d), side(c, d, a), side(c, d, b)
    crossing = (ac * ad < 0) & (ca * cb < 0)
    return (
        crossing
        | ((ac == 0) & within(a, b, c))
        | ((ad == 0) & within(a, b, d))
        | ((ca == 0) & within(c, d, a))
        | ((cb == 0) & within(c, d, b))
    )
