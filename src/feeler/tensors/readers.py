"""What the guard's process does with each kind of file: opened by its library, given as JSON and
arrays.

The JSON is what :func:`feeler.tensors.plain.describe` writes. Nothing is imported before its kind
of file is read.
"""

import json
import os
from pathlib import Path
from typing import Any

from feeler.errors import InvalidInput

_MAX_MEMBERS = 10_000
DESCRIPTION = "feeler_description"
_NO_TENSORS = "this NWB file holds no tensors by feeler."
_POSES = "Poses are read by feeler tracks, other series with pynwb."
_NO_POSES = "It holds no poses (ndx-pose) either; read its series with pynwb."
_Answer = tuple[dict[str, Any], dict[str, Any]]


def read_hdf5(path: str) -> _Answer:
    """NetCDF-4, or NWB that feeler wrote."""
    import h5py

    file = h5py.File(path, "r")
    if "nwb_version" in file.attrs and "notes" not in file.get("general", ()):
        from feeler.tensors.poses import holds_poses

        raise InvalidInput(f"{_NO_TENSORS} {_POSES if holds_poses(file) else _NO_POSES}")
    _refuse_links(file, set())
    if "nwb_version" in file.attrs:
        return _read_nwb(file)
    description = file.attrs.get(DESCRIPTION)
    arrays = {name: item for name, item in file.items() if isinstance(item, h5py.Dataset)}
    if isinstance(description, str):
        content = json.loads(description)
        return content, {
            name: item for name, item in arrays.items() if item.dtype.kind in "biuf"
        }
    return _read_netcdf(file, arrays)


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

    from feeler.tensors.poses import name_hdf5

    try:
        data = h5netcdf.File(file, "r")
        dims = {name: item.dimensions for name, item in data.variables.items()}
    except ValueError as error:  # arrays without dimensions are HDF5, not netCDF
        raise InvalidInput(name_hdf5(file)) from error
    if not dims:
        raise InvalidInput(name_hdf5(file))
    named = set(str(data.attrs.get("coordinates", "")).split())
    variables, numbers = {}, {}
    for name, item in data.variables.items():
        named |= set(str(item.attrs.get("coordinates", "")).split())
        text = h5py.check_string_dtype(arrays[name].dtype)
        values = arrays[name].asstr(errors="replace")[...] if text else arrays[name]
        variables[name] = _describe(values, dims[name], item.attrs)
        if not text:
            numbers[name] = values
    return _mark(variables, named, data.attrs), numbers


def _read_nwb(file: Any) -> _Answer:
    """The series of an NWB file by feeler, stacked as the description in its notes says."""
    import numpy as np

    try:
        content = json.loads(file["general/notes"].asstr()[()])
        numbers, series = content["numbers"], content["series"]
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise InvalidInput(f"{_NO_TENSORS} {_NO_POSES}") from error
    arrays = {
        name: np.array([float(x) if isinstance(x, str) else x for x in item])
        for name, item in numbers.items()
    }
    for name, kind in series.items():
        titles = sorted(
            title for title in file["acquisition"] if title.rpartition("_")[0] == name
        )
        values = np.stack([file["acquisition"][title]["data"][...] for title in titles])
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
        found = _read_units(file, float(arrays["time"][0]))
        arrays["spike_time"] = found
        content["rest"]["variables"]["spike_time"] = _describe(
            found, ["trial", "unit", "event"], {"units": "ms"}
        )
    return content["rest"], arrays


def _read_units(file: Any, first: float) -> Any:
    """Trains (trial, unit, event) [ms] from a table of units on the session's clock."""
    import numpy as np

    starts = file["intervals/trials/start_time"][...]
    ends = file["units/spike_times_index"][...]
    trains = np.split(file["units/spike_times"][...], ends[:-1])
    owners = [np.searchsorted(starts, train + 0.5) - 1 for train in trains]  # half of nwb.PAUSE
    counts = np.array([np.bincount(owner, minlength=starts.size) for owner in owners])
    found = np.full((starts.size, len(trains), max(1, int(counts.max()))), np.nan)
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
    attributes = group.attrs.asdict()
    named = set(str(attributes.pop("coordinates", "")).split())
    variables, arrays = {}, {}
    for name, item in group.arrays():
        own = item.attrs.asdict()
        named |= set(str(own.get("coordinates", "")).split())
        text = item.dtype.kind not in "biuf"
        values = item[...] if text else item
        variables[name] = _describe(
            values, getattr(item.metadata, "dimension_names", None) or (), own
        )
        if not text:
            arrays[name] = item
    return _mark(variables, named, attributes), arrays


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
    return content, {
        name: values[name]
        for name in names
        if name in values and values[name].dtype.kind in "biuf"
    }


def read_safetensors(path: str) -> _Answer:
    """A model: its notes, and its arrays."""
    from safetensors import safe_open

    with safe_open(path, framework="numpy") as file:
        names = list(file.keys())
        return dict(file.metadata() or {}), {name: file.get_tensor(name) for name in names}


def _describe(values: Any, dims: Any, attributes: Any) -> dict[str, Any]:
    """One entry of the JSON; texts stand in it themselves."""
    text = values.dtype.kind not in "biuf"
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


def _mark(variables: dict[str, Any], named: set[str], attributes: Any) -> dict[str, Any]:
    """The whole JSON; a coordinate is what is called one, or has the name of its dim."""
    for name, entry in variables.items():
        entry["coordinate"] = name in named or entry["dims"] == [name]
    plain = {
        name: _plain(value) for name, value in dict(attributes).items() if name != "coordinates"
    }
    return {"variables": variables, "attributes": plain}
