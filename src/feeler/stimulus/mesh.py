"""Meshes: solids in space made of convex parts."""

import os
from typing import Annotated, ClassVar

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Of, freeze
from feeler.stimulus.feature import Feature, digest_numbers

_MAX_CORNERS = 5000  # [C]


class Mesh(Feature):
    """Convex solids, each the hull of its corners and grown by ``rounding``; only antennae in space
    meet it. Without a name it is called after its corners.

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

    vertices: Annotated[np.ndarray, "corner 3"]
    starts: Annotated[np.ndarray, "part", Of(int)] = (0,)  # type: ignore[assignment]
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
    def from_file(
        cls,
        path: str | os.PathLike,
        *,
        scale: float = 1.0,
        width: float | None = None,
        threshold: float = 0.05,
        simplify: int | None = None,
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
        MissingExtra
            Mesh files need ``pip install 'feeler[meshes]'``.
        """
        from feeler.stimulus.meshing import read_mesh

        corners, starts = read_mesh(path, scale, width, threshold, simplify)
        return cls(vertices=corners, starts=starts, rounding=rounding, name=name)

    @classmethod
    @checked
    def from_heights(
        cls,
        heights: Annotated[np.ndarray, "row column"],
        spacing: Annotated[float, "> 0"],
        *,
        depth: Annotated[float, "> 0"] = 5.0,
        rounding: float = 0.0,
        name: str = "",
    ) -> "Mesh":
        """A ground of known heights, such as bark: two upright wedges below each square of them.

        Between four neighbours the ground is two triangles. It moves the way its heights rise.

        Parameters
        ----------
        heights
            Heights (row, column) [mm], rows along the resting antenna and columns across it, both
            centred.
        spacing
            Distance of neighbours [mm].
        depth
            How far the solid goes on below the lowest height [mm].
        rounding, name
            As in ``Mesh``.

        Raises
        ------
        InvalidInput
            Fewer than two rows or columns, heights that are not finite, or more than 416 squares.
        """
        n_rows, n_columns = heights.shape
        n_corners = 12 * (n_rows - 1) * (n_columns - 1)
        if not 0 < n_corners <= _MAX_CORNERS or not np.isfinite(heights).all():
            raise InvalidInput(
                "Mesh.from_heights takes finite heights, two rows and two columns at least and"
                f" {_MAX_CORNERS // 12} squares between them at most, such as 21 × 21, got"
                f" {n_rows} × {n_columns}. Take every second height, or a part of the ground."
            )
        along, across = (spacing * (np.arange(n) - (n - 1) / 2) for n in heights.shape)
        ground = np.stack([heights, *np.meshgrid(along, across, indexing="ij")], axis=2)
        first, below = ground[:-1, :-1], ground[1:, :-1]
        beside, last = ground[:-1, 1:], ground[1:, 1:]
        tops = np.stack([[first, below, last], [first, last, beside]]).transpose(2, 3, 0, 1, 4)
        feet = tops.copy()
        feet[..., 0] = heights.min() - depth
        wedges = np.concatenate([tops, feet], axis=3).reshape(-1, 3)
        starts = np.arange(0, len(wedges), 6)
        return cls(vertices=wedges, starts=starts, rounding=rounding, name=name)

    def make_name(self) -> str:
        """``mesh`` and six digits that stand for the corners and the rounding."""
        return f"mesh {digest_numbers(self.vertices, self.starts, self.rounding)}"

    def make_parts(self) -> list[np.ndarray]:
        """The parts' shadows in the plane."""
        from scipy.spatial import ConvexHull

        shadows = [part[:, :2] for part in self._split()]
        return [shadow[ConvexHull(shadow).vertices] for shadow in shadows]

    def make_solids(self) -> list[np.ndarray]:
        """The parts, set back by the rounding."""
        return [part - [self.rounding, 0.0, 0.0] for part in self._split()]
