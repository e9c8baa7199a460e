"""What a window of 380 ms cuts off a touch, and touches over their whole length."""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
import xarray as xr

from feeler.decoding.classifiers import make_labels
from feeler.experiments.tactile import DURATION
from feeler.tensors import in_unit, rectify

WINDOWS = ("380 ms window", "complete touches")
"""The paper's, and each profile's own shortest full one with equal sample counts."""
_NO_MOTION = 0.01  # [C] of a tensor's peak: less is no motion
SAME = 1e-6  # rad: two tensors that differ by less are one


def _list_contact(tensors: xr.Dataset) -> np.ndarray:
    """Whether each touch is in contact (trial, time)."""
    return (np.abs(tensors["force"].transpose("trial", "time", "axis").values) > 0).any(axis=2)


def find_end(tensors: xr.Dataset) -> float:
    """When the last touch lets go for good [ms]."""
    contact, time = _list_contact(tensors), in_unit(tensors["time"], "ms").values
    return float(time[contact.any(axis=0)].max(initial=0.0) + time[1] - time[0])


def measure_window(tensors: xr.Dataset, duration: float = DURATION) -> SimpleNamespace:
    """What a window of ``duration`` [ms] does to complete touches.

    Returns
    -------
    SimpleNamespace
        ``end``: see :func:`find_end`. ``cut``: touches that go on, or begin
        again, after the window; ``again``: of these, those without contact when it closes.
        ``pairs`` of touches whose tensors are the same inside the window, and ``ceiling``, the
        greatest accuracy that these leave.
    """
    contact, time = _list_contact(tensors), in_unit(tensors["time"], "ms").values
    inside, after = time < duration, contact[:, time >= duration].any(axis=1)
    array = _rectify(tensors)[:, :, inside]
    same = np.array([np.abs(array - one).max(axis=(1, 2)) < SAME for one in array])
    return SimpleNamespace(
        end=find_end(tensors),
        cut=int(after.sum()),
        again=int((after & ~contact[:, inside][:, -1]).sum()),
        pairs=int(np.triu(same, 1).sum()),
        ceiling=np.unique(np.argmax(same, axis=1)).size / len(array),
    )


def _rectify(tensors: xr.Dataset) -> np.ndarray:
    angle = in_unit(tensors["angle"], "rad").transpose("trial", "sensor", "time")
    return rectify(angle.values)


def cut_window(tensors: xr.Dataset, duration: float = DURATION) -> np.ndarray:
    """Rectified angles (trial, sensor, time) [rad] before ``duration`` [ms]."""
    return _rectify(tensors)[:, :, in_unit(tensors["time"], "ms").values < duration]


def keep_whole(tensors: xr.Dataset) -> np.ndarray:
    """Rectified angles (trial, sensor, time) [rad] until the last touch of all lets go for good, at
    the recording's own rate.
    """
    return cut_window(tensors, find_end(tensors))


def cut_to_contact(tensors: xr.Dataset) -> list[np.ndarray]:
    """Rectified angles (sensor, time) [rad] of each touch from its first to its last sample in
    contact; a touch without any keeps one sample, of zeros.
    """
    return _cut_each(_rectify(tensors), _list_contact(tensors))


def cut_to_motion(tensors: xr.Dataset) -> list[np.ndarray]:
    """Rectified angles (sensor, time) [rad] of each touch from the first to the last sample in
    which any sensor passes ``_NO_MOTION`` of the tensor's peak: with the swing after the touch.
    """
    array = _rectify(tensors)
    return _cut_each(array, array.max(axis=1) > _NO_MOTION * array.max(axis=(1, 2))[:, None])


def _cut_each(array: np.ndarray, kept: np.ndarray) -> list[np.ndarray]:
    """From the first to the last kept sample; of a touch without any one sample, of zeros."""
    return [
        angle[:, times[0] : times[-1] + 1] if times.size else 0 * angle[:, :1]
        for angle, times in zip(array, map(np.flatnonzero, kept), strict=True)
    ]


def resample(tensors: xr.Dataset, end: float, n_samples: int) -> xr.Dataset:
    """Angle and curvature (trial, sensor, time) from 0 to ``end`` [ms] at so many samples, by
    linear interpolation, with what is known of each trial.
    """
    time = np.linspace(0.0, end, n_samples, endpoint=False)
    names = [name for name in ("angle", "curvature") if name in tensors]
    return tensors[names].transpose("trial", "sensor", "time").interp(time=time)


def complete_tensors(tensors: xr.Dataset) -> xr.Dataset:
    """One profile's touches over its own shortest full window, with the samples of the paper's."""
    return resample(tensors, find_end(tensors), round(DURATION))


def complete_arrays(
    tensors: Mapping[str, xr.Dataset],
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Rectified angles (trial, sensor, time) of ``complete_tensors`` by profile, as shares of the
    greatest of all, in order of label; and the labels, which all profiles share.
    """
    arrays = {
        name: rectify(complete_tensors(data)["angle"].values)[
            np.argsort(make_labels(data), kind="stable")
        ]
        for name, data in tensors.items()
    }
    peak = max(array.max() for array in arrays.values())
    labels = np.sort(make_labels(next(iter(tensors.values()))))
    return {name: array / peak for name, array in arrays.items()}, labels
