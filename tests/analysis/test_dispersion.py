"""Closest matches, averages and intervals."""

import matplotlib
import numpy as np
import pytest
import xarray as xr
from sklearn.base import BaseEstimator
from sklearn.metrics import normalized_mutual_info_score

from feeler.analysis import (
    INDICES,
    bootstrap_difference,
    bootstrap_mean,
    compute_dispersion,
    compute_mse,
    compute_nmi,
    compute_pearson,
    compute_ssim,
    find_closest,
    scale_common,
    search_closest,
)
from feeler.analysis.dispersion import student_mean
from feeler.comparison import compare_antennas
from feeler.decoding import list_groups
from feeler.decoding.sweeps import Plan
from feeler.errors import InvalidInput
from paper import fig5_data

from .test_indices import ssim_slowly

MATRIX = {
    "pearson": compute_pearson,
    "ssim": compute_ssim,
    "mse": compute_mse,
    "nmi": compute_nmi,
}


def make_pairs(n_pairs=4, seed=0):
    """Tensors 2k and 2k + 1 are near copies of each other and unlike all others."""
    rng = np.random.default_rng(seed)
    pairs = np.repeat(rng.random((n_pairs, 12, 20)), 2, axis=0)
    return pairs + 1e-3 * rng.random(pairs.shape)


@pytest.mark.parametrize("index", INDICES)
def test_search_in_blocks_equals_the_full_matrix(index):
    tensors = np.random.default_rng(3).random((11, 12, 13))
    expected = find_closest(MATRIX[index](tensors), greatest=index != "mse")
    for block in (1, 4, 256):
        got = search_closest(tensors, index, block=block)
        np.testing.assert_array_equal(got.trial, expected.trial)
        np.testing.assert_allclose(got.value, expected.value, atol=1e-13)


def test_closest_is_the_greatest_unless_it_is_said_to_be_the_least():
    matrix = np.array([[9.0, 1.0, 2.0], [1.0, 9.0, 3.0], [2.0, 3.0, 9.0]])
    found, least = find_closest(matrix), find_closest(matrix, greatest=False)
    np.testing.assert_array_equal([found.trial, found.value], [[2, 2, 1], [2, 3, 3]])
    np.testing.assert_array_equal([least.trial, least.value], [[1, 0, 0], [1, 1, 2]])


def test_first_of_equals_is_taken_in_any_block_size():
    tensors = np.repeat(np.random.default_rng(0).random((1, 12, 12)), 5, axis=0)
    for block in (1, 2, 3, 5):
        np.testing.assert_array_equal(
            search_closest(tensors, "mse", block=block).trial, [1, 0, 0, 0, 0]
        )


def test_groups_do_not_see_each_other():
    tensors = make_pairs()
    groups = np.arange(8) % 2  # every near copy is in the other group
    dispersion = compute_dispersion(tensors, groups)
    assert dispersion.groups == (0, 1)
    for group in (0, 1):
        alone = compute_dispersion(
            tensors[groups == group], options={"nmi": {"data_range": (0.0, 1.0)}}
        )
        assert dispersion.average["pearson"][group].estimate == pytest.approx(
            alone.average["pearson"][""].estimate
        )
        assert dispersion.values("pearson", group).max() < 0.9


@pytest.mark.parametrize("scale", [True, False])
def test_every_average_is_that_of_the_libraries_written_out(scale):
    """NumPy, SciPy and scikit-learn on the whole set divided by its greatest magnitude, which here
    is negative; bins of NMI span the whole set, not each group."""
    rng = np.random.default_rng(8)
    tensors, groups = rng.normal(size=(7, 12, 13)), ["a", "b", "a", "b", "b", "a", "b"]
    tensors[3, 2, 2] = -9.0
    used = tensors / 9.0 if scale else tensors
    bins = np.clip(np.floor((used - used.min()) / np.ptp(used) * 64), 0, 63)
    compare = {
        "pearson": lambda i, j: np.corrcoef(used[i].ravel(), used[j].ravel())[0, 1],
        "mse": lambda i, j: np.mean((used[i] - used[j]) ** 2),
        "nmi": lambda i, j: normalized_mutual_info_score(bins[i].ravel(), bins[j].ravel()),
        "ssim": lambda i, j: ssim_slowly(used[i], used[j], "nearest"),
    }
    found = compute_dispersion(tensors, groups, options={"nmi": {"n_bins": 64}}, scale=scale)
    for index, one in compare.items():
        for group in "ab":
            own = [k for k, name in enumerate(groups) if name == group]
            pick = min if index == "mse" else max
            expected = [pick(one(i, j) for j in own if j != i) for i in own]
            np.testing.assert_allclose(
                found.values(index, group), expected, rtol=1e-9, atol=1e-12
            )
            assert found.average[index][group].estimate == pytest.approx(np.mean(expected))


