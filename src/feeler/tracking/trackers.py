"""Files of pose trackers, each turned into names, positions, confidence and times."""

import io
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.files import read_start, read_text
from feeler.sandbox import open_guarded
from feeler.tables import (
    MAX_BYTES,
    TIME_UNITS,
    Heading,
    Table,
    find_heading,
    find_times,
    is_numeral,
    join_lines,
    parse_table,
    split_line,
)
from feeler.tensors.formats import HDF5
from feeler.tensors.readers import TRAINING_LABELS

# The clock of a film: frame rate from times, and frames that a file leaves out.

_MAX_JITTER = 0.35  # [C] of a frame interval, by which a step may be longer or shorter
_MAX_LOST = 2.5  # [C] frames a step in the mean; where more are lost, the interval is not known
_STRETCH, _MAX_CHANGE = 50, 0.05  # [C] frames whose rate may differ by so much from the film's
_MAX_CELLS = 12_000_000  # [C] ~100 MB of numbers
_SLOWEST, _FASTEST = 2.0, 2e4  # [C] frames per second of films of moving animals
_FRAME = re.compile(r"frames?|frame[ _.]?(?:idx|index|no|number|num|nr)|fnum", re.IGNORECASE)


def _count_frames(time: np.ndarray) -> tuple[np.ndarray | None, float, str]:
    """Number of the frame (row,) that each time belongs to, the mean interval in the times' unit,
    and, where the times are of no even clock (then without numbers), what is wrong with them.

    Steps of whole multiples of the interval are frames that were left out.
    """
    steps = np.diff(time)
    if not steps.size or not (np.isfinite(steps) & (steps > 0)).all():
        return None, float("nan"), "its times do not rise"
    # a tenth of the steps is taken to be without a lost frame
    step = float(steps[steps < 1.6 * np.percentile(steps, 10)].mean())
    many = np.maximum(np.round(steps / step), 1)
    interval = float(steps.sum() / many.sum())
    whole = np.round(steps)
    if {*whole} == {1.0, 2.0} and np.abs(steps - whole).max() < 1e-3:
        return None, interval, "its times are whole ms, too coarse for frames 1 or 2 ms apart"
    sparse = many.mean() > _MAX_LOST and many.min() < many.max()
    if sparse or np.abs(steps / interval - many).max() > _MAX_JITTER:
        return None, interval, f"its frames are {steps.min():.4g} to {steps.max():.4g} ms apart"
    frame = np.concatenate([[0.0], np.cumsum(many)])
    n = _STRETCH
    local = (time[n:] - time[:-n]) / (frame[n:] - frame[:-n])
    if local.size and np.abs(local / interval - 1).max() > _MAX_CHANGE:
        slow, fast = 1e3 / local.max(), 1e3 / local.min()
        return None, interval, f"it runs at {slow:.4g} to {fast:.4g} frames/s"
    return frame, interval, ""


def _spread_frames(
    frame: np.ndarray, source: str, *arrays: np.ndarray | None
) -> tuple[list[Any], dict[str, str]]:
    """Arrays (row, …) with a row for each frame of the film, NaN for those that the file leaves
    out, and a note of how many these are.

    Raises
    ------
    InvalidInput
        Frame numbers that do not rise, are no whole numbers, or span too many frames.
    """
    steps = np.diff(frame)
    wrong = ~((steps >= 1) & (steps == np.round(steps)))
    if wrong.any():
        row = int(np.argmax(wrong))
        raise InvalidInput(
            f"{source}: frame numbers must rise, but {frame[row]:g} is followed by"
            f" {frame[row + 1]:g}; there are frames missing, twice or in another order. Sort"
            " them, one row for each frame."
        )
    n = int(frame[-1] - frame[0]) + 1 if frame.size else 0
    if n == frame.size:
        return list(arrays), {}
    cells = n * max(int(np.prod(one.shape[1:])) for one in arrays if one is not None)
    if cells > _MAX_CELLS:
        raise InvalidInput(
            f"{source}: frames {frame[0]:g} to {frame[-1]:g} are {n:,}, of which the file holds"
            f" {frame.size:,}. Split it where frames are left out."
        )
    index = (frame - frame[0]).astype(int)
    full: list[Any] = []
    for one in arrays:
        if one is not None:
            wide = np.full((n, *one.shape[1:]), np.nan)
            wide[index] = one
            one = wide
        full.append(one)
    return full, {"left out": f"{n - frame.size} of {n} frames, which count as not seen"}


