"""Twins and identical touches, with an encoder that marks places in the set or does not."""

from dataclasses import replace

import numpy as np
import pytest
from sklearn.base import BaseEstimator

from feeler.decoding.curves import Group, _repeat_code, compare_twins, fit_null, make_null
from feeler.decoding.sweeps import Plan

PLAN = Plan(ratios=(0.05,), n_repeats=2, n_copies=4, null_iter=7)
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
    found = compare_twins(TENSORS, np.arange(8), MarkEncoder(mark), replace(PLAN, n_repeats=8))
    assert found.same.noisy.mean() == 1.0
    assert found.kept == pytest.approx(kept, abs=0.1)


def test_the_null_is_fitted_with_its_own_iterations_and_says_how_it_ended():
    found = fit_null(TENSORS, MarkEncoder(), PLAN)
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
