"""Small sets of trials that any process computes alike, and what judges a file of them."""

import json
from pathlib import Path

import numpy as np
import xarray as xr
import zarr

N_TRIALS, N_SENSORS, N_SAMPLES = 8, 5, 40
CONFIGURATION = {
    "antenna": {"stiffness": [37.78, 1.0 / 3.0], "name": "exponential"},
    "timestep": 0.01,
    "seed": 7,
}


def make_trial(index: int, n_samples: int = N_SAMPLES) -> xr.Dataset:
    """Trial ``index`` as the contract has it, filled with reproducible noise."""
    rng = np.random.default_rng([7, index])
    angle = rng.normal(size=(1, N_SENSORS, n_samples))
    return xr.Dataset(
        {
            "angle": (("trial", "sensor", "time"), angle, {"units": "rad"}),
            "curvature": (("trial", "sensor", "time"), angle / 0.3, {"units": "1/mm"}),
            "tip": (
                ("trial", "time", "axis"),
                rng.normal(size=(1, n_samples, 2)),
                {"units": "mm"},
            ),
        },
        coords={
            "time": ("time", np.arange(float(n_samples)), {"units": "ms"}),
            "position": ("sensor", np.linspace(0, 1, N_SENSORS)),
            "segment": ("sensor", np.arange(1, N_SENSORS + 1)),
            "axis": ("axis", ["x", "y"]),
            "feature": ("trial", [["ball", "box", "triangle", "Wändli"][index % 4]]),
            "size": (
                "trial",
                [np.inf if index % 4 == 3 else 1.0 / (index + 3)],
                {"units": "mm"},
            ),
            "location": ("trial", [0.1 * index]),
            "speed": ("trial", [0.06 if index % 2 else np.nan]),
            "antenna": ("trial", ["exponential"]),
            "source": ("trial", ["simulation"]),
            "seed": ("trial", [2**62 + index]),
        },
        attrs={
            "configuration": json.dumps(CONFIGURATION),
            "engine": "none",
            "versions": json.dumps({"feeler": "0.1"}),
            "timestep": 0.01,
            "licence": "CC0-1.0",
        },
    )


def make_set(n_trials: int = N_TRIALS) -> xr.Dataset:
    """All trials in one Dataset."""
    return xr.concat(
        [make_trial(n) for n in range(n_trials)],
        "trial",
        data_vars="minimal",
        coords="minimal",
        compat="override",
    )


def find_finished(path) -> list[int]:
    """Numbers of the trials that a store holds."""
    if not (Path(path) / "zarr.json").exists():
        return []
    return np.flatnonzero(zarr.open_group(path, mode="r")["finished"][:]).tolist()


def forget(path, first, last) -> None:
    """Let a store count trials as not finished."""
    zarr.open_group(path, mode="r+")["finished"][first : last + 1] = False


def fill(path, configuration=CONFIGURATION, n_trials=N_TRIALS, order=1, **options) -> None:
    """Compute and store what is missing, one by one."""
    from feeler.tensors.store import open_store

    with open_store(path, configuration, n_trials, **options) as store:
        for index in range(n_trials)[::order]:
            if not store.finished[index]:
                store.append([index], make_trial(index))


def judge(path):
    """All that nwbinspector holds against a file by its own and by DANDI's settings, but for
    suggestions.
    """
    from nwbinspector import Importance, configure_checks, inspect_nwbfile, load_config

    found = [*inspect_nwbfile(nwbfile_path=path)]
    checks = configure_checks(config=load_config("dandi"))
    found += inspect_nwbfile(nwbfile_path=path, checks=checks)
    return [
        (m.check_function_name, m.message)
        for m in found
        if m.importance != Importance.BEST_PRACTICE_SUGGESTION
    ]
