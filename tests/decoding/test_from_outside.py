"""A new dispersion index and noise model from outside the package go through to figures."""

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Text
from scipy.spatial.distance import cdist
from sklearn.neighbors import KNeighborsClassifier

from feeler.analysis import INDICES, Index, compute_dispersion
from feeler.decoding import NOISES, Noise, compute_sweep, make_codes
from feeler.decoding.curves import Group, compute_curves
from feeler.decoding.sweeps import Plan
from feeler.encoding import ConvolutiveNMF
from feeler.errors import InvalidInput
from feeler.plotting.results import plot_curves, plot_index

PLAN = Plan(
    ratios=(0.2,), n_repeats=1, n_copies=4, other_copies=(), before_repeats=0, n_restarts=1
)


def make_cosine(tensors):
    """Cosine distance of flattened tensors."""
    flat = tensors.reshape(len(tensors), -1)
    return lambda rows, columns: cdist(flat[rows], flat[columns], "cosine")


class Dropout(Noise):
    """Each entry is lost with a probability."""

    def add(self, codes, rng, n_copies=1):
        kept = rng.random((n_copies, *codes.shape)) >= self.size
        return (kept * codes).reshape(-1, *codes.shape[1:])


@pytest.fixture
def added():
    INDICES.register(
        "cosine", Index(label="cosine distance", make=make_cosine, is_similarity=False)
    )
    NOISES.register("dropout", Dropout)
    yield
    INDICES.unregister("cosine")
    NOISES.unregister("dropout")


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


@pytest.mark.long
def test_a_noise_model_goes_through_every_curve_to_a_figure(added, tensors):
    encoder = ConvolutiveNMF(
        n_components=2, n_lags=5, n_restarts=1, max_iter=5, warn=False, random_state=0
    )
    group = Group(
        tensors=tensors,
        labels=np.arange(6),
        encoder=encoder,
        codes=make_codes(tensors, encoder, ("sparse", "raw")),
    )
    curves = compute_curves({"a": group}, PLAN, kinds=("sparse", "raw"))
    assert curves.noises == ("relative", "common", "dropout")
    assert set(curves.find("raw", "dropout")) == set(curves.find("sparse", "dropout")) == {"a"}
    figure = Figure()
    plot_curves(curves, "raw", "dropout", figure.subplots())
    assert "a" in [line.get_label() for line in figure.axes[0].lines]


def test_without_loss_every_touch_is_known_and_with_all_lost_none_is(added, tensors):
    nearest = KNeighborsClassifier(1)
    options = {"noise": "dropout", "n_repeats": 1, "n_copies": 4, "estimator": nearest}
    sweep = compute_sweep(tensors, np.arange(6), ratios=(0.0, 1.0), **options)
    assert sweep.noisy[:, 0].tolist() == [1.0, sweep.chance]
    with pytest.raises(InvalidInput, match="rotate needs noise that is the same over a trial"):
        compute_sweep(tensors, np.arange(6), noise="dropout", rotate=True)
