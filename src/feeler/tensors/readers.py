"""Readers of foreign binary files, which run in the sandbox."""

import io
import json
import os
import pickle
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from feeler.errors import InvalidInput

# What the guard's process does with each kind of file: opened by its library, given as JSON and
# arrays.
#
# The JSON is what :func:`feeler.tensors.writers.describe` writes. Nothing is imported before its
# kind of file is read.

_MAX_MEMBERS = 10_000
DESCRIPTION = "feeler_description"
_NO_TENSORS = "this NWB file holds no tensors by feeler."
_POSES = "Poses are read by feeler tracks, other series with pynwb."
_NO_POSES = "It holds no poses (ndx-pose) either; read its series with pynwb."
_Answer = tuple[dict[str, Any], dict[str, Any]]
_TEXT = "OSTU"  # kinds of types
_PACKED = ("scale_factor", "add_offset")  # CF: number = offset + scale * whole number


def read_hdf5(path: str) -> _Answer:
    """NetCDF-4, or NWB that feeler wrote."""
    import h5py

    file = h5py.File(path, "r")
    if "nwb_version" in file.attrs and "notes" not in file.get("general", ()):
        films = _find(file["processing"], "PoseEstimation") if "processing" in file else {}
        posed = any(_find(film, "PoseEstimationSeries") for film in films.values())
        raise InvalidInput(f"{_NO_TENSORS} {_POSES if posed else _NO_POSES}")
    _refuse_links(file, set())
    if "nwb_version" in file.attrs:
        return _read_nwb(file)
    description = file.attrs.get(DESCRIPTION)
    arrays = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset)}
    content = json.loads(description) if isinstance(description, str) else {}
    if not _describes(content, arrays):
        return _read_netcdf(file, arrays)
    for name, entry in content["variables"].items():
        # another program may have changed their order or words
        if "texts" in entry and h5py.check_string_dtype(arrays[name].dtype):
            entry["texts"] = arrays[name].asstr(errors="replace")[...].ravel().tolist()
    return content, {name: item for name, item in arrays.items() if item.dtype.kind in "biuf"}


def _describes(content: dict[str, Any], arrays: dict[str, Any]) -> bool:
    """Whether a description is that of these arrays, and not of those that another program had
    before it cut, turned, packed or converted them.
    """
    packed = any({*_PACKED} & {*item.attrs} for item in arrays.values())
    bare = b"This is a netCDF dimension but not a netCDF variable"
    own = {
        name: (item.shape, _plain(item.attrs.get("units", "")))
        for name, item in arrays.items()
        if not item.attrs.get("NAME", b"").startswith(bare)
    }
    return not packed and own == {
        name: (tuple(entry["shape"]), entry["attributes"].get("units", ""))
        for name, entry in content.get("variables", {}).items()
    }


def _refuse_links(group: Any, seen: set[int]) -> None:
    """Raise on whatever leads out of the file, or round in a circle without end."""
    import h5py

    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise InvalidInput(
                f"the entry {name[:60]!r} is a link; only data inside the file are read."
            )
        item = group[name]
        if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
            raise InvalidInput(
                f"the numbers of {name[:60]!r} lie in another file; only data inside the file are"
                " read."
            )
        place = h5py.h5o.get_info(item.id).addr
        if len(seen) > _MAX_MEMBERS:
            raise InvalidInput(f"it holds more than {_MAX_MEMBERS:,} objects.")
        if isinstance(item, h5py.Group) and place not in seen:
            seen.add(place)
            _refuse_links(item, seen)


def _read_netcdf(file: Any, arrays: dict[str, Any]) -> _Answer:
    """A NetCDF-4 file of somebody else: dims and attributes as h5netcdf understands them."""
    import h5netcdf
    import h5py

    try:
        data = h5netcdf.File(file, "r")
        dims = {name: item.dimensions for name, item in data.variables.items()}
    except ValueError as error:  # arrays without dimensions are HDF5, not netCDF
        raise InvalidInput(_name_hdf5(file)) from error
    if not dims:
        raise InvalidInput(_name_hdf5(file))
    texts = {name for name, item in arrays.items() if h5py.check_string_dtype(item.dtype)}
    values = {
        name: arrays[name].asstr(errors="replace")[...] if name in texts else arrays[name]
        for name in dims
    }
    for name in texts:
        if dims[name][-1:] and dims[name][-1].startswith("string"):  # a dim of characters
            rows = values[name].reshape(-1, values[name].shape[-1]).tolist()
            whole = np.array(["".join(row) for row in rows], dtype=object)
            dims[name], values[name] = dims[name][:-1], whole.reshape(values[name].shape[:-1])
    return _gather(
        {name: (values[name], dims[name], data.variables[name].attrs) for name in dims},
        data.attrs,
    )


