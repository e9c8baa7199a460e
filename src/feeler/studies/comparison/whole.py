"""Touches recorded until the last has let go, with equally many samples of each antenna."""

import warnings
from collections.abc import Sequence
from typing import Annotated

import numpy as np
import xarray as xr
from annotated_types import Len

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import Doubtful
from feeler.experiment.touch import DURATION, touch
from feeler.stimulus.trial import Trial

_DISTANCE = 48.0  # mm that an object goes at first; the last slow touch of the paper ends before 42
_FACTORS = (1, 2, 4, 8)


@checked
def touch_whole(
    antenna: Antenna, trials: Annotated[Sequence[Trial], Len(1)], *, seed: Annotated[int, "≥ 0"] = 0
) -> tuple[xr.Dataset, float]:
    """Touches over the shortest stretch that holds all of them whole.

    Returns
    -------
    angle : xr.Dataset
        ``angle`` (trial, sensor, time) [rad] at as many moments as the paper's window has, by
        linear interpolation.
    end : float
        Where the stretch ends [ms]: one sample after the last contact. A touch that still holds
        after eight times the usual way is cut there, with a warning.
    """
    slowest = min(trial.speed for trial in trials)
    for factor in _FACTORS:
        recorded = touch(antenna, trials, duration=factor * _DISTANCE / slowest, seed=seed)
        held = (recorded["force"] != 0).any(("trial", "axis")).values
        if not held[-1]:
            break
    else:
        warnings.warn(
            f"{antenna.name} is still touched when the recording ends; what follows is cut.",
            Doubtful,
            stacklevel=2,
        )
    time = recorded["time"].values
    end = float(time[held].max(initial=time[1]) + time[1] - time[0])
    moments = np.linspace(0.0, end, round(DURATION), endpoint=False)
    angle = recorded[["angle"]].transpose("trial", "sensor", "time")
    return angle.interp(time=moments), end
