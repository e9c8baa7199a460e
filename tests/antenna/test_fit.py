"""The sigmoid of segment lengths comes back from antennae that were made with it."""

import numpy as np
import pytest

from feeler.antenna import Sigmoid
from feeler.antenna.animals import fit_sigmoid
from feeler.errors import InvalidInput

PLANTED = Sigmoid(low=0.00349, rise=0.00588, slope=11.06, centre=0.377)


def make_lengths(n, rng=None, scatter=0.0, length=42.0):
    share = PLANTED.sample(n)
    if rng is not None:
        share = share * np.exp(scatter * rng.standard_normal(n))
    return length * share / share.sum()


def test_an_exact_sigmoid_is_found_exactly():
    fit = fit_sigmoid([make_lengths(140), make_lengths(140, length=38.0)])
    total = PLANTED.sample(140).sum()
    np.testing.assert_allclose(
        [fit.sigmoid.slope, fit.sigmoid.centre], [11.06, 0.377], rtol=1e-5
    )
    np.testing.assert_allclose(
        [fit.sigmoid.low, fit.sigmoid.rise], np.array([0.00349, 0.00588]) / total, rtol=1e-5
    )
    assert fit.squared_residual < 1e-16


def test_antennae_of_different_counts_are_put_on_one_scale():
    fit = fit_sigmoid([make_lengths(140), make_lengths(150), make_lengths(133)])
    assert fit.share.shape == (3, 150)
    np.testing.assert_allclose(fit.share.sum(axis=1), 1.0)
    assert fit.sigmoid.centre == pytest.approx(0.377, abs=0.01)


def test_residuals_are_those_of_the_fit():
    rng = np.random.default_rng(4)
    fit = fit_sigmoid([make_lengths(140, rng, 0.08) for _ in range(4)])
    curve = fit.sigmoid.at(fit.x)
    assert fit.squared_residual == pytest.approx(np.sum((fit.share.mean(axis=0) - curve) ** 2))
    planted = np.sum(
        (fit.share.mean(axis=0) - PLANTED.sample(140) / PLANTED.sample(140).sum()) ** 2
    )
    assert fit.squared_residual <= planted


@pytest.mark.parametrize(
    ("lengths", "match"),
    [
        ([], "at least one antenna"),
        ([np.ones(3)], "at least 8 lengths"),
        (
            [np.ones(140), np.where(np.arange(140) == 7, np.nan, 1.0)],
            "antenna 2 has segment lengths",
        ),
        ([np.zeros(140)], "finite and > 0"),
    ],
)
def test_bad_lengths_are_refused(lengths, match):
    with pytest.raises(InvalidInput, match=match):
        fit_sigmoid(lengths)
