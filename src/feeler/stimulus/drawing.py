"""Drawings: the closed paths of an SVG, DXF or CSV file as corners."""

import os
import re
import warnings
from collections.abc import Callable, Iterator
from functools import partial
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from feeler.errors import InvalidInput, MissingExtra

MAX_BYTES = 8 * 2**20  # [C]
MAX_HALVINGS = 16
UNITS = {
    "mm": 1.0,
    "cm": 10.0,
    "in": 25.4,
    "pt": 25.4 / 72,
    "pc": 25.4 / 6,
    "m": 1e3,
    "q": 0.25,
}  # mm, as CSS has them
PIXEL = 25.4 / 96  # mm; CSS's, for a drawing whose page has a size but no viewBox

DXF_CURVES = ("LINE", "ARC", "CIRCLE", "ELLIPSE", "SPLINE", "LWPOLYLINE", "POLYLINE")


Flatten = Callable[[float], np.ndarray]
"""Gives the corners (corner, 2) of a closed path for a tolerance, both in the drawing's unit."""
Paths = list[tuple[str, Flatten]]
"""The closed paths of a drawing by their names, x to the right and y up."""


def read_outline(
    path: str | os.PathLike,
    *,
    width: float | None = None,
    scale: float | None = None,
    which: int | str | None = None,
    tolerance: float = 0.01,
) -> np.ndarray:
    """Corners (corner, 2) [mm] of the closed path in a file, as ``Outline.from_file`` says."""
    for word, value in (("width", width), ("scale", scale), ("tolerance", tolerance)):
        number = isinstance(value, float | int | np.number) and not isinstance(value, bool)
        if value is not None and not (number and 0 < value < np.inf):
            raise InvalidInput(f"{word} must be finite and > 0, got {str(value)[:40]!r}.")
    if width is not None and scale is not None:
        raise InvalidInput("give width or scale, not both.")
    path = _check_file(path)
    try:
        paths, given = _READERS[path.suffix.lower()](path)
        flatten = _choose(path.name, paths, which)
        unit = _find_unit(path.name, flatten, given, width, scale)
        corners = unit * _tidy(flatten(tolerance / unit))
    except (InvalidInput, MissingExtra):
        raise
    except Exception as error:  # whatever a parser of foreign text may raise
        raise InvalidInput(
            f"{path.name} cannot be read as a {path.suffix[1:].upper()} drawing:"
            f" {str(error)[:200]}."
        ) from error
    if path.suffix.lower() != ".csv":  # elsewhere places on the page mean nothing
        corners = corners - [0.0, (corners[:, 1].min() + corners[:, 1].max()) / 2]
    return corners


def _check_file(path: str | os.PathLike) -> Path:
    try:
        path = Path(path)
        usable = path.is_file() and path.stat().st_size <= MAX_BYTES
    except (TypeError, ValueError, OSError) as error:
        raise InvalidInput(f"path must name a file, got {str(path)[:80]!r}.") from error
    if path.suffix.lower() not in _READERS:
        raise InvalidInput(
            f"{path.name!r} is none of {', '.join(_READERS)}; save the drawing as one of these."
        )
    if not usable:
        raise InvalidInput(f"{path} must be a file of at most {MAX_BYTES:,} bytes. Check the path.")
    return path


def _choose(file: str, paths: Paths, which: int | str | None) -> Flatten:
    listing = ", ".join(
        f"{number}: {name or 'no id'}" for number, (name, _) in enumerate(paths[:20])
    )
    if not paths:
        raise InvalidInput(
            f"{file} has no closed path; close the outline in your drawing program (SVG: end it"
            " with Z)."
        )
    if which is None and len(paths) > 1:
        raise InvalidInput(
            f"{file} has {len(paths)} closed paths; choose one by which=number or id: {listing}."
        )
    named = [
        flatten
        for number, (name, flatten) in enumerate(paths)
        if which is None or (which in (number, name) and not isinstance(which, bool))
    ]
    if len(named) != 1:
        raise InvalidInput(f"{file} has no one closed path {str(which)[:40]!r}; it has {listing}.")
    return named[0]


def _find_unit(
    file: str, flatten: Flatten, unit: float | None, width: float | None, scale: float | None
) -> float:
    """Length of one unit of the drawing [mm]."""
    if width is not None:
        rough = flatten(np.inf)
        extent = float(np.ptp(flatten(1e-3 * np.ptp(rough, axis=0).max())[:, 1]))
        if extent == 0:
            raise InvalidInput(
                f"{file} has an outline without extent across the motion, which no width can scale."
            )
        return width / extent
    unit = unit if scale is None else scale
    if unit is None:
        raise InvalidInput(
            f"{file} does not say how long its unit is; give width= [mm] across the motion, or"
            " scale= [mm]."
        )
    return unit


def _tidy(corners: np.ndarray) -> np.ndarray:
    """Without corners that repeat the one before, as paths end where they begin."""
    gap = np.abs(corners - np.roll(corners, 1, axis=0)).max(axis=1)
    return corners[gap > 1e-9 * np.ptp(corners, axis=0).max()]


