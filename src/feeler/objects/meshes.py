"""Solids in space made of convex parts, also from STL and OBJ files."""

import json
import os
from dataclasses import field
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from feeler.antenna.segments import find_frames
from feeler.errors import InvalidInput, require_extra
from feeler.files import find_file
from feeler.objects.shapes import Feature, name_by_extent
from feeler.records import Ge, Gt, Le, Unit, freeze
from feeler.sandbox import Limits, find_limits, open_guarded
from feeler.validation import checked

# Meshes: solids in space made of convex parts.

_MAX_CORNERS = 5000  # [C]


class Mesh(Feature):
    """Convex solids, each the hull of its corners and grown by ``rounding``; only antennae in space
    meet it. Without a name it is called after its extent.

    Attributes
    ----------
    vertices : np.ndarray
        Corners (corner, 3) [mm], part after part, in a frame whose first axis points the way it
        moves; kept with the foremost at 0.
    starts : np.ndarray
        Number (part,) of each part's first corner, from 0; default: one part.
    rounding : float
        Distance [mm] by which it is grown, ≥ 0.

    Raises
    ------
    InvalidInput
        More than 5000 corners, or a part of fewer than four or all in one plane.
    """

    vertices: Annotated[np.ndarray, "corner 3"] = field(repr=False)
    starts: Annotated[np.ndarray, "part", int] = field(
        default=(0,),  # type: ignore[arg-type]
        repr=False,
    )
    rounding: float = 0.0
    kind: ClassVar[str] = "mesh"
    only_in_space: ClassVar[bool] = True

    def _check(self) -> None:
        n, starts = len(self.vertices), self.starts
        if not 4 <= n <= _MAX_CORNERS:
            raise InvalidInput(
                f"Mesh.vertices must be 4 to {_MAX_CORNERS} corners (corner, 3), got {n}. Simplify"
                " the mesh (simplify=), or take coarser parts (threshold=)."
            )
        if not starts.size or starts[0] != 0 or np.any(np.diff([*starts, n]) < 4):
            raise InvalidInput(
                "Mesh.starts must rise from 0, with at least four corners to a part, got"
                f" {starts.tolist()[:8]} for {n} corners."
            )
        corners = self.vertices + 0.0  # no −0: equal meshes have equal names
        vars(self)["vertices"] = freeze(corners - [corners[:, 0].max(), 0.0, 0.0])
        for number, part in enumerate(self._split()):
            spread = np.linalg.svd(part - part.mean(axis=0), compute_uv=False)
            if spread[2] <= 1e-6 * spread[0]:
                raise InvalidInput(f"Mesh: part {number} lies in one plane, which is no solid.")
        super()._check()

    def _split(self) -> list[np.ndarray]:
        return np.split(self.vertices, self.starts[1:])

    @classmethod
    @checked
    def from_file(
        cls,
        path: str | os.PathLike,
        *,
        scale: Annotated[float, Gt(0), Unit("mm")] = 1.0,
        width: Annotated[float, Gt(0), Unit("mm")] | None = None,
        threshold: Annotated[float, Ge(0.01), Le(1)] = 0.05,
        simplify: Annotated[int, Gt(0)] | None = None,
        rounding: float = 0.0,
        name: str = "",
    ) -> "Mesh":
        """The closed mesh in an STL or OBJ file, in convex parts.

        It moves along the file's x axis, and is centred across. What is not convex is cut into
        parts that are (Wei et al. 2022, CoACD, ACM Trans. Graph. 41: 42); each part's hull may
        stand out from the mesh a little.

        Parameters
        ----------
        scale
            How long one unit of the file is [mm], > 0; such files do not say it.
        width
            In its place: extent along y that the solid shall have [mm].
        threshold
            How hollow a part may be, over the mesh's size, 0.01 (many parts) to 1 (the hull).
        simplify
            Number of triangles to which the mesh is first reduced; default: as it is, which may
            have 100,000 at most.
        rounding, name
            As in ``Mesh``.

        Raises
        ------
        InvalidInput
            No such file, not of its format, open or inside out, or too many triangles.
        MissingDependencyError
            Mesh files need ``pip install 'feeler[meshes]'``.
        """
        path, own = find_file(path, MESHES, _MAX_BYTES), find_limits()
        for library in ("trimesh", "coacd"):
            require_extra(library, "meshes", "a mesh file")
        limits = Limits(
            max_bytes=max(own.max_bytes, _MEMORY), max_seconds=max(own.max_seconds, _SECONDS)
        )
        wanted = json.dumps([scale, width, threshold, simplify])
        _, found = open_guarded(f"{__name__}:read_parts", path, limits, words=(wanted,))
        vertices, starts = found["corners"], found["starts"]
        return cls(vertices=vertices, starts=starts, rounding=rounding, name=name)

    def make_name(self) -> str:
        """``mesh``, its extent, and six digits that stand for the corners and the rounding."""
        return name_by_extent("mesh", self.vertices, self.starts, self.rounding)

    def make_parts(self) -> list[np.ndarray]:
        """The parts' shadows in the plane."""
        from scipy.spatial import ConvexHull

        shadows = [part[:, :2] for part in self._split()]
        return [shadow[ConvexHull(shadow).vertices] for shadow in shadows]

    def make_solids(self) -> list[np.ndarray]:
        """The parts, set back by the rounding."""
        return [part - [self.rounding, 0.0, 0.0] for part in self._split()]


