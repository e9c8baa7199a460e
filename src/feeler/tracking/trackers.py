"""What trackers write: DeepLabCut, SLEAP, Anipose, movement and ndx-pose, each turned into names,
places and likelihoods.

Text is parsed here; HDF5 and netCDF are opened by the guard, in a process of their own
(:mod:`feeler.tensors.poses`).
"""

import io
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from feeler.errors import InvalidInput
from feeler.files import read_text
from feeler.guard import open_guarded
from feeler.tensors.table import MAX_BYTES, Table, parse_table

HDF5_ENDINGS = (".h5", ".hdf5", ".nc", ".nwb")
PLANES = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}


@dataclass(frozen=True, kw_only=True, eq=False)
class Found:
    """The content of a tracker's file.

    Attributes
    ----------
    position : np.ndarray
        (frame, landmark, axis), as in the file.
    likelihood : np.ndarray | None
        (frame, landmark), where the tracker gives one.
    frame_rate : float | None
        Frames per second, where the file holds it.
    """

    names: tuple[str, ...]
    position: np.ndarray
    likelihood: np.ndarray | None = None
    frame_rate: float | None = None
    software: str = ""
    unit: str = "px"
    notes: dict[str, str] = field(default_factory=dict)


def read_tracker(
    path: str | os.PathLike, individual: str | None, plane: str | None
) -> Found | Table:
    """The file's content; a plain or DLTdv table is handed on as it is."""
    if plane is not None and plane not in PLANES:
        raise InvalidInput(f"unknown plane {plane!r}; valid: {', '.join(PLANES)}.")
    if Path(path).suffix.lower() in HDF5_ENDINGS:
        return _project(_read_hdf5_file(path, individual), plane, Path(path).name)
    text, source = read_text(path, MAX_BYTES), Path(path).name
    if re.match(r"\s*scorer[,;\t]", text):
        return _read_deeplabcut(text, source, individual)
    table = parse_table(text, source=source)
    if any(name.endswith("_ncams") for name in table.columns) and "fnum" in table.columns:
        return _project(_read_anipose(table), plane, source)
    return table


def _read_deeplabcut(text: str, source: str, individual: str | None) -> Found:
    """DeepLabCut's CSV: rows scorer, (individuals,) bodyparts and coords above the numbers."""
    lines = io.StringIO(text)
    rows: list[list[str]] = []
    while not rows or (rows[-1][0] != "coords" and len(rows) < 4):
        rows.append([cell.strip() for cell in re.split("[,;\t]", lines.readline().rstrip("\n"))])
    named = {row[0]: row[1:] for row in rows}
    if not {"bodyparts", "coords"} <= named.keys() or len({len(row) for row in rows}) > 1:
        raise InvalidInput(
            f"{source}: begins like DeepLabCut's CSV but lacks its rows bodyparts and coords."
        )
    header = ",".join(f"c{k}" for k in range(len(rows[0])))
    rest = lines.read()
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
    return _gather(labels, table.values[:, 1:], table.values[:, 0], individual, source)


def _gather(
    labels: Sequence[tuple[str, str, str]],
    values: np.ndarray,
    frame: np.ndarray,
    individual: str | None,
    source: str,
) -> Found:
    """DeepLabCut's columns (individual, body part, coordinate) as landmarks."""
    chosen = _choose(
        list(dict.fromkeys(label[0] for label in labels if label[0] != "single")),
        individual,
        source,
    )
    place = {label[1:]: k for k, label in enumerate(labels) if label[0] in (chosen, "single")}
    parts = tuple(dict.fromkeys(part for part, _ in place))
    if not parts or any((part, axis) not in place for part in parts for axis in "xy"):
        raise InvalidInput(f"{source}: every body part needs its columns x and y.")
    position = values[:, [[place[part, axis] for axis in "xy"] for part in parts]]
    given = all((part, "likelihood") in place for part in parts)
    likelihood = values[:, [place[part, "likelihood"] for part in parts]] if given else None
    _check_frames(frame, source)
    return Found(names=parts, position=position, likelihood=likelihood, software="DeepLabCut")


def _check_frames(frame: np.ndarray, source: str) -> None:
    if not np.all(np.diff(frame) == 1):
        raise InvalidInput(
            f"{source}: frame numbers do not rise one by one; there are frames missing. Fill them"
            " with NaN."
        )


def _choose(individuals: list[str], individual: str | None, source: str) -> str:
    if individual is not None and individual in individuals:
        return individual
    if len(individuals) == 1 and individual is None:
        return individuals[0]
    shown = ", ".join(individuals[:12])
    asked = (
        "holds several individuals" if individual is None else f"has no individual {individual!r}"
    )
    raise InvalidInput(f"{source} {asked}; choose one of {shown} (individual=, or --individual).")


def _read_anipose(table: Table) -> Found:
    """Anipose's pose-3d: NAME_x, _y, _z, _error, _ncams, _score per landmark, then M, center and
    fnum.
    """
    names = tuple(name.removesuffix("_ncams") for name in table.columns if name.endswith("_ncams"))
    _check_frames(table.column("fnum"), table.source)
    position = np.stack([[table.column(f"{name}_{axis}") for axis in "xyz"] for name in names])
    likelihood = np.stack([table.column(f"{name}_score") for name in names], axis=1)
    return Found(
        names=names, position=position.transpose(2, 0, 1), likelihood=likelihood, software="Anipose"
    )


def _project(found: Found, plane: str | None, source: str) -> Found:
    """The two axes of ``plane`` of landmarks in space."""
    if found.position.shape[2] == 2:
        return found
    if plane is None:
        raise InvalidInput(
            f"{source} holds places in space; say onto which plane to look: {', '.join(PLANES)}"
            " (plane=)."
        )
    position = found.position[:, :, list(PLANES[plane])]
    return Found(**{**vars(found), "position": position})


def _read_hdf5_file(path: str | os.PathLike, individual: str | None) -> Found:
    if not Path(path).is_file():
        raise InvalidInput(f"cannot read {path!s}: no such file. Check the path.")
    about, arrays = open_guarded("feeler.tensors.poses:read_poses", path)
    source, kind = Path(path).name, about["kind"]
    if kind == "DeepLabCut":
        labels = [tuple(label) for label in about["labels"]]
        if arrays["values"].ndim != 2 or arrays["values"].shape[1] != len(labels):
            raise InvalidInput(
                f"{source}: {len(labels)} columns are named, the table has shape"
                f" {arrays['values'].shape}."
            )
        return _gather(labels, arrays["values"], arrays["frame"], individual, source)
    position, score = (
        arrays["position"].astype(float),
        arrays.get("likelihood"),
    )  # (individual, frame, landmark, axis)
    n_animals, _, n_points, n_axes = position.shape
    if (n_animals, n_points) != (len(about["individuals"]), len(about["names"])) or n_axes not in (
        2,
        3,
    ):
        raise InvalidInput(f"{source}: its names do not fit places of shape {position.shape}.")
    k = about["individuals"].index(_choose(about["individuals"], individual, source))
    n = about["frames"][k] if "frames" in about else None
    return Found(
        names=tuple(about["names"]),
        position=position[k, :n],
        likelihood=None if score is None else score[k, :n].astype(float),
        unit=about.get("unit", "px"),
        notes={"source": about["sources"][k]} if "sources" in about else {},
        frame_rate=about.get("frame_rate"),
        software=kind,
    )
