"""What a file holds, and what is wrong with it, in words."""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.antenna.parse import AntennaFile
from feeler.errors import FeelerError
from feeler.limits import Limits, find_limits
from feeler.tensors.contract import find_breaches
from feeler.tensors.formats import FORMATS, detect
from feeler.tensors.models import Model

MAX_VALUES = 6
LARGE = 64 * 2**20  # bytes; the extremes of a larger variable are not looked up


def describe_file(path: str | os.PathLike, limits: Limits | None = None) -> list[str]:
    """Lines that say what a file holds: kind, sizes, variables with units, labels, configuration,
    versions, licence.
    """
    path, form = Path(path), FORMATS[detect(path)]
    lines = [f"{path}: {form.words}", *(form.describe(path) if form.describe else [])]
    content = form.glance(path) if form.glance else form.load(path, find_limits(limits), False)
    return lines + DESCRIBE[form.kind](content)


def _describe_dataset(dataset: xr.Dataset) -> list[str]:
    lines = ["sizes       " + ", ".join(f"{name} {size}" for name, size in dataset.sizes.items())]
    for name, item in dataset.data_vars.items():
        unit = item.attrs.get("units", "no unit")
        lines.append(
            f"{name:12}({', '.join(map(str, item.dims))}) [{unit}] {_find_spread(item)}".rstrip()
        )
    for name, item in dataset.coords.items():
        unit = f" [{item.attrs['units']}]" if "units" in item.attrs else ""
        lines.append(f"{name:12}{_summarise(item.values)}{unit}")
    return lines + [f"{name:12}{_short(value)}" for name, value in dataset.attrs.items()]


def _find_spread(item: xr.DataArray) -> str:
    if not item.size or item.nbytes > LARGE or item.dtype.kind not in "fiu":
        return ""
    values = item.values  # of a store this reads, each time
    return "" if np.isnan(values).all() else f"{np.nanmin(values):.3g} … {np.nanmax(values):.3g}"


def _summarise(values: np.ndarray) -> str:
    distinct = np.unique(values)
    if distinct.size <= MAX_VALUES:
        return ", ".join(
            f"{value:g}" if values.dtype.kind in "fiu" else str(value) for value in distinct
        )
    return f"{distinct[0]} … {distinct[-1]} ({distinct.size} values)"


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
    arrays = [f"  {name} {values.shape} {values.dtype}" for name, values in model.arrays.items()]
    made = ", ".join(f"{name} {version}" for name, version in model.versions.items())
    return [
        f"kind {model.kind}, version {model.version}, by {made}",
        *arrays,
        f"settings {_short(model.settings)}",
    ]


DESCRIBE: dict[str, Callable[[Any], list[str]]] = {
    "tensors": _describe_dataset,
    "antenna": _describe_antenna,
    "model": _describe_model,
}


def _short(value: object) -> str:
    text = value if isinstance(value, str) else json.dumps(value, default=str)
    return text if len(text) <= 160 else f"{text[:150]}… ({len(text):,} characters)"


def find_problems(path: str | os.PathLike, limits: Limits | None = None) -> list[str]:
    """What is wrong with a file, one line each; empty where nothing is."""
    try:
        form = FORMATS[detect(path)]
        if form.find_damage and (damage := form.find_damage(Path(path))):
            return damage
        content = form.load(Path(path), find_limits(limits), False)
        return find_breaches(content) if form.kind == "tensors" else []
    except FeelerError as error:
        return [str(error)]
