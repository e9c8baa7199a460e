"""The process that reads one HDF5 file: ``python -m feeler.tensors.hdf5_child FILE LIMITS…``, answer on stdout."""

import json
import math
import resource
import sys
from typing import Any

import h5py
import numpy as np

from feeler.errors import InvalidInput
from feeler.tensors.arrays import pack_arrays
from feeler.tensors.limits import NAME, Limits

BASE_MEMORY = 2**30  # bytes for the interpreter and the libraries, beside the numbers
HIDDEN = ("CLASS", "NAME", "DIMENSION_LIST", "REFERENCE_LIST", "_Netcdf4Dimid", "_Netcdf4Coordinates", "_NCProperties")
DESCRIPTION = "feeler_description"
NO_VARIABLE = b"This is a netCDF dimension but not a netCDF variable"


def read_file(path: str, limits: Limits) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Arrays and notes for the parent; any failure becomes the note ``error``."""
    try:
        with h5py.File(path, "r") as file:
            return _read_nwb(file, limits) if "nwb_version" in file.attrs else _read_netcdf(file, limits)
    except InvalidInput as error:
        return {}, {"error": str(error)}
    except MemoryError:
        return {}, {"error": f"needs more memory than the limit of {limits.max_bytes:,} bytes leaves."}
    except RecursionError:
        return {}, {"error": "is damaged: its parts are nested without end."}
    except Exception as error:  # whatever the library says of a damaged file is news about the file, not about us
        words = " ".join(str(error).split())[:200].encode("utf-8", "replace").decode()
        return {}, {"error": f"is damaged or no NetCDF-4 or NWB file ({words})."}


def _members(group: h5py.Group, limits: Limits) -> dict[str, Any]:
    """The group's datasets and groups by name; links out of the file and outside storage are refused."""
    if len(group) > 4 * limits.max_arrays:
        raise InvalidInput(f"holds {len(group)} objects in one group.")
    found = {}
    for name in group:
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise InvalidInput(f"the entry {name[:60]!r} is a link; only data inside the file are read.")
        item = group[name]
        if isinstance(item, h5py.Dataset) and (item.external or item.is_virtual):
            raise InvalidInput(f"the numbers of {name[:60]!r} lie in another file; only data inside the file are read.")
        found[name] = item
    return found


def _take(items: dict[str, h5py.Dataset], limits: Limits) -> dict[str, np.ndarray]:
    """Values of the datasets, once their shapes have passed."""
    total = 0
    for name, item in items.items():
        if item.shape is None or item.dtype.kind not in "biufSO" or (item.dtype.kind == "O" and not _is_text(item)):
            raise InvalidInput(f"variable {name[:60]!r} has the type {item.dtype}; readable are numbers and texts.")
        total += limits.check_shape(tuple(map(int, item.shape)), item.dtype.itemsize, f"variable {name[:60]!r}")
        limits.check_bytes(total, "the file")
        chunk = math.prod(item.chunks) * item.dtype.itemsize if item.chunks else 0
        limits.check_bytes(chunk, f"a chunk of {name[:60]!r}")
    return {name: item.asstr(errors="replace")[...] if _is_text(item) else item[...] for name, item in items.items()}


def _is_text(item: h5py.Dataset) -> bool:
    return h5py.check_string_dtype(item.dtype) is not None


