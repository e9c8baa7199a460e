"""What the guard's process does with a pose tracker's HDF5 file: SLEAP's, DeepLabCut's or movement's.

It stands here and not in the room of tracking, whose libraries that process would have to load first.
"""

import io
import pickle
from typing import Any

import numpy as np

from feeler.errors import InvalidInput

MAX_LABELS = 2**20  # [C] bytes of a DeepLabCut file's column names


def read_poses(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does with an HDF5 file: which tracker wrote it, its names and arrays."""
    import h5py

    with h5py.File(path, "r") as file:
        if {"tracks", "node_names"} <= file.keys():
            return _take_sleap(file)
        if {"position", "keypoints", "individuals"} <= file.keys():
            return _take_movement(file)
        for group in file.values():
            if isinstance(group, h5py.Group) and "table" in group:
                return _take_deeplabcut(group["table"])
        raise InvalidInput(
            "it is none of SLEAP's analysis (tracks, node_names), DeepLabCut's table, or movement's netCDF; it holds "
            f"{', '.join(list(file)[:8])}. A .slp project must be exported as analysis first."
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
    about["names"], about["individuals"] = ([_decode(v) for v in file[key][:]] for key in ("keypoints", "individuals"))
    if "fps" in file.attrs and np.isfinite(file.attrs["fps"]):
        about["frame_rate"] = float(np.ravel(file.attrs["fps"])[0])
    return about, arrays


class _Plain(pickle.Unpickler):
    """Lists, tuples, texts and numbers: nothing in the file can name anything that would be called."""

    def find_class(self, module: str, name: str) -> Any:
        raise InvalidInput(f"its column names call {module}.{name}; only plain texts are read.")


def _take_deeplabcut(table: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """DeepLabCut's table by pandas: a column of frames and one block of numbers, column names as a pickled list."""
    words = bytes(table.attrs["values_block_0_kind"])
    if len(words) > MAX_LABELS:
        raise InvalidInput(f"its column names take {len(words):,} bytes, more than {MAX_LABELS:,}.")
    labels = _Plain(io.BytesIO(words)).load()
    plain = [["" if len(label) == 3 else str(label[1]), str(label[-2]), str(label[-1])] for label in labels]
    rows = table[:]
    arrays = {"values": rows["values_block_0"].astype(float), "frame": rows["index"].astype(float)}
    return {"kind": "DeepLabCut", "labels": plain}, arrays


def _decode(name: Any) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
