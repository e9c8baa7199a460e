"""Noise has the size asked for, relative to what is said, and the rotated form has the same
statistics.
"""

import numpy as np
import pytest

from feeler.decoding import NOISES, Common, Relative, compute_sweep
from feeler.decoding.noise import draw_copies, draw_rotated
from feeler.errors import InvalidInput


@pytest.fixture
def codes():
    codes = np.random.default_rng(0).random((4, 3, 500))
    return (
        codes * np.array([1.0, 2.0, 5.0, 10.0])[:, None, None] * np.array([1.0, 0.5, 0.1])[:, None]
    )


@pytest.mark.parametrize(
    ("noise", "peak"),
    [
        (Relative(), lambda c: c.max(axis=2, keepdims=True)),
        (Relative(each="tensor"), lambda c: c.max(axis=(1, 2), keepdims=True)),
        (Common(), lambda c: np.full((1, 1, 1), c.max())),
    ],
)
def test_noise_is_the_ratio_of_the_maximum_named(codes, noise, peak):
    sd = noise.sd(codes, 0.2)
    np.testing.assert_allclose(sd, 0.2 * peak(codes))
    copies = noise.draw(codes, 0.2, 20, np.random.default_rng(1)).reshape(20, *codes.shape)
    measured = (copies - codes).std(axis=(0, 3))
    np.testing.assert_allclose(measured, np.broadcast_to(sd, (4, 3, 1))[:, :, 0], rtol=0.05)


@pytest.mark.parametrize(
    ("noise", "expected"),
    [
        (Relative(), [[4.0, 2.0], [1.0, 5.0]]),
        (Relative(each="tensor"), [[4.0, 4.0], [5.0, 5.0]]),
        (Common(), [[5.0, 5.0], [5.0, 5.0]]),
    ],
)
def test_noise_of_signed_codes_goes_by_their_greatest_magnitude(noise, expected):
    codes = np.array([[[1.0, -4.0], [2.0, 1.0]], [[-1.0, 0.5], [3.0, -5.0]]])
    sd = np.broadcast_to(noise.sd(codes, 0.1), codes.shape)
    np.testing.assert_allclose(sd, 0.1 * np.array(expected)[:, :, None] * np.ones(2), rtol=1e-12)


def test_common_noise_follows_the_reference(codes):
    np.testing.assert_allclose(Common(reference=50.0).sd(codes, 0.1), 5.0)


def test_copies_are_fresh_and_in_turn(codes):
    copies = draw_copies(codes, np.zeros((1, 1, 1)), 3, np.random.default_rng(1))
    np.testing.assert_array_equal(copies, np.tile(codes, (3, 1, 1)))
    noisy = draw_copies(codes, np.ones((1, 1, 1)), 2, np.random.default_rng(1))
    assert (
        np.abs(
            np.corrcoef(noisy[0].ravel() - codes[0].ravel(), noisy[4].ravel() - codes[0].ravel())[
                0, 1
            ]
        )
        < 0.2
    )


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


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda c: Relative().sd(c, -0.1), "ratio ≥ 0 .* got -0.1"),
        (lambda c: Common().sd(c, np.nan), "ratio ≥ 0"),
        (lambda c: Relative(each="row"), "each of vector, tensor, got 'row'"),
        (lambda c: NOISES["pink"], "unknown noise model 'pink'; valid: relative, common"),
        (lambda c: draw_copies(c, c, 0, np.random.default_rng(0)), "n_copies"),
    ],
)
def test_bad_noise_is_refused(codes, call, message):
    with pytest.raises(InvalidInput, match=message):
        call(codes)
