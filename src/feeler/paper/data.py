"""The tactile tensors that most sections share: made once, kept in a store, resumed after a kill."""

import shutil
from functools import lru_cache

import xarray as xr

from feeler.errors import StoreError
from feeler.experiment.touch import DURATION, touch
from feeler.paper.context import Context
from feeler.paper.stage import hold, is_kept
from feeler.paper.trials import LOCATIONS, SPEEDS, make_features, trials
from feeler.provenance import make_key
from feeler.stimulus.trial import Trial


def list_profiles(context: Context) -> list[str]:
    """Profiles compared at this scale; smoke leaves out all but the first and the constant one."""
    names = list(context.profiles)
    return [name for name in names if name == names[0] or name == "constant"] if context.scale == "smoke" else names


def list_speeds(context: Context, profile: str) -> dict[str, float]:
    """Speeds simulated for a profile: all for the first, only slow for controls below paper scale."""
    first = profile == next(iter(context.profiles))
    if context.scale == "paper" or (first and context.scale == "quick"):
        return SPEEDS
    return {name: SPEEDS[name] for name in (("fast", "slow") if first else ("slow",))}


def list_touches(context: Context, profile: str) -> list[Trial]:
    """Touches simulated for a profile; smoke has ball and box at the first and the last place: eight at each speed."""
    speeds = list(list_speeds(context, profile).values())
    if context.scale != "smoke":
        return trials(speeds)
    return trials(speeds, (LOCATIONS[0], LOCATIONS[-1]), [f for f in make_features() if f.kind != "triangle"])


@lru_cache(maxsize=16)
def load_tensors(context: Context, profile: str) -> xr.Dataset:
    """The paper's touches of one profile: Dataset (trial, sensor, time), from the store or made now."""
    antenna, touches = context.profiles[profile], list_touches(context, profile)
    made_with = {"antenna": antenna, "touches": touches, "timestep": context.timestep, "engine": context.engine}
    key = make_key(made_with | {"seed": context.seed}, touch.__module__)
    path = context.out / "cache" / "tensors" / f"{profile}-{key}.zarr"
    options = {
        "duration": DURATION,
        "timestep": context.timestep,
        "engine": context.engine,
        "workers": context.workers,
        "seed": context.seed,
        "progress": context.progress,
    }
    try:
        with hold(path):
            if not is_kept(path, context):
                shutil.rmtree(path, ignore_errors=True)
            return touch(antenna, touches, store=path, **options)
    except StoreError as error:
        raise StoreError(f"{error} Remove {path} or choose another --out.") from error


def select_speed(tensors: xr.Dataset, speed: float) -> xr.Dataset:
    """The trials of one speed."""
    return tensors.isel(trial=abs(tensors["speed"].values - speed) < 1e-9)
