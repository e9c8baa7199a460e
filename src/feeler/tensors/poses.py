"""What the guard's process does with a pose tracker's HDF5 file: SLEAP's, DeepLabCut's, movement's
or ndx-pose's.

It stands here and not in the room of tracking, whose libraries that process would have to load
first.
"""

import io
import pickle
from typing import Any

import numpy as np

from feeler.errors import InvalidInput

MAX_LABELS = 2**20  # [C] bytes of a DeepLabCut file's column names


def read_poses(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does with an HDF5 file: which tracker wrote it, its names and
    arrays.
    """
    import h5py

    with h5py.File(path, "r") as file:
        if {"tracks", "node_names"} <= file.keys():
            return _take_sleap(file)
        if {"position", "keypoints", "individuals"} <= file.keys():
            return _take_movement(file)
        if "nwb_version" in file.attrs:
            return _take_ndx_pose(file)
        for group in file.values():
            if isinstance(group, h5py.Group) and "table" in group:
                return _take_deeplabcut(group["table"])
        raise InvalidInput(
            "it is none of SLEAP's analysis (tracks, node_names), DeepLabCut's table, movement's"
            f" netCDF, or NWB; it holds {', '.join(list(file)[:8])}. A .slp project must be"
            " exported as analysis first."
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


def _take_movement(file: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """movement's netCDF: position and confidence with named dims in any order."""
    wanted = ("individuals", "time", "keypoints", "space")
    about: dict[str, Any] = {"kind": "movement"}
    arrays = {}
    for name, key in (("position", "position"), ("confidence", "likelihood")):
        if name in file:
            dims = [dim[0].name.rsplit("/", 1)[-1] for dim in file[name].dims]
            order = [dims.index(dim) for dim in wanted if dim in dims]
            arrays[key] = np.ascontiguousarray(file[name][:].transpose(order))
    about["names"], about["individuals"] = (
        [_decode(v) for v in file[key][:]] for key in ("keypoints", "individuals")
    )
    if "fps" in file.attrs and np.isfinite(file.attrs["fps"]):
        about["frame_rate"] = float(np.ravel(file.attrs["fps"])[0])
    return about, arrays


def _take_ndx_pose(file: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """NWB's poses: a PoseEstimation per film, in it a series per landmark with data (frame, axis)
    and confidence (frame,).
    """
    films = _find(file["processing"], "PoseEstimation") if "processing" in file else {}
    series = [_find(film, "PoseEstimationSeries") for film in films.values()]
    names = list(series[0]) if series else []
    for skeleton in _find(file["processing"], "Skeleton").values() if names else ():
        nodes = [_decode(node) for node in skeleton["nodes"][:]]
        names = (
            nodes if {*nodes} == {*names} else names
        )  # HDF5 sorts by name, a skeleton holds the order
    if not names or any({*one} != {*names} for one in series):
        raise InvalidInput(
            "it holds no poses (ndx-pose), or other landmarks in each; read its series with pynwb."
        )
    frames = [min(len(one["data"]) for one in film.values()) for film in series]
    shape = len(films), max(frames), len(names)
    arrays = {
        "position": np.full((*shape, series[0][names[0]]["data"].shape[1]), np.nan),
        "likelihood": np.ones(shape),
    }
    for k, (film, n) in enumerate(zip(series, frames, strict=True)):
        for j, one in enumerate(film[name] for name in names):
            arrays["position"][k, :n, j] = one["data"][:n] * (1e3 * _read_metres(one) or 1.0)
            if "confidence" in one:
                arrays["likelihood"][k, :n, j] = one["confidence"][:n]
    first = next(iter(series[0].values()))
    about = {"kind": "ndx-pose", "names": names, "individuals": [*films], "frames": frames}
    about["sources"] = [
        _decode(film["description"][()]) if "description" in film else "" for film in films.values()
    ]
    about["unit"] = "mm" if _read_metres(first) else "px"
    rate = (
        first["starting_time"].attrs["rate"]
        if "starting_time" in first
        else 1 / np.diff(first["timestamps"][:2])[0]
    )
    return {**about, "frame_rate": float(rate)}, arrays


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
    if len(words) > MAX_LABELS:
        raise InvalidInput(f"its column names take {len(words):,} bytes, more than {MAX_LABELS:,}.")
    labels = _Plain(io.BytesIO(words)).load()
    plain = [
        ["" if len(label) == 3 else str(label[1]), str(label[-2]), str(label[-1])]
        for label in labels
    ]
    rows = table[:]
    arrays = {"values": rows["values_block_0"].astype(float), "frame": rows["index"].astype(float)}
    return {"kind": "DeepLabCut", "labels": plain}, arrays


def _decode(name: Any) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
