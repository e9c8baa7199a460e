"""Features: the things an antenna touches, as plane shapes in their own frame.

In a feature's frame the first axis points the way the feature moves, the second to its left; the origin is the foremost
point on the feature's axis, so that everything else lies at first coordinates ≤ 0.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from feeler.errors import InvalidInput


def _check_positive(feature: object, **values: float) -> None:
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0):
            raise InvalidInput(f"{type(feature).__name__}.{name} must be finite and > 0 mm, got {value}.")


@dataclass(frozen=True, kw_only=True)
class Ball:
    """A ball (in the plane: a disc) of the given radius [mm]."""

    radius: float
    kind: ClassVar[str] = "ball"

    def __post_init__(self) -> None:
        _check_positive(self, radius=self.radius)

    @property
    def size(self) -> float:
        """Radius [mm]."""
        return float(self.radius)

    @property
    def vertices(self) -> np.ndarray:
        """Core points (1, 2) [mm]: the centre, to be rounded by ``rounding``."""
        return np.array([[-float(self.radius), 0.0]])

    @property
    def rounding(self) -> float:
        """Distance [mm] by which the core is grown."""
        return float(self.radius)


@dataclass(frozen=True, kw_only=True)
class _Polygon:
    rounding: ClassVar[float] = 0.0

    @property
    def size(self) -> float:
        """Half the extent across the motion [mm]."""
        return float(np.ptp(self.vertices[:, 1]) / 2)


@dataclass(frozen=True, kw_only=True)
class Box(_Polygon):
    """A box whose face leads: ``half_width`` across the motion, ``half_height`` along it [mm]."""

    half_width: float
    half_height: float
    kind: ClassVar[str] = "box"

    def __post_init__(self) -> None:
        _check_positive(self, half_width=self.half_width, half_height=self.half_height)

    @property
    def vertices(self) -> np.ndarray:
        """Corners (4, 2) [mm], counter-clockwise."""
        w, h = float(self.half_width), 2.0 * float(self.half_height)
        return np.array([[0.0, -w], [0.0, w], [-h, w], [-h, -w]])


@dataclass(frozen=True, kw_only=True)
class Triangle(_Polygon):
    """A triangle whose vertex leads: base 2·``half_width`` across the motion, height 2·``half_height`` along it [mm]."""

    half_width: float
    half_height: float | None = None
    kind: ClassVar[str] = "triangle"

    def __post_init__(self) -> None:
        if self.half_height is None:
            object.__setattr__(self, "half_height", self.half_width)
        _check_positive(self, half_width=self.half_width, half_height=self.half_height)

    @property
    def vertices(self) -> np.ndarray:
        """Corners (3, 2) [mm], counter-clockwise, the leading one first."""
        w, h = float(self.half_width), 2.0 * float(self.half_height)
        return np.array([[0.0, 0.0], [-h, w], [-h, -w]])


@dataclass(frozen=True, kw_only=True)
class Outline(_Polygon):
    """Any simple polygon: corners (corner, 2) [mm] in a frame whose first axis points the way it moves."""

    vertices: tuple[tuple[float, float], ...]
    kind: ClassVar[str] = "outline"

    def __post_init__(self) -> None:
        try:
            corners = np.array(self.vertices, dtype=float)
        except (TypeError, ValueError) as error:
            raise InvalidInput(f"Outline.vertices must be pairs of numbers [mm], got {self.vertices!r}.") from error
        if corners.ndim != 2 or corners.shape[1] != 2 or not 3 <= corners.shape[0] <= 1000:
            raise InvalidInput(f"Outline.vertices must be 3 to 1000 points (corner, 2), got shape {corners.shape}.")
        if not np.all(np.isfinite(corners)):
            raise InvalidInput("Outline.vertices must be finite.")
        _check_simple(corners)
        if _area(corners) < 0:
            corners = corners[::-1]
        corners = corners - [corners[:, 0].max(), 0.0]
        corners.setflags(write=False)
        object.__setattr__(self, "vertices", corners)

    def mirror(self) -> "Outline":
        """The mirror image about the line of motion."""
        return Outline(vertices=self.vertices * [1.0, -1.0])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Outline) and np.array_equal(self.vertices, other.vertices)

    def __hash__(self) -> int:
        return hash(self.vertices.tobytes())


@dataclass(frozen=True, kw_only=True)
class Wall:
    """A wide-field feature: a straight face without end, perpendicular to its motion unless turned."""

    kind: ClassVar[str] = "wall"
    rounding: ClassVar[float] = 0.0

    @property
    def size(self) -> float:
        """A wall has no size: infinite [mm]."""
        return float("inf")


Feature = Ball | Box | Triangle | Outline | Wall
FEATURES = {cls.kind: cls for cls in (Ball, Box, Triangle, Outline, Wall)}


def make_feature(kind: str, size: float | None = None) -> Feature:
    """A feature by name with one size: a ball's radius, a box's or triangle's half-width (and half-height) [mm]."""
    if kind == "wall":
        return Wall()
    if kind not in ("ball", "box", "triangle"):
        raise InvalidInput(
            f"unknown feature {kind!r}; valid: ball, box, triangle, wall (an Outline needs its vertices)."
        )
    if size is None:
        raise InvalidInput(f"feature {kind!r} needs a size [mm]: a ball's radius, a box's or triangle's half-width.")
    return Ball(radius=size) if kind == "ball" else FEATURES[kind](half_width=size, half_height=size)


def _area(corners: np.ndarray) -> float:
    x, y = corners.T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


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
    if abs(_area(corners)) < 1e-9 * extent**2:
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
