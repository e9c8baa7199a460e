"""Tracks: positions of landmarks in every frame of a film, and as poses in NWB."""

import json
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from datetime import datetime
from difflib import get_close_matches
from pathlib import Path
from pkgutil import resolve_name
from shlex import quote
from typing import Annotated, Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.records import ALLOW_NAN, Choice, Ge, Gt, Le, Len, Record, Unit, show_html
from feeler.sandbox import Limits
from feeler.tables import Table, sniff_columns
from feeler.tensors.formats import HDF5, Format
from feeler.tensors.readers import name_series
from feeler.tensors.writers import PAUSE, make_nwb, make_subject, require_pynwb, write_nwb
from feeler.tracking.trackers import (
    LENGTHS,
    OWN_UNIT,
    PLACEHOLDER,
    PLANES,
    SURE,
    Found,
    _find_boxes,
    _find_landmarks,
    _is_export,
    _read_clock,
    _read_tracker,
    _spread_frames,
    project,
)
from feeler.validation import checked

# Tracks: the positions of landmarks in every frame of a film.

LANDMARKS = ("left_tip", "right_tip", "head", "abdomen")
"""[P] The four landmarks of the paper's Fig. S2; their order in its files is not published [C]."""
_ORIGINS = ("top-left", "bottom-left")
_CERTAIN = 2.0  # [C] likelihood: scores of SLEAP are a little above 1 at times
MIN_LIKELIHOOD = 0.6  # [B] the default of DeepLabCut (pcutoff) and of movement
_MAX_FRAME_RATE = 1e6  # frames per second; above it the number is no frame rate of a film
_SAME_RATE = 0.02  # [C] by which a frame rate may differ from the one that times say
_AWAY = 0.05  # [C] of all landmarks' extent, by which (0, 0) is no place that was tracked


