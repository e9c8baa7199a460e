"""Figures 4, 5F–G and S5 from small made-up touches: what they hold, and that they draw."""

from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

from feeler.errors import InvalidInput
from paper import fig4, fig5f, figS5
from paper.fig4 import prepare
from paper.scale import SCALES

QUICK = SCALES["quick"]


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


def test_fig4(touched):
    data = fig4.compute(touched, effort=replace(QUICK, ranks=(2, 3), restarts=2))
    assert data.residual.shape == data.entropy["mass per tensor"].shape == (2, 2)
    assert data.residual[1, 0] < data.residual[0, 0]
    assert next(iter(data.examples)) == "ball 0.5"
    assert len(data.examples) == 10
    codes = data.residual_by_code
    assert codes["nonnegative"] <= codes["sparse"] + 1e-3
    assert data.sparseness_by_code["sparse"] == pytest.approx(0.8, abs=1e-6)
    assert data.mapping["ridge"].p_information < 0.01
    assert data.mapping["ridge"].correlation > 0.8
    draw(fig4.plot, data)


def test_fig5f(touched):
    data = fig5f.compute(
        {"exponential": touched, "uniform": make_dataset(width=5)}, effort=QUICK
    )
    entropy = data.entropy["histogram of [0, 1]"]
    means = {name: np.nanmean(values[0]) for name, values in entropy.items()}
    assert min(means, key=means.get) == "exponential"
    assert data.entropy["probability mass"]["uniform"].shape == (1, 3)  # restart, component
    assert set(data.mapping) == {"exponential", "uniform"}
    draw(fig5f.plot, data)


def test_figS5(touched):
    data = figS5.compute(touched, effort=QUICK, durations=(10, 40))
    assert data.residual.shape == (2,)
    np.testing.assert_allclose(data.basis_similarity[1], 1)
    assert data.profile_similarity.shape == (2, 3)
    draw(figS5.plot, data)


def test_what_is_encoded_is_rectified_and_named(touched):
    assert prepare(touched).min() == 0
    with pytest.raises(InvalidInput, match="quantity must be one of 'angle', 'curvature'"):
        prepare(touched, "torque")
    with pytest.raises(
        InvalidInput, match="unknown scale 'huge'; valid: smoke, quick, published, paper"
    ):
        SCALES["huge"]