_Clock = tuple[np.ndarray | None, float | None, str, str]
"""What a table says of its film's time: the number of each row's frame (row,), where frames or
are given; frames per second, and the column that they were measured from; and why there is no rate
although there are times."""


def _read_clock(table: Table, given: float | None) -> _Clock:
    """Frames and times of a table's columns, such as ``frame``, ``time_s`` or ``Time (ms)``.

    A column ``time`` without a unit is in s or ms, whichever fits the ``given`` frame rate or,
    without one, is the only possible film.
    """
    numbers = next((name for name in table.columns if _FRAME.fullmatch(name)), None)
    frame = None if numbers is None or numbers in table.words else table.column(numbers)
    found = find_times(table.columns)
    if not found:
        return frame, None, "", ""
    column = next((name for name, unit in found.items() if unit), next(iter(found)))
    unit = found[column]
    if column in table.words:
        return frame, None, "", f"column {column!r} holds text"
    time = table.column(column)
    if (falls := np.diff(time) < 0).any():
        k = int(np.argmax(falls))
        raise InvalidInput(
            f"{table.source} line {table.line[k + 1]}: {column} falls from {time[k]:g} to"
            f" {time[k + 1]:g}. Are these several films or animals? Say whose a row is in a column"
            " individual, or give each a file of its own."
        )
    counted, step, wrong = _count_frames(time * TIME_UNITS[unit or "s"])
    if counted is None:
        return frame, None, "", f"{wrong} in column {column!r}"
    if frame is not None:
        step *= counted[-1] / max(frame[-1] - frame[0], 1)
    rate = 1e3 / step
    if not unit:
        options = [rate, 1e3 * rate]
        if given is not None:
            rate = min(options, key=lambda one: abs(np.log(one / given)))
        elif (possible := [one for one in options if _SLOWEST < one <= _FASTEST]) and len(
            possible
        ) == 1:
            rate = possible[0]
        else:
            return counted, None, "", f"column {column!r} has no unit"
        if np.all(np.diff(time) == np.round(np.diff(time))) and abs(step - 1e3) < 1e-6:
            return counted, None, "", f"column {column!r} may count frames or ms"
    return counted if frame is None else frame, rate, f"column {column!r}", ""


# What trackers write: DeepLabCut, SLEAP, Anipose, sleap-anipose, movement and ndx-pose, each
# turned into names, places and likelihoods.
#
# Text is parsed here; HDF5 and netCDF are opened by the guard, in a process of their own
# (:mod:`feeler.tensors.readers`).

PLANES = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2), "space": (0, 1, 2)}
# [C] frames per second; slower than any film of a moving animal. Converters that have not seen the
# film write 1
PLACEHOLDER = 2.0
OWN_UNIT = (
    "own unit"  # of places in space: that of the cameras' calibration, which no file says
)


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """The content of a tracker's file.

    Attributes
    ----------
    position : np.ndarray
        (frame, landmark, axis), two or three axes, as in the file.
    individuals : tuple[str, ...]
        Names of all animals, where the file has names for them.
    likelihood : np.ndarray | None
        (frame, landmark), where the tracker gives one.
    frame_rate : float | None
        Frames per second, where the file holds it.
    timed : str
        Whence the frame rate is measured, where the file holds a time for each frame; empty where
        it is a number that the file claims.
    settings : dict
        What the places were measured with when feeler wrote them.
    """

    names: tuple[str, ...]
    position: np.ndarray
    likelihood: np.ndarray | None = None
    frame_rate: float | None = None
    software: str = ""
    unit: str = "px"
    individuals: tuple[str, ...] = ()
    notes: dict[str, str] = field(default_factory=dict)
    timed: str = ""
    settings: dict[str, Any] = field(default_factory=dict)


