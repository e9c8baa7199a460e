"""Figures 5 and S6, the comparison page and the network's absence, on small planted tensors."""

import matplotlib
import numpy as np
import pytest
import xarray as xr
from sklearn.base import BaseEstimator

from feeler.comparison import compare_antennas
from feeler.decoding import list_groups
from feeler.decoding.sweeps import Plan
from feeler.errors import InvalidInput
from paper import fig5_data

matplotlib.use("Agg")
PLAN = Plan(
    ratios=(0.2,), n_repeats=2, n_copies=4, other_copies=(3,), before_copies=3, before_all=True
)


class SumEncoder(BaseEstimator):
    """Stands in for the convolutive NMF."""

    def __init__(self, n_restarts=1, random_state=None):
        self.n_restarts = n_restarts
        self.random_state = random_state

    def fit(self, X):
        self.components_ = X[:3, :, :5] + 1e-3
        self.activations_ = X.reshape(len(X), 3, -1, X.shape[2]).sum(axis=2)
        return self

    def transform(self, X, *, code):
        return X.reshape(len(X), 3, -1, X.shape[2]).sum(axis=2)


def make_tensors(spread, speeds=(0.6, 0.06)):
    """Slow touches and large ``spread`` set the stimuli apart in time."""
    grid = [
        (f, s, x, v)
        for v in speeds
        for x in (0.5, 0.7, 0.9)
        for s in (1.5, 3.0)
        for f in ("ball", "box")
    ]
    feature, size, location, speed = (np.array(column) for column in zip(*grid, strict=True))
    shift = 8 + spread * np.where(speed < 0.1, 1.0, 0.2) * (np.arange(len(grid)) % 12)
    time, sensor = np.arange(40), np.arange(12)
    rows = np.exp(-0.5 * ((sensor - 12 * location[:, None]) / 2) ** 2)
    angle = rows[:, :, None] * np.exp(-0.5 * ((time - shift[:, None]) / 2) ** 2)[:, None, :]
    coordinates = {"feature": feature, "size": size, "location": location, "speed": speed}
    return xr.Dataset(
        {"angle": (("trial", "sensor", "time"), angle, {"units": "rad"})},
        {k: ("trial", v) for k, v in coordinates.items()},
    )


@pytest.fixture(scope="module")
def tensors():
    return {
        "exponential": make_tensors(2.0),
        "linear": make_tensors(0.8),
        "uniform": make_tensors(0.1),
    }


def test_groups_hold_the_same_stimuli_in_the_same_order(tensors):
    listed = list_groups(tensors)
    assert list(listed["speed"]) == ["0.06 m/s", "0.6 m/s"]
    assert list(listed["profile"]) == ["exponential", "linear", "uniform"]
    labels = [tuple(y) for groups in listed.values() for _, y in groups.values()]
    assert len(set(labels)) == 1 and len(labels[0]) == 12


def test_antennas_may_have_different_numbers_of_sensors(tensors):
    fewer = tensors["uniform"].isel(sensor=slice(None, None, 2))
    found = compare_antennas({"a": tensors["exponential"], "b": fewer}, SumEncoder(), plan=PLAN)
    alone = compare_antennas({"b": fewer, "c": fewer}, SumEncoder(), plan=PLAN)
    # each antenna's own tensors, however many sensors its neighbour has
    np.testing.assert_allclose(
        found.dispersion["raw"].values("pearson", "b"),
        alone.dispersion["raw"].values("pearson", "b"),
    )


def test_bad_input_is_refused(tensors):
    with pytest.raises(InvalidInput, match="at least two antennas"):
        compare_antennas({"a": tensors["linear"]}, SumEncoder(), plan=PLAN)
    with pytest.raises(
        InvalidInput, match="no tensors of the reference antenna 'x'; given: exponential"
    ):
        fig5_data.compute(tensors, SumEncoder(), plan=PLAN, reference="x")
    with pytest.raises(InvalidInput, match="did any contact"):
        list_groups({"exponential": 0 * tensors["linear"]})
