"""Courses: a wall of straight faces with angled turns, on the right of a body that runs along it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.wall.table import F_END, F_LENGTH, F_NX, F_NY, F_START, F_X, F_Y

RUN_UP = 150.0  # [C] mm of straight wall before the first turn, about 12 wall distances


@dataclass(frozen=True, kw_only=True)
class Course:
    """A wall that starts along +y and turns; the free side is on the left of its direction.

    Raises
    ------
    InvalidInput
        No face, a face that is too short for a corner, or a turn of 80 degrees and more.
    """

    lengths: tuple[float, ...] = (RUN_UP, RUN_UP)
    """Length of each face [mm], > 10."""
    turns: tuple[float, ...] = (30.0,)
    """Turn after each face but the last [degrees]: positive turns towards the body, negative away from it."""

    def __post_init__(self) -> None:
        if len(self.lengths) < 1 or len(self.turns) != len(self.lengths) - 1:
            raise InvalidInput(
                f"a Course needs one turn fewer than it has faces, got {len(self.lengths)} lengths and "
                f"{len(self.turns)} turns."
            )
        if not all(np.isfinite(length) and length > 10 for length in self.lengths):
            raise InvalidInput(f"Course.lengths must be finite and > 10 mm, got {self.lengths}.")
        if not all(np.isfinite(turn) and abs(turn) < 80 for turn in self.turns):
            raise InvalidInput(f"Course.turns must lie within ±80 degrees, got {self.turns}.")

    @property
    def corners(self) -> np.ndarray:
        """Points (face + 1, 2) [mm] from the start of the wall to its end."""
        heading = -np.radians(np.concatenate(([0.0], np.cumsum(self.turns))))
        steps = np.array(self.lengths)[:, None] * np.stack([np.sin(heading), np.cos(heading)], axis=1)
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    def make_faces(self, margin: float = 100.0) -> np.ndarray:
        """The faces' table, the first and last prolonged by ``margin`` [mm]."""
        corners, n = self.corners, len(self.lengths)
        faces = np.zeros((n, 7))
        along = np.diff(corners, axis=0) / np.array(self.lengths)[:, None]
        faces[:, F_X:F_NX] = corners[:-1]
        faces[:, F_NX], faces[:, F_NY] = -along[:, 1], along[:, 0]
        faces[:, F_LENGTH] = self.lengths
        away = np.array(self.turns) < 0
        faces[:-1, F_END], faces[1:, F_START] = away, away
        faces[0, F_X : F_Y + 1] -= margin * along[0]
        faces[0, F_LENGTH] += margin
        faces[-1, F_LENGTH] += margin
        return faces

    def measure(self, points: np.ndarray) -> np.ndarray:
        """Distance (point,) [mm] of points (point, 2) from the wall, negative behind it."""
        return measure_distance(self.make_faces(), np.asarray(points, dtype=float))


def measure_distance(faces: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distance (point,) to the nearest face, with the sign of its side."""
    along = np.stack([faces[:, F_NY], -faces[:, F_NX]], axis=1)
    offset = points[:, None, :] - faces[None, :, F_X : F_Y + 1]
    place = np.clip(np.einsum("pfc,fc->pf", offset, along), 0.0, faces[:, F_LENGTH])
    foot = offset - place[..., None] * along
    far = np.linalg.norm(foot, axis=2)
    best = far.argmin(axis=1)
    row = np.arange(len(points))
    side = np.einsum("pc,pc->p", offset[row, best], faces[best, F_NX : F_NY + 1])
    return np.where(side < 0, -1.0, 1.0) * far[row, best]


@checked
def make_turn(angle: float, lengths: Sequence[float] = (RUN_UP, RUN_UP)) -> Course:
    """A wall with one turn of ``angle`` degrees, positive towards the body."""
    return Course(lengths=tuple(lengths), turns=(float(angle),))