def _read_tracker(
    path: str | os.PathLike, individual: str | None, *, first: bool = False
) -> Found | Table:
    """The file's content; a plain or DLTdv table is handed on as it is.

    ``first``: of several animals the first one, where none is named.
    """
    source = Path(path).name
    if read_start(path, len(HDF5)) == HDF5:
        return _read_hdf5_file(path, individual, first)
    text = join_lines(read_text(path, MAX_BYTES))
    if re.match(r"\s*\"?scorer\"?[,;\t]", text):
        return _read_deeplabcut(text, source, individual, first)
    try:
        if found := _read_fictrac(text, source) or _read_motive(text, source):
            return found
    except (InvalidInput, ValueError) as error:
        raise InvalidInput(f"{source}: {error}") from None
    words = (*_LONG["landmark"], *_LONG["animal"])
    heading = find_heading(enumerate(io.StringIO(text), 1), words)
    if heading is not None:
        names = heading.names
        unlike = [  # as pandas does it: name, name.1, …
            f"{name}.{n}" if name and (n := names[:k].count(name)) else name
            for k, name in enumerate(names)
        ]
        heading = replace(heading, names=unlike)
    table = parse_table(text, source=source, words=words, heading=heading)
    if {"track", "frame_idx"} <= {*table.columns} and any(
        name.endswith(".x") for name in table.columns
    ):
        return _read_sleap(table, individual=individual, first=first)
    table = _take_animal(table, individual=individual, first=first)
    if (spread := _spread_long(table)) is not None:
        return spread
    if any(name.endswith("_ncams") for name in table.columns) and "fnum" in table.columns:
        return _read_anipose(table)
    return table


def _read_deeplabcut(text: str, source: str, individual: str | None, first: bool) -> Found:
    """DeepLabCut's CSV: rows scorer, (individuals,) bodyparts and coords above the numbers."""
    lines = io.StringIO(text)
    rows: list[list[str]] = []
    while not rows or (rows[-1][0] != "coords" and len(rows) < 4):
        cells = re.split("[,;\t]", lines.readline().rstrip("\n"))
        rows.append([cell.strip().strip('"') for cell in cells])
    named = {row[0]: row[1:] for row in rows}
    if not {"bodyparts", "coords"} <= named.keys() or len({len(row) for row in rows}) > 1:
        raise InvalidInput(
            f"{source}: begins like DeepLabCut's CSV but lacks its rows bodyparts and coords."
        )
    rest = lines.read()
    if re.match(r"\s*\"?[^,;\t\n]*[^\d\s\".,;\t][^,;\t\n]*[,;\t]", rest):
        raise InvalidInput(f"{source}: {TRAINING_LABELS}")
    table = _parse_numbers(text, len(rows), len(rows[0]), source)
    labels = list(
        zip(
            named.get("individuals", [""] * len(named["coords"])),
            named["bodyparts"],
            named["coords"],
            strict=True,
        )
    )
    return _gather(
        labels,
        table.values[:, 1:],
        table.values[:, 0],
        source,
        individual=individual,
        first=first,
    )


def _parse_numbers(text: str, start: int, n_columns: int, source: str) -> Table:
    """The numbers below line ``start`` of a text whose columns are named in a way of its own."""
    line = text.split("\n", start + 1)[start] if start < text.count("\n") else ""
    names = [f"column {k + 1}" for k in range(n_columns)]
    delimiter = max(",;\t", key=line.count)
    heading = Heading(notes={}, start=start, names=names, delimiter=delimiter)
    return parse_table(text, source=source, heading=heading)


def _gather(
    labels: Sequence[tuple[str, str, str]],
    values: np.ndarray,
    frame: np.ndarray,
    source: str,
    **asked: Any,
) -> Found:
    """DeepLabCut's columns (individual, body part, coordinate) as landmarks."""
    individuals = list(dict.fromkeys(label[0] for label in labels if label[0] != "single"))
    chosen = _choose(individuals or ["single"], source, **asked)
    place = {label[1:]: k for k, label in enumerate(labels) if label[0] in (chosen, "single")}
    parts = tuple(dict.fromkeys(part for part, _ in place))
    axes = "xyz" if any(axis == "z" for _, axis in place) else "xy"
    if not parts or any((part, axis) not in place for part in parts for axis in axes):
        raise InvalidInput(f"{source}: every body part needs its columns {' and '.join(axes)}.")
    position = values[:, [[place[part, axis] for axis in axes] for part in parts]]
    given = all((part, "likelihood") in place for part in parts)
    likelihood = values[:, [place[part, "likelihood"] for part in parts]] if given else None
    (position, likelihood), notes = _spread_frames(frame, source, position, likelihood)
    return Found(
        names=parts,
        position=position,
        likelihood=likelihood,
        software="DeepLabCut",
        unit="px" if axes == "xy" else OWN_UNIT,
        individuals=tuple(name for name in individuals if name),
        notes=notes,
    )