def _read_nwb(file: Any) -> _Answer:
    """The series of an NWB file by feeler, cut into trials as the description in its notes says; up
    to 0.3 each trial had its own.
    """
    try:
        content = json.loads(file["general/notes"].asstr()[()])
        numbers, series = content["numbers"], content["series"]
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise InvalidInput(f"{_NO_TENSORS} {_NO_POSES}") from error
    arrays = _read_numbers(numbers, content["rest"]["variables"])
    for name, kind in series.items():
        held = file["acquisition"]
        if name in held:
            n_trials, n_times = len(file["intervals/trials/id"]), arrays["time"].size
            values = held[name]["data"][: n_trials * n_times]
            values = values.reshape(n_trials, n_times, *values.shape[1:])
        else:
            titles = sorted(title for title in held if title.rpartition("_")[0] == name)
            values = np.stack([held[title]["data"][...] for title in titles])
        order = [
            "trial",
            "time",
            *(dim for dim in kind["dims"] if dim not in ("trial", "time")),
        ]
        arrays[name] = values.transpose([order.index(dim) for dim in kind["dims"]])
        content["rest"]["variables"][name] = _describe(
            arrays[name], kind["dims"], kind["attributes"]
        )
    if "units" in file:
        found = _read_units(file, float(arrays["time"][0]), int(content.get("events", 1)))
        arrays["spike_time"] = found
        content["rest"]["variables"]["spike_time"] = _describe(
            found, ["trial", "unit", "event"], {"units": "ms"}
        )
    return content["rest"], arrays


def _read_numbers(numbers: dict[str, Any], variables: dict[str, Any]) -> dict[str, np.ndarray]:
    """Arrays of what JSON holds, with NaN and infinities as words."""
    return {
        name: np.array(
            [float(x) if isinstance(x, str) else x for x in values],
            np.uint64 if variables[name]["type"].endswith("u8") else None,  # none is rounded
        )
        for name, values in numbers.items()
    }


def _read_units(file: Any, first: float, n_events: int) -> Any:
    """Trains (trial, unit, event) [ms] from a table of units on the session's clock."""
    starts = file["intervals/trials/start_time"][...]
    ends = file["units/spike_times_index"][...]
    trains = np.split(file["units/spike_times"][...], ends[:-1])
    owners = [np.searchsorted(starts, train + 0.5) - 1 for train in trains]  # half of nwb.PAUSE
    counts = np.array([np.bincount(owner, minlength=starts.size) for owner in owners])
    found = np.full((starts.size, len(trains), max(n_events, int(counts.max()))), np.nan)
    for unit, (train, owner, many) in enumerate(zip(trains, owners, counts, strict=True)):
        place = np.arange(train.size) - np.repeat(np.cumsum(many) - many, many)
        found[owner, unit, place] = (train - starts[owner]) * 1e3 + first
    return found


def read_zarr(path: str) -> _Answer:
    """A plain Zarr v3 group, as xarray's ``to_zarr`` writes it."""
    import zarr

    for folder, names, files in os.walk(path):
        for name in (*names, *files):
            if os.path.islink(os.path.join(folder, name)):
                raise InvalidInput(
                    f"{name} is a symbolic link; inside a group they are refused. Copy the data in."
                )
    if any(
        (Path(path) / name).exists() for name in (".zgroup", ".zattrs", ".zmetadata", ".zarray")
    ):
        raise InvalidInput(
            "is Zarr v2, which may hold pickles and is not read. Open it with xarray, and write it"
            " again: dataset.to_zarr(path, zarr_format=3)."
        )
    group = zarr.open_group(path, mode="r", zarr_format=3, use_consolidated=False)
    held = {
        name: (
            item[...] if item.dtype.kind in _TEXT else item,
            getattr(item.metadata, "dimension_names", None) or (),
            item.attrs.asdict(),
        )
        for name, item in group.arrays()
    }
    return _gather(held, group.attrs.asdict())


