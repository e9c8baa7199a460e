"""Entropy, matching of bases, mapping of locations."""

import numpy as np
import pytest
from scipy.stats import permutation_test, spearmanr

from feeler.encoding import (
    compute_basis_similarity,
    compute_entropies,
    compute_histogram_entropy,
    compute_mass_entropy,
    compute_stability,
    locate_components,
    map_locations,
    match_components,
)
from feeler.encoding.convolution import canonicalise
from feeler.errors import InvalidInput


@pytest.mark.parametrize(
    ("values", "bits"),
    [
        (np.full((4, 4), 3.0), 0),
        (np.arange(256.0), 8),
        (np.repeat([0.0, 1.0], 8), 1),
        (np.zeros(5), 0),
    ],
)
def test_histogram_entropy_counts_grey_levels(values, bits):
    assert compute_histogram_entropy(values) == pytest.approx(bits)


@pytest.mark.parametrize(
    ("values", "bits"), [(np.ones(64), 6), (np.eye(1, 9), 0), ([0.5, 0.25, 0.25], 1.5)]
)
def test_mass_entropy_counts_sharing_entries(values, bits):
    assert compute_mass_entropy(7 * np.asarray(values)) == pytest.approx(bits)


def test_histogram_entropy_depends_on_scale_only_where_told():
    values = np.random.default_rng(0).random(1000)
    assert compute_histogram_entropy(0.1 * values) == compute_histogram_entropy(values)
    assert (
        compute_histogram_entropy(0.1 * values, scale="none")
        < compute_histogram_entropy(values, scale="none") - 2
    )


@pytest.mark.parametrize(
    ("values", "levels", "bits"),
    [
        ([0.4, 0.6], 2, 1),
        ([0.2, 0.3], 2, 0),
        ([0.1, 0.2, 0.6, 0.8], 3, 1.5),
        ([0.49, 0.51, 2.0], 2, np.log2(3) - 2 / 3),
    ],
)
def test_values_between_grey_levels_go_to_the_nearest(values, levels, bits):
    """As MATLAB's ``im2uint8`` rounds: level round(x (levels − 1)); values above 1 are white."""
    assert compute_histogram_entropy(
        np.array(values), levels=levels, scale="none"
    ) == pytest.approx(bits)


def test_histogram_entropy_is_that_of_a_picture_with_256_levels():
    from skimage.measure import shannon_entropy

    picture = np.random.default_rng(0).integers(0, 256, (30, 40))
    assert compute_histogram_entropy(picture / 255, scale="none") == pytest.approx(
        shannon_entropy(picture)
    )


def test_entropies_of_a_stack():
    stack = np.stack([np.ones((3, 3)), np.arange(9.0).reshape(3, 3)])
    np.testing.assert_allclose(compute_entropies(stack), [0, np.log2(9)])
    with pytest.raises(InvalidInput, match="'histogram', 'mass'"):
        compute_entropies(stack, "shannon")


@pytest.mark.parametrize("bad", [-1.0, np.inf, np.nan])
def test_entropy_refuses_entries_that_are_no_mass(bad):
    for measure in (compute_mass_entropy, compute_histogram_entropy):
        with pytest.raises(InvalidInput, match="finite, non-negative"):
            measure(np.array([bad, 2.0]))


def test_matching_undoes_order_scale_and_shift():
    bases = np.zeros((3, 6, 12))
    bases[:, :, 3:8] = np.random.default_rng(0).random((3, 6, 5))
    other = np.roll(bases, 2, axis=2)[[2, 0, 1]] * np.array([1, 5, 9])[:, None, None]
    order, similarity = match_components(bases, other)
    np.testing.assert_array_equal(order, [1, 2, 0])
    np.testing.assert_allclose(similarity, 1)
    assert compute_stability([bases, other, bases]) == pytest.approx(1)
    assert np.isnan(compute_stability([bases]))


def test_similarity_of_bases_on_other_sensors_is_none():
    bases = np.zeros((2, 4, 3))
    bases[0, 0], bases[1, 2] = 1, 1
    np.testing.assert_allclose(compute_basis_similarity(bases, bases), np.eye(2), atol=1e-12)


def test_a_shift_does_not_lead_from_the_last_lag_to_the_first():
    ends, middle = np.zeros((2, 1, 1, 10))
    ends[..., [0, 9]], middle[..., [4, 5]] = 1, 1
    assert compute_basis_similarity(ends, middle) == pytest.approx(0.5)


def test_place_of_a_basis_is_its_centre_of_mass():
    bases = np.zeros((4, 5, 2))
    bases[0, 0], bases[1, 4], bases[2, 1:4], bases[3, 0, 0], bases[3, 4] = 1, 1, 1, 1, 1
    np.testing.assert_allclose(locate_components(bases), [0, 1, 0.5, 2 / 3])
    np.testing.assert_allclose(locate_components(1e-3 * bases), [0, 1, 0.5, 2 / 3])