def _choose(
    individuals: list[str], source: str, *, individual: str | None, first: bool = False
) -> str:
    if individual is not None and individual in individuals:
        return individual
    if individual is None and individuals and (first or len(individuals) == 1):
        return individuals[0]
    shown = ", ".join(individuals[:12])
    asked = (
        "holds several individuals"
        if individual is None
        else f"has no individual {individual!r}"
    )
    raise InvalidInput(f"{source} {asked}; choose one of {shown} (individual=).")


def _read_sleap(table: Table, **asked: Any) -> Found:
    """SLEAP's CSV: a row for each animal in each frame, with NAME.x, NAME.y and NAME.score."""
    track = np.array([cell or "track_0" for cell in table.words["track"].tolist()])
    mine = track == _choose([*dict.fromkeys(track.tolist())], table.source, **asked)
    frame = table.column("frame_idx")[mine]
    if not frame.size or np.unique(frame).size < frame.size:
        raise InvalidInput(
            f"{table.source}: every frame of a track needs one row, and no more."
        )
    names = tuple(name[:-2] for name in table.columns if name.endswith(".x"))
    columns = [[f"{name}.{what}" for what in ("x", "y", "score")] for name in names]
    rows = np.array([[table.column(one)[mine] for one in three] for three in columns])
    order = np.argsort(frame)
    (parts,), notes = _spread_frames(
        frame[order], table.source, np.moveaxis(rows, 2, 0)[order].astype(float)
    )
    return Found(
        names=names,
        position=parts[:, :, :2],
        likelihood=parts[:, :, 2],
        software="SLEAP",
        individuals=tuple(dict.fromkeys(track.tolist())),
        notes=notes | ({"first frame": f"{frame.min():g} of the film"} if frame.min() else {}),
    )


def _read_anipose(table: Table) -> Found:
    """Anipose's pose-3d: NAME_x, _y, _z, _error, _ncams, _score per landmark, then M, center and
    fnum.
    """
    names = tuple(
        name.removesuffix("_ncams") for name in table.columns if name.endswith("_ncams")
    )
    position = np.stack([[table.column(f"{name}_{axis}") for axis in "xyz"] for name in names])
    likelihood = np.stack([table.column(f"{name}_score") for name in names], axis=1)
    (position, likelihood), notes = _spread_frames(
        table.column("fnum"), table.source, position.transpose(2, 0, 1), likelihood
    )
    return Found(
        names=names,
        position=position,
        likelihood=likelihood,
        notes=notes,
        software="Anipose",
        unit=OWN_UNIT,
    )


def project(found: Found, plane: str | None, source: str) -> Found:
    """The axes of ``plane`` of landmarks in space.

    Raises
    ------
    InvalidInput
        Places in space and no plane, or a plane that the file cannot have.
    """
    n_axes = found.position.shape[2]
    if n_axes == 2 and plane is not None:
        raise InvalidInput(
            f"{source} holds places in a picture (x, y), which have no plane {plane}. Leave the"
            " plane out."
        )
    if n_axes == 3 and plane is None:
        raise InvalidInput(
            f"{source} holds places in space; say onto which plane to look (xy, xz, yz), or space"
            " for angles between vectors (plane=)."
        )
    return (
        found if plane is None else replace(found, position=found.position[:, :, PLANES[plane]])
    )


