"""Noise has the size asked for, relative to what is said; a new model gives sd or add."""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.objects import NOISES, Common, Mixed, Noise, Relative, parse_noise


@pytest.fixture
def codes():
    codes = np.random.default_rng(0).random((4, 3, 500))
    return (
        codes
        * np.array([1.0, 2.0, 5.0, 10.0])[:, None, None]
        * np.array([1.0, 0.5, 0.1])[:, None]
    )


class Proportional(Noise):
    """Each entry has an sd of its own."""

    def sd(self, tensors):
        return self.size * np.abs(tensors)


class Dropout(Noise):
    """Each entry is lost with a probability."""

    def add(self, tensors, rng, n_copies=1):
        kept = rng.random((n_copies, *np.shape(tensors))) >= self.size
        return (kept * tensors).reshape(-1, *np.shape(tensors)[1:])


@pytest.mark.parametrize(
    ("noise", "peak"),
    [
        (Relative(0.2, each="vector"), lambda c: c.max(axis=2, keepdims=True)),
        (Relative(0.2), lambda c: c.max(axis=(1, 2), keepdims=True)),
        (Common(0.2, reference=None), lambda c: np.full((1, 1, 1), c.max())),
        (Common(0.2), lambda c: np.ones((1, 1, 1))),
        (Common(0.2, reference=50.0), lambda c: np.full((1, 1, 1), 50.0)),
        (Proportional(0.2), np.abs),
        (Mixed(0.2, share=0.6), lambda c: np.sqrt(1 + 9 * c**2)),
        (
            Mixed(0.2, share=0.2, each="tensor"),
            lambda c: np.sqrt(1 + c.max(axis=(1, 2), keepdims=True) ** 2),
        ),
    ],
)
def test_noise_is_the_ratio_of_the_maximum_named(codes, noise, peak):
    sd = noise.sd(codes)
    np.testing.assert_allclose(sd, 0.2 * peak(codes))
    copies = noise.add(codes, np.random.default_rng(1), 20).reshape(20, *codes.shape)
    measured = np.sqrt(((copies - codes) ** 2).mean(axis=(0, 3)))
    expected = np.sqrt(np.mean(np.broadcast_to(sd, codes.shape) ** 2, axis=2))
    np.testing.assert_allclose(measured, expected, rtol=0.05)


@pytest.mark.parametrize(
    ("noise", "expected"),
    [
        (Relative(each="vector"), [[4.0, 2.0], [1.0, 5.0]]),
        (Relative(), [[4.0, 4.0], [5.0, 5.0]]),
        (Common(0.1, reference=None), [[5.0, 5.0], [5.0, 5.0]]),
    ],
)
def test_noise_of_signed_codes_goes_by_their_greatest_magnitude(noise, expected):
    codes = np.array([[[1.0, -4.0], [2.0, 1.0]], [[-1.0, 0.5], [3.0, -5.0]]])
    sd = np.broadcast_to(noise.sd(codes), codes.shape)
    np.testing.assert_allclose(
        sd, 0.1 * np.array(expected)[:, :, None] * np.ones(2), rtol=1e-12
    )


def test_copies_are_fresh_and_in_turn(codes):
    copies = Common(0.0).add(codes, np.random.default_rng(1), 3)
    np.testing.assert_array_equal(copies, np.tile(codes, (3, 1, 1)))
    noisy = Common(1.0).add(codes, np.random.default_rng(1), 2) - np.tile(codes, (2, 1, 1))
    assert np.abs(np.corrcoef(noisy[0].ravel(), noisy[4].ravel())[0, 1]) < 0.2


def test_the_sd_of_a_model_that_only_draws_is_measured(codes):
    sd = Dropout(0.3).sd(codes)
    np.testing.assert_allclose(sd.mean(), np.sqrt(0.3) * codes.mean(), rtol=0.02)


@pytest.mark.parametrize(
    ("noise", "even"),
    [
        (Relative(), True),
        (Common(), True),
        (Relative(each="vector"), False),
        (Mixed(), False),
        (Mixed(each="tensor"), True),
        (Proportional(), False),
        (Dropout(), False),
    ],
)
def test_noise_is_even_where_one_sd_holds_for_a_trial(codes, noise, even):
    assert noise.is_even(codes) == even


@pytest.mark.parametrize(
    "noise",
    [Relative(0.3), Common(0.3), Relative(0.3, each="vector"), Proportional(0.3), Dropout(0.3)],
)
def test_in_the_unit_of_whitened_tensors_the_noise_has_its_size(codes, noise):
    """On the average over a trial; for even noise, everywhere."""
    white = noise.whiten(codes)
    unit = (codes / white)[:, :1, :1]
    noisy = noise.add(codes, np.random.default_rng(2), 40).reshape(40, *codes.shape) / unit
    spread = np.sqrt(((noisy - white) ** 2).mean(axis=(0, 2, 3)))
    np.testing.assert_allclose(spread, 0.3, rtol=0.05)
    np.testing.assert_allclose(white * unit, codes)


@pytest.mark.parametrize(
    ("text", "noise"),
    [
        ("relative:0.25", Relative(0.25)),
        ("relative:0.25,each=vector", Relative(0.25, each="vector")),
        ("common:0.03", Common(0.03)),
        ("common:0.5,reference=2.0", Common(0.5, reference=2.0)),
        ("common:0.5,reference=None", Common(0.5, reference=None)),
    ],
)
def test_text_and_noise_are_one(text, noise):
    assert parse_noise(text) == noise == parse_noise(noise) and str(noise) == text


def test_a_name_alone_has_the_models_own_size():
    assert parse_noise("relative") == Relative() and parse_noise("common").size == 0.03


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda c: Relative(-0.1), "Relative.size must be ≥ 0, got -0.1"),
        (lambda c: Common(np.nan), "Common.size must be .* got nan"),
        (lambda c: parse_noise("common:loud"), "Common.size must be .* got 'loud'"),
        (lambda c: Relative(each="row"), "one of vector, tensor, got 'row'"),
        (lambda c: NOISES["pink"], "unknown noise model 'pink'; valid: relative, common"),
        (lambda c: Common().add(c, np.random.default_rng(0), 0), "n_copies"),
        (
            lambda c: Relative().whiten(c * [[[1]], [[1]], [[0]], [[1]]]),
            "no level for tensor 2",
        ),
        (lambda c: Common(0.0).whiten(c), "common:0 has no level"),
        (lambda c: Noise(0.1).sd(c), "must define sd or add"),
    ],
)
def test_bad_noise_is_refused(codes, call, message):
    with pytest.raises(InvalidInput, match=message):
        call(codes)
