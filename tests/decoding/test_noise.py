"""The rotated form of noise has the same statistics as copies drawn whole."""

import numpy as np
import pytest

from feeler.decoding import Relative, compute_sweep, make_lda, sweeps
from feeler.decoding.sweeps import draw_rotated, span


@pytest.mark.parametrize("n_learned", [4, 2])
@pytest.mark.parametrize("n_entries", [400, 5])
def test_rotated_copies_have_the_clean_inner_products_and_the_moments_of_noise(
    n_entries, n_learned
):
    rng = np.random.default_rng(3)
    clean = rng.normal(size=(3, n_entries))
    owner = np.array([0, 0, 1, 2])
    sd = np.array([0.5, 0.5, 1.0, 2.0])
    turned = span(clean)
    np.testing.assert_allclose(turned @ turned.T, clean @ clean.T, rtol=1e-10)
    grams = []
    for _ in range(400):
        noisy = sd[:, None] * draw_rotated(turned.shape[1], n_entries, 4, rng, n_learned)
        noisy[:, : turned.shape[1]] += turned[owner]
        grams.append(noisy @ noisy.T)
    counts = np.zeros((4, 4), dtype=bool)
    counts[:n_learned] = counts[:, :n_learned] = True
    expected = (clean @ clean.T)[np.ix_(owner, owner)] + np.diag(n_entries * sd**2)
    spread = np.std(grams, axis=0)
    off = np.abs(np.mean(grams, axis=0) - expected)
    np.testing.assert_array_less(off[counts], 5 * spread[counts] / 20)
    direct = [clean[owner] + sd[:, None] * rng.normal(size=(4, n_entries)) for _ in range(400)]
    plain = np.std([x @ x.T for x in direct], axis=0)
    np.testing.assert_allclose(spread[counts], plain[counts], rtol=0.25)


def test_rotated_sweep_agrees_with_the_plain_one():
    rng = np.random.default_rng(0)
    tensors = 0.3 * rng.random((6, 10, 60)) + 2 * rng.random((10, 60))
    labels = np.arange(6)
    options = {
        "ratios": (0.1, 0.3),
        "n_copies": 10,
        "n_repeats": 10,
        "noise": Relative(each="tensor"),
    }
    plain = compute_sweep(tensors, labels, rotate=False, **options)
    turned = compute_sweep(tensors, labels, rotate=True, **options)
    assert (
        0.3 < plain.noisy[1].mean() < 0.97
    )  # neither floor nor ceiling, so that agreement means something
    np.testing.assert_allclose(turned.noisy.mean(axis=1), plain.noisy.mean(axis=1), atol=0.06)
    np.testing.assert_allclose(
        turned.kept_noisy.mean(axis=1), plain.kept_noisy.mean(axis=1), atol=0.01
    )
    np.testing.assert_allclose(
        turned.kept_clean.mean(axis=1), plain.kept_clean.mean(axis=1), atol=0.06
    )


def test_copies_that_are_never_drawn_are_classified_as_drawn_ones(monkeypatch):
    """Uneven noise, held-out trials: accuracy and variance kept, over the spread of repeats."""
    rng = np.random.default_rng(1)
    every = (0.3 * rng.random((9, 7, 50)) + rng.random((7, 50))) * rng.uniform(1, 3, (9, 1, 1))
    options = {
        "ratios": (0.1, 0.3),
        "n_copies": 12,
        "n_repeats": 12,
        "noise": Relative(each="tensor"),
        "held_out": (every[4:], np.arange(4, 9)),
        "estimator": make_lda(6),
    }
    drawn = compute_sweep(every, np.arange(9), **options)
    monkeypatch.setattr(sweeps, "_MOST_COPIES", 10)
    unseen = compute_sweep(every, np.arange(9), **options)
    assert 0.3 < drawn.noisy[1].mean() < 0.9
    for name in ("noisy", "clean", "kept_noisy", "kept_clean"):
        a, b = getattr(drawn, name), getattr(unseen, name)
        spread = np.sqrt((a.var(axis=1) + b.var(axis=1)) / 11)
        np.testing.assert_array_less(abs(a.mean(axis=1) - b.mean(axis=1)), 4 * spread + 1e-3)


def test_products_with_an_unseen_matrix_are_those_of_one_matrix():
    """Linear from both sides, so equal to a matrix; its entries are normal."""
    rng = np.random.default_rng(2)
    noise = sweeps.UnseenNoise(4, 3, rng)
    first = rng.normal(size=3)
    product, back = noise.multiply(first), noise.multiply(np.eye(4)[1], transposed=True)
    whole = np.stack([noise.multiply(one) for one in np.eye(3)], axis=1)
    np.testing.assert_allclose(whole @ first, product, rtol=1e-9)
    np.testing.assert_allclose(whole[1], back, rtol=1e-9)
    drawn = []
    for _ in range(3000):
        noise = sweeps.UnseenNoise(4, 3, rng)
        noise.multiply(first), noise.multiply(np.ones(4), transposed=True)
        drawn.append([noise.multiply(one) for one in np.eye(3)])
    cov = np.cov(np.reshape(drawn, (3000, 12)), rowvar=False)
    np.testing.assert_allclose(cov, np.eye(12), atol=0.13)