def _read_hdf5_file(
    path: str | os.PathLike, individual: str | None, first: bool = False
) -> Found:
    about, arrays = open_guarded("feeler.tensors.readers:read_poses", path)
    source, kind = Path(path).name, about["kind"]
    asked: dict[str, Any] = {"individual": individual, "first": first}
    if kind == "DeepLabCut":
        labels = [tuple(label) for label in about["labels"]]
        if arrays["values"].ndim != 2 or arrays["values"].shape[1] != len(labels):
            raise InvalidInput(
                f"{source}: {len(labels)} columns are named, the table has shape"
                f" {arrays['values'].shape}."
            )
        found = _gather(labels, arrays["values"], arrays["frame"], source, **asked)
        return replace(found, notes=found.notes | about.get("notes", {}))
    position, score = (
        arrays["position"].astype(float),
        arrays.get("likelihood"),
    )  # (individual, frame, landmark, axis)
    n_animals, _, n_points, n_axes = position.shape
    individuals = about["individuals"]
    if (n_animals, n_points) != (len(individuals), len(about["names"])) or n_axes not in (2, 3):
        raise InvalidInput(f"{source}: its names do not fit places of shape {position.shape}.")
    k = individuals.index(_choose(individuals, source, **asked))
    n = about["frames"][k] if "frames" in about else None
    places, scores = position[k, :n], None if score is None else score[k, :n].astype(float)
    notes = {"source": about["sources"][k]} if "sources" in about else {}
    notes |= about.get("notes", {})
    if about.get("flat"):
        notes["without z"] = ", ".join(about["flat"])
    rate, timed = about.get("frame_rate"), ""
    if "times" in arrays:
        frame, step, wrong = _count_frames(np.array(arrays["times"][k, :n], dtype=float) * 1e3)
        if frame is None:
            notes |= {"clock": wrong}
        else:
            (places, scores), more = _spread_frames(frame, source, places, scores)
            notes |= more
            if rate is None:
                rate = 1e3 / step
                timed = "its times" if rate > PLACEHOLDER else ""  # converters count frames so
    return Found(
        names=tuple(about["names"]),
        position=places,
        likelihood=scores,
        unit=about.get("unit", "px") if n_axes == 2 or about.get("unit") == "mm" else OWN_UNIT,
        individuals=tuple(individuals),
        notes=notes,
        frame_rate=rate,
        timed=timed,
        settings=about.get("settings", {}),
        software=kind,
    )


# Columns of landmarks: NAME and axis, in the ways in which programs write them.

# (mm), or _mm at the end
_UNIT = r"(?:(?:[\s_]*[(\[]|[\s_](?=(?:px|pixels?|[mcuµμ]?m)$))(?P<unit>[^)\]]*)[)\]]?)?"
_PATTERNS = (
    re.compile(
        rf"(?P<name>.{{1,200}}?)[_. :/](?P<axis>[xyz]){_UNIT}", re.IGNORECASE
    ),  # head_x, head/X, head_x (mm)
    re.compile(
        rf"(?P<axis>[xyz])#(?P<name>.{{1,200}}?){_UNIT}", re.IGNORECASE
    ),  # TRex's centroids
    re.compile(r"pose(?P<axis>[XY])(?P<name>\d+)"),  # and its points
    re.compile(r"(?P<axis>[xy])(?P<name>\d+)"),  # idtracker.ai
    re.compile(r"(?P<axis>[XY])_(?P<name>.{1,200})"),  # AnimalTA
    re.compile(rf"(?P<name>)(?P<axis>[xyz]){_UNIT}", re.IGNORECASE),  # one place alone
)
SURE = ("confidence", "conf", "likelihood", "score", "probability", "prob")
_ALONE = "body"
LENGTHS = {"mm": 1.0, "cm": 10.0, "m": 1e3, "um": 1e-3, "µm": 1e-3, "μm": 1e-3}
_PIXELS = ("", "px", "pixel", "pixels")


def _find_landmarks(columns: Sequence[str]) -> tuple[dict[tuple[str, str], int], str]:
    """Index of the column of each (landmark, axis), by the first way of writing them that fits at
    least one landmark with x and y, and the unit that it states; without one, what NAME_x fits.

    A centroid of TRex and its points are told by different ways; the points, if any, are taken.
    """
    first: dict[tuple[str, str], int] = {}
    for pattern in (_PATTERNS[0], *_PATTERNS[2:4], _PATTERNS[1], *_PATTERNS[4:]):
        found: dict[tuple[str, str], int] = {}
        units = set()
        for index, column in enumerate(columns):
            if column.startswith("/"):  # a ROS topic
                continue
            if match := pattern.fullmatch(column):
                found.setdefault((match["name"] or _ALONE, match["axis"].upper()), index)
                unit = (match.groupdict().get("unit") or "").strip()
                units.add("" if unit.lower() in _PIXELS else unit)
        names = {name for name, _ in found}
        if any({(name, "X"), (name, "Y")} <= found.keys() for name in names):
            return found, ", ".join(sorted(units))
        first = found if pattern is _PATTERNS[0] else first
    return first, ""


