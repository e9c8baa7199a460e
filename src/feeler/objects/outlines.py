"""Outlines: any simple polygon as an object, also from SVG and CSV files."""

import json
import os
import re
import warnings
from collections.abc import Callable, Iterable, Iterator
from functools import partial
from itertools import groupby, islice
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from feeler.errors import InvalidInput, require_extra
from feeler.files import find_file, read_text
from feeler.objects.shapes import Prism, measure_area, name_by_extent, split_convex
from feeler.records import Gt, Unit, freeze
from feeler.sandbox import Limits, find_limits, open_guarded
from feeler.validation import checked

# Outlines: any simple polygon as a feature.

MAX_CORNERS = 1000  # [C]
_FARTHEST = 1e6  # [C] mm; whatever an antenna meets is nearer than a kilometre


class Outline(Prism):
    """Any simple polygon, grown by ``rounding``; without a name it is called after its extent.

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
    @checked
    def from_file(
        cls,
        path: str | os.PathLike,
        *,
        width: Annotated[float, Gt(0), Unit("mm")] | None = None,
        scale: Annotated[float, Gt(0), Unit("mm")] | None = None,
        which: int | str | None = None,
        tolerance: Annotated[float, Gt(0), Unit("mm")] = 0.01,
        rounding: float = 0.0,
        name: str = "",
    ) -> "Outline":
        """The closed path in an SVG or CSV file.

        The drawing moves to the right of its page: its x axis becomes the first, up becomes left.
        SVG drawings are centred across the motion; the two columns of a CSV file are taken
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
        MissingDependencyError
            SVG files need ``pip install 'feeler[outlines]'``.
        """
        if width is not None and scale is not None:
            raise InvalidInput("give width or scale, not both.")
        path, limits = find_file(path, LIBRARIES, _MAX_BYTES), find_limits()
        if library := LIBRARIES[path.suffix.lower()]:
            require_extra(library, "outlines", "an outline from an SVG file")
        wanted = json.dumps([width, scale, which, tolerance], default=str)
        limits = Limits(
            max_bytes=min(limits.max_bytes, _MAX_MEMORY), max_seconds=limits.max_seconds
        )
        _, found = open_guarded(f"{__name__}:read_corners", path, limits, words=(wanted,))
        return cls(vertices=found["corners"], rounding=rounding, name=name)

    def make_name(self) -> str:
        """``outline``, its extent, and six digits that stand for the corners and the rounding."""
        return name_by_extent("outline", self.vertices, self.rounding)

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


# Drawings: the closed paths of an SVG or CSV file as corners, read in the guard's process.

_MAX_BYTES = 8 * 2**20  # [C]
_MAX_MEMORY = 2**30  # [C] bytes that reading a drawing may take
_MAX_HALVINGS = 16
_SIZING = 64  # times more corners than an outline has may be looked at for its width
_UNITS = {
    "mm": 1.0,
    "cm": 10.0,
    "in": 25.4,
    "pt": 25.4 / 72,
    "pc": 25.4 / 6,
    "m": 1e3,
    "µm": 1e-3,
    "q": 0.25,
}  # mm, as CSS has them
_PIXEL = 25.4 / 96  # mm; CSS's, for a drawing whose page has a size but no viewBox

LIBRARIES = {".svg": "svgpathtools", ".csv": ""}

_Curve = Callable[[float], complex]
"""A point of a piece of a path, from 0 where it starts to 1 where it ends; y points up."""
_Paths = list[tuple[str, list[_Curve]]]
"""The closed paths of a drawing by their names, x to the right and y up."""


def read_corners(path: str, wanted: str) -> tuple[dict, dict[str, np.ndarray]]:
    """What the guard's process does for ``Outline.from_file``."""
    width, scale, which, tolerance = json.loads(wanted)
    kind = Path(path).suffix.lower()
    try:
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")
            paths, given = _READERS[kind](path)
            chosen = _choose(paths, which)
            unit = _find_unit(chosen, given, width, scale)
            corners = unit * _flatten(chosen, tolerance / unit)
    except InvalidInput:
        raise
    except Exception as error:  # whatever a parser of foreign text may raise
        words = f"{type(error).__name__}: {error}"[:200]
        raise InvalidInput(
            f"it cannot be read as a {kind[1:].upper()} drawing ({words})."
        ) from error
    corners = _tidy(corners)
    if kind != ".csv":  # elsewhere places on the page mean nothing
        corners = corners - [0.0, (corners[:, 1].min() + corners[:, 1].max()) / 2]
    return {}, {"corners": corners}


def _choose(paths: _Paths, which: int | str | None) -> list[_Curve]:
    listing = ", ".join(
        f"{number}: {name or 'no id'}" for number, (name, _) in enumerate(paths[:20])
    )
    if not paths:
        raise InvalidInput(
            "it has no closed path; close the outline in your drawing program (SVG: end it with Z)."
        )
    if which is None and len(paths) > 1:
        raise InvalidInput(
            f"it has {len(paths)} closed paths; choose one by which=number or id: {listing}."
        )
    named = [
        curves
        for number, (name, curves) in enumerate(paths)
        if which is None or (which in (number, name) and not isinstance(which, bool))
    ]
    if len(named) != 1:
        raise InvalidInput(f"it has no one closed path {str(which)[:40]!r}; it has {listing}.")
    return named[0]


