"""Tactile tensors: the one Dataset that every producer makes and every analysis reads."""

import json
from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput

DIMS = ("trial", "sensor", "time")
UNITS = {
    "angle": "rad",
    "curvature": "1/mm",
    "tip": "mm",
    "force": "N",
    "time": "ms",
    "position": "fraction of length",
    "size": "mm",
    "location": "fraction of length",
    "speed": "mm/ms",
}
MEANING = {
    "angle": "hinge angle, positive towards +x",
    "curvature": "hinge angle over the length of the segment it carries",
    "tip": "place of the tip, base at the origin, straight antenna along +y",
    "force": "total contact force on the antenna",
    "position": "arc length of the sensor's hinge over antenna length",
    "segment": "number of the sensor's hinge, 1 at the base",
}
TRIAL_COORDINATES = ("feature", "size", "location", "speed", "antenna", "source", "seed")
SOURCES = ("simulation", "robot", "surrogate")


def make_tensors(
    *,
    angle: np.ndarray,
    time: np.ndarray,
    segment: Sequence[int],
    position: np.ndarray,
    segment_length: np.ndarray,
    trials: Mapping[str, Sequence[object]],
    tip: np.ndarray | None = None,
    force: np.ndarray | None = None,
    attrs: Mapping[str, object] | None = None,
) -> xr.Dataset:
    """The Dataset of the data contract, units attached.

    Parameters
    ----------
    angle
        (trial, sensor, time) [rad], sensors from base to tip.
    time
        (time,) [ms].
    segment, position, segment_length
        Per sensor: hinge number, arc length over antenna length, and length [mm] of the segment it carries.
    trials
        The coordinates ``feature, size, location, speed, antenna, source, seed``, one value per trial.
    tip, force
        (trial, time, axis) [mm], [N].
    attrs
        ``configuration`` and whatever else should travel; mappings are stored as JSON.

    Returns
    -------
    xarray.Dataset
        Variables ``angle``, ``curvature`` = angle / segment_length, and ``tip``, ``force`` where given.
    """
    missing = [name for name in TRIAL_COORDINATES if name not in trials]
    if missing:
        raise InvalidInput(f"trials lacks {', '.join(missing)}; each trial needs {', '.join(TRIAL_COORDINATES)}.")
    angle = np.asarray(angle, dtype=float)
    variables = {"angle": (DIMS, angle), "curvature": (DIMS, angle / np.asarray(segment_length, dtype=float)[:, None])}
    for name, values in (("tip", tip), ("force", force)):
        if values is not None:
            variables[name] = (("trial", "time", "axis"), np.asarray(values, dtype=float))
    coordinates = {
        "time": ("time", np.asarray(time, dtype=float)),
        "sensor": ("sensor", np.arange(1, len(segment) + 1)),
        "segment": ("sensor", np.asarray(segment, dtype=int)),
        "position": ("sensor", np.asarray(position, dtype=float)),
        "trial": ("trial", np.arange(angle.shape[0])),
        **{name: ("trial", np.asarray(list(values))) for name, values in trials.items()},
    }
    if "tip" in variables or "force" in variables:
        coordinates["axis"] = ("axis", ["x", "y"])
    dataset = xr.Dataset(variables, coordinates, attrs=_plain(attrs or {}))
    return label_units(dataset)


def label_units(dataset: xr.Dataset) -> xr.Dataset:
    """Attach ``units`` and ``long_name`` to every variable that has one in the contract."""
    for name in dataset.variables:
        if name in UNITS:
            dataset[name].attrs["units"] = UNITS[name]
        if name in MEANING:
            dataset[name].attrs["long_name"] = MEANING[name]
    return dataset


def _plain(attrs: Mapping[str, object]) -> dict[str, object]:
    return {
        name: json.dumps(value, sort_keys=True) if isinstance(value, Mapping | list | tuple) else value
        for name, value in attrs.items()
    }