def _find_boxes(table: Table) -> tuple[Table, dict[str, str]]:
    """The table with the middles of Bonsai's rectangles (X, Y, Width, Height) in the place of their
    corners, and a note of it.
    """
    columns = list(table.columns)
    values, boxes = table.values.copy(), []
    for column in columns:
        stem = column[:-2]
        if column.endswith(".X") and {f"{stem}.{one}" for one in ("Y", "Width", "Height")} <= {
            *columns
        }:
            boxes.append(stem)
            for axis, size in (("X", "Width"), ("Y", "Height")):
                place, extent = columns.index(f"{stem}.{axis}"), columns.index(f"{stem}.{size}")
                values[:, place] = values[:, place] + values[:, extent] / 2
    if not boxes:
        return table, {}
    found = Table(**vars(table) | {"values": values})
    return found, {"rectangles": f"the middles of {', '.join(boxes)} are taken"}


def _is_export(start: str) -> bool:
    """Whether a text begins as FicTrac's, Motive's or a long table of landmarks does."""
    cells = split_line(start.split("\n", 1)[0], ",")
    if _FICTRAC[0] <= len(cells) <= _FICTRAC[1] and all(map(is_numeral, cells)):
        return True
    words = {cell.lower() for cell in re.split("[,;\t]", start.split("\n", 1)[0])}
    axes = {word[0] for word in words if _PATTERNS[-1].fullmatch(word)}
    long = {"x", "y"} <= axes and bool(words & {*_LONG["landmark"]})
    return start.startswith("Format Version") or long


# Tables without a heading.


_FICTRAC = (23, 26)  # numbers in a line of FicTrac's, whose names stand in its documentation


def _read_fictrac(text: str, source: str) -> Found | None:
    """FicTrac's output: the body's path on the ball as a landmark ``body``, and one of a ball's
    radius ahead of it, ``ahead``; None where a text is no such.
    """
    first = split_line(text.split("\n", 1)[0], ",")
    if not (_FICTRAC[0] <= len(first) <= _FICTRAC[1] and all(map(is_numeral, first))):
        return None
    rows = _parse_numbers(text, 0, len(first), source).values
    heading = rows[:, 16]
    body = rows[:, 14:16]
    ahead = body + np.stack([np.cos(heading), np.sin(heading)], axis=1)
    (position,), notes = _spread_frames(rows[:, 0], source, np.stack([body, ahead], axis=1))
    counted, step, _ = _count_frames(rows[:, 21])
    return Found(
        names=("body", "ahead"),
        position=position,
        frame_rate=None if counted is None else 1e3 / step,
        timed="" if counted is None else "its timestamps",
        software="FicTrac",
        unit="ball radii",
        notes=notes | {"ahead": "a landmark one ball's radius ahead of the body"},
    )


# Long tables: a row for each landmark in each frame.

_LONG = {
    "landmark": ("keypoint", "keypoints", "bodypart", "bodyparts", "node", "landmark", "part"),
    "animal": ("individual", "individuals", "track", "animal", "id", "trial"),
    "likelihood": SURE,
}


def _take_animal(table: Table, *, individual: str | None, first: bool) -> Table:
    """The rows of one animal or trial, where a column says whose a row is.

    Raises
    ------
    InvalidInput
        Several animals and none chosen, or one chosen that there is not.
    """
    lower = {name.lower(): name for name in reversed(table.columns)}
    owner = next((lower[word] for word in _LONG["animal"] if word in lower), "")
    who = table.words.get(owner, np.zeros(0))
    animals = [*dict.fromkeys(who.tolist())]
    if not owner or len(animals) == who.size:  # none, or numbers of rows
        if individual is not None:
            raise InvalidInput(
                f"{table.source} is a table of one animal; leave individual {individual!r} out."
            )
        return table
    chosen = _choose(animals, table.source, individual=individual, first=first)
    mine, notes = who == chosen, table.notes
    if len(animals) > 1:
        notes = notes | {"animals": f"{', '.join(animals)} ({chosen} taken)"}
    words = {name: texts[mine] for name, texts in table.words.items()}
    return replace(
        table, values=table.values[mine], line=table.line[mine], words=words, notes=notes
    )


