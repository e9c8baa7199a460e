"""Figures 5 and S6, the comparison page and the network's absence, on small planted tensors."""

import re

import matplotlib
import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from sklearn.base import BaseEstimator

from feeler.comparison import compare_antennas, write_comparison
from feeler.decoding import list_groups
from feeler.decoding.sweeps import Plan
from feeler.errors import InvalidInput
from paper import fig5, fig5_data, figS6
from tests.pages import FOREIGN

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


@pytest.fixture(scope="module")
def data(tensors):
    return fig5_data.compute(tensors, SumEncoder(), plan=PLAN)


def draw_fig5(data, figure):
    """With accuracies of each group's own name that fall with the noise."""
    ratios = (0.0, 0.1, 0.3)
    traced = {
        comparison: {str(name): np.array([[0.9, 0.8], [0.4, 0.5]]) for name in groups}
        for comparison, groups in data.groups.items()
    }
    fig5.plot(data, traced, ratios, figure)
    below = [ax for ax in figure.axes if ax.get_title(loc="left") in ("c", "d")]
    for ax, groups in zip(below, traced.values(), strict=True):
        assert len(ax.get_lines()) == len(groups) + 1  # chance


def test_accuracies_are_listed_for_every_number_of_copies(data):
    for comparison, curves in data.curves.items():
        assert {row[2] for row in fig5._list_copies(comparison, curves)} == {"3", "4"}


def test_groups_hold_the_same_stimuli_in_the_same_order(tensors):
    listed = list_groups(tensors)
    assert list(listed["speed"]) == ["0.06 m/s", "0.6 m/s"]
    assert list(listed["profile"]) == ["exponential", "linear", "uniform"]
    labels = [tuple(y) for groups in listed.values() for _, y in groups.values()]
    assert len(set(labels)) == 1 and len(labels[0]) == 12


@pytest.mark.further
@pytest.mark.parametrize("plot", [draw_fig5, figS6.plot])
def test_figures_draw_every_group(data, plot):
    figure = Figure(figsize=(9, 9))
    plot(data, figure)
    written = {
        t.get_text()
        for ax in figure.findobj(matplotlib.axes.Axes)
        for t in ax.findobj(matplotlib.text.Text)
    }
    assert {"exponential", "linear", "uniform", "0.06 m/s", "0.6 m/s"} <= written


@pytest.mark.long
def test_one_antenna_alone_still_has_its_speeds(tensors):
    data = fig5_data.compute(
        {"mine": tensors["linear"]}, SumEncoder(), plan=PLAN, reference="mine"
    )
    assert list(data.curves) == ["speed"]
    draw_fig5(data, Figure())


@pytest.mark.long
def test_comparison_page_is_whole(tensors, tmp_path):
    found = compare_antennas(
        {"<a>": tensors["exponential"], "b": tensors["uniform"]}, SumEncoder(), plan=PLAN
    )
    page = write_comparison(found, tmp_path / "sub" / "page.html").read_text()
    assert "&lt;a&gt; against b" in page and "data:image/" in page
    assert not re.search(FOREIGN, page)  # nothing comes from elsewhere
    assert all(title.split(" (")[0].split(",")[0] in page for title, *_ in found.list_rows())
    row = {title: cells for title, *cells in found.list_rows()}
    assert float(row["accuracy, tensors, common noise (%)"][0]) > float(
        row["accuracy, tensors, common noise (%)"][1]
    )


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