def test_canonical_bases_have_unit_length_and_give_the_same_product():
    rng = np.random.default_rng(5)
    bases, activations = rng.random((4, 6, 3)), rng.random((2, 4, 10))
    bases[1] = 0.0  # one that says nothing keeps its activations, and goes to the tip
    order = [*np.argsort(locate_components(bases[[0, 2, 3]])), 3]
    order = [[0, 2, 3, 1][k] for k in order]
    found, turned = canonicalise(bases, activations)
    np.testing.assert_allclose(np.sqrt((found**2).sum(axis=(1, 2))), [1, 1, 1, 0])
    np.testing.assert_allclose(
        np.einsum("nct,csl->ntsl", turned, found),
        np.einsum("nct,csl->ntsl", activations, bases),
        rtol=1e-12,
    )
    np.testing.assert_array_equal(turned[:, 3], activations[:, 1])
    np.testing.assert_allclose(
        found[:3] * np.sqrt((bases[order[:3]] ** 2).sum(axis=(1, 2)))[:, None, None],
        bases[order[:3]],
    )


def make_codes(locations, rng):
    codes = 0.1 * rng.random((len(locations), 3, 20))
    for code, location in zip(codes, locations, strict=True):
        code[int(location)] += 1
    return codes


def test_a_perfect_map_scores_its_ceiling_and_beats_chance():
    rng = np.random.default_rng(0)
    locations = np.repeat([0, 1, 2], 10)
    score = map_locations(make_codes(locations, rng), locations, np.array([0.2, 0.5, 0.8]))
    assert score.information == pytest.approx(np.log2(3)) == score.ceiling
    assert score.correlation > 0.9
    assert score.p_information == score.p_correlation == 1 / 1000
    np.testing.assert_array_equal(score.share.argmax(axis=1), [0, 1, 2])


def test_no_code_tells_more_than_it_has_components_or_there_are_locations():
    rng, places = np.random.default_rng(3), np.array([0.2, 0.5, 0.8])
    for count, ceiling in ((6, np.log2(3)), (2, 1.0)):
        locations = np.repeat(np.arange(count), 4)
        codes = make_codes(locations % 3, rng)
        score = map_locations(codes, locations, places, n_shuffles=9)
        assert score.ceiling == pytest.approx(ceiling)


def test_the_correlation_is_spearman_s_where_places_are_met_unequally_often():
    rng, places = np.random.default_rng(2), np.array([0.1, 0.3, 0.9])
    locations, codes = np.repeat([0.5, 0.6, 0.9], [2, 3, 7]), rng.random((12, 3, 20)) ** 4
    share = np.square(codes).sum(axis=2)
    centre = (share / share.sum(axis=1, keepdims=True)) @ places
    score = map_locations(codes, locations, places, n_shuffles=9)
    assert score.correlation == pytest.approx(spearmanr(centre, locations).statistic)


@pytest.mark.long
@pytest.mark.parametrize("turn", [1, -1])
def test_a_map_the_other_way_round_is_as_unlikely(turn):
    """p of the correlation is two-sided, as SciPy's permutation test of Spearman's is."""
    rng = np.random.default_rng(7)
    locations = np.repeat([0, 1, 2], 4)
    codes = rng.random((12, 3, 20)) + 0.04 * make_codes(locations, rng)
    places = np.array([0.2, 0.5, 0.8])[::turn]
    score = map_locations(codes, locations, places, n_shuffles=1999)
    energy = np.square(codes).sum(axis=2)
    centre = (energy / energy.sum(axis=1, keepdims=True)) @ places
    expected = permutation_test(
        (centre,),
        lambda x: spearmanr(x, locations).statistic,
        permutation_type="pairings",
        n_resamples=1999,
        random_state=2,
    )
    assert score.correlation == pytest.approx(expected.statistic)
    assert turn * score.correlation > 0
    assert 0.2 < expected.pvalue < 0.5
    assert score.p_correlation == pytest.approx(expected.pvalue, abs=0.05)


def test_no_map_looks_like_chance():
    rng = np.random.default_rng(1)
    passed = [
        map_locations(
            make_codes(rng.integers(0, 3, 30), rng),
            np.repeat([0, 1, 2], 10),
            np.arange(3),
            n_shuffles=99,
        ).p_information
        for _ in range(40)
    ]
    assert 0.3 < np.mean(passed) < 0.7


@pytest.mark.parametrize(
    ("locations", "places", "message"),
    [
        (np.zeros(6), np.arange(3), "two locations"),
        (
            np.arange(5),
            np.arange(3),
            "activations and locations must have one trial size, got 6 and 5",
        ),
    ],
)
def test_map_refuses_what_it_cannot_score(locations, places, message):
    with pytest.raises(InvalidInput, match=message):
        map_locations(np.ones((6, 3, 4)), locations, places)