class Tracks(Record):
    """Landmark positions, y upwards, first pixel at 0.

    Attributes
    ----------
    position : np.ndarray
        (frame, landmark, axis) [``unit``: px, or mm after ``scaled``], with two axes, or three of
        places in space; NaN where a landmark was not seen.
    landmarks : tuple[str, ...]
        Name of each landmark.
    interval : float
        Time between frames [ms].
    source : str
        ``tracked``, or ``synthetic`` for made-up motion.
    doubted : dict[str, int]
        Landmark → frames that were made NaN because the tracker's likelihood was below
        ``min_likelihood``.
    likelihood : np.ndarray | None
        (frame, landmark) as the tracker gave it; NaN where it gave none.
    unfiltered : np.ndarray | None
        Positions as ``position``, with those that are doubted; None where none is.
    settings : dict[str, Any]
        What feeler measured these tracks with, where they come from an NWB file that it wrote.
    first_pixel : float
        Coordinate of the first pixel's centre in the file, which is 0 here.

    Raises
    ------
    InvalidInput
        Wrong shape, no landmark, names given twice, infinite positions, or an interval that is not
        > 0.
    """

    position: Annotated[np.ndarray, "frame landmark axis", ALLOW_NAN]
    landmarks: Annotated[tuple[str, ...], Len(1)]
    interval: Annotated[float, Gt(0), Unit("ms")]
    unit: str = "px"
    source: str = "tracked"
    notes: dict[str, str] = field(default_factory=dict)
    doubted: dict[str, int] = field(default_factory=dict)
    likelihood: Annotated[np.ndarray, "frame landmark", ALLOW_NAN] | None = None
    unfiltered: Annotated[np.ndarray, "frame landmark axis", ALLOW_NAN] | None = None
    min_likelihood: float = MIN_LIKELIHOOD
    settings: dict[str, Any] = field(default_factory=dict)
    first_pixel: float = 0.0

    def _check(self) -> None:
        names = self.landmarks
        if self.position.shape[1] != len(names) or self.position.shape[2] not in (2, 3):
            raise InvalidInput(
                f"position must be (frame, landmark, axis) = (…, {len(names)}, 2 or 3) for"
                f" landmarks {', '.join(names)}; got shape {self.position.shape}."
            )
        if len(set(names)) < len(names):
            raise InvalidInput(f"each landmark needs its own name, got {', '.join(names)}.")
        if np.isinf(self.position).any():
            raise InvalidInput(
                "positions must be finite, or NaN where a landmark was not seen; got infinity."
            )

    @property
    def n_frames(self) -> int:
        """Number of frames."""
        return self.position.shape[0]

    @property
    def time(self) -> np.ndarray:
        """Time (frame,) since the first frame [ms]."""
        return np.arange(self.n_frames) * self.interval

    def plot(self) -> Any:
        """A matplotlib Figure of where every landmark was."""
        return resolve_name("feeler.plotting.results:draw_tracks")(self)

    def _repr_html_(self) -> str:
        """Picture and short table, as a notebook shows them."""
        seen = np.isfinite(self.position).all(axis=2).mean(axis=0)
        rows = [
            ("frames", f"{self.n_frames}, {1e3 / self.interval:.4g} per second"),
            ("landmarks", ", ".join(self.landmarks)),
            ("seen", ", ".join(f"{share:.1%}" for share in seen)),
            ("unit", self.unit),
            *self.notes.items(),
        ]
        return show_html("Tracks", rows, self.plot())

    @checked
    def scaled(self, pixels_per_mm: Annotated[float, Gt(0), Unit("px/mm")]) -> "Tracks":
        """The same tracks in mm."""
        if self.unit == "mm":
            raise InvalidInput("tracks in mm are scaled already; scaling is for tracks in px.")
        whole = None if self.unfiltered is None else self.unfiltered / pixels_per_mm
        return self.replace(position=self.position / pixels_per_mm, unfiltered=whole, unit="mm")

    def of(self, landmark: str) -> np.ndarray:
        """Positions (frame, axis) of one landmark; the error lists the names there are."""
        if landmark not in self.landmarks:
            near = get_close_matches(landmark, self.landmarks, n=2)
            hint = f" Nearest: {', '.join(near)}." if near else ""
            raise InvalidInput(
                f"no landmark {landmark!r}; the tracks hold {', '.join(self.landmarks)}.{hint}"
            )
        return self.position[:, self.landmarks.index(landmark)]