def _find_unit(
    curves: list[_Curve], unit: float | None, width: float | None, scale: float | None
) -> float:
    """Length of one unit of the drawing [mm]."""
    if width is not None:
        most = _SIZING * MAX_CORNERS
        rough = np.ptp(_flatten(curves, np.inf, most), axis=0).max()
        extent = float(np.ptp(_flatten(curves, 1e-3 * rough, most)[:, 1]))
        if extent == 0:
            raise InvalidInput(
                "it has an outline without extent across the motion, which no width can scale."
            )
        return width / extent
    unit = unit if scale is None else scale
    if unit is None:
        raise InvalidInput(
            "it does not say how long its unit is; give width= [mm] across the motion (on the"
            " command line --feature outline:file=NAME,width=4), or scale= [mm]."
        )
    return unit


def _flatten(curves: Iterable[_Curve], tolerance: float, most: int = MAX_CORNERS) -> np.ndarray:
    """Corners (corner, 2) of a polygon within ``tolerance`` of a path, at most so many."""
    points = (point for curve in curves for point in _bisect(curve, 0.0, 1.0, tolerance))
    found = np.array([point for point, _ in islice(groupby(points), most + 1)])
    corners = np.column_stack([found.real, found.imag])
    if len(corners) > most:
        raise InvalidInput(
            f"it has a path of more than {most:,} corners. Raise tolerance=, or simplify the path."
        )
    if not np.isfinite(corners).all():
        lost = int(np.argmin(np.isfinite(corners).all(axis=1)))
        raise InvalidInput(
            f"it has a corner that is not finite, number {lost + 1}:"
            f" {corners[lost, 0]:g} {corners[lost, 1]:g}."
        )
    return corners


def _bisect(
    curve: _Curve, start: float, stop: float, tolerance: float, depth: int = 0
) -> Iterator[complex]:
    """Points of a curve from ``start`` to before ``stop`` whose polygon stays within ``tolerance``
    of it.
    """
    first, last = curve(start), curve(stop)
    share = np.array([0.25, 0.5, 0.75])
    gap = [abs(curve(start + t * (stop - start)) - (first + t * (last - first))) for t in share]
    far = max(gap) > tolerance or (depth == 0 and max(gap) > 1e-12 * abs(last - first))
    if depth >= _MAX_HALVINGS or not far:  # not far is also what is no number
        yield first
    else:
        middle = (start + stop) / 2
        yield from _bisect(curve, start, middle, tolerance, depth + 1)
        yield from _bisect(curve, middle, stop, tolerance, depth + 1)


def _tidy(corners: np.ndarray) -> np.ndarray:
    """Without corners that repeat the one before, as paths end where they begin."""
    gap = np.abs(corners - np.roll(corners, 1, axis=0)).max(axis=1)
    extent = np.ptp(corners, axis=0).max()
    if not 0 < extent < np.inf:
        raise InvalidInput(
            f"it has an outline whose extent is {extent:g} mm, which is no shape."
        )
    return corners[gap > 1e-9 * extent]


def _read_csv(path: str) -> tuple[_Paths, float | None]:
    from feeler.tables import parse_table, split_unit

    table = parse_table(read_text(path, _MAX_BYTES), source="table", bare=("x", "y"))
    named = [split_unit(name) for name in table.columns]
    units = {"mm" if unit.lower() in ("", "x", "y") else unit for _, unit in named}
    if len(named) != 2 or len(units) != 1 or not units <= {*_UNITS}:
        raise InvalidInput(
            "it must have two columns, x and y, in mm or as their names say (x_cm), and nothing"
            f" else; it has {', '.join(table.columns[:12])}."
        )
    turned = [name.lower() for name, _ in named] == ["y", "x"]
    corners = [complex(x, y) for x, y in table.values[:, :: -1 if turned else 1]]
    return [(Path(path).stem, [partial(_stay, corner) for corner in corners])], _UNITS[
        units.pop()
    ]


def _stay(corner: complex, _: float) -> complex:
    return corner


def _read_svg(path: str) -> tuple[_Paths, float | None]:
    import svgpathtools

    document = svgpathtools.Document(path)
    if not document.root.tag.endswith("svg"):
        raise InvalidInput("it is XML but no SVG drawing.")
    paths: _Paths = []
    for whole in document.paths():
        name = whole.element.get("id") or ""
        closed = [
            piece for piece in whole.continuous_subpaths() if len(piece) and piece.isclosed()
        ]
        paths += [(name, [_turn_up(segment.point) for segment in piece]) for piece in closed]
    return paths, _find_svg_unit(document.root)


def _turn_up(curve: _Curve) -> _Curve:
    """The curve of a page whose y axis points down, as SVG's does."""
    return lambda t: complex(curve(t)).conjugate()


def _find_svg_unit(root: Any) -> float | None:
    """Page width in mm over its width in the drawing's own units; None where the page has no
    physical size.
    """
    found = re.fullmatch(
        r"\s*([\d.]+(?:[eE][+-]?\d+)?)\s*([a-zA-Z]+)\s*", root.get("width") or ""
    )
    if not found or found[2].lower() not in _UNITS:
        return None
    box = re.split(r"[\s,]+", (root.get("viewBox") or "").strip())
    unit = (
        float(found[1]) * _UNITS[found[2].lower()] / float(box[2]) if len(box) == 4 else _PIXEL
    )
    if not 0 < unit < np.inf:
        raise InvalidInput(f"it says that its unit is {unit:g} mm. Mend its width and viewBox.")
    return unit


_READERS: dict[str, Callable[[str], tuple[_Paths, float | None]]] = {
    ".svg": _read_svg,
    ".csv": _read_csv,
}
