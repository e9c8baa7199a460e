"""Figures 4, 5F–G and S5 from small made-up touches: what they hold, and that they draw."""

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from feeler.errors import InvalidInput
from paper.fig4 import prepare
from paper.scale import SCALES


def make_dataset(width=1.5, n_sensors=16, n_times=120):
    """Bumps at five locations, two features, two speeds; a little of it negative."""
    sensor, time = np.arange(n_sensors)[:, None], np.arange(n_times)[None, :]
    tensors, locations, features, speeds = [], [], [], []
    for location in (0.5, 0.6, 0.7, 0.8, 0.9):
        for feature, wide in (("ball", 1.0), ("box", 1.4)):
            for speed, lasting in ((0.6, 20), (0.06, 60)):
                phase = np.clip((time - 10) / lasting, 0, 1)
                bump = np.exp(
                    -0.5 * ((sensor - n_sensors * location - phase) / (width * wide)) ** 2
                )
                tensors.append(0.05 * bump * np.sin(np.pi * phase) - 1e-4)
                locations.append(location), features.append(feature), speeds.append(speed)
    coords = {
        "time": ("time", np.arange(n_times, dtype=float), {"units": "ms"}),
        "location": ("trial", locations),
        "feature": ("trial", features),
        "speed": ("trial", speeds),
        "size": ("trial", np.full(len(tensors), 1.5)),
    }
    return xr.Dataset(
        {"angle": (("trial", "sensor", "time"), np.array(tensors))}, coords=coords
    )


@pytest.fixture(scope="module")
def touched():
    return make_dataset()


def draw(plot, data):
    figure = Figure(figsize=(7, 7), layout="constrained")
    plot(data, figure)
    figure.canvas.draw()
    return figure


def test_what_is_encoded_is_rectified_and_named(touched):
    assert prepare(touched).min() == 0
    with pytest.raises(InvalidInput, match="quantity must be one of 'angle', 'curvature'"):
        prepare(touched, "torque")
    with pytest.raises(
        InvalidInput, match="unknown scale 'huge'; valid: smoke, quick, published, paper"
    ):
        SCALES["huge"]