def _read_netcdf(file: h5py.File, limits: Limits) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    members = {name: item for name, item in _members(file, limits).items() if isinstance(item, h5py.Dataset)}
    members = {name: item for name, item in members.items() if NO_VARIABLE not in _bytes(item.attrs.get("NAME", b""))}
    described = file.attrs.get(DESCRIPTION)
    if isinstance(described, str):
        members = {name: item for name, item in members.items() if not _is_text(item)}
        return _numbers(_take(members, limits)), {"description": described}
    coordinates = _words(file.attrs.get("coordinates", ""))
    for item in members.values():
        coordinates |= _words(item.attrs.get("coordinates", ""))
    values, variables = _take(members, limits), {}
    dims = {name: _dims(item) for name, item in members.items()}
    for name, value in values.items():
        entry = {
            "dims": dims[name],
            "shape": list(value.shape),
            "type": value.dtype.str,
            "attributes": _attributes(members[name]),
        }
        entry["coordinate"] = name in coordinates or name in dims[name]
        if value.dtype.kind in "OU":
            entry |= {"type": "str", "texts": [str(text) for text in value.ravel()]}
        variables[name] = entry
    description = {"variables": variables, "attributes": _attributes(file)}
    return _numbers(values), {"description": json.dumps(description)}


def _numbers(values: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    return {name: value for name, value in values.items() if value.dtype.kind in "biuf"}


def _dims(item: h5py.Dataset) -> list[str]:
    names = [item.dims[n][0].name.rpartition("/")[2] if len(item.dims[n]) else "" for n in range(item.ndim)]
    if item.is_scale and item.ndim == 1:
        names = [item.name.rpartition("/")[2]]
    if not all(NAME.fullmatch(name) for name in names):
        raise InvalidInput(f"variable {item.name[:60]!r} does not name its dimensions; save it as NetCDF-4.")
    return names


def _attributes(item: Any) -> dict[str, Any]:
    found = {}
    for name in item.attrs:
        if name in HIDDEN or name.startswith("_"):
            continue
        value = item.attrs[name]
        if isinstance(value, bytes | str):
            found[name] = value if isinstance(value, str) else value.decode("utf-8", "replace")
        elif isinstance(value, np.ndarray | np.generic) and value.dtype.kind in "biuf" and value.size <= 10_000:
            plain = value.tolist() if np.all(np.isfinite(value)) else str(value)
            found[name] = plain[0] if isinstance(plain, list) and len(plain) == 1 else plain
    return found


def _words(value: Any) -> set[str]:
    return set(value.split()) if isinstance(value, str) else set()


def _bytes(value: Any) -> bytes:
    return value if isinstance(value, bytes) else str(value).encode("utf-8", "replace")


def _read_nwb(file: h5py.File, limits: Limits) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    general, acquisition = _members(file, limits).get("general"), _members(file, limits).get("acquisition")
    notes = _members(general, limits).get("notes") if isinstance(general, h5py.Group) else None
    if not isinstance(notes, h5py.Dataset) or not isinstance(acquisition, h5py.Group) or notes.shape != ():
        raise InvalidInput("this NWB file was not written by feeler (no notes); read its series with pynwb.")
    description = notes.asstr(errors="replace")[()] if _is_text(notes) else ""
    series = {
        name: item.get("data")
        for name, item in _members(acquisition, limits).items()
        if isinstance(item, h5py.Group) and isinstance(_members(item, limits).get("data"), h5py.Dataset)
    }
    return _numbers(_take(series, limits)), {"description": str(description), "nwb": "1"}


def main() -> None:
    """Read the file named on the command line within the limits that follow it."""
    path, max_bytes, max_arrays, max_text, max_seconds = sys.argv[1:]
    seconds = float(max_seconds)
    limits = Limits(max_bytes=int(max_bytes), max_arrays=int(max_arrays), max_text=int(max_text), max_seconds=seconds)
    for kind, wanted in (
        (resource.RLIMIT_DATA, 3 * limits.max_bytes + BASE_MEMORY),
        (resource.RLIMIT_CPU, math.ceil(seconds)),
        (resource.RLIMIT_CORE, 0),
    ):
        hard = resource.getrlimit(kind)[1]
        resource.setrlimit(kind, (wanted if hard == resource.RLIM_INFINITY else min(wanted, hard), hard))
    sys.stdout.buffer.write(pack_arrays(*read_file(path, limits)))


if __name__ == "__main__":
    main()