def test_indices_may_be_chosen_and_groups_be_of_different_shapes():
    rng = np.random.default_rng(10)
    sets = {"short": rng.random((3, 12, 13)), "long": 4 * rng.random((4, 15, 20))}
    found = compute_dispersion(sets, indices=["mse"], random_state=3)
    assert list(found.average) == ["mse"] and found.groups == ("short", "long")
    largest = max(array.max() for array in sets.values())
    for name, array in sets.items():
        alone = search_closest(array / largest, "mse")
        np.testing.assert_array_equal(found.values("mse", name), alone.value)
    again = compute_dispersion(sets, indices=["mse"], random_state=3)
    assert again.average["mse"] == found.average["mse"]


def test_dataarray_in_any_order_of_dims_is_read_by_name():
    tensors = np.random.default_rng(0).random((5, 12, 14))
    array = xr.DataArray(tensors, dims=("trial", "sensor", "time")).transpose(
        "time", "sensor", "trial"
    )
    np.testing.assert_allclose(compute_ssim(array), compute_ssim(tensors), atol=1e-14)


def test_one_common_factor_keeps_ratios():
    scaled = scale_common(np.stack([np.full((2, 2), 0.5), np.full((2, 2), -2.0)]))
    np.testing.assert_array_equal(scaled[:, 0, 0], [0.25, -1.0])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda x: compute_dispersion(x, [1, 2]), "2 group names for 8 tensors"),
        (lambda x: compute_dispersion(x, [1] * 7 + [2]), "group 2 has one tensor"),
        (lambda x: compute_dispersion(0 * x), "every tensor is zero"),
        (lambda x: search_closest(x, "cosine"), "pearson, ssim, mse, nmi"),
        (lambda x: find_closest(x[0]), "square matrix"),
        (lambda x: find_closest(np.array([[1.0, np.nan], [np.nan, 1.0]])), "without NaN"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(InvalidInput, match=message):
        call(make_pairs())


def test_an_interval_is_that_of_two_thousand_means_of_drawn_values():
    """Efron's percentile interval (https://doi.org/10.1214/aos/1176344552), written out with the
    same draws.
    """
    values = np.random.default_rng(6).normal(size=30)
    rng = np.random.default_rng(7)
    means = [np.mean(draw) for draw in rng.choice(values, size=(2000, 30))]
    found = bootstrap_mean(values, np.random.default_rng(7))
    assert (found.low, found.high) == pytest.approx(
        tuple(np.percentile(means, [2.5, 97.5])), rel=1e-12
    )


def test_effect_is_the_mean_over_the_sample_sd():
    """Cohen's d_z (Lakens 2013, https://doi.org/10.3389/fpsyg.2013.00863): differences 1, 1, 1 and
    5 have the sd 2.
    """
    a, b = np.array([1.0, 2.0, 4.0, 7.0]), np.array([0.0, 1.0, 3.0, 2.0])
    difference = bootstrap_difference(a, b, np.random.default_rng(0))
    assert difference.estimate == 2.0
    assert difference.effect == pytest.approx(1.0, rel=1e-12)
    assert bootstrap_difference(b, a, np.random.default_rng(0)).effect == pytest.approx(
        -1.0, rel=1e-12
    )


@pytest.mark.parametrize(
    ("values", "level", "message"),
    [
        ([], 0.9, "finite values"),
        ([1.0, np.nan], 0.9, "finite values"),
        ([[1.0, 2.0]], 0.9, "finite values"),
        ([1.0, 2.0], 0.0, "level must be > 0 and < 1"),
        ([1.0, 2.0], 1.0, "level must be > 0 and < 1"),
    ],
)
def test_what_has_no_mean_or_no_interval_is_refused(values, level, message):
    with pytest.raises(InvalidInput, match=message):
        bootstrap_mean(np.array(values), np.random.default_rng(0), level=level)


def test_one_difference_has_no_effect_size():
    one = bootstrap_difference(np.array([3.0]), np.array([1.0]), np.random.default_rng(0))
    assert (one.estimate, one.effect) == (2.0, np.inf)
    other = bootstrap_difference(np.array([1.0]), np.array([3.0]), np.random.default_rng(0))
    assert other.effect == -np.inf


def test_unpaired_values_are_refused():
    with pytest.raises(InvalidInput, match="one to one"):
        bootstrap_difference(np.ones(3), np.ones(4), np.random.default_rng(0))


def test_students_interval_holds_the_mean_as_often_as_it_says():
    rng = np.random.default_rng(7)
    draws = rng.normal(3.0, 2.0, (4000, 3))
    found = [student_mean(values) for values in draws]
    assert np.mean([one.low <= 3.0 <= one.high for one in found]) == pytest.approx(
        0.95, abs=0.012
    )
    alone = student_mean(np.array([2.0]))
    assert alone.estimate == 2.0 and np.isnan(alone.low) and np.isnan(alone.high)


matplotlib.use("Agg")
PLAN = Plan(
    ratios=(0.2,), n_repeats=2, n_copies=4, other_copies=(3,), before_copies=3, before_all=True
)


class SumEncoder(BaseEstimator):
    """Stands in for the convolutive NMF."""

    def __init__(self, n_restarts=1, random_state=None):
        self.n_restarts = n_restarts
        self.random_state = random_state

    def fit(self, X):
        self.components_ = X[:3, :, :5] + 1e-3
        self.activations_ = X.reshape(len(X), 3, -1, X.shape[2]).sum(axis=2)
        return self

    def transform(self, X, *, code):
        return X.reshape(len(X), 3, -1, X.shape[2]).sum(axis=2)


def make_tensors(spread, speeds=(0.6, 0.06)):
    """Slow touches and large ``spread`` set the stimuli apart in time."""
    grid = [
        (f, s, x, v)
        for v in speeds
        for x in (0.5, 0.7, 0.9)
        for s in (1.5, 3.0)
        for f in ("ball", "box")
    ]
    feature, size, location, speed = (np.array(column) for column in zip(*grid, strict=True))
    shift = 8 + spread * np.where(speed < 0.1, 1.0, 0.2) * (np.arange(len(grid)) % 12)
    time, sensor = np.arange(40), np.arange(12)
    rows = np.exp(-0.5 * ((sensor - 12 * location[:, None]) / 2) ** 2)
    angle = rows[:, :, None] * np.exp(-0.5 * ((time - shift[:, None]) / 2) ** 2)[:, None, :]
    coordinates = {"feature": feature, "size": size, "location": location, "speed": speed}
    return xr.Dataset(
        {"angle": (("trial", "sensor", "time"), angle, {"units": "rad"})},
        {k: ("trial", v) for k, v in coordinates.items()},
    )


@pytest.fixture(scope="module")
def tensors():
    return {
        "exponential": make_tensors(2.0),
        "linear": make_tensors(0.8),
        "uniform": make_tensors(0.1),
    }


def test_antennas_may_have_different_numbers_of_sensors(tensors):
    fewer = tensors["uniform"].isel(sensor=slice(None, None, 2))
    found = compare_antennas({"a": tensors["exponential"], "b": fewer}, SumEncoder(), plan=PLAN)
    alone = compare_antennas({"b": fewer, "c": fewer}, SumEncoder(), plan=PLAN)
    # each antenna's own tensors, however many sensors its neighbour has
    np.testing.assert_allclose(
        found.dispersion["raw"].values("pearson", "b"),
        alone.dispersion["raw"].values("pearson", "b"),
    )


def test_sets_that_make_no_comparison_are_refused(tensors):
    with pytest.raises(InvalidInput, match="at least two antennas"):
        compare_antennas({"a": tensors["linear"]}, SumEncoder(), plan=PLAN)
    with pytest.raises(
        InvalidInput, match="no tensors of the reference antenna 'x'; given: exponential"
    ):
        fig5_data.compare(tensors, SumEncoder(), plan=PLAN, reference="x")
    with pytest.raises(InvalidInput, match="did any contact"):
        list_groups({"exponential": 0 * tensors["linear"]})
