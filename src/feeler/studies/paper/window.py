"""What a window of 380 ms cuts off a touch, and touches over their whole length."""

import re
from collections.abc import Iterable, Mapping
from types import SimpleNamespace

import numpy as np
import xarray as xr

from feeler.decoding.labels import make_labels
from feeler.experiment.touch import DURATION
from feeler.tensors import in_unit, rectify

WINDOWS = ("380 ms window", "complete touches")
"""The paper's, and each profile's own shortest full one with equal sample counts."""
SAME = 1e-6  # rad: two tensors that differ by less are one


def _list_contact(tensors: xr.Dataset) -> np.ndarray:
    """Whether each touch is in contact (trial, time)."""
    return (np.abs(tensors["force"].transpose("trial", "time", "axis").values) > 0).any(axis=2)


def measure_window(tensors: xr.Dataset, duration: float = DURATION) -> SimpleNamespace:
    """What a window of ``duration`` [ms] does to complete touches.

    Returns
    -------
    SimpleNamespace
        ``end``: when the last touch lets go for good [ms]. ``cut``: touches that go on, or begin
        again, after the window; ``again``: of these, those without contact when it closes.
        ``pairs`` of touches whose tensors are the same inside the window, and ``ceiling``, the
        greatest accuracy that these leave.
    """
    contact, time = _list_contact(tensors), in_unit(tensors["time"], "ms").values
    inside, after = time < duration, contact[:, time >= duration].any(axis=1)
    angle = in_unit(tensors["angle"], "rad").transpose("trial", "sensor", "time")
    array = rectify(angle.values)[:, :, inside]
    same = np.abs(array[:, None] - array[None]).max(axis=(2, 3)) < SAME
    kinds = np.unique(np.argmax(same, axis=1)).size
    last = time[contact.any(axis=0)].max() if contact.any() else 0.0
    return SimpleNamespace(
        end=float(last + (time[1] - time[0])),
        cut=int(after.sum()),
        again=int((after & ~contact[:, inside][:, -1]).sum()),
        pairs=int(np.triu(same, 1).sum()),
        ceiling=kinds / len(array),
    )


def resample(tensors: xr.Dataset, end: float, n_samples: int) -> xr.Dataset:
    """Angle and curvature (trial, sensor, time) from 0 to ``end`` [ms] at so many samples, by
    linear interpolation, with what is known of each trial.
    """
    time = np.linspace(0.0, end, n_samples, endpoint=False)
    names = [name for name in ("angle", "curvature") if name in tensors]
    return tensors[names].transpose("trial", "sensor", "time").interp(time=time)


def complete_tensors(tensors: xr.Dataset) -> xr.Dataset:
    """One profile's touches over its own shortest full window, with the samples of the paper's."""
    return resample(tensors, measure_window(tensors).end, round(DURATION))


def complete_arrays(tensors: Mapping[str, xr.Dataset]) -> dict[str, np.ndarray]:
    """Rectified angles (trial, sensor, time) of ``complete_tensors`` by profile, in order of
    label.
    """
    return {
        name: rectify(complete_tensors(data)["angle"].values)[
            np.argsort(make_labels(data), kind="stable")
        ]
        for name, data in tensors.items()
    }


PROFILES = ("exponential", "linear", "constant", "matched", "rival")
WHOLE = (
    *("wall", "robot", "window", "tradeoff", "gradient", "choices", "design", "active", "bounds"),
    *("axes", "antenna", "calibration", "tensors", "tracking"),
)
"""Kinds of values, by how their keys begin, that hang on no window of slow touches."""
_UNCUT = ("complete touches", "complete", "within each touch", "while it moves")
_CUT = ("380 ms window", "cut")


def find_one_sided(keys: Iterable[str]) -> set[str]:
    """Measures in which values of these keys compare profiles in the paper's window alone.

    Some of the linear and of the constant profile's touches are the same tensor in that window, so
    no page, figure, claim or sentence compares profiles there without complete touches beside it.
    A key that names no window is of the paper's.
    """
    found: dict[str, dict[bool, set[str]]] = {}
    for key in keys:
        parts = re.split(r"[.,]\s*", key)
        profile = next((part for part in parts if part in PROFILES), "")
        if profile and parts[0] not in WHOLE:
            uncut = any(part in _UNCUT for part in parts)
            rest = [part for part in parts if part not in (*_UNCUT, *_CUT, profile)]
            sides = found.setdefault(".".join(rest), {True: set(), False: set()})
            sides[uncut].add(profile)
    return {
        measure
        for measure, sides in found.items()
        if len(sides[False]) > 1 and not sides[False] <= sides[True]
    }
