"""The one door: every Dataset of tactile tensors passes here, whoever made it."""

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput
from feeler.tensors.dataset import DIMS, SOURCES, TRIAL_COORDINATES, UNITS


def validate(dataset: xr.Dataset) -> xr.Dataset:
    """The same Dataset if it keeps the data contract.

    Raises
    ------
    InvalidInput
        With every breach found, one a line.
    """
    breaches = find_breaches(dataset)
    if breaches:
        raise InvalidInput("not a valid set of tactile tensors:\n" + "\n".join(f"  - {breach}" for breach in breaches))
    return dataset


def find_breaches(dataset: xr.Dataset) -> list[str]:
    """What is wrong with a Dataset, in words; empty where nothing is."""
    if "angle" not in dataset:
        return [f"variable 'angle' {DIMS} is missing; found {list(dataset.data_vars) or 'no variables'}"]
    breaches = _find_shape_breaches(dataset)
    if not breaches:
        breaches = _find_value_breaches(dataset)
    return breaches


def _find_shape_breaches(dataset: xr.Dataset) -> list[str]:
    breaches = [
        f"'{name}' must have dims {DIMS}, got {dataset[name].dims}"
        for name in ("angle", "curvature")
        if name in dataset and dataset[name].dims != DIMS
    ]
    breaches += [
        f"'{name}' must have dims (trial, time, axis) with 2 axes, got {dataset[name].dims}"
        for name in ("tip", "force")
        if name in dataset and (dataset[name].dims != ("trial", "time", "axis") or dataset.sizes["axis"] != 2)
    ]
    wanted = {"time": "time", "position": "sensor", "segment": "sensor", **dict.fromkeys(TRIAL_COORDINATES, "trial")}
    for name, dim in wanted.items():
        if name not in dataset.coords:
            breaches.append(f"coordinate '{name}' along {dim} is missing")
        elif dataset[name].dims != (dim,):
            breaches.append(f"coordinate '{name}' must run along {dim}, got dims {dataset[name].dims}")
    return breaches


def _find_value_breaches(dataset: xr.Dataset) -> list[str]:
    numbers = [name for name in ("angle", "curvature", "tip", "force", "time", "position") if name in dataset]
    wrong = [name for name in numbers if not _is_finite(dataset[name])]
    breaches = [f"'{name}' has values that are not finite numbers" for name in wrong]
    for name, unit in UNITS.items():
        if name in dataset.variables and dataset[name].attrs.get("units", unit) != unit:
            breaches.append(f"'{name}' must be in {unit}, says {dataset[name].attrs['units']!r}")
    if "time" not in wrong and np.any(np.diff(dataset["time"].values) <= 0):
        breaches.append("'time' must rise strictly")
    if "position" not in wrong and np.any(np.diff(dataset["position"].values) <= 0):
        breaches.append("sensors must run from base to tip: 'position' must rise strictly")
    unknown = sorted(set(np.unique(dataset["source"].values).tolist()) - set(SOURCES))
    if unknown:
        breaches.append(f"'source' must be one of {', '.join(SOURCES)}, got {unknown}")
    return breaches


def _is_finite(array: xr.DataArray) -> bool:
    return array.dtype.kind in "fiu" and bool(np.isfinite(array.values).all())