@checked
def load_tracks(
    path: str | os.PathLike,
    *,
    frame_rate: Annotated[float, Gt(0), Le(_MAX_FRAME_RATE)] | None = None,
    landmarks: tuple[str, ...] | None = None,
    origin: Annotated[str, Choice(_ORIGINS)] = "top-left",
    camera: int = 1,
    first_pixel: float | None = None,
    min_likelihood: Annotated[float, Ge(0), Le(1)] | None = None,
    individual: str | None = None,
    plane: Annotated[str, Choice(PLANES)] | None = None,
) -> Tracks:
    """Read landmark tracks of DeepLabCut (CSV, H5 in either form of pandas), SLEAP (project,
    analysis H5, CSV), Anipose (CSV), sleap-anipose (H5), movement (netCDF), ndx-pose (NWB), DLTdv,
    Motive, TRex, idtracker.ai, AnimalTA, FicTrac, Bonsai, or a table.

    A table has columns ``NAME_x, NAME_y`` per landmark (or ``NAME/X``, ``NAME:x``, ``x1, y1``), in
    space ``NAME_z`` too, and, if it likes, ``NAME_likelihood``; or, a long one, a row for each
    landmark in each frame: ``frame`` or ``time``, ``keypoint``, ``x``, ``y``, and perhaps
    ``individual`` and ``confidence``.
    Places whose likelihood is below ``min_likelihood`` become NaN and are counted in ``doubted``,
    and so does a place such as (0, 0) or (-1, -1) that is far from those before and after, by which
    some programs mark a lost point (``notes``). Frames that the file leaves out, by its frame
    numbers or times, are NaN; nothing is filled in.

    Parameters
    ----------
    path
        The tracker's file; what wrote it is seen by its content.
    frame_rate
        Frames per second of the film; needed unless the file holds it (movement, NWB, a column
        ``time_s`` or ``time_ms``) and it is more than 2, which converters write that have not seen
        the film. It may mend a number that the file claims, which ``notes`` then say, but not
        contradict the times of a table or NWB file.
    landmarks
        What DLTdv's or sleap-anipose's points 1, 2, … are; default of DLTdv: left_tip, right_tip,
        head, abdomen for four points [C]. Of other files: which landmarks to take, default all.
    origin
        ``top-left`` (y downwards; DLTdv8 and most trackers) or ``bottom-left`` (y upwards; DLTdv5
        to 7, Argus).
    camera
        Which camera of a DLTdv file with several.
    first_pixel
        Coordinate of the first pixel's centre; default 1 for DLTdv (MATLAB counts from 1), 0 for
        other tables.
    min_likelihood
        Least likelihood (score, confidence) that counts as seen; 0 takes all. Default: that of the
        run that wrote the file, if it was feeler, else 0.6, DeepLabCut's and movement's default.
    individual
        Which animal of a file with several, or which trial of an NWB file or of a table with a
        column ``individual``, ``track``, ``animal``, ``id`` or ``trial``.
    plane
        Of places in space, needed there: ``xy``, ``xz`` or ``yz``, which count as seen with the
        second axis upwards, or ``space`` for all three, whose angles have no sign.

    Returns
    -------
    Tracks
        y upwards. With ``top-left`` y is the negative of the file's, which changes no angle.

    Raises
    ------
    InvalidInput
        A file that holds no such tracks, no frame rate or one that contradicts its times, or an
        option out of range.
    """
    found, name = _read_tracker(path, individual), os.path.basename(path)
    first = first_pixel or 0.0
    if isinstance(found, Table):
        first = float(_is_dltdv(found)) if first_pixel is None else first_pixel
        found = _read_landmarks(found, camera, landmarks, frame_rate)
    elif landmarks is not None:
        found = _select(found, landmarks)
    found = project(found, plane, name)
    frame_rate, notes = _choose_rate(found, frame_rate, name)
    found, every = _take_tracked(found)
    frame_rate /= every
    found, lost = _leave_out_marks(found)
    if min_likelihood is None:
        kept = found.settings.get("min_likelihood")
        min_likelihood = kept if isinstance(kept, float) and 0 <= kept <= 1 else MIN_LIKELIHOOD
    position, doubted = _doubt(found, min_likelihood, name)
    turn = np.ones(position.shape[2])
    if origin == "top-left" and plane is None:
        turn[1] = -1.0
    source = "synthetic" if "synthetic" in found.notes.get("source", "").lower() else "tracked"
    notes = {**found.notes, **notes, **lost}
    notes |= {"software": found.software} if found.software else {}
    return Tracks(
        position=(position - first) * turn,
        landmarks=found.names,
        interval=1e3 / frame_rate,
        unit=found.unit,
        source=source,
        notes=notes,
        doubted=doubted,
        likelihood=found.likelihood,
        unfiltered=(found.position - first) * turn if doubted else None,
        min_likelihood=min_likelihood,
        settings=found.settings,
        first_pixel=first,
    )


def _read_landmarks(
    table: Table,
    camera: int = 1,
    landmarks: tuple[str, ...] | None = None,
    frame_rate: float | None = None,
) -> Found:
    """Landmarks of a plain or DLTdv table, as in the file, with the clock of its columns."""
    take = (
        _take_dltdv(table, camera, landmarks)
        if _is_dltdv(table)
        else _take_named(table, landmarks)
    )
    frame, rate, timed, wrong = _read_clock(table, frame_rate)
    notes = {**take.notes, **({"clock": wrong} if wrong else {})}
    position, likelihood = take.position, take.likelihood
    if frame is not None:
        (position, likelihood), more = _spread_frames(frame, table.source, position, likelihood)
        notes |= more
    return replace(
        take,
        position=position,
        likelihood=likelihood,
        notes=notes,
        frame_rate=rate,
        timed=timed,
    )


