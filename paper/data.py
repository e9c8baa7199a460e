"""The tactile tensors that most sections share: made once, and kept in a store."""

import shutil
from functools import lru_cache
from pathlib import Path

import xarray as xr

from feeler import touch
from feeler.errors import InvalidInput, StoreError
from feeler.experiments.tactile import DURATION
from feeler.objects.trials import SPEEDS, Trial, make_features
from feeler.presets import paper_trials
from feeler.provenance import make_key
from feeler.tensors.store import read_store
from paper.cache import hold
from paper.context import Context
from paper.stage import is_kept

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
