"""What trackers write: DeepLabCut, SLEAP, Anipose, sleap-anipose, movement and ndx-pose, each
turned into names, places and likelihoods.

Text is parsed here; HDF5 and netCDF are opened by the guard, in a process of their own
(:mod:`feeler.tensors.poses`).
"""

import io
import os
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from feeler.disk.files import read_start, read_text
from feeler.disk.guard import open_guarded
from feeler.errors import InvalidInput
from feeler.tensors.heading import split_line
from feeler.tensors.kinds import HDF5
from feeler.tensors.poses import TRAINING_LABELS
from feeler.tensors.table import MAX_BYTES, Table, parse_table
from feeler.tracking.clock import count_frames, spread_frames

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


def read_tracker(
    path: str | os.PathLike, individual: str | None, *, first: bool = False
) -> Found | Table:
    """The file's content; a plain or DLTdv table is handed on as it is.

    ``first``: of several animals the first one, where none is named.
    """
    source = Path(path).name
    if _has_hdf5(path):
        return _read_hdf5_file(path, individual, first)
    text = read_text(path, MAX_BYTES)
    if re.match(r"\s*\"?scorer\"?[,;\t]", text):
        return _read_deeplabcut(text, source, individual, first)
    table = parse_table(text, source=source, words=True)
    if {"track", "frame_idx"} <= {*table.columns}:
        return _read_sleap(table, text, individual=individual, first=first)
    if individual is not None:
        raise InvalidInput(
            f"{source} is a table of one animal; leave individual {individual!r} out."
        )
    if any(name.endswith("_ncams") for name in table.columns) and "fnum" in table.columns:
        return _read_anipose(table)
    return table


def _has_hdf5(path: str | os.PathLike) -> bool:
    """Whether a file is HDF5, by how it begins."""
    try:
        return read_start(path, len(HDF5)) == HDF5
    except InvalidInput:
        return False


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
    header = ",".join(f"c{k}" for k in range(len(rows[0])))
    rest = lines.read()
    if re.match(r"\s*\"?[^,;\t\n]*[^\d\s\".,;\t][^,;\t\n]*[,;\t]", rest):
        raise InvalidInput(f"{source}: {TRAINING_LABELS}")
    delimiter = max(",;\t", key=rest[:1000].count)
    table = parse_table(f"{header.replace(',', delimiter)}\n{rest}", source=source)
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
    (position, likelihood), notes = spread_frames(frame, source, position, likelihood)
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


def _read_sleap(table: Table, text: str, **asked: Any) -> Found:
    """SLEAP's CSV: a row for each animal in each frame, with NAME.x, NAME.y and NAME.score."""
    lines, column = text.split("\n"), table.columns.index("track")
    cells = (split_line(lines[number - 1], ",")[column] for number in table.line)
    track = np.array([cell or "track_0" for cell in cells])
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
    (parts,), notes = spread_frames(
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
    (position, likelihood), notes = spread_frames(
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
    if plane is not None and plane not in PLANES:
        raise InvalidInput(f"unknown plane {plane!r}; valid: {', '.join(PLANES)}.")
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
    about, arrays = open_guarded("feeler.tensors.poses:read_poses", path)
    source, kind = Path(path).name, about["kind"]
    asked: dict[str, Any] = {"individual": individual, "first": first}
    if kind == "DeepLabCut":
        labels = [tuple(label) for label in about["labels"]]
        if arrays["values"].ndim != 2 or arrays["values"].shape[1] != len(labels):
            raise InvalidInput(
                f"{source}: {len(labels)} columns are named, the table has shape"
                f" {arrays['values'].shape}."
            )
        return _gather(labels, arrays["values"], arrays["frame"], source, **asked)
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
    notes, rate, timed = _take_notes(about, k), about.get("frame_rate"), ""
    if "times" in arrays:
        frame, step, wrong = count_frames(np.array(arrays["times"][k, :n], dtype=float) * 1e3)
        if frame is None:
            notes |= {"clock": wrong}
        else:
            (places, scores), more = spread_frames(frame, source, places, scores)
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


def _take_notes(about: Mapping[str, Any], animal: int) -> dict[str, str]:
    """What the file says beside the numbers, and what is odd about it."""
    notes = {"source": about["sources"][animal]} if "sources" in about else {}
    if about.get("flat"):
        notes["without z"] = ", ".join(about["flat"])
    return notes