def _spread_long(table: Table) -> Table | None:
    """A long table of one animal as one with a row per frame and columns such as NAME_x,
    NAME_y, NAME_likelihood; None where a table is no long one.

    Raises
    ------
    InvalidInput
        A landmark twice in a frame.
    """
    named = {
        what: next((name for name in table.columns if name.lower() in words), "")
        for what, words in _LONG.items()
    }
    ends = [name for name in table.columns if _PATTERNS[-1].fullmatch(name)]
    clocks = [name for name in table.columns if _FRAME.fullmatch(name)]
    clocks += [name for name in find_times(table.columns) if name not in table.words]
    if not (named["landmark"] and clocks and {"x", "y"} <= {name[0].lower() for name in ends}):
        return None
    landmark = table.words[named["landmark"]]
    mine = landmark != ""
    ends += [named["likelihood"]] if named["likelihood"] else []
    order = [*dict.fromkeys(landmark[mine].tolist())]
    clock, first, row = np.unique(
        table.column(clocks[0])[mine], return_index=True, return_inverse=True
    )
    column = np.array([order.index(name) for name in landmark[mine].tolist()], dtype=int)
    _, begin, count = np.unique(
        row * len(order) + column, return_index=True, return_counts=True
    )
    if (count > 1).any():
        k = begin[np.argmax(count > 1)]
        raise InvalidInput(
            f"{table.source}: {order[column[k]]} is there twice at {clocks[0]}"
            f" {clock[row[k]]:g}. Are these several animals? Give them a column individual."
        )
    wide = np.full((clock.size, len(order), len(ends)), np.nan)
    wide[row, column] = np.stack([table.column(name)[mine] for name in ends], axis=1)
    columns = [f"{name}_{end}" for name in order for end in ends]
    return replace(
        table,
        columns=(*clocks, *columns),
        values=np.column_stack(
            [
                *(table.column(name)[mine][first] for name in clocks),
                wide.reshape(clock.size, -1),
            ]
        ),
        line=table.line[mine][first],
        words={},
    )


# Motive.


def _read_motive(text: str, source: str) -> Found | None:
    """Motive's CSV of rigid bodies and markers (``Format Version`` in its first cell): places [mm],
    names and frame rate; None where a text is no such.
    """
    if not text.lstrip("\ufeff").startswith("Format Version"):
        return None
    lines = text.lstrip("\ufeff").split("\n")
    first = [cell.strip() for cell in lines[0].split(",")]
    about = dict(zip(first[::2], first[1::2], strict=False))
    start = next((k for k, line in enumerate(lines[:20]) if line.startswith("Frame,")), None)
    if start is None:
        raise InvalidInput("it begins as Motive's export, but has no line Frame,Time.")
    rows = [[cell.strip().strip('"') for cell in line.split(",")] for line in lines[1:start]]
    axes = [cell.strip() for cell in lines[start].split(",")]
    names = next((row for row in rows if "Name" in row[:2]), None)
    kinds = rows[-1] if rows else None
    if names is None or kinds is None or "Position" not in kinds:
        raise InvalidInput("it is Motive's export without a line Name and a column Position.")
    found = {
        (name, axis): k
        for k, (name, kind, axis) in enumerate(zip(names, kinds, axes, strict=False))
        if kind == "Position" and axis in "XYZ" and axis
    }
    marks = list(dict.fromkeys(name for name, _ in found))
    values = _parse_numbers(text, start + 1, len(axes), source).values
    scale = {"Meters": 1e3, "Centimeters": 10.0}.get(about.get("Length Units", "Meters"), 1.0)
    columns = [[found[name, axis] for axis in "XYZ"] for name in marks]
    (position,), notes = _spread_frames(values[:, 0], source, scale * values[:, columns])
    rate = about.get("Capture Frame Rate")
    return Found(
        names=tuple(marks),
        position=position,
        frame_rate=None if rate is None else float(rate),
        software="Motive",
        unit="mm",
        notes=notes,
    )
