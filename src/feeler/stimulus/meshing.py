"""Mesh files, read and cut into convex parts in the guard's process."""

import json
import os
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from feeler.disk.files import find_file
from feeler.disk.guard import Limits, find_limits, open_guarded
from feeler.errors import InvalidInput, MissingExtra

MESHES = (".stl", ".obj")
_MAX_BYTES = 256 * 2**20  # [C]
_MAX_FACES = 100_000  # [C] that are cut into parts as they are
_MAX_PART_CORNERS = 64  # [C] of a part, where there are several
_CONVEX = 1e-3  # [C] share of its hull by which a convex mesh's volume may fall short
_SECONDS, _MEMORY = 120.0, 4 * 2**30  # [C] that reading and cutting may take


def read_mesh(
    path: str | os.PathLike,
    scale: float = 1.0,
    width: float | None = None,
    threshold: float = 0.05,
    simplify: int | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Corners (corner, 3) [mm] and first corners (part,) of a file's mesh, as ``Mesh.from_file``
    says.
    """
    for word, value in (("scale", scale), ("width", width), ("simplify", simplify)):
        number = isinstance(value, float | int | np.number) and not isinstance(value, bool)
        if value is not None and not (number and 0 < value < np.inf):
            raise InvalidInput(f"{word} must be finite and > 0, got {str(value)[:40]!r}.")
    if not 0.01 <= threshold <= 1:
        raise InvalidInput(f"threshold must be from 0.01 to 1, got {str(threshold)[:40]!r}.")
    path, own = find_file(path, MESHES, _MAX_BYTES), find_limits()
    if find_spec("trimesh") is None or find_spec("coacd") is None:
        raise MissingExtra("mesh files need: pip install 'feeler[meshes]'")
    limits = Limits(
        max_bytes=max(own.max_bytes, _MEMORY), max_seconds=max(own.max_seconds, _SECONDS)
    )
    wanted = json.dumps([scale, width, threshold, simplify])
    found = open_guarded(f"{__name__}:read_parts", path, limits, words=(wanted,))[1]
    return found["corners"], found["starts"]


def read_parts(path: str, wanted: str) -> tuple[dict, dict[str, np.ndarray]]:
    """What the guard's process does for :func:`read_mesh`."""
    scale, width, threshold, simplify = json.loads(wanted)
    mesh = _load(path)
    if simplify is not None and len(mesh.faces) > simplify:
        mesh = mesh.simplify_quadric_decimation(face_count=int(simplify))
    if len(mesh.faces) > _MAX_FACES:
        raise InvalidInput(
            f"it has {len(mesh.faces):,} triangles, more than {_MAX_FACES:,}. Simplify it, as in"
            " simplify=20000."
        )
    _check_closed(mesh)
    parts = _cut(mesh, threshold)
    corners = np.concatenate(parts)
    low, high = corners.min(axis=0), corners.max(axis=0)
    unit = scale if width is None else width / (high[1] - low[1])
    corners = unit * (corners - [0.0, *(low[1:] + high[1:]) / 2])
    return {}, {"corners": corners, "starts": np.cumsum([0, *map(len, parts[:-1])])}


def _load(path: str) -> Any:
    trimesh: Any = import_module("trimesh")
    kind = Path(path).suffix.lower()[1:]
    try:
        with open(path, "rb") as file:  # not by its name: an OBJ may name other files
            options = {"file_type": kind, "process": True, "skip_materials": True}
            mesh = trimesh.load_mesh(file, **options)
        mesh.merge_vertices(merge_tex=True, merge_norm=True)
    except Exception as error:  # whatever a parser of foreign files may raise
        words = f"{type(error).__name__}: {error}"[:200]
        raise InvalidInput(f"it cannot be read as {kind.upper()} ({words}).") from error
    if not len(getattr(mesh, "faces", ())):
        raise InvalidInput("it has no triangles.")
    if not np.isfinite(mesh.vertices).all():
        raise InvalidInput("it has a corner that is not finite.")
    return mesh


def _check_closed(mesh: Any) -> None:
    """Refuse what bounds no solid."""
    if not mesh.is_watertight:
        _, count = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
        raise InvalidInput(
            f"it is open: {int((count != 2).sum())} of its {len(count)} edges have not two"
            " triangles. Close its holes in the program that made it."
        )
    if not mesh.is_winding_consistent:
        raise InvalidInput(
            "its triangles do not agree which side is out. Let the program that made it recompute"
            " the normals."
        )
    if mesh.volume <= 0:
        raise InvalidInput("it is inside out: flip its normals in the program that made it.")


def _cut(mesh: Any, threshold: float) -> list[np.ndarray]:
    """The corners of convex parts that fill a mesh."""
    hull = mesh.convex_hull
    if threshold >= 1 or mesh.volume >= (1 - _CONVEX) * hull.volume:
        return [np.asarray(hull.vertices, dtype=float)]
    coacd: Any = import_module("coacd")
    coacd.set_log_level("error")
    whole = coacd.Mesh(mesh.vertices, mesh.faces)
    options = {"decimate": True, "max_ch_vertex": _MAX_PART_CORNERS, "preprocess_mode": "off"}
    found = coacd.run_coacd(whole, threshold=threshold, seed=0, **options)
    found = found if len(found) > 1 else [(hull.vertices, None)]
    return [np.asarray(vertices, dtype=float) for vertices, _ in found]
