"""The formats that feeler ships, as records for the registry."""

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import xarray as xr

from feeler.antenna.file import read_antenna_file
from feeler.antenna.parse import AntennaFile
from feeler.disk.foreign import name_start
from feeler.disk.guard import Limits, open_guarded
from feeler.tensors import records, store, stored
from feeler.tensors.csvfile import MAGIC, load_csv, save_csv
from feeler.tensors.formats import Format
from feeler.tensors.heading import find_heading
from feeler.tensors.inspect import shorten
from feeler.tensors.mat import save_mat
from feeler.tensors.models import Model, read_model
from feeler.tensors.netcdf import save_netcdf
from feeler.tensors.nwb import save_nwb
from feeler.tensors.plain import restore
from feeler.tensors.table import Table, read_table

_ZARR = (
    "zarr.json",
    ".zgroup",
    ".zarray",
)  # of Zarr 3, and of Zarr 2, which is refused by name
HDF5 = b"\x89HDF\r\n\x1a\n"


def guarded(function: str) -> Callable[[Path, Limits, bool], xr.Dataset]:
    """A loader that lets the guard call ``function`` (``"module:name"``), which gives what
    ``plain.describe`` gives.
    """

    def load(path: Path, limits: Limits, trusted: bool) -> xr.Dataset:
        return restore(*open_guarded(function, path, limits, trusted=trusted), path.name)

    return load


def _starts(*magic: bytes) -> Callable[[Path, bytes], bool]:
    return lambda path, start: start.startswith(magic)


def _is_antenna(path: Path, start: bytes) -> bool:
    other = re.search(rb'schema\s*=\s*"feeler\.(?!antenna/)', start)
    return b"feeler.antenna/" in start or (path.suffix.lower() == ".toml" and not other)


def _describe_antenna(file: AntennaFile) -> list[str]:
    antenna = file.antenna
    lines = [
        f"name        {antenna.name}",
        (
            f"segments    {antenna.n_segments}, {antenna.length:g} mm,"
            f" {antenna.segment_mass.sum() * 1e3:g} mg"
        ),
        f"stiffness   {antenna.stiffness[0]:g} (base) … {antenna.stiffness[-1]:g} (tip) N·mm/rad",
        f"damping     {antenna.damping[0]:g} (base) … {antenna.damping[-1]:g} (tip) N·mm·ms/rad",
        f"sensors     {antenna.sensors.size}",
    ]
    return lines + [
        f"source      {name}: [{item.tag}] {item.reference} {item.note}"
        for name, item in file.sources.items()
    ]


def _describe_model(model: Model) -> list[str]:
    arrays = [
        f"  {name} {values.shape} {values.dtype}" for name, values in model.arrays.items()
    ]
    made = ", ".join(f"{name} {version}" for name, version in model.versions.items())
    return [
        f"kind {model.kind}, version {model.version}, by {made}",
        *arrays,
        f"settings {shorten(model.settings)}",
    ]


STORE = Format(
    words="store of trials (Zarr v3)",
    suffix=".zarr",
    detect=lambda path, start: records.is_store(path),
    load=lambda path, limits, trusted: stored.read_store(path),
    save=store.save_store,
    describe=stored.describe_store,
    glance=lambda path: stored.read_store(path, first=stored.MANY),
    find_damage=stored.find_damage,
)
ZARR = Format(
    words="Zarr v3 group",
    detect=lambda path, start: any((path / name).exists() for name in _ZARR),
    load=guarded("feeler.tensors.readers:read_zarr"),
)
NWB = Format(
    words="NWB file (HDF5)",
    suffix=".nwb",
    detect=lambda path, start: start.startswith(HDF5) and path.suffix.lower() == ".nwb",
    load=guarded("feeler.tensors.readers:read_hdf5"),
    save=save_nwb,
)
NETCDF = Format(
    words="NetCDF-4 file (HDF5)",
    suffix=".nc",
    detect=lambda path, start: start.startswith(HDF5) and path.suffix.lower() != ".nwb",
    load=guarded("feeler.tensors.readers:read_hdf5"),
    save=save_netcdf,
)
MAT = Format(
    words="MATLAB 5 file",
    suffix=".mat",
    detect=_starts(b"MATLAB 5.0 MAT-file"),
    load=guarded("feeler.tensors.readers:read_mat"),
    save=save_mat,
)
CSV = Format(
    words="one tensor as CSV",
    suffix=".csv",
    detect=_starts(MAGIC.encode(), b"\xef\xbb\xbf" + MAGIC.encode()),
    load=lambda path, limits, trusted: load_csv(path, limits),
    save=save_csv,
)
ANTENNA = Format(
    words="antenna (TOML)",
    kind="antenna",
    detect=_is_antenna,
    load=lambda path, limits, trusted: read_antenna_file(path),
    tell=_describe_antenna,
)
MODEL = Format(
    words="model (safetensors)",
    kind="model",
    detect=lambda path, start: start[8:9] == b"{" and len(start) > 9,
    load=lambda path, limits, trusted: read_model(path, limits, trusted=trusted),
    tell=_describe_model,
)


_MOST = 12  # columns that are listed
_ADVICE = (
    "a robot's recording needs time_ms and hinge1_deg, hinge2_deg …: feeler robot check",
    "tracks need head_x, head_y, left_tip_x, left_tip_y …: feeler tracks",
    "a trace to calibrate with needs time_ms and displacements: feeler calibrate --data",
)


def _is_table(path: Path, start: bytes) -> bool:
    lines = start.decode("utf-8-sig", "ignore").split("\n")
    heading = None if b"\0" in start or name_start(start) else find_heading(enumerate(lines, 1))
    return heading is not None and len(heading.names) > 1 and path.suffix.lower() in _ENDINGS


_ENDINGS = (".csv", ".tsv", ".txt", ".dat", ".asc", ".log", "")


def _describe(table: Table) -> list[str]:
    lines = [f"rows        {len(table.values)}"]
    for name, values in list(zip(table.columns, table.values.T, strict=True))[:_MOST]:
        seen = values[~np.isnan(values)]
        span = f"{seen.min():.4g} … {seen.max():.4g}" if seen.size else "empty"
        if name in table.words:
            span = f"text ({table.words[name][:40]!r} …)"
        lines.append(f"column      {name}: {span}")
    if len(table.columns) > _MOST:
        lines.append(f"            … {len(table.columns)} columns in all")
    return lines + [f"next        {words}" for words in _ADVICE]


PLAIN_TABLES = {
    "table": Format(
        words="a table that no verb of feeler reads as it is",
        kind="table",
        detect=_is_table,
        load=lambda path, limits, trusted: read_table(path, words=True),
        tell=_describe,
    ),
}
