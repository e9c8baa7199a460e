"""Load: a Dataset from any file that feeler can read, told by its content, never executing any of it."""

import os
from pathlib import Path

import xarray as xr

from feeler.errors import InvalidInput
from feeler.tensors.finished import read_label, read_store
from feeler.tensors.hdf5 import MAGIC as HDF5
from feeler.tensors.hdf5 import load_hdf5
from feeler.tensors.limits import Limits, find_limits, list_folder
from feeler.tensors.mat import MAGIC as MATLAB
from feeler.tensors.mat import load_mat
from feeler.tensors.plain import restore
from feeler.tensors.table import MAGIC as TABLE
from feeler.tensors.table import load_csv
from feeler.tensors.zarr3 import list_arrays, read_array

KINDS = ("store", "zarr", "hdf5", "mat", "csv", "antenna", "model")
_HINTS = {
    b"PK\x03\x04": "a ZIP archive (.npz, .zip): unpack it first; pickled content is never read",
    b"CDF": "NetCDF-3: convert it with nccopy -k nc4, or open it with xarray and feeler.save it",
    b"\x80": "a Python pickle, which can run programs when opened: it is never read",
    b"MATLAB 7.3": "MATLAB -v7.3: save it with '-v7', or as NetCDF",
}


def detect(path: str | os.PathLike) -> str:
    """What a file is by its content: one of KINDS; InvalidInput says what it is if none of them."""
    path = Path(path)
    if path.is_dir():
        return "store" if _is_store(path) else "zarr"
    start = _read_start(path)
    if start.startswith(HDF5):
        return "hdf5"
    if start.startswith(MATLAB):
        return "mat"
    if start.startswith(TABLE.encode()) or start.startswith(b"\xef\xbb\xbf" + TABLE.encode()):
        return "csv"
    if path.suffix.lower() == ".toml" or b"feeler.antenna/" in start:
        return "antenna"
    if start[8:9] == b"{" and len(start) > 9:
        return "model"
    hint = next((words for magic, words in _HINTS.items() if start.startswith(magic)), "")
    raise InvalidInput(
        f"{path.name} is {hint}."
        if hint
        else f"{path.name} is no file of feeler (Zarr, NetCDF-4, MATLAB 5, CSV, NWB, TOML)."
    )


def _read_start(path: Path) -> bytes:
    try:
        if not path.is_file():  # also false for pipes and devices, which could keep us waiting
            reason = "not a regular file" if path.exists() else "no such file"
            raise InvalidInput(f"cannot read {path}: {reason}. Check the path.")
        with open(path, "rb") as file:
            return file.read(512)
    except (OSError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"cannot read {path!s}: {getattr(error, 'strerror', None) or error}.") from error


def _is_store(path: Path) -> bool:
    try:
        read_label(path, find_limits())
    except InvalidInput as error:
        if "no store of feeler" in str(error):
            return False
        raise
    return True


def load(path: str | os.PathLike, limits: Limits | None = None) -> xr.Dataset:
    """A Dataset from a store, Zarr v3 group, NetCDF-4, NWB, MATLAB 5 or CSV file.

    Nothing in the file is executed; sizes are checked before memory is taken; damage is named.

    Parameters
    ----------
    limits
        What may be read at most; default 4 GiB, or FEELER_MAX_GIB from the environment.

    Raises
    ------
    InvalidInput
        Unreadable, of another kind, damaged, or over the limits.
    """
    limits, kind = find_limits(limits), detect(path)
    readers = {"store": read_store, "zarr": load_zarr, "hdf5": load_hdf5, "mat": load_mat, "csv": load_csv}
    if kind not in readers:
        other = {"antenna": "an antenna: use load_antenna", "model": "a model: use the reader of its kind"}
        raise InvalidInput(f"{path} holds no tensors but {other[kind]}.")
    return readers[kind](path, limits)


def load_zarr(path: str | os.PathLike, limits: Limits | None = None) -> xr.Dataset:
    """The Dataset in a plain Zarr v3 group, as xarray's ``to_zarr`` writes it (codecs zstd, gzip or none)."""
    path, limits = Path(path), find_limits(limits)
    list_folder(path)
    infos, attributes = list_arrays(path, limits)
    named = set(str(attributes.pop("coordinates", "")).split())
    for info in infos.values():
        named |= set(str(info.attributes.pop("coordinates", "")).split())
    variables, arrays = {}, {}
    for name, info in infos.items():
        values = read_array(path, info)
        entry = {
            "dims": info.dims,
            "shape": info.shape,
            "type": values.dtype.str,
            "attributes": _visible(info.attributes),
        }
        entry["coordinate"] = name in named or info.dims == (name,)
        if values.dtype.kind in "OU":
            entry |= {"type": "str", "texts": values.ravel().tolist()}
        variables[name], arrays[name] = entry, values
    return restore({"variables": variables, "attributes": attributes}, arrays, str(path))


def _visible(attributes: dict) -> dict:
    return {name: value for name, value in attributes.items() if name != "_FillValue"}
