"""Bases that begin at the wrong lag come to where their patterns begin."""

import numpy as np
import pytest

from feeler.encoding import ConvolutiveNMF, compute_stability, match_components, reconstruct
from feeler.encoding.convolution import compute_activation_gram, descend_bases, multiply_bases
from feeler.encoding.factorise import Data, _slide_bases

N_LAGS = 12


@pytest.fixture(scope="module")
def truth():
    """(tensors, bases, activations): two patterns that begin at once, and fade."""
    rng = np.random.default_rng(2)
    bases = rng.random((2, 9, N_LAGS)) * np.exp(-np.arange(N_LAGS) / 4)
    activations = np.zeros((10, 2, 70))
    for trial in activations:
        for row in trial:
            row[rng.choice(np.arange(8, 55), 3, replace=False)] = rng.uniform(0.5, 1, 3)
    return reconstruct(bases, activations), bases, activations


def displace(bases, activations, lags):
    """The same patterns, ``lags`` later within their bases; what leaves them is lost."""
    displaced, moved = np.full_like(bases, 1e-3), np.zeros_like(activations)
    if lags > 0:
        displaced[:, :, lags:], moved[..., :-lags] = (
            bases[:, :, :-lags],
            activations[..., lags:],
        )
    else:
        displaced[:, :, :lags], moved[..., -lags:] = (
            bases[:, :, -lags:],
            activations[..., :lags],
        )
    return displaced, moved


@pytest.mark.parametrize("lags", [-4, 2, 5])
def test_displaced_bases_slide_back(truth, lags):
    tensors, bases, activations = truth
    found = _slide_bases(Data(tensors, N_LAGS), *displace(bases, activations, lags))
    assert found is not None
    _, before = match_components(bases, displace(bases, activations, lags)[0], shift=False)
    _, after = match_components(bases, found[0], shift=False)
    assert after.min() > max(0.95, before.max())
    kept = slice(abs(lags), 70 - abs(lags))
    np.testing.assert_array_equal(found[1][..., kept], activations[..., kept])


def test_bases_in_place_stay(truth):
    tensors, bases, activations = truth
    assert _slide_bases(Data(tensors, N_LAGS), bases, activations) is None


@pytest.mark.parametrize("n_lags", [1, 70])
def test_no_place_to_slide_to(truth, n_lags):
    tensors = truth[0]
    assert (
        _slide_bases(Data(tensors, n_lags), np.ones((1, 9, n_lags)), np.ones((10, 1, 70)))
        is None
    )


@pytest.mark.parametrize("constraint", ["trial", "all"])
def test_a_fit_from_the_wrong_lag_ends_as_low_as_one_from_the_truth(truth, constraint):
    tensors, bases, activations = truth
    model = ConvolutiveNMF(2, N_LAGS, 0.8, constraint=constraint, max_iter=60, warn=False)
    ends = []
    for components, codes in ((bases, activations), displace(bases, activations, 6)):
        model.fit(tensors, components=components, activations=codes)
        assert (np.diff(model.loss_curve_) <= 0).all()
        ends.append(model.relative_residual_)
    assert ends[1] < 1.05 * ends[0]


def test_stability_in_place_sees_a_shift():
    basis = np.zeros((1, 4, 10))
    basis[0, 1, 2:5] = 1
    pair = [basis, np.roll(basis, 2, axis=2)]
    assert compute_stability(pair) == pytest.approx(1)
    assert compute_stability(pair, shift=False) == pytest.approx(1 / 3)


def test_entries_end_where_no_other_value_is_better(truth):
    """The conditions of least squares with w ≥ 0, after many sweeps; fewer never end higher than as
    many multiplications.
    """
    tensors, bases, activations = truth
    data = Data(tensors, N_LAGS)
    seen, gram = data.gather(activations), compute_activation_gram(activations, N_LAGS)
    begun = np.random.default_rng(0).random(bases.shape)
    found, shared, square = descend_bases(begun, seen, gram, 3)
    _, slower, bent = multiply_bases(begun, seen, gram, 3)
    assert 0.5 * square - shared < 0.5 * bent - slower
    found, shared, square = descend_bases(begun, seen, gram, 5000)
    slope = np.einsum("kxs,ksmt->mxt", found, gram) - seen
    assert slope.min() > -1e-6
    assert np.abs(slope[found > 0]).max() < 1e-6
    rest = tensors - reconstruct(found, activations)
    assert 0.5 * data.energy - shared + 0.5 * square == pytest.approx(
        0.5 * (rest**2).sum(), abs=1e-9
    )


def test_wider_correlations_are_those_of_shifted_activations(truth):
    tensors, _, activations = truth
    data = Data(tensors, N_LAGS)
    wide = data.gather(activations, margin=3)
    np.testing.assert_allclose(wide[..., 3:-3], data.gather(activations), atol=1e-12)
    earlier = np.einsum("nmt,nxt->mx", activations[..., 3:], tensors[..., :-3])
    np.testing.assert_allclose(wide[..., 0], earlier, atol=1e-12)