# Mesh files, read and cut into convex parts in the guard's process.

MESHES = (".stl", ".obj")
_MAX_BYTES = 256 * 2**20  # [C]
_MAX_FACES = 100_000  # [C] that are cut into parts as they are
_MAX_PART_CORNERS = 64  # [C] of a part, where there are several
_CONVEX = 1e-3  # [C] share of its hull by which a convex mesh's volume may fall short
_SECONDS, _MEMORY = 120.0, 4 * 2**30  # [C] that reading and cutting may take


def read_parts(path: str, wanted: str) -> tuple[dict, dict[str, np.ndarray]]:
    """What the guard's process does for ``Mesh.from_file``."""
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


# Features as solids in space: convex bodies, and walls without end; how near an antenna they
# are, and where a trial's feature starts.

_MARCHES = 200  # [C] steps of a search for the place where surfaces meet


def list_solids(feature: Feature) -> list[np.ndarray]:
    """Corners (corner, 3) [mm] of a feature's convex solids in its frame, all grown by
    ``rounding``: one is a ball, two are a capsule, more a body of flat faces. A wall without end
    is none.

    Raises
    ------
    InvalidInput
        A shape that has corners in the plane and no depth, or nothing to touch.
    """
    if feature.unbounded:
        return []
    solids = feature.make_solids()
    for corners in solids:
        flat = len(corners) > 2 and not np.ptp(corners, axis=0).all()
        if flat or (len(corners) <= 2 and feature.rounding == 0):
            raise InvalidInput(
                f"the {feature.kind} {feature.name!r} has no solid in space: give it a depth"
                " (half_length), or a rounding where it has no faces; or use antenna.flatten()."
            )
    return solids


def is_box(corners: np.ndarray) -> bool:
    """Whether a solid is a box along the axes of its frame."""
    return len(corners) == 8 and all(np.unique(row).size == 2 for row in corners.T)


def compute_gap_in_space(
    points: np.ndarray, radius: np.ndarray, feature: Feature, origin: Any, axes: np.ndarray
) -> float:
    """Smallest gap [mm] between surfaces, negative where they overlap: of an antenna's points
    (segment + 1, 3) and radii, and a feature whose frame stands at ``origin`` with ``axes``.
    """
    if feature.unbounded:
        gap = (points - origin) @ axes[0]
        return float(np.min(np.minimum(gap[:-1], gap[1:]) - radius))
    from feeler.objects.distance import find_gap  # numba is slow to load

    own = (points - origin) @ axes.T
    gaps = [find_gap(own, radius, *hull) for hull in _list_hulls(feature)]
    return float(np.min(gaps) - feature.rounding)


@lru_cache(maxsize=8)
def _list_hulls(feature: Feature) -> list[tuple[np.ndarray, int]]:
    from feeler.objects.distance import make_hull

    return [make_hull(corners) for corners in list_solids(feature)]


def place_in_space(antenna: Any, trial: Any) -> tuple[np.ndarray, np.ndarray]:
    """Where a trial's feature just touches an antenna in space at rest (3,), and its axes there
    (3, 3): forward, left, up.

    It comes as in the plane of the touched segment's first two axes, and all is then turned about
    that segment by ``azimuth``. Drawn back from its aim along its motion until it is clear.

    Raises
    ------
    InvalidInput
        It would meet the antenna elsewhere before its start.
    """
    arc = trial.location * antenna.length
    n = min(
        int(np.searchsorted(antenna.hinge_position, arc * (1 - 1e-12)) - 1), antenna.n_segments
    )
    points, (x, y, z) = antenna.shape(), find_frames(antenna.rest_angle)[max(n, 0)]
    aim = points[max(n, 0)] + (arc - antenna.hinge_position[max(n, 0)]) * y
    turn, angle = np.radians(trial.azimuth), np.radians(trial.approach)
    side = 1.0 if trial.side == "left" else -1.0
    across, up = np.cos(turn) * x + np.sin(turn) * z, np.cos(turn) * z - np.sin(turn) * x
    forward = side * np.sin(angle) * across + np.cos(angle) * y
    axes = np.array([forward, np.cross(up, forward), up])

    def measure(back: float) -> float:
        where = aim - back * forward
        return compute_gap_in_space(points, antenna.radius, trial.shape, where, axes)

    back = 0.0
    for _ in range(_MARCHES):
        gap = measure(back)
        if gap > -1e-13:
            break
        back -= gap  # the least way out, never beyond it
    if trial.shape.unbounded:
        return aim - back * forward, axes
    near, far = back + 1e-9, back + trial.speed * trial.lead
    while near < far:
        gap = measure(near)
        if gap <= 0:
            raise InvalidInput(
                "the feature starts in contact with the antenna, or meets another part of it first"
                f" ({trial.label}, approach {trial.approach:g}°). Choose an approach nearer to 90°,"
                " a shorter lead, or a straighter antenna."
            )
        near += max(gap, 1e-6)
    return aim - back * forward, axes
