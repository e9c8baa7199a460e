"""The rotated form of noise has the same statistics as copies drawn whole."""

import numpy as np

from feeler.decoding import Relative, compute_sweep
from feeler.decoding.noise import draw_rotated


def test_rotated_copies_have_the_clean_inner_products_and_the_moments_of_noise():
    rng = np.random.default_rng(3)
    clean = rng.normal(size=(3, 400))
    owner = np.array([0, 0, 1, 2])
    sd = np.array([0.5, 0.5, 1.0, 2.0])
    grams = []
    for _ in range(400):
        noisy, turned = draw_rotated(clean, owner, sd, rng)
        np.testing.assert_allclose(turned @ turned.T, clean @ clean.T, rtol=1e-10)
        grams.append(noisy @ noisy.T)
    expected = (clean @ clean.T)[np.ix_(owner, owner)] + np.diag(400 * sd**2)
    spread = np.std(grams, axis=0)
    np.testing.assert_array_less(np.abs(np.mean(grams, axis=0) - expected), 5 * spread / 20)
    direct = [clean[owner] + sd[:, None] * rng.normal(size=(4, 400)) for _ in range(400)]
    np.testing.assert_allclose(spread, np.std([x @ x.T for x in direct], axis=0), rtol=0.25)


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
    plain = compute_sweep(tensors, labels, **options)
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
