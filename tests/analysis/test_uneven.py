"""Noise of an sd for each entry: the ideal observer, a closed form, and noise drawn whole."""

import numpy as np
import pytest
from scipy.stats import norm

from feeler.analysis import (
    compute_information,
    compute_information_known_noise,
    find_noise,
    find_told,
)
from feeler.errors import InvalidInput
from feeler.objects import Common, Mixed, Relative


@pytest.fixture
def tensors():
    steps = np.random.default_rng(0).standard_normal((6, 4, 30))
    return np.cumsum(steps, axis=2) * 0.05


@pytest.mark.parametrize("sd", [0.4, 0.9])
def test_of_even_noise_it_is_the_ideal_observer(tensors, sd):
    own = compute_information_known_noise(
        tensors, np.full(tensors.shape, sd), n_draws=3000, random_state=1
    )
    ideal = compute_information(tensors, sd, n_draws=3000)
    assert own.accuracy == pytest.approx(ideal.accuracy, abs=4 * own.accuracy_error)
    assert own.bits == pytest.approx(ideal.bits, abs=4 * own.bits_error)


def test_two_touches_in_noise_of_two_sizes():
    """A linear rule: each is right in Φ(half its weighed distance over the sd of the rule)."""
    means, sd = np.array([[0.0, 0.0], [1.0, 0.5]]), np.array([[0.5, 0.5], [1.5, 0.25]])
    weight = 1 / np.mean(sd**2, axis=0)
    step = means[1] - means[0]
    half = np.sum(step**2 * weight) / 2
    truth = norm.cdf(half / np.sqrt(np.sum((step * weight * sd) ** 2, axis=1))).mean()
    found = compute_information_known_noise(means, sd, n_draws=20_000)
    assert found.accuracy == pytest.approx(truth, abs=4 * found.accuracy_error)


@pytest.mark.parametrize("noise", [Mixed(0.5, share=2.0), Mixed(0.5, share=1.0, each="vector")])
def test_the_short_way_equals_noise_drawn_whole(tensors, noise):
    sd = np.broadcast_to(noise.sd(tensors), tensors.shape)
    met = noise.add(tensors, np.random.default_rng(2), 3000).reshape(3000, 6, -1)
    weight = 1 / np.mean(sd**2, axis=0).ravel()
    far = met[:, :, None] - tensors.reshape(6, -1)
    logs = -0.5 * np.sum(far**2 * weight, axis=3)
    right = np.mean(logs.argmax(axis=2) == np.arange(6))
    own = np.diagonal(logs, axis1=1, axis2=2) - np.logaddexp.reduce(logs, axis=2)
    found = compute_information_known_noise(tensors, noise.sd(tensors), n_draws=3000)
    assert found.accuracy == pytest.approx(right, abs=0.015)
    assert found.bits == pytest.approx(np.log2(6) + own.mean() / np.log(2), abs=0.05)


def test_the_size_of_the_noise_alone_tells_nothing():
    """An observer who took it for a signal would know each of these at any level."""
    rng = np.random.default_rng(3)
    sd = 0.5 + rng.random((5, 4000))
    assert compute_information_known_noise(np.ones((5, 4000)), sd).bits == pytest.approx(
        0.0, abs=1e-9
    )


@pytest.mark.parametrize("noise", [Common(1.0), Relative(1.0), Mixed(1.0, share=5.0)])
def test_at_the_level_found_that_share_is_named_right(tensors, noise):
    sd = noise.sd(tensors)
    level = find_told(tensors, sd, 0.75, n_draws=400)
    assert compute_information_known_noise(
        tensors, level * sd, n_draws=400
    ).accuracy == pytest.approx(0.75, abs=0.01)


def test_the_level_of_common_noise_is_that_of_even_noise(tensors):
    level = find_told(tensors, Common(1.0).sd(tensors), 0.75, n_draws=400)
    assert level == pytest.approx(find_noise(tensors, 0.75)[0], rel=0.05)


def test_touches_that_are_the_same_have_no_level(tensors):
    same = np.repeat(tensors[:1], 3, axis=0)
    assert np.isnan(find_told(same, np.ones_like(same)))


@pytest.mark.parametrize(
    ("sd", "said"),
    [
        (np.ones((6, 4, 31)), "shape"),
        (np.zeros((6, 4, 30)), "sd > 0 everywhere"),
        (np.full((6, 4, 30), np.nan), "finite"),
    ],
)
def test_noise_that_cannot_be_is_refused(tensors, sd, said):
    with pytest.raises(InvalidInput, match=said):
        compute_information_known_noise(tensors, sd)
    with pytest.raises(InvalidInput, match="at least two tensors"):
        compute_information_known_noise(tensors[:1], np.ones((1, 4, 30)))


@pytest.mark.parametrize("sd", [[[0.3], [2.4]], [[0.2, 1.5], [2.0, 0.7]]], ids=["one", "two"])
def test_of_two_touches_it_tells_what_the_normal_law_of_its_log_odds_says(sd):
    """Touches at ±x: with entries weighed by w = 1 / ⟨g²⟩ the log odds of the true one are normal,
    with a mean of 2 Σ w x² and an sd of 2 √(Σ w² g² x²); their bits are 1 − ⟨log₂(1 + 1/odds)⟩.
    """
    g = np.array(sd)
    x = np.array([0.6, 0.9])[: g.shape[1]]
    weight = 1 / np.mean(g**2, axis=0)
    middle = np.full(2, 2 * np.sum(weight * x**2))
    spread = 2 * np.sqrt(np.sum((weight * g * x) ** 2, axis=1))
    z, share = np.polynomial.hermite_e.hermegauss(120)
    odds = middle[:, None] + spread[:, None] * z
    lost = (np.logaddexp(0, -odds) * share / share.sum()).sum(axis=1) / np.log(2)
    found = compute_information_known_noise(np.stack([-x, x]), g, n_draws=100_000)
    right = norm.cdf(middle / spread).mean()
    assert found.accuracy == pytest.approx(right, abs=4 * found.accuracy_error)
    assert found.bits == pytest.approx(1 - lost.mean(), abs=4 * found.bits_error)
    assert found.bits_error < 0.003
