"""The tactile tensors that most sections share, and what a window of 380 ms cuts off them."""

import shutil
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import xarray as xr

from feeler import touch
from feeler.decoding.classifiers import make_labels
from feeler.errors import InvalidInput, StoreError
from feeler.experiments.tactile import DURATION
from feeler.objects.trials import SPEEDS, Trial, make_features
from feeler.presets import paper_trials
from feeler.provenance import make_key
from feeler.tensors import in_unit, rectify
from feeler.tensors.store import read_store
from paper.cache import hold, is_kept
from paper.context import Context

# The tactile tensors that most sections share: made once, and kept in a store.

COMPLETE = 800.0  # [C] ms; the last slow touch of any profile ends before 700


def list_profiles(context: Context) -> list[str]:
    """Profiles compared at this scale: the first and its controls."""
    first, *controls = context.profiles
    return [first, *(name for name in controls if name in context.effort.controls)]


def list_speeds(context: Context, profile: str) -> dict[str, float]:
    """Speeds simulated for a profile."""
    first = profile == next(iter(context.profiles))
    names = context.effort.speeds if first else context.effort.control_speeds
    return {name: SPEEDS[name] for name in names}


def list_touches(context: Context, profile: str) -> list[Trial]:
    """Touches simulated for a profile."""
    effort = context.effort
    features = [feature for feature in make_features() if feature.kind in effort.shapes]
    return paper_trials(
        list(list_speeds(context, profile).values()), effort.locations, features
    )


@lru_cache(maxsize=16)
def load_tensors(context: Context, profile: str) -> xr.Dataset:
    """The paper's touches of one profile: Dataset (trial, sensor, time), from the store or made
    now.
    """
    return _load(context, profile, list_touches(context, profile), DURATION, profile)


@lru_cache(maxsize=16)
def load_complete(context: Context, profile: str) -> xr.Dataset:
    """The slow touches of one profile, recorded until long after the last has let go."""
    touches = [
        trial for trial in list_touches(context, profile) if trial.speed == SPEEDS["slow"]
    ]
    return _load(context, profile, touches, COMPLETE, f"{profile}-complete")


def _load(
    context: Context, profile: str, touches: list[Trial], duration: float, name: str
) -> xr.Dataset:
    antenna = context.profiles[profile]
    made_with = {
        "antenna": antenna,
        "touches": touches,
        "timestep": context.timestep,
        "engine": context.engine,
    }
    key = make_key(made_with | {"seed": context.seed, "duration": duration})
    path = context.out / "cache" / "tensors" / f"{name}-{key}.zarr"
    options = context.physics | {
        "duration": duration,
        "seed": context.seed,
        "progress": context.progress,
    }
    try:
        with hold(path):
            if not is_kept(path, context):
                shutil.rmtree(path, ignore_errors=True)
            elif (whole := _read_whole(path, len(touches))) is not None:
                return whole
            return touch(antenna, touches, store=path, **options)
    except StoreError as error:
        raise StoreError(f"{error} Remove {path} or choose another --out.") from error


def _read_whole(path: Path, n_trials: int) -> xr.Dataset | None:
    """The touches kept there, if all are; an unfinished or damaged store is left to ``touch``,
    which mends it.
    """
    try:
        found = read_store(path).load()
    except InvalidInput:
        return None
    return found if found.sizes["trial"] == n_trials else None


def select_speed(tensors: xr.Dataset, speed: float) -> xr.Dataset:
    """The trials of one speed."""
    return tensors.isel(trial=abs(tensors["speed"].values - speed) < 1e-9)


# What a window of 380 ms cuts off a touch, and touches over their whole length.

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
    return rectify(in_unit(tensors["angle"], "rad").transpose("trial", "sensor", "time").values)


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


CLAIMED = ("exponential", "linear", "uniform")  # [P]
"""The order of profiles that the paper claims."""