def _is_dltdv(table: Table) -> bool:
    return any(re.fullmatch(r"pt\d+_cam\d+_X", name, re.IGNORECASE) for name in table.columns)


def _choose_rate(found: Found, given: float | None, name: str) -> tuple[float, dict[str, str]]:
    """Frames per second, and a note where the file claims another number than the given one."""
    own = found.frame_rate
    if given is None:
        return _check_rate(found, name), {}
    if own is None or abs(given - own) <= _SAME_RATE * abs(own):
        return given, {}
    if found.timed:
        raise InvalidInput(
            f"{name}: frame_rate={given:g} contradicts {found.timed}, by which there are"
            f" {own:.4g} frames/s. Leave frame_rate= out or, if these are not the times at which"
            " the frames were filmed, that column."
        )
    return given, {"frame rate": f"{given:g} frames/s as given; the file claims {own:.4g}"}


def _take_tracked(found: Found) -> tuple[Found, int]:
    """Every k-th frame alone, and k, where no other was tracked or others repeat it."""
    new = np.isfinite(found.position).any(axis=(1, 2))
    new[1:] &= (np.diff(found.position, axis=0) != 0).any(axis=(1, 2))
    rows = np.flatnonzero(new)
    every = int(np.gcd.reduce(np.diff(rows))) if rows.size > 2 else 1
    if every == 1:
        return found, 1
    kept, words = slice(rows[0], None, every), f"one in {every} frames of the film"
    likelihood = found.likelihood if found.likelihood is None else found.likelihood[kept]
    notes = {k: v for k, v in found.notes.items() if k != "left out"} | {"tracked": words}
    return replace(
        found, position=found.position[kept], likelihood=likelihood, notes=notes
    ), every


def _leave_out_marks(found: Found) -> tuple[Found, dict[str, str]]:
    """The same without places that only mark a lost point, as (0, 0) and (-1, -1) do, and a note of
    how many.
    """
    position = found.position.astype(float)
    alike = (position == position[..., :1]).all(axis=2)
    if not alike.any():
        return found, {}
    middle = np.median(np.nan_to_num(position, nan=np.inf), axis=0)
    rests = (position == middle).all(axis=2)  # for more than half of the film
    alike &= ~rests | (position == 0).all(axis=2)
    values, often = np.unique(position[alike], return_counts=True)
    if not values.size:
        return found, {}
    value = values[often.argmax()]
    mark = alike & (position[..., 0] == value)
    seen = position[np.isfinite(position).all(axis=2) & ~mark]
    if not len(seen):
        return found, {}
    extent = np.ptp(seen, axis=0).max()
    counts = {}
    for k, name in enumerate(found.names):
        known = np.flatnonzero(np.isfinite(position[:, k]).all(axis=1) & ~mark[:, k])
        if not mark[:, k].any() or known.size < 2:
            continue
        usual = np.linalg.norm(np.diff(position[known, k], axis=0), axis=1)
        marked = np.flatnonzero(mark[:, k])
        edge = known[np.isin(known + 1, marked) | np.isin(known - 1, marked)]
        away = np.linalg.norm(position[edge, k] - value, axis=1)
        if away.size and np.median(away) > max(_AWAY * extent, 3 * np.percentile(usual, 90)):
            counts[name] = marked.size
            position[marked, k] = np.nan
    if not counts:
        return found, {}
    words = ", ".join(f"{name} {n}" for name, n in sorted(counts.items()))
    note = f"({', '.join([f'{value:g}'] * position.shape[2])})"
    return replace(found, position=position), {note: f"counts as not seen, frames: {words}"}


