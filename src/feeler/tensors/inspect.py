"""What a file holds, and what is wrong with it, in words."""

import json
import os
from pathlib import Path

import numpy as np
import xarray as xr

from feeler.antenna.file import read_antenna_file
from feeler.errors import FeelerError
from feeler.tensors.contract import find_breaches
from feeler.tensors.finished import find_damage, find_records, read_label
from feeler.tensors.layout import read_layout
from feeler.tensors.limits import Limits, find_limits
from feeler.tensors.load import detect, load
from feeler.tensors.model import read_model

NAMES = {
    "store": "store of trials (Zarr v3)",
    "zarr": "Zarr v3 group",
    "hdf5": "HDF5 file (NetCDF-4 or NWB)",
    "mat": "MATLAB 5 file",
    "csv": "one tensor as CSV",
    "antenna": "antenna (TOML)",
    "model": "model (safetensors)",
}
MAX_VALUES = 6


def describe_file(path: str | os.PathLike, limits: Limits | None = None) -> list[str]:
    """Lines that say what a file holds: kind, sizes, variables with units, labels, configuration, versions, licence."""
    limits, kind = find_limits(limits), detect(path)
    lines = [f"{path}: {NAMES[kind]}"]
    if kind == "antenna":
        return lines + _describe_antenna(path)
    if kind == "model":
        model = read_model(path, limits)
        arrays = [f"  {name} {values.shape} {values.dtype}" for name, values in model.arrays.items()]
        return [*lines, f"kind {model.kind}, version {model.version}", *arrays, f"settings {_short(model.settings)}"]
    if kind == "store":
        label = read_label(Path(path), limits)
        lines.append(f"{len(find_records(Path(path)))} of {label['n_trials']} trials finished")
    return lines + _describe_dataset(load(path, limits))


def _describe_dataset(dataset: xr.Dataset) -> list[str]:
    lines = ["sizes       " + ", ".join(f"{name} {size}" for name, size in dataset.sizes.items())]
    for name, item in dataset.data_vars.items():
        unit = item.attrs.get("units", "no unit")
        spread = (
            f"{np.nanmin(item.values):.3g} … {np.nanmax(item.values):.3g}"
            if item.size and item.dtype.kind in "fiu"
            else ""
        )
        lines.append(f"{name:12}({', '.join(map(str, item.dims))}) [{unit}] {spread}".rstrip())
    for name, item in dataset.coords.items():
        unit = f" [{item.attrs['units']}]" if "units" in item.attrs else ""
        lines.append(f"{name:12}{_summarise(item.values)}{unit}")
    return lines + [f"{name:12}{_short(value)}" for name, value in dataset.attrs.items()]


def _summarise(values: np.ndarray) -> str:
    distinct = np.unique(values)
    if distinct.size <= MAX_VALUES:
        return ", ".join(f"{value:g}" if values.dtype.kind in "fiu" else str(value) for value in distinct)
    return f"{distinct[0]} … {distinct[-1]} ({distinct.size} values)"


def _describe_antenna(path: str | os.PathLike) -> list[str]:
    file = read_antenna_file(path)
    antenna = file.antenna
    lines = [
        f"name        {antenna.name}",
        f"segments    {antenna.n_segments}, {antenna.length:g} mm, {antenna.segment_mass.sum() * 1e3:g} mg",
        f"stiffness   {antenna.stiffness[0]:g} (base) … {antenna.stiffness[-1]:g} (tip) N·mm/rad",
        f"damping     {antenna.damping[0]:g} (base) … {antenna.damping[-1]:g} (tip) N·mm·ms/rad",
        f"sensors     {antenna.sensors.size}",
    ]
    return lines + [
        f"source      {name}: [{item.tag}] {item.reference} {item.note}" for name, item in file.sources.items()
    ]


def _short(value: object) -> str:
    text = value if isinstance(value, str) else json.dumps(value, default=str)
    return text if len(text) <= 160 else f"{text[:150]}… ({len(text):,} characters)"


def find_problems(path: str | os.PathLike, limits: Limits | None = None) -> list[str]:
    """What is wrong with a file, one line each; empty where nothing is."""
    try:
        limits, kind = find_limits(limits), detect(path)
        if kind == "antenna":
            read_antenna_file(path)
            return []
        if kind == "model":
            read_model(path, limits)
            return []
        problems = _find_store_problems(Path(path), limits) if kind == "store" else []
        return problems or find_breaches(load(path, limits))
    except FeelerError as error:
        return [str(error)]


def _find_store_problems(path: Path, limits: Limits) -> list[str]:
    label, layout = read_label(path, limits), read_layout(path, limits)
    if layout is None:
        return []
    damage = find_damage(path, layout, label["n_trials"])
    hint = " The command that made the store computes it again."
    return [f"trial {index}: {reason}{hint}" for index, reason in damage.items()]
