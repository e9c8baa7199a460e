"""Outlines: any simple polygon as a feature."""

import hashlib
import re
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from feeler.errors import InvalidInput
from feeler.frozen import freeze
from feeler.stimulus.convex import measure_area, split_convex
from feeler.stimulus.feature import Feature

MAX_CORNERS = 1000  # [C]


@dataclass(frozen=True, kw_only=True, eq=False)
class Outline(Feature):
    """Any simple polygon, grown by ``rounding``; without a name it is called after its corners.

    Raises
    ------
    InvalidInput
        Corners that are no pairs of finite numbers, fewer than 3 or more than 1000, repeated, on one line, or in an order
        in which edges cross.
    """

    vertices: tuple[tuple[float, float], ...]
    """Corners (corner, 2) [mm] in a frame whose first axis points the way it moves; kept counter-clockwise, foremost at 0."""
    rounding: float = 0.0
    """Distance [mm] by which the polygon is grown, ≥ 0."""
    kind: ClassVar[str] = "outline"

    def __post_init__(self) -> None:
        corners = _read_corners(self.vertices)
        _check_simple(corners)
        if measure_area(corners) < 0:
            corners = corners[::-1]
        object.__setattr__(self, "vertices", freeze(corners - [corners[:, 0].max(), 0.0]))
        if isinstance(self.name, str) and re.fullmatch("outline [0-9a-f]{6}", self.name):
            object.__setattr__(self, "name", "")  # named after corners, maybe others: dataclasses.replace keeps a name
        super().__post_init__()

    def make_name(self) -> str:
        """``outline`` and six digits that stand for the corners and the rounding."""
        return f"outline {digest_numbers(self.vertices, self.rounding)}"

    def make_parts(self) -> list[np.ndarray]:
        """Convex polygons that together fill the outline."""
        return split_convex(self.vertices)


def digest_numbers(*values: object) -> str:
    """Six hexadecimal digits that differ where the numbers do (but for one pair in 17 million)."""
    return hashlib.sha256(b"".join(np.asarray(v, dtype=float).tobytes() for v in values)).hexdigest()[:6]


def _read_corners(vertices: object) -> np.ndarray:
    try:
        corners = np.array(vertices, dtype=float)
    except (TypeError, ValueError) as error:
        raise InvalidInput(f"Outline.vertices must be pairs of numbers [mm], got {str(vertices)[:80]!r}.") from error
    if corners.ndim != 2 or corners.shape[1] != 2 or not 3 <= corners.shape[0] <= MAX_CORNERS:
        raise InvalidInput(
            f"Outline.vertices must be 3 to {MAX_CORNERS} points (corner, 2), got shape {corners.shape}."
        )
    if not np.all(np.isfinite(corners)):
        raise InvalidInput("Outline.vertices must be finite.")
    return corners + 0.0  # no −0: equal outlines have equal names


def _check_simple(corners: np.ndarray) -> None:
    """Raise where two edges meet other than at their shared corner, or the polygon has no area."""
    start, end = corners, np.roll(corners, -1, axis=0)
    n = len(corners)
    if np.any(np.all(start == end, axis=1)):
        raise InvalidInput("Outline.vertices repeats a corner; give each corner once (the last joins the first).")
    for i in range(n):
        others = np.array([j for j in range(i + 2, n) if (j + 1) % n != i], dtype=int)
        if others.size and np.any(_cross(start[i], end[i], start[others], end[others])):
            raise InvalidInput(
                f"Outline is self-intersecting: the edge from corner {i + 1} crosses another. Order the corners around the rim."
            )
    extent = np.ptp(corners, axis=0).max()
    if abs(measure_area(corners)) < 1e-9 * extent**2:
        raise InvalidInput("Outline has no area; give at least three corners that are not on one line.")


def _cross(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Whether segment a–b meets each segment c–d (touching counts)."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return np.sign(
            (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])
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
