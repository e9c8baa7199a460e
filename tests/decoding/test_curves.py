"""The whole comparison on a toy encoder."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.base import BaseEstimator

from feeler.decoding import Relative
from feeler.decoding.curves import (
    Group,
    PeakEncoder,
    _repeat_code,
    compare_twins,
    compute_curves,
    fit_null,
    make_codes,
    make_null,
)
from feeler.decoding.sweeps import Plan, compute_sweep, draw_rotated, span
from feeler.errors import InvalidInput

PLAN = Plan(
    ratios=(0.05, 0.4),
    n_repeats=2,
    n_copies=4,
    other_copies=(3,),
    before_copies=4,
    probe=0.4,
    before_all=True,
)


class SumEncoder(BaseEstimator):
    """Codes are sums over the antenna; joint ones also carry a mark of the trial's place in the
    set, as a trap.
    """

    def fit(self, X):
        mark = np.eye(len(X), X.shape[2])[:, None, :]
        self.activations_ = X.sum(axis=1, keepdims=True) + 100 * mark
        return self

    def transform(self, X, *, code):
        return X.sum(axis=1, keepdims=True)


def make_group(height):
    time = np.arange(60)
    places = np.linspace(15, 45, 8)[:, None]
    tensors = np.exp(-0.5 * ((time - places) / 2) ** 2)[:, None, :] * np.full((1, 4, 1), height)
    encoder = SumEncoder()
    return Group(
        tensors=tensors,
        labels=np.arange(8),
        encoder=encoder,
        codes=make_codes(tensors, encoder),
    )


@pytest.fixture(scope="module")
def curves():
    return compute_curves({"strong": make_group(1.0), "weak": make_group(0.1)}, PLAN)


def test_every_group_has_every_curve(curves):
    for kind in ("joint", "sparse", "ridge", "raw"):
        for level in ("relative", "common"):
            assert list(curves.find(kind, level)) == ["strong", "weak"]
        assert list(curves.find(kind, n_copies=3)) == ["strong", "weak"]
    assert list(curves.find("sparse", when="before", n_copies=4)) == ["strong", "weak"]
    assert set(curves.baselines) == {"strong", "weak"}


def test_any_classifier_reads_the_codes(curves):
    plan = replace(PLAN, other_copies=(), n_repeats=1, before_repeats=1)
    groups = {"strong": make_group(1.0), "weak": make_group(0.1)}
    found = compute_curves(groups, plan, kinds=("raw", "sparse"), classifier="ideal")
    for kind in ("raw", "sparse"):
        mine, others = (
            np.mean([sweep.noisy.mean() for sweep in each.find(kind).values()])
            for each in (found, curves)
        )
        assert mine >= others - 0.1
    assert not found.find("sparse", when="before", n_copies=4)
    assert found.find_null("raw").noisy.mean() < 0.4


def test_no_curve_is_made_that_nobody_asked_for(curves):
    """Other numbers of copies for relative noise alone; noise before encoding for codes of fixed
    bases alone.
    """
    after = [curve for curve in curves.sweeps if curve.when == "after"]
    assert {(c.noise, c.n_copies) for c in after} == {
        ("relative", 4),
        ("relative", 3),
        ("common", 4),
    }
    assert len(set(curves.sweeps)) == len(curves.sweeps)


def test_null_unmasks_a_code_that_depends_on_the_trials_place(curves):
    assert curves.find_null("joint").noisy[0].mean() > 0.8
    for kind in ("sparse", "ridge", "raw"):
        assert curves.find_null(kind).noisy.mean() < 0.3


def test_stronger_tensors_stand_common_noise_better(curves):
    found = {name: sweep.area for name, sweep in curves.find("raw", "common").items()}
    assert found["strong"].mean() > found["weak"].mean() + 0.1


def test_a_seed_and_a_number_of_repeats_are_whole_and_not_negative():
    with pytest.raises(InvalidInput, match="random_state must be ≥ 0, got -1"):
        PeakEncoder(random_state=-1)
    with pytest.raises(InvalidInput, match="n_repeats"):
        compute_sweep(np.ones((2, 1, 1)), [0, 1], n_repeats=0)


PLAN_NULL = Plan(ratios=(0.05,), n_repeats=2, n_copies=4, null_iter=7)
TIME = np.arange(60)
TENSORS = np.exp(-0.5 * ((TIME - np.linspace(10, 50, 8)[:, None]) / 2) ** 2)[:, None, :].repeat(
    4, axis=1
)


class MarkEncoder(BaseEstimator):
    """Joint codes are sums over the antenna, with a mark of the trial's place in the set."""

    def __init__(self, mark=0.0, max_iter=3):
        self.mark, self.max_iter = mark, max_iter

    def fit(self, X):
        self.n_iter_ = self.max_iter
        self.activations_ = (
            X.sum(axis=1, keepdims=True) + self.mark * np.eye(len(X), X.shape[2])[:, None, :]
        )
        return self


@pytest.mark.parametrize(("mark", "kept"), [(0.0, 1.0), (100.0, 0.0)])
def test_only_what_belongs_to_the_touch_carries_over_to_its_twin(mark, kept):
    found = compare_twins(
        TENSORS, np.arange(8), MarkEncoder(mark), replace(PLAN_NULL, n_repeats=8)
    )
    assert found.same.noisy.mean() == 1.0
    assert found.kept == pytest.approx(kept, abs=0.1)


def test_the_null_is_fitted_with_its_own_iterations_and_says_how_it_ended():
    found = fit_null(TENSORS, MarkEncoder(), PLAN_NULL)
    assert found.n_iter == 7 and not found.converged
    assert (found.codes == found.codes[0]).all() and len(found.codes) == len(TENSORS)


def test_the_null_is_the_tensor_of_the_median_energy():
    """Neither the first nor the strongest: energies 9, 1, 25, 4, 16 (of five), and its code by
    fixed bases with it.
    """
    tensors = np.array([3.0, 1.0, 5.0, 2.0, 4.0])[:, None, None] * np.eye(2)
    np.testing.assert_array_equal(make_null(tensors), np.tile(3 * np.eye(2), (5, 1, 1)))
    turned = np.roll(tensors, 1, axis=0)
    np.testing.assert_array_equal(make_null(turned, 2), np.tile(3 * np.eye(2), (2, 1, 1)))
    group = Group(tensors=turned, labels=np.arange(5), encoder=Doubler(), codes={})
    np.testing.assert_array_equal(
        _repeat_code(group, "ridge"), np.tile(6 * np.eye(2), (5, 1, 1))
    )


class Doubler:
    def transform(self, tensors, *, code):
        return 2 * tensors


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