def _check_rate(found: Found, name: str) -> float:
    """The file's own frame rate, where it can be one."""
    advice = "give frame_rate=."
    if clock := found.notes.get("clock"):
        raise InvalidInput(
            f"{name} has no even clock: {clock}. To count frames alone, {advice}"
        )
    if found.frame_rate is None:
        raise InvalidInput(f"{name} does not say how many frames a second; {advice}")
    if not PLACEHOLDER < found.frame_rate <= _MAX_FRAME_RATE:
        raise InvalidInput(
            f"{name} claims {found.frame_rate:.4g} frames/s, which no film of a moving animal has;"
            f" {advice}"
        )
    return found.frame_rate


def _select(found: Found, landmarks: tuple[str, ...]) -> Found:
    """These landmarks of a tracker's file; names for points that have none."""
    if found.software == "sleap-anipose":
        return replace(found, names=_name_points([*range(len(found.names))], landmarks))
    if unknown := [name for name in landmarks if name not in found.names]:
        raise InvalidInput(
            f"no landmark {unknown[0]!r}; the tracks hold {', '.join(found.names)}."
        )
    index = [found.names.index(name) for name in landmarks]
    likelihood = None if found.likelihood is None else found.likelihood[:, index]
    return replace(
        found, names=tuple(landmarks), position=found.position[:, index], likelihood=likelihood
    )


def _doubt(found: Found, least: float, name: str) -> tuple[np.ndarray, dict[str, int]]:
    """Positions with NaN where the tracker was unsure, and how many frames that were of each
    landmark.
    """
    if found.likelihood is None:
        return found.position, {}
    if least and (most := np.fmax.reduce(found.likelihood, axis=None, initial=0.0)) > _CERTAIN:
        raise InvalidInput(
            f"{name}: likelihoods go up to {most:.4g}, where 1 is certain. Divide them by 100 if"
            " they are percent; with min_likelihood=0 all places count as seen."
        )
    unsure = (found.likelihood < least) & np.isfinite(found.position).all(axis=2)
    counts = dict(zip(found.names, unsure.sum(axis=0).tolist(), strict=True))
    return np.where(unsure[:, :, None], np.nan, found.position), {
        name: n for name, n in counts.items() if n
    }


def _take_dltdv(table: Table, camera: int, landmarks: tuple[str, ...] | None) -> Found:
    pattern = re.compile(r"pt(\d{1,4})_cam(\d{1,3})_([XY])", re.IGNORECASE)
    found = {}
    for index, column in enumerate(table.columns):
        match = pattern.fullmatch(column)
        if match and int(match[2]) == camera:
            found[int(match[1]), match[3].upper()] = index
    points = sorted({point for point, _ in found})
    if not points:
        raise InvalidInput(
            f"{table.source}: no column of camera {camera}, such as pt1_cam{camera}_X. Check"
            " camera=."
        )
    for point in points:
        _require_axes(table, found, point, f"pt{point}_cam{camera}")
    names = _name_points(points, landmarks)
    columns = [[found[point, axis] for axis in "XY"] for point in points]
    cameras = {int(match[2]) for name in table.columns if (match := pattern.fullmatch(name))}
    notes = {**table.notes, "camera": f"{camera} of {len(cameras)} (--camera chooses)"}
    if len(cameras) == 1:
        notes = table.notes
    return Found(names=names, position=table.values[:, columns], notes=notes, software="DLTdv")


def _name_points(points: list[int], landmarks: tuple[str, ...] | None) -> tuple[str, ...]:
    if landmarks is None:
        return (
            LANDMARKS
            if len(points) == len(LANDMARKS)
            else tuple(f"pt{point}" for point in points)
        )
    if len(landmarks) != len(points):
        raise InvalidInput(
            f"the file has {len(points)} points, landmarks names {len(landmarks)}: one name per"
            " point."
        )
    return tuple(landmarks)


