"""What the guard's process does with a pose tracker's HDF5 file: SLEAP's, DeepLabCut's, movement's
or ndx-pose's.

It stands here and not in the room of tracking, whose libraries that process would have to load
first.
"""

import io
import json
import os
import pickle
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from feeler.errors import InvalidInput

TRAINING_LABELS = (
    "these are DeepLabCut training labels (pictures and the places that a person marked in them),"
    " not tracks of a film. analyze_videos writes the tracks."
)
_MAX_LABELS = 2**20  # [C] bytes of a DeepLabCut file's column names


def read_poses(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does with an HDF5 file: which tracker wrote it, its names and
    arrays.
    """
    import h5py

    with h5py.File(path, "r") as file:
        if {"tracks", "node_names"} <= file.keys():
            return _take_sleap(file)
        if "position" in file and any(name in file for name in ("keypoints", "keypoint")):
            return _take_movement(file)
        if "nwb_version" in file.attrs:
            return _take_ndx_pose(file)
        if list(file) == ["tracks"] and file["tracks"].ndim == 4:
            return _take_triangulated(file["tracks"])
        for group in file.values():
            if isinstance(group, h5py.Group) and "table" in group:
                return _take_deeplabcut(group["table"])
        raise InvalidInput(name_hdf5(file))


def name_hdf5(file: Any) -> str:
    """What an open HDF5 file is that holds neither tensors nor tracks, and what to do."""
    if {"metadata", "frames", "instances"} <= file.keys():
        name = os.path.basename(file.filename)
        return (
            "it is a SLEAP project, which holds labels and tracks of whole films. Write its tracks"
            f" with sleap-io: pip install sleap-io; sio convert {name} -o"
            f" {os.path.splitext(name)[0]}.analysis.h5 --to analysis_h5"
        )
    if any("axis0" in group for group in file.values() if hasattr(group, "keys")):
        return (
            "it is a pandas table in fixed form; DeepLabCut keeps training labels so, which are no"
            " tracks. For tracks write it with to_hdf(…, format='table') or to_csv."
        )
    held = [
        f"the group {name}" if hasattr(item, "keys") else f"{name} of shape {item.shape}"
        for name, item in list(file.items())[:8]
    ]
    return (
        "it is HDF5, but neither tensors (netCDF, NWB) nor tracks (SLEAP's analysis, DeepLabCut's"
        f" table, movement, ndx-pose); it holds {', '.join(held) or 'nothing'}."
    )


def _take_sleap(file: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """SLEAP's analysis: tracks (track, axis, node, frame), point_scores (track, node, frame)."""
    names = [_decode(name) for name in file["node_names"][:]]
    tracks = [_decode(name) for name in file["track_names"][:]] if "track_names" in file else []
    position = file["tracks"][:].transpose(0, 3, 2, 1)
    arrays = {"position": np.ascontiguousarray(position)}
    if "point_scores" in file:
        arrays["likelihood"] = np.ascontiguousarray(file["point_scores"][:].transpose(0, 2, 1))
    tracks = tracks or [f"track_{k}" for k in range(len(position))]
    return {"kind": "SLEAP", "names": names, "individuals": tracks}, arrays


def _take_triangulated(tracks: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """sleap-anipose's points in space (frame, track, node, axis), which have no names."""
    n_animals, n_points = tracks.shape[1:3]
    names = [f"pt{k + 1}" for k in range(n_points)]
    animals = [f"track_{k}" for k in range(n_animals)]
    about = {
        "kind": "sleap-anipose",
        "names": names,
        "individuals": animals,
        "unit": "own unit",
    }
    return about, {"position": np.ascontiguousarray(tracks[:].transpose(1, 0, 2, 3))}


def _take_movement(file: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """movement's netCDF: position and confidence with named dims in any order, which older
    versions call keypoints and individuals.
    """
    s = "s" if "keypoints" in file else ""
    wanted = (f"individual{s}", "time", f"keypoint{s}", "space")
    about: dict[str, Any] = {"kind": "movement"}
    arrays = {}
    for name, key in (("position", "position"), ("confidence", "likelihood")):
        if name in file:
            dims = [dim[0].name.rsplit("/", 1)[-1] for dim in file[name].dims]
            order = [dims.index(dim) for dim in wanted if dim in dims]
            arrays[key] = np.ascontiguousarray(file[name][:].transpose(order))
    about["names"], about["individuals"] = (
        [_decode(v) for v in file[key][:]] for key in (wanted[2], wanted[0])
    )
    if "fps" in file.attrs and np.isfinite(file.attrs["fps"]):
        about["frame_rate"] = float(np.ravel(file.attrs["fps"])[0])
    seconds = _decode(file.attrs.get("time_unit", "")) == "seconds"
    if "time" in file and (seconds or "frame_rate" in about):
        arrays["times"] = np.tile(file["time"][:], (len(arrays["position"]), 1))
    return about, arrays


def _take_ndx_pose(file: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """NWB's poses: a PoseEstimation per film, in it a series per landmark with data (frame, axis)
    and confidence (frame,).
    """
    films = _find(file["processing"], "PoseEstimation") if "processing" in file else {}
    series = [_find(film, "PoseEstimationSeries") for film in films.values()]
    titles = list(series[0]) if series else []
    if not titles or any({*one} != {*titles} for one in series):
        raise InvalidInput(
            "it holds no poses (ndx-pose), or other landmarks in each; read its series with pynwb."
        )
    names, titles = _order_landmarks(file, films, titles)
    frames = [min(len(one["data"]) for one in film.values()) for film in series]
    n_axes = max(one["data"].shape[1] for film in series for one in film.values())
    shape = len(films), max(frames), len(titles)
    arrays = {
        "position": np.full((*shape, n_axes), np.nan),
        "likelihood": np.full(shape, np.nan),
    }
    arrays["times"] = np.full(shape[:2], np.nan)
    for k, (film, n) in enumerate(zip(series, frames, strict=True)):
        for j, one in enumerate(film[title] for title in titles):
            place = one["data"][:n] * (1e3 * _read_metres(one) or 1.0)
            arrays["position"][k, :n, j, : place.shape[1]] = place
            if "confidence" in one:
                arrays["likelihood"][k, :n, j] = one["confidence"][:n]
        one = next(iter(film.values()))
        if "timestamps" in one:
            arrays["times"][k, :n] = one["timestamps"][:n]
    first = next(iter(series[0].values()))
    if "starting_time" in first:
        del arrays["times"]
    if np.isnan(arrays["likelihood"]).all():
        del arrays["likelihood"]
    about = {"kind": "ndx-pose", "names": names, "individuals": [*films], "frames": frames}
    about["sources"] = [
        _decode(film["description"][()]) if "description" in film else ""
        for film in films.values()
    ]
    flat = [
        name
        for name, title in zip(names, titles, strict=True)
        if series[0][title]["data"].shape[1] < n_axes
    ]
    about["unit"] = "mm" if _read_metres(first) else "px"
    clock = {}
    if "starting_time" in first:
        clock = {"frame_rate": float(first["starting_time"].attrs["rate"])}
    return {**about, **clock, "flat": flat, "settings": _read_settings(file)}, arrays


def _read_settings(file: Any) -> dict[str, Any]:
    """What feeler measured the poses with, from its notes on data collection and analysis."""
    try:
        settings = json.loads(_decode(file["general/data_collection"][()]))["feeler tracks"]
    except (KeyError, ValueError, TypeError):
        return {}
    return settings if isinstance(settings, dict) else {}


def holds_poses(file: Any) -> bool:
    """Whether an NWB file has a pose estimation with landmarks."""
    films = _find(file["processing"], "PoseEstimation") if "processing" in file else {}
    return any(_find(film, "PoseEstimationSeries") for film in films.values())


def _order_landmarks(file: Any, films: Any, titles: list[str]) -> tuple[list[str], list[str]]:
    """Names of the landmarks, and of their series, in the skeleton's order: HDF5 sorts by name."""
    held = [film["nodes"] for film in films.values() if "nodes" in film]
    held += [one["nodes"] for one in _find(file["processing"], "Skeleton").values()]
    for item in held:
        nodes = [_decode(node) for node in item[:]]
        if {*name_series(nodes)} == {*titles}:
            return nodes, name_series(nodes)
    return titles, titles


def name_series(landmarks: Sequence[str]) -> list[str]:
    """Names that series of NWB may have: no / and no :, and each another one."""
    found: list[str] = []
    for name in landmarks:
        plain = re.sub("[/:]", "_", name)
        while plain in found or (plain != name and plain in landmarks):
            plain += "_"
        found.append(plain)
    return found


def _read_metres(series: Any) -> float:
    """What turns a series into metres; 0 where it is in pixels."""
    held = series["data"].attrs
    return (
        float(held.get("conversion", 1.0))
        if _decode(held.get("unit", "")).lower() in ("meters", "m")
        else 0.0
    )


def _find(group: Any, kind: str) -> dict[str, Any]:
    """The groups of one neurodata type within, by their own names; links are not followed."""
    found: dict[str, Any] = {}

    def look(name: str, item: Any) -> None:
        if _decode(item.attrs.get("neurodata_type", "")) == kind:
            found[name.rsplit("/", 1)[-1]] = item

    group.visititems(look)
    return found


class _Plain(pickle.Unpickler):
    """Lists, tuples, texts and numbers: nothing in the file can name what would be called."""

    def find_class(self, module: str, name: str) -> Any:
        raise InvalidInput(f"its column names call {module}.{name}; only plain texts are read.")


def _take_deeplabcut(table: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """DeepLabCut's table by pandas: a column of frames and one block of numbers, column names as a
    pickled list.
    """
    words = bytes(table.attrs["values_block_0_kind"])
    if len(words) > _MAX_LABELS:
        raise InvalidInput(
            f"its column names take {len(words):,} bytes, more than {_MAX_LABELS:,}."
        )
    labels = _Plain(io.BytesIO(words)).load()
    plain = [
        ["" if len(label) == 3 else str(label[1]), str(label[-2]), str(label[-1])]
        for label in labels
    ]
    rows = table[:]
    if rows["index"].dtype.kind not in "iuf":
        raise InvalidInput(TRAINING_LABELS)
    arrays = {
        "values": rows["values_block_0"].astype(float),
        "frame": rows["index"].astype(float),
    }
    return {"kind": "DeepLabCut", "labels": plain}, arrays


def _decode(name: Any) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
