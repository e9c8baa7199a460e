"""Bases that begin at the wrong lag come to where their patterns begin."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from feeler.encoding import (
    ConvolutiveNMF,
    compute_stability,
    hoyer_sparseness,
    match_components,
    project_to_sparseness,
    reconstruct,
)
from feeler.encoding.convolution import compute_activation_gram, descend_bases, multiply_bases
from feeler.encoding.factorise import Data, _slide_bases
from feeler.errors import InvalidInput

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


@pytest.mark.parametrize(
    ("vector", "expected"),
    [([0, 3, 0, 0], 1), ([2, 2, 2], 0), ([3, 4], (2**0.5 - 1.4) / (2**0.5 - 1))],
)
def test_sparseness_of_known_vectors(vector, expected):
    assert hoyer_sparseness(np.array(vector)) == pytest.approx(expected)


def test_sparseness_ignores_scale_and_takes_any_axis():
    values = np.random.default_rng(0).random((4, 30))
    np.testing.assert_allclose(
        hoyer_sparseness(1e-200 * values.T, axis=0), hoyer_sparseness(values)
    )


def test_sparseness_of_entries_whose_squares_underflow_is_that_of_their_ratios():
    for vector in ([1.0, 0.0, 2.0], [1.0, 3.0, 2.0]):
        assert hoyer_sparseness(1e-200 * np.array(vector)) == pytest.approx(
            hoyer_sparseness(vector), rel=1e-12
        )


def test_sparseness_of_zeros_is_undefined():
    assert np.isnan(hoyer_sparseness(np.zeros(5)))


@settings(max_examples=150, deadline=None)
@given(
    arrays(float, st.integers(2, 200), elements=st.floats(-1e3, 1e3, width=32)),
    st.floats(0, 0.99),
)
def test_projection_reaches_the_sparseness_asked(vector, sparseness):
    projected = project_to_sparseness(vector, sparseness)
    assert (projected >= 0).all()
    assume(projected.any())
    assert hoyer_sparseness(projected) == pytest.approx(sparseness, abs=1e-6)


@pytest.mark.parametrize("sparseness", [0.1, 0.5, 0.8, 0.95])
def test_projection_is_the_nearest_point(sparseness):
    """No other vector of this sparseness lies nearer: not those made from random vectors, not those
    near by.
    """
    rng = np.random.default_rng(3)
    vector = rng.normal(size=40)
    projected = project_to_sparseness(vector, sparseness)
    distance = np.linalg.norm(vector - projected)
    others = [rng.normal(size=40) for _ in range(200)] + [
        projected + 1e-3 * rng.normal(size=40) for _ in range(200)
    ]
    rivals = [project_to_sparseness(other, sparseness) for other in others]
    rivals = [
        rival * max(0, rival @ vector) / (rival @ rival) for rival in rivals if rival.any()
    ]
    assert len(rivals) > 300
    assert min(np.linalg.norm(vector - rival) for rival in rivals) >= distance - 1e-12


def test_projection_leaves_a_point_of_the_set_alone():
    once = project_to_sparseness(np.random.default_rng(1).normal(size=100), 0.7)
    np.testing.assert_allclose(project_to_sparseness(once, 0.7), once, atol=1e-12)


def test_equal_peaks_are_settled_the_same_way_each_time():
    vector = np.ones(50)
    first = project_to_sparseness(vector, 0.8)
    assert hoyer_sparseness(first) == pytest.approx(0.8, abs=1e-6)
    np.testing.assert_array_equal(first, project_to_sparseness(vector, 0.8))


def test_of_too_many_equal_peaks_the_earliest_are_kept():
    """The nearest point is not unique then, also among low entries, which measure the ramp."""
    for low in (1.0, 0.5, -3.0):
        projected = project_to_sparseness(np.array([1.0] * 40 + [low] * 10), 0.8)
        assert np.flatnonzero(projected).max() < 20
        assert (np.diff(projected[:40]) <= 0).all()


@pytest.mark.parametrize("size", [1e-9, 1e9])
def test_the_nearest_point_grows_with_the_vector_ties_or_not(size):
    for vector in (
        np.r_[np.full(40, 1.0), np.full(10, -3.0)],
        np.random.default_rng(1).random(50),
    ):
        np.testing.assert_allclose(
            project_to_sparseness(size * vector, 0.8),
            size * project_to_sparseness(vector, 0.8),
            rtol=1e-5,
        )


@pytest.mark.parametrize("sparseness", [-0.1, 1.0, 1.5])
def test_impossible_sparseness_is_refused(sparseness):
    with pytest.raises(InvalidInput, match=r"sparseness must lie in \[0, 1\)"):
        project_to_sparseness(np.ones(4), sparseness)


@pytest.mark.parametrize("vector", [np.ones((3, 2)), np.ones(1)])
def test_only_vectors_of_several_entries_are_projected(vector):
    with pytest.raises(InvalidInput):
        project_to_sparseness(vector, 0.5)


def test_one_entry_has_no_sparseness():
    with pytest.raises(InvalidInput, match="at least 2 entries"):
        hoyer_sparseness(np.ones((3, 1)))


@pytest.mark.parametrize("ties", [2, 6, 8])
def test_equal_peaks_stay_equal_where_the_nearest_point_is_unique(ties):
    """12 entries at sparseness 0.2 allow ‖u‖₁² up to 8.8: fewer equal peaks leave one nearest
    point, symmetric in them.
    """
    vector = np.array([2.0] * ties + [1.0] * (12 - ties))
    projected = project_to_sparseness(vector, 0.2)
    assert hoyer_sparseness(projected) == pytest.approx(0.2, abs=1e-12)
    np.testing.assert_array_equal(projected[:ties], projected[0])
    np.testing.assert_array_equal(projected[ties:], projected[-1])