def read_mat(path: str) -> _Answer:
    """A MATLAB file (version 5 to 7) that feeler wrote, or MATLAB wrote again."""
    from scipy.io import loadmat, whosmat

    plain = (
        "double",
        "single",
        "char",
        "logical",
        *(f"{sign}int{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)),
    )
    names = [name for name, _, kind in whosmat(path) if kind in plain]
    if DESCRIPTION not in names:
        raise InvalidInput(
            f"it has no {DESCRIPTION}, so what its variables ({', '.join(names[:8]) or 'none'})"
            " mean is unknown. Recordings are read from CSV."
        )
    values = loadmat(path, variable_names=names, chars_as_strings=True)
    content = json.loads(str(values.pop(DESCRIPTION)[0]))
    for name, entry in content["variables"].items():
        found = [text.rstrip() for text in np.ravel(values.get(name, [])).astype(str).tolist()]
        if len(known := entry.get("texts", [])) == len(found) and found != [
            text.rstrip() for text in known
        ]:
            entry["texts"] = found  # MATLAB has put them in another order, or changed them
    return content, {
        name: values[name]
        for name in names
        if name in values and values[name].dtype.kind in "biuf"
    }


def read_parquet(path: str) -> _Answer:
    """Touches that feeler wrote as Parquet, one a row."""
    from pyarrow import types
    from pyarrow.parquet import ParquetFile

    file = ParquetFile(path)
    notes = file.schema_arrow.metadata or {}
    if b"PANDAS_ATTRS" in notes:  # which pandas keeps, and writes again
        notes = {k.encode(): v for k, v in json.loads(notes[b"PANDAS_ATTRS"]).items()}
    if DESCRIPTION.encode() not in notes:
        names = ", ".join(file.schema_arrow.names[:8])
        raise InvalidInput(
            f"it has no {DESCRIPTION}, so what its columns ({names or 'none'}) mean is unknown."
            " Recordings are read from CSV. Programs other than pandas drop it as they write."
        )
    content = json.loads(notes[DESCRIPTION.encode()])
    variables = content["rest"]["variables"]
    arrays = _read_numbers(content["numbers"], variables)
    for name, entry in content["columns"].items():
        if name not in file.schema_arrow.names:
            raise InvalidInput(f"the column {name[:60]!r} is missing.")
        column = file.read([name], use_threads=False).column(0)
        if column.null_count:
            raise InvalidInput(f"the column {name[:60]!r} has empty cells.")
        column = column.combine_chunks()
        while types.is_nested(column.type):
            column = column.flatten()
        entry["shape"][0] = file.metadata.num_rows
        if entry["type"] == "str":
            entry["texts"] = column.to_pylist()
        else:
            arrays[name] = column.to_numpy(zero_copy_only=False)
        variables[name] = entry
    return content["rest"], arrays


def read_safetensors(path: str) -> _Answer:
    """A model: its notes, and its arrays."""
    from safetensors import safe_open

    with safe_open(path, framework="numpy") as file:
        names = list(file.keys())
        return dict(file.metadata() or {}), {name: file.get_tensor(name) for name in names}


def _describe(values: Any, dims: Any, attributes: Any) -> dict[str, Any]:
    """One entry of the JSON; texts stand in it themselves."""
    text = values.dtype.kind in _TEXT
    entry = {
        "dims": list(dims),
        "shape": list(map(int, values.shape)),
        "type": "str" if text else values.dtype.str,
    }
    plain = {
        name: _plain(value)
        for name, value in dict(attributes).items()
        if not name.startswith("_")
    }
    plain.pop("coordinates", None)
    return (
        entry
        | {"attributes": plain}
        | ({"texts": [str(x) for x in values.ravel()]} if text else {})
    )


def _plain(value: Any) -> Any:
    """An attribute in JSON's types."""
    value = value.tolist() if hasattr(value, "tolist") else value
    value = value[0] if isinstance(value, list) and len(value) == 1 else value
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


def _unpack(values: Any, dims: Any, attributes: Any) -> tuple[Any, Any, Any]:
    """The numbers that whole ones stand for; as they are where nothing is packed."""
    about = dict(attributes)
    scale, offset = (about.pop(name, None) for name in _PACKED)
    if scale is None and offset is None:
        return values, dims, attributes
    whole = values[...]
    found = whole * float(1 if scale is None else scale) + float(offset or 0)
    return np.where(whole == about.get("_FillValue"), np.nan, found), dims, about


def _gather(held: dict[str, tuple[Any, Any, Any]], attributes: Any) -> _Answer:
    """The whole JSON, and the numbers, of variables with their dims and attributes; a coordinate is
    what is called one, or has the name of its dim.
    """
    held = {name: _unpack(*parts) for name, parts in held.items()}
    variables = {name: _describe(*parts) for name, parts in held.items()}
    owners = [attributes, *(own for *_, own in held.values())]
    named = {name for one in owners for name in str(one.get("coordinates", "")).split()}
    for name, entry in variables.items():
        entry["coordinate"] = name in named or entry["dims"] == [name]
    plain = {
        name: _plain(value)
        for name, value in dict(attributes).items()
        if name not in ("coordinates", DESCRIPTION)
    }
    numbers = {name: parts[0] for name, parts in held.items() if "texts" not in variables[name]}
    return {"variables": variables, "attributes": plain}, numbers


# What the guard's process does with a pose tracker's HDF5 file: SLEAP's, DeepLabCut's,
# movement's or ndx-pose's.
#
# It stands here and not in the room of tracking, whose libraries that process would have to
# load first.

TRAINING_LABELS = (
    "these are DeepLabCut training labels (pictures and the places that a person marked in them),"
    " not tracks of a film. analyze_videos writes the tracks."
)
_OTHER_COLUMNS = (
    "it is a pandas table whose columns are not DeepLabCut's (scorer, bodyparts, coords)."
    " Write it with to_csv, with columns NAME_x and NAME_y."
)
_MAX_PLACES = 6_000_000  # [C] of landmarks in all frames
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
        if list(file) == ["tracks"] and getattr(file["tracks"], "ndim", 0) == 4:
            return _take_triangulated(file["tracks"])
        if getattr(file.get("trajectories"), "ndim", 0) == 3:
            return _take_idtracker(file)
        if {"metadata", "frames", "instances", "tracks_json"} <= file.keys():
            return _take_sleap_project(file)
        tables = {
            name: group
            for name, group in file.items()
            if isinstance(group, h5py.Group) and ("table" in group or "axis0_label0" in group)
        }
        for name, group in tables.items():
            if "table" in group:
                about, arrays = _take_deeplabcut(group["table"])
            else:
                about, arrays = _take_fixed(group)
            if others := [other for other in tables if other != name]:
                about["notes"] = {
                    "dataset": f"{name} taken; the file also holds {', '.join(others)}"
                }
            return about, arrays
        raise InvalidInput(_name_hdf5(file))


def _name_hdf5(file: Any) -> str:
    """What an open HDF5 file is that holds neither tensors nor tracks, and what to do."""
    if {"metadata", "frames", "instances"} <= file.keys():
        name = os.path.basename(file.filename)
        stem = os.path.splitext(name)[0]
        return (
            "it is a SLEAP project of another make than is read. Write its tracks with sleap-io:"
            f" pip install sleap-io; sio convert {name} -o {stem}.analysis.h5 --to analysis_h5"
        )
    if any("axis0" in group for group in file.values() if hasattr(group, "keys")):
        return _OTHER_COLUMNS
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
    try:  # what feeler measured the poses with
        settings = json.loads(_decode(file["general/data_collection"][()]))["feeler tracks"]
    except (KeyError, ValueError, TypeError):
        settings = {}
    settings = settings if isinstance(settings, dict) else {}
    return {**about, **clock, "flat": flat, "settings": settings}, arrays


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
    labels = [
        tuple(one) if isinstance(one, (tuple, list)) else ("", *str(one).rpartition("_")[::2])
        for one in _Plain(io.BytesIO(words)).load()
    ]
    if any(len(label) < 3 for label in labels) or "x" not in {label[-1] for label in labels}:
        raise InvalidInput(_OTHER_COLUMNS)
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


def _take_fixed(group: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """DeepLabCut's table in pandas' fixed form: levels and codes of the column names, and blocks of
    numbers.
    """
    depth = int(group.attrs["axis0_nlevels"])
    levels = [[_decode(one) for one in group[f"axis0_level{k}"][...]] for k in range(depth)]
    codes = [group[f"axis0_label{k}"][...].astype(int) for k in range(depth)]
    if any(level and level[0].startswith("\x80") for level in levels):
        raise InvalidInput(
            "its column names are pickled, which is not read. Write it with to_csv."
        )
    names = list(
        zip(
            *([level[c] for c in code] for level, code in zip(levels, codes, strict=True)),
            strict=True,
        )
    )
    if depth < 3 or "x" not in levels[-1]:
        raise InvalidInput(_OTHER_COLUMNS)
    if "axis1" not in group or group["axis1"].dtype.kind not in "iuf":
        raise InvalidInput(TRAINING_LABELS)
    values = np.full((group["axis1"].shape[0], len(names)), np.nan)
    for k in range(int(group.attrs["nblocks"])):
        owners = [group[f"block{k}_items_label{n}"][...].astype(int) for n in range(depth)]
        items = [
            [_decode(one) for one in group[f"block{k}_items_level{n}"][...]]
            for n in range(depth)
        ]
        block = group[f"block{k}_values"][...]
        for column, place in enumerate(zip(*owners, strict=True)):
            name = tuple(items[n][c] for n, c in enumerate(place))
            values[:, names.index(name)] = block[:, column]
    plain = [["" if depth == 3 else name[1], name[-2], name[-1]] for name in names]
    return {"kind": "DeepLabCut", "labels": plain}, {
        "values": values,
        "frame": group["axis1"][...].astype(float),
    }


def _take_idtracker(file: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """idtracker.ai's trajectories (frame, animal, axis), one place for each animal."""
    places = file["trajectories"][...].astype(float)
    arrays = {"position": places.transpose(1, 0, 2)[:, :, None, :]}
    about: dict[str, Any] = {"kind": "idtracker.ai", "names": ["body"]}
    about["individuals"] = [str(k + 1) for k in range(places.shape[1])]
    if "frames_per_second" in file.attrs:
        about["frame_rate"] = float(file.attrs["frames_per_second"])
    return about, arrays


def _take_sleap_project(file: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """A SLEAP project of one film: its predictions, or, in frames without them, its labels."""
    about = json.loads(file["metadata"].attrs["json"])
    skeleton = about["skeletons"][0]
    skeleton = skeleton.get("nx_graph", skeleton)
    names = [about["nodes"][int(node["id"])]["name"] for node in skeleton["nodes"]]
    animals = [json.loads(one)[1] for one in file["tracks_json"][...]] or ["track_0"]
    frames, instances = file["frames"][...], file["instances"][...]
    if len({*frames["video"].tolist()}) > 1:
        raise InvalidInput(
            "it is a SLEAP project of several films; write each one's tracks with sleap-io:"
            f" sio convert {os.path.basename(file.filename)} -o NAME.analysis.h5 --to analysis_h5"
        )
    first = int(frames["frame_idx"].min()) if frames.size else 0
    n = int(frames["frame_idx"].max()) - first + 1 if frames.size else 0
    if n * len(names) * len(animals) > _MAX_PLACES:
        raise InvalidInput(f"its {n:,} frames of {len(animals)} animals are too many at once.")
    position = np.full((len(animals), n, len(names), 2), np.nan)
    likelihood = np.full(position.shape[:3], np.nan)
    half = 0.5 if float(file["metadata"].attrs["format_id"]) < 1.1 else 0.0
    points = {0: file["points"][...], 1: file["pred_points"][...]}
    for frame in frames:
        own = instances[int(frame["instance_id_start"]) : int(frame["instance_id_end"])]
        for one in sorted(own, key=lambda one: -int(one["instance_type"])):
            animal = int(one["track"]) if one["track"] >= 0 else 0
            if animal >= len(animals):
                raise InvalidInput("an instance is of a track that the project does not name.")
            kind = int(one["instance_type"])
            place = points[kind][int(one["point_id_start"]) : int(one["point_id_end"])]
            row = int(frame["frame_idx"]) - first
            seen = place["visible"].astype(bool)
            position[animal, row, : len(place)][seen, 0] = place["x"][seen] - half
            position[animal, row, : len(place)][seen, 1] = place["y"][seen] - half
            sure = place["score"] if kind else np.ones(len(place))
            likelihood[animal, row, : len(place)] = np.where(seen, sure, np.nan)
    found: dict[str, Any] = {
        "kind": "SLEAP",
        "names": names,
        "individuals": animals,
        "frames": [n] * len(animals),
    }
    if first:
        found["notes"] = {"first frame": f"{first} of the film"}
    return found, {"position": position, "likelihood": likelihood}


def _decode(name: Any) -> str:
    return name.decode("utf-8", "replace") if isinstance(name, bytes) else str(name)
