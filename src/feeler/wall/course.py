"""Courses: a wall of straight faces with angled turns, on the right of a body that runs along
it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated, ClassVar

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Gt, Lt, Record, Unit, freeze
from feeler.stimulus.feature import Feature
from feeler.stimulus.object import Object

_RUN_UP = 150.0  # [C] mm of straight wall before the first turn, about 12 wall distances
_MARGIN = 100.0  # mm; the first and the last face go on by this
_THICK = 10.0  # mm; from a face to the back of its block
# mm; a block goes on by this behind the next face where the wall turns towards the body
_OVERLAP = 5.0
_ROUND = 150.0  # degrees; blocks that turn by more in all are divided, so that they stay convex


@dataclass(frozen=True, kw_only=True, eq=False)
class Faces(Feature):
    """A wall's faces along a line of corners with blocks behind them, on the right of the line.

    Attributes
    ----------
    corners : np.ndarray
        (corner, 2) [mm] seen from above: the body looks along +y, so that the frame's first axis is
        −x.
    """

    corners: np.ndarray
    kind: ClassVar[str] = "course"
    rounding: ClassVar[float] = 0.0
    wide: ClassVar[bool] = True

    def __post_init__(self) -> None:
        object.__setattr__(self, "corners", freeze(np.array(self.corners, dtype=float)))
        super().__post_init__()

    def make_parts(self) -> list[np.ndarray]:
        """A block for each stretch that only turns away from the body."""
        along = np.diff(self.corners, axis=0)
        along /= np.hypot(along[:, 0], along[:, 1])[:, None]
        behind, turn = _THICK * along[:, ::-1] * [1.0, -1.0], _measure_turns(along)
        blocks, first = [], 0
        for last in range(len(along)):
            if last < len(turn) and turn[last] < 0 and turn[first : last + 1].sum() > -_ROUND:
                continue
            line = self.corners[first : last + 2].copy()
            line[0] -= (_OVERLAP if first and turn[first - 1] > 0 else 0.0) * along[first]
            line[-1] += (_OVERLAP if last < len(turn) and turn[last] > 0 else 0.0) * along[last]
            blocks.append(
                -np.concatenate([line, [line[-1] + behind[last], line[0] + behind[first]]])
            )
            first = last + 1
        return blocks


def _measure_turns(along: np.ndarray) -> np.ndarray:
    """Turns between unit vectors (face, 2) [degrees], positive to the left."""
    before, after = along[:-1], along[1:]
    sine = before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0]
    return np.degrees(np.arctan2(sine, (before * after).sum(axis=1)))


class Course(Record):
    """A wall that starts along +y and turns; the free side is on the left of its direction.

    Attributes
    ----------
    lengths : tuple[Annotated[float, Gt(10), Unit(mm)], ...]
        Length of each face [mm], > 10.
    turns : tuple[Annotated[float, Gt(-80), Lt(80), Unit(degrees)], ...]
        Turn after each face but the last [degrees]: positive turns towards the body, negative away
        from it.

    Raises
    ------
    InvalidInput
        No face, a face that is too short for a corner, or a turn of 80 degrees and more.
    """

    lengths: tuple[Annotated[float, Gt(10), Unit("mm")], ...] = (_RUN_UP, _RUN_UP)
    turns: tuple[Annotated[float, Gt(-80), Lt(80), Unit("degrees")], ...] = (30.0,)

    def _check(self) -> None:
        if len(self.lengths) < 1 or len(self.turns) != len(self.lengths) - 1:
            raise InvalidInput(
                f"a Course needs one turn fewer than it has faces, got {len(self.lengths)} lengths"
                f" and {len(self.turns)} turns."
            )

    @property
    def corners(self) -> np.ndarray:
        """Points (face + 1, 2) [mm] from the start of the wall to its end."""
        heading = -np.radians(np.concatenate(([0.0], np.cumsum(self.turns))))
        along = np.stack([np.sin(heading), np.cos(heading)], axis=1)
        steps = np.array(self.lengths)[:, None] * along
        return np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])

    @cached_property
    def line(self) -> np.ndarray:
        """The corners with the first and the last face prolonged (face + 1, 2) [mm], read-only."""
        line = self.corners
        line[0], line[-1] = _prolong(line[1], line[0]), _prolong(line[-2], line[-1])
        return freeze(line)

    def make_object(self, friction: float = 0.0) -> Object:
        """The wall as an object of a scene."""
        faces = Faces(corners=self.line)
        front = max(block[:, 0].max() for block in faces.make_parts())
        return Object(
            feature=faces, place=(-front, 0.0), forward=(-1.0, 0.0), friction=friction
        )

    def measure(self, points: np.ndarray) -> np.ndarray:
        """Distance [mm] of points (point, 2) from the nearest face (point,), negative behind it."""
        start, along = self.line[:-1], np.diff(self.line, axis=0)
        length = np.hypot(along[:, 0], along[:, 1])
        along /= length[:, None]
        offset = np.asarray(points, dtype=float)[:, None, :] - start
        place = np.clip((offset * along).sum(axis=2), 0.0, length)
        foot = offset - place[..., None] * along
        far = np.hypot(foot[..., 0], foot[..., 1])
        row, best = np.arange(len(far)), far.argmin(axis=1)
        left = offset[row, best, 1] * along[best, 0] - offset[row, best, 0] * along[best, 1]
        return np.where(left < 0, -1.0, 1.0) * far[row, best]


def _prolong(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    return end + _MARGIN * (end - start) / np.hypot(*(end - start))


@checked
def make_turn(angle: float, lengths: Sequence[float] = (_RUN_UP, _RUN_UP)) -> Course:
    """A wall with one turn of ``angle`` degrees, positive towards the body."""
    return Course(lengths=tuple(lengths), turns=(float(angle),))