def _take_named(table: Table, landmarks: tuple[str, ...] | None) -> Found:
    table, notes = _find_boxes(table)
    found, stated = _find_landmarks(table.columns)
    names = (
        tuple(dict.fromkeys(name for name, _ in found))
        if landmarks is None
        else tuple(landmarks)
    )
    if not names:
        raise InvalidInput(
            f"{table.source}: no landmark columns among {', '.join(table.columns[:12])}. A landmark"
            " is two columns, such as head_x and head_y, or DLTdv's pt1_cam1_X and pt1_cam1_Y."
        )
    axes = "XYZ" if any((name, "Z") in found for name in names) else "XY"
    for name in names:
        _require_axes(table, found, name, name, axes)
    places = [[found[name, axis] for axis in axes] for name in names]
    position = table.values[:, places]
    for column in [table.columns[k] for row in places for k in row]:
        again = f"{column}.1"
        if again in table.columns and not np.array_equal(
            table.column(column), table.column(again), equal_nan=True
        ):
            raise InvalidInput(
                f"{table.source}: two columns are called {column!r}, with other numbers. Give each"
                " its own name."
            )
    unit = "px" if axes == "XY" else OWN_UNIT
    if stated and stated not in LENGTHS:
        raise InvalidInput(
            f"{table.source}: its places are in {stated}; give all in px, or all in one of"
            f" {', '.join(LENGTHS)}."
        )
    if stated:
        position, unit = position * LENGTHS[stated], "mm"
    elif 0 < np.abs(position).max(initial=0.0, where=np.isfinite(position)) <= 1:
        raise InvalidInput(
            f"{table.source}: all places lie between 0 and 1, as shares of a picture's width and"
            " height do, in which angles are wrong. Multiply x by its width and y by its height"
            f" [px], or name the unit, {names[0]}_x (m)."
        )
    sure = [
        [
            c
            for c in table.columns
            if re.fullmatch(rf"{re.escape(n)}[_. :/](?i:{'|'.join(SURE)})", c)
        ]
        for n in names
    ]
    blank = np.full(len(position), np.nan)
    seen = [table.column(columns[0]) if columns else blank for columns in sure]
    return Found(
        names=names,
        position=position,
        likelihood=np.stack(seen, axis=1) if any(sure) else None,
        notes=table.notes | notes,
        unit=unit,
    )


def _require_axes(table: Table, found: dict, key: object, shown: str, axes: str = "XY") -> None:
    for axis in axes:
        if (key, axis) not in found:
            raise InvalidInput(
                f"{table.source}: no column {shown}_{axis}; the file has"
                f" {', '.join(table.columns[:12])}. Each landmark needs its {' and '.join(axes)}."
            )
        table.refuse_words(table.columns[found[key, axis]])


# Tracked landmarks as poses in Neurodata Without Borders (ndx-pose), one clock for all films;
# needs the extra ``nwb``.