def _need(module: str) -> ModuleType:
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingExtra(
            "outlines from SVG and DXF files need: pip install 'feeler[outlines]'"
        ) from error


def _read_csv(path: Path) -> tuple[Paths, float | None]:
    lines = path.read_text(encoding="utf-8-sig").splitlines()
    start = 1 if lines and re.search("[A-Za-z]", re.sub("[eE]", "", lines[0])) else 0
    rows = [
        re.split(r"[,;\t]\s*|\s+", line.strip())
        for line in lines[start:]
        if line.strip() and line.lstrip()[0] != "#"
    ]
    if not rows or {len(row) for row in rows} != {2}:
        raise InvalidInput(f"{path.name} must have two columns, x and y [mm], and nothing else.")
    corners = np.array(rows, dtype=float)
    if not np.isfinite(corners).all():
        lost = int(np.flatnonzero(~np.isfinite(corners).all(axis=1))[0])
        raise InvalidInput(
            f"{path.name} has a corner that is not finite, number {lost + 1}:"
            f" {' '.join(rows[lost])}."
        )
    return [(path.stem, lambda _: corners)], 1.0


def _read_svg(path: Path) -> tuple[Paths, float | None]:
    svg = _need("svgpathtools")
    document = svg.Document(str(path))
    if not document.root.tag.endswith("svg"):
        raise InvalidInput(f"{path.name} is XML but no SVG drawing.")
    paths: Paths = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for whole in document.paths():
            name = whole.element.get("id") or ""
            closed = [
                piece for piece in whole.continuous_subpaths() if len(piece) and piece.isclosed()
            ]
            paths += [(name, partial(_flatten_svg, piece)) for piece in closed]
    return paths, _find_svg_unit(document.root)


def _flatten_svg(piece: list, tolerance: float) -> np.ndarray:
    points = [point for segment in piece for point in _bisect(segment.point, 0.0, 1.0, tolerance)]
    return np.array([[point.real, -point.imag] for point in points])  # SVG's y axis points down


def _bisect(
    curve: Callable[[float], complex], start: float, stop: float, tolerance: float, depth=0
) -> Iterator[complex]:
    """Points of a curve from ``start`` to before ``stop`` whose polygon stays within ``tolerance``
    of it.
    """
    first, last = curve(start), curve(stop)
    share = np.array([0.25, 0.5, 0.75])
    gap = [abs(curve(start + t * (stop - start)) - (first + t * (last - first))) for t in share]
    if depth >= MAX_HALVINGS or (
        max(gap) <= tolerance and (depth > 0 or max(gap) <= 1e-12 * abs(last - first))
    ):
        yield first
    else:
        middle = (start + stop) / 2
        yield from _bisect(curve, start, middle, tolerance, depth + 1)
        yield from _bisect(curve, middle, stop, tolerance, depth + 1)


def _find_svg_unit(root: Any) -> float | None:
    """Page width in mm over its width in the drawing's own units; None where the page has no
    physical size.
    """
    found = re.fullmatch(r"\s*([\d.]+(?:[eE][+-]?\d+)?)\s*([a-zA-Z]+)\s*", root.get("width") or "")
    if not found or found[2].lower() not in UNITS:
        return None
    box = re.split(r"[\s,]+", (root.get("viewBox") or "").strip())
    return float(found[1]) * UNITS[found[2].lower()] / float(box[2]) if len(box) == 4 else PIXEL


def _read_dxf(path: Path) -> tuple[Paths, float | None]:
    ezdxf = _need("ezdxf")
    smith, miner, paths = _need("ezdxf.edgesmith"), _need("ezdxf.edgeminer"), _need("ezdxf.path")
    document = ezdxf.readfile(path)
    drawn = document.modelspace().query(" ".join(DXF_CURVES))
    entities = [entity for entity in drawn if smith.is_pure_2d_entity(entity)]
    whole = [entity for entity in entities if smith.is_closed_entity(entity)]
    named = [
        (f"{entity.dxftype()} on {entity.dxf.layer}", paths.make_path(entity)) for entity in whole
    ]
    edges = list(smith.edges_from_entities_2d(entity for entity in entities if entity not in whole))
    if edges:
        chains = miner.find_all_simple_chains(miner.Deposit(edges, gap_tol=1e-6))
        loops = [chain for chain in chains if len(chain) > 1 and miner.is_loop(chain, gap_tol=1e-6)]
        named += [("chain of lines", smith.path2d_from_chain(chain)) for chain in loops]
    factor = (
        ezdxf.units.conversion_factor(document.units, ezdxf.units.MM) if document.units else None
    )
    return [(name, partial(_flatten_dxf, outline)) for name, outline in named], factor


def _flatten_dxf(outline: Any, tolerance: float) -> np.ndarray:
    return np.array([(point.x, point.y) for point in outline.flattening(min(tolerance, 1e9))])


_READERS: dict[str, Callable[[Path], tuple[Paths, float | None]]] = {
    ".svg": _read_svg,
    ".dxf": _read_dxf,
    ".csv": _read_csv,
}
