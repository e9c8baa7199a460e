"""A new dispersion index from outside the package goes through to a figure."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from scipy.spatial.distance import cdist

from feeler.analysis import INDICES, Index, compute_dispersion
from feeler.plotting.results import plot_index


def make_cosine(tensors):
    """Cosine distance of flattened tensors."""
    flat = tensors.reshape(len(tensors), -1)
    return lambda rows, columns: cdist(flat[rows], flat[columns], "cosine")


@pytest.fixture
def added():
    INDICES.register(
        "cosine", Index(label="cosine distance", make=make_cosine, is_similarity=False)
    )
    yield
    INDICES.unregister("cosine")


@pytest.fixture(scope="module")
def tensors():
    time, place = np.arange(60), np.linspace(15, 45, 6)[:, None]
    return np.exp(-0.5 * ((time - place) / 2) ** 2)[:, None, :] * np.ones((1, 4, 1))


def read_words(figure):
    return {text.get_text() for text in figure.findobj(Text)}


@pytest.mark.long
def test_an_index_goes_from_dispersion_to_a_figure(added, tensors):
    found = compute_dispersion({"a": tensors, "b": tensors[:, :2] + 0.1})
    expected = cdist(tensors.reshape(6, -1), tensors.reshape(6, -1), "cosine")
    np.fill_diagonal(expected, np.inf)
    np.testing.assert_allclose(
        found.values("cosine", "a"), expected.min(axis=1)
    )  # a distance: the least is the closest
    assert list(found.average) == ["pearson", "ssim", "mse", "nmi", "cosine"]
    figure = Figure()
    plot_index(found, "cosine", figure.subplots())
    assert {"a", "b"} <= read_words(figure)