@checked
def save_poses(
    trials: Sequence[Tracks],
    path: str | os.PathLike,
    *,
    session_start: datetime | str,
    identifier: str,
    edges: Sequence[tuple[str, str]] = (),
    subject: str = "",
    settings: Mapping[str, Any] | None = None,
) -> None:
    """Write films of one animal as NWB: a table of trials, and for each a ``PoseEstimation`` with a
    series per landmark, its places as the tracker gave them (``Tracks.unfiltered``) and, where it
    gave one, its likelihood as ``confidence``.

    All films share the session's clock: each begins 1 s after the one before has ended, because
    tracks do not hold when they were filmed. ``load_tracks(path, individual="trial_000000")`` reads
    one again.

    Parameters
    ----------
    trials
        With the same landmarks, in px or mm (stored in mm, with the factor to metres).
    session_start, identifier, subject
        As :func:`feeler.tensors.writers.save_nwb` has them.
    edges
        Which landmarks are joined, for instance neighbours along a flagellum.
    settings
        What the films were measured with (plain data), kept as JSON in ``data_collection``;
        ``load_tracks`` gives it back as ``Tracks.settings``.

    Raises
    ------
    MissingDependencyError
        pynwb or ndx-pose is not installed.
    InvalidInput
        No trial, other landmarks in one of them, an edge to an unknown one, or no time zone.
    """
    require_pynwb()
    names = trials[0].landmarks if trials else ()
    if not names or any(one.landmarks != names for one in trials):
        raise InvalidInput(
            "poses need at least one film, and in all of them the same landmarks in the same order."
        )
    if unknown := [name for edge in edges for name in edge if name not in names]:
        raise InvalidInput(f"an edge joins {unknown[0]!r}; the tracks hold {', '.join(names)}.")
    file = make_nwb(
        identifier,
        session_start,
        words=f"feeler: {', '.join(sorted({one.source for one in trials}))} landmarks",
        about=f"{len(trials)} films of tracked landmarks; missing places are NaN",
        subject=make_subject(subject),
        data_collection=json.dumps({"feeler tracks": dict(settings)}) if settings else None,
    )
    from ndx_pose import Skeleton, Skeletons

    places = np.array(
        [[names.index(name) for name in edge] for edge in edges], dtype=np.uint8
    ).reshape(-1, 2)
    skeleton = Skeleton(name="skeleton", nodes=list(names), edges=places)
    module = file.create_processing_module("behavior", "tracked landmarks")
    module.add(Skeletons(skeletons=[skeleton]))
    begin = 0.0
    for number, one in enumerate(trials):
        poses = _make_poses(one, f"trial_{number:06d}", skeleton, begin)
        module.add(poses)
        end = begin + float(one.time[-1]) * 1e-3
        file.add_trial(
            start_time=begin,
            stop_time=end,
            timeseries=list(poses.pose_estimation_series.values()),
        )
        begin = end + PAUSE
    write_nwb(file, path)


def _make_poses(tracks: Tracks, title: str, skeleton: Any, begin: float) -> Any:
    """One film; a series per landmark."""
    from ndx_pose import PoseEstimation, PoseEstimationSeries

    unit: dict[str, Any] = {"unit": "pixels" if tracks.unit == "px" else "unknown"}
    if tracks.unit == "mm":
        unit = {"unit": "meters", "conversion": 1e-3}
    whole = tracks.position if tracks.unfiltered is None else tracks.unfiltered
    flat = whole.shape[2] == 2
    frame = "(0, 0) is the centre of the film's first pixel; x to the right, y downwards"
    series = [
        PoseEstimationSeries(
            name=title,
            data=place * ((1.0, -1.0) if flat else 1.0),
            reference_frame=frame if flat else "that of the cameras' calibration",
            description=f"place of {name}; NaN where it was not seen",
            starting_time=begin,
            rate=float(np.round(1e3 / tracks.interval, 6)),
            **unit,
            **sure,
        )
        for name, title, place, sure in zip(
            tracks.landmarks,
            name_series(tracks.landmarks),
            np.moveaxis(whole, 1, 0),
            _list_confidence(tracks),
            strict=True,
        )
    ]
    return PoseEstimation(
        name=title,
        pose_estimation_series=series,
        description=f"{tracks.source} landmarks, as feeler read them",
        source_software=tracks.notes.get("software", "unknown"),
        skeleton=skeleton,
    )


def _list_confidence(tracks: Tracks) -> list[dict[str, Any]]:
    """What a series says of its landmark's likelihood."""
    if tracks.likelihood is None:
        return [{} for _ in tracks.landmarks]
    words = "likelihood by the tracker; NaN where it gave none"
    return [{"confidence": row, "confidence_definition": words} for row in tracks.likelihood.T]


# What ``feeler info`` says of a tracker's file.

_SCORER = re.compile(rb"(?m)^\s*\"?scorer\"?[,;\t]")
_MAX_NAMES = 12


