"""A small set that no coincidence hides in: no factor is 1, no order is that of the numbers, no two
lengths are equal, time does not go in milliseconds, sensors are not hinges, sides and signs differ.
"""

from functools import cache

import numpy as np
import xarray as xr

import feeler

SENSORS = (2, 3, 5, 8, 10)
INTERVAL = 0.3  # ms, so 3,333.3 Hz
N_SAMPLES = 31


def make_antenna() -> feeler.Antenna:
    """Eleven segments, five sensors."""
    n = np.arange(11)
    return feeler.Antenna(
        segment_length=2.9 - 0.13 * n,
        segment_mass=2e-3 * np.exp(-0.31 * n),
        radius=0.27 - 0.011 * n,
        stiffness=7.1 * np.exp(-0.53 * n),
        damping=3.7 * np.exp(-0.47 * n),
        rest_angle=0.004 * np.sin(n),
        sensors=list(SENSORS),
        name="awkward",
    )


def list_trials() -> list[feeler.Trial]:
    """Three touches that differ in everything."""
    base = feeler.BaseMotion(velocity=(0.03, -0.02), turn=0.004)
    return [
        feeler.Trial(
            feature=feeler.Triangle(half_width=1.3),
            location=0.83,
            speed=0.37,
            approach=81.0,
            lead=0.9,
            friction=0.4,
        ),
        feeler.Trial(
            feature=feeler.Ball(radius=0.9), location=0.52, speed=0.61, side="right", lead=1.7
        ),
        feeler.Trial(
            feature=feeler.Box(half_width=1.1, half_height=2.3),
            location=0.67,
            speed=0.23,
            approach=97.0,
            lead=0.7,
            base=base,
        ),
    ]


@cache
def _simulate() -> xr.Dataset:
    return feeler.touch(
        make_antenna(),
        list_trials(),
        duration=INTERVAL * N_SAMPLES,
        sample_interval=INTERVAL,
        seed=5,
    )


def make_set() -> xr.Dataset:
    """What ``feeler.touch`` makes of them, a copy of one's own."""
    return _simulate().copy(deep=True)
