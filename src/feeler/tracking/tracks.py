"""Tracks: the positions of landmarks in every frame of a film."""

import os
import re
from dataclasses import dataclass, field

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.tensors.table import Table, read_table

LANDMARKS = ("left_tip", "right_tip", "head", "abdomen")
"""[P] The four landmarks of the paper's Fig. S2; their order in its files is not published [C]."""
ORIGINS = ("top-left", "bottom-left")
MAX_FRAME_RATE = 1e6  # frames per second; above it the number is no frame rate of a film


@dataclass(frozen=True, kw_only=True, eq=False)
class Tracks:
    """Landmark positions, y upwards, first pixel at 0.

    Raises
    ------
    InvalidInput
        Wrong shape, no landmark, names given twice, infinite positions, or an interval that is not > 0.
    """

    position: np.ndarray
    """(frame, landmark, axis) [px, or mm after ``scaled``]; NaN where a landmark was not seen."""
    landmarks: tuple[str, ...]
    """Name of each landmark."""
    interval: float
    """Time between frames [ms]."""
    unit: str = "px"
    source: str = "tracked"
    """``tracked``, or ``synthetic`` for made-up motion."""
    notes: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        position = np.array(self.position, dtype=float)
        names = tuple(self.landmarks)
        if position.ndim != 3 or position.shape[1:] != (len(names), 2) or not names:
            raise InvalidInput(
                f"position must be (frame, landmark, axis) = (…, {len(names)}, 2) for landmarks {', '.join(names)}; "
                f"got shape {position.shape}."
            )
        if len(set(names)) < len(names):
            raise InvalidInput(f"each landmark needs its own name, got {', '.join(names)}.")
        if np.isinf(position).any():
            raise InvalidInput("positions must be finite, or NaN where a landmark was not seen; got infinity.")
        if not (np.isfinite(self.interval) and self.interval > 0):
            raise InvalidInput(f"interval must be > 0 ms, got {self.interval}.")
        object.__setattr__(self, "position", position)
        object.__setattr__(self, "landmarks", names)

    @property
    def n_frames(self) -> int:
        """Number of frames."""
        return self.position.shape[0]

    @property
    def time(self) -> np.ndarray:
        """Time (frame,) since the first frame [ms]."""
        return np.arange(self.n_frames) * self.interval

    def of(self, landmark: str) -> np.ndarray:
        """Positions (frame, axis) of one landmark; the error lists the names there are."""
        if landmark not in self.landmarks:
            raise InvalidInput(f"no landmark {landmark!r}; the tracks hold {', '.join(self.landmarks)}.")
        return self.position[:, self.landmarks.index(landmark)]


@checked
def load_tracks(
    path: str | os.PathLike,
    *,
    frame_rate: float,
    landmarks: tuple[str, ...] | None = None,
    origin: str = "top-left",
    camera: int = 1,
    first_pixel: float | None = None,
) -> Tracks:
    """Read landmark tracks: DLTdv xypts CSV, or any table with two columns ``NAME_x, NAME_y`` per landmark.

    Parameters
    ----------
    path
        CSV file; DLTdv files are recognised by their header ``pt1_cam1_X, pt1_cam1_Y, …``.
    frame_rate
        Frames per second of the film.
    landmarks
        What DLTdv's points 1, 2, … are; default: left_tip, right_tip, head, abdomen for four points [C]. For a
        generic table: which landmarks to take, default all.
    origin
        ``top-left`` (y downwards; DLTdv8 and most trackers) or ``bottom-left`` (y upwards; DLTdv5 to 7, Argus).
    camera
        Which camera of a DLTdv file with several.
    first_pixel
        Coordinate of the first pixel's centre; default 1 for DLTdv (MATLAB counts from 1), 0 for other tables.

    Returns
    -------
    Tracks
        y upwards. With ``top-left`` y is the negative of the file's, which changes no angle.
    """
    if origin not in ORIGINS:
        raise InvalidInput(f"unknown origin {origin!r}; valid: {', '.join(ORIGINS)}.")
    if not 0 < frame_rate <= MAX_FRAME_RATE:  # also refuses NaN
        raise InvalidInput(f"frame_rate must lie in (0, {MAX_FRAME_RATE:g}] frames per second, got {frame_rate}.")
    table = read_table(path)
    is_dltdv = any(re.fullmatch(r"pt\d+_cam\d+_X", name, re.IGNORECASE) for name in table.columns)
    names, position = _take_dltdv(table, camera, landmarks) if is_dltdv else _take_named(table, landmarks)
    position = position - (float(is_dltdv) if first_pixel is None else first_pixel)
    if origin == "top-left":
        position = position * (1.0, -1.0)
    source = "synthetic" if "synthetic" in table.notes.get("source", "").lower() else "tracked"
    return Tracks(position=position, landmarks=names, interval=1e3 / frame_rate, source=source, notes=table.notes)


def _take_dltdv(table: Table, camera: int, landmarks: tuple[str, ...] | None) -> tuple[tuple[str, ...], np.ndarray]:
    pattern = re.compile(r"pt(\d{1,4})_cam(\d{1,3})_([XY])", re.IGNORECASE)
    found = {}
    for index, column in enumerate(table.columns):
        match = pattern.fullmatch(column)
        if match and int(match[2]) == camera:
            found[int(match[1]), match[3].upper()] = index
    points = sorted({point for point, _ in found})
    if not points:
        raise InvalidInput(f"{table.source}: no column of camera {camera}, such as pt1_cam{camera}_X. Check camera=.")
    for point in points:
        _require_pair(table, found, point, f"pt{point}_cam{camera}")
    names = _name_points(points, landmarks)
    columns = [[found[point, axis] for axis in "XY"] for point in points]
    return names, table.values[:, columns]


def _name_points(points: list[int], landmarks: tuple[str, ...] | None) -> tuple[str, ...]:
    if landmarks is None:
        return LANDMARKS if len(points) == len(LANDMARKS) else tuple(f"pt{point}" for point in points)
    if len(landmarks) != len(points):
        raise InvalidInput(f"the file has {len(points)} points, landmarks names {len(landmarks)}: one name per point.")
    return tuple(landmarks)


def _take_named(table: Table, landmarks: tuple[str, ...] | None) -> tuple[tuple[str, ...], np.ndarray]:
    found = {}
    for index, column in enumerate(table.columns):
        match = re.fullmatch(r"(.{1,200}?)[_. ]([xyXY])", column)
        if match:
            found[match[1], match[2].upper()] = index
    names = tuple(dict.fromkeys(name for name, _ in found)) if landmarks is None else tuple(landmarks)
    if not names:
        raise InvalidInput(
            f"{table.source}: no landmark columns among {', '.join(table.columns[:12])}. A landmark is two columns, "
            "such as head_x and head_y, or DLTdv's pt1_cam1_X and pt1_cam1_Y."
        )
    for name in names:
        _require_pair(table, found, name, name)
    return names, table.values[:, [[found[name, axis] for axis in "XY"] for name in names]]


def _require_pair(table: Table, found: dict, key: object, shown: str) -> None:
    for axis in "XY":
        if (key, axis) not in found:
            raise InvalidInput(
                f"{table.source}: no column {shown}_{axis}; the file has {', '.join(table.columns[:12])}. "
                "Each landmark needs its x and its y."
            )
