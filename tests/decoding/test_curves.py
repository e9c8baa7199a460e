"""The whole comparison on a toy encoder."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.base import BaseEstimator

from feeler.decoding.curves import (
    Curve,
    Group,
    PeakEncoder,
    _repeat_code,
    compare_twins,
    compute_curves,
    fit_null,
    make_codes,
    make_null,
)
from feeler.decoding.sweeps import Plan, compute_sweep
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


def test_curve_names_what_it_is():
    assert Curve("slow", "joint", "relative", 10).when == "after"
    with pytest.raises(InvalidInput, match="n_repeats"):
        compute_sweep(np.ones((2, 1, 1)), [0, 1], n_repeats=0)


def test_a_seed_is_a_whole_number_from_0():
    with pytest.raises(InvalidInput, match="random_state must be ≥ 0, got -1"):
        PeakEncoder(random_state=-1)


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