def _is_tracks(path: Path, start: bytes) -> bool:
    """Whether a file may hold landmarks: HDF5, or a table with a column x and y of one point."""
    if start.startswith(HDF5) or _SCORER.search(start.removeprefix(b"\xef\xbb\xbf")):
        return True
    if _is_export(start.decode("utf-8-sig", "ignore")):
        return True
    found = _find_landmarks(sniff_columns(start))[0]
    return any((name, "Y") in found and len(name) > 1 and name != "body" for name, _ in found)


def _load(path: Path, limits: Limits, trusted: bool) -> list[str]:
    found = _read_tracker(path, None, first=True)
    if isinstance(found, Table):
        found = _read_landmarks(found)
    if not len(found.position):
        raise InvalidInput(
            f"{path.name} names {_list(found.names)}, but holds no frame of a film."
        )
    rate = "not in the file (--frame-rate)"
    if found.frame_rate is not None:
        rate = f"{found.frame_rate:g} frames/s, as the file claims (--frame-rate mends it)"
    if found.timed:
        rate = f"{found.frame_rate:.4g} frames/s, by {found.timed}"
    lines = [
        f"by          {found.software or 'no tracker that is named'}",
        f"landmarks   {_list(found.names)}",
        f"frames      {found.position.shape[0]}, frame rate {rate}",
    ]
    if len(found.individuals) > 1:
        animals, first = _list(found.individuals), found.individuals[0]
        lines.append(f"animals     {animals} (--individual chooses); said of {first}:")
    lines += _describe_spans(found)
    lines += [f"{name:12}{text}" for name, text in found.notes.items()]
    return [*lines, f"next        {_suggest(path, found)}"]


def _list(names: tuple[str, ...]) -> str:
    more = f", … ({len(names)} in all)" if len(names) > _MAX_NAMES else ""
    return ", ".join(names[:_MAX_NAMES]) + more


def _describe_spans(found: Found) -> list[str]:
    """Where the landmarks are, by axis, and how many of them were not seen or are doubted."""
    seen = np.isfinite(found.position).any(axis=2)
    lines = []
    for axis, values in zip("xyz", np.moveaxis(found.position, 2, 0), strict=False):
        if np.isfinite(values).any():
            low, high = np.nanmin(values), np.nanmax(values)
            lines.append(f"{axis:12}{low:.4g} … {high:.4g} [{found.unit}]")
    lines.append(f"seen        {seen.mean():.1%} of places")
    if found.likelihood is not None and seen.any():
        share = np.mean(found.likelihood[seen] < MIN_LIKELIHOOD)
        lines.append(f"doubted     {share:.1%} of them (likelihood below {MIN_LIKELIHOOD:g})")
    return lines


def _suggest(path: Path, found: Found) -> str:
    """The command that measures with these landmarks; those that it needs are to be named."""
    words = ["feeler tracks", quote(path.name)]
    tips = [name if name in found.names else "" for name in ("left_tip", "right_tip")]
    if not all(tips):
        words.append(f"--tips {','.join(tips) if any(tips) else 'LEFT,RIGHT'}")
    if not {"head", "abdomen"} <= {*found.names}:
        words.append("--body HEAD,ABDOMEN")
    if found.frame_rate is None or found.frame_rate <= PLACEHOLDER:
        words.append("--frame-rate RATE")
    if found.position.shape[2] == 3:
        words.append("--plane space")
    if len(found.individuals) > 1 or "animals" in found.notes:
        words.append(f"--individual {quote([*found.individuals, 'NAME'][0])}")
    if len(found.names) < 3:
        words.append(
            f"(which needs a tip, head and abdomen, or three --points; here are {len(found.names)}"
            " landmarks. feeler calibrate --data takes a column frame and how far tips are aside)"
        )
    return " ".join(words)


TRACK_FILES = {
    "tracks": Format(
        words="tracks of landmarks",
        kind="tracks",
        detect=_is_tracks,
        load=_load,
        tell=list,
    ),
}
