"""The fast sums equal the obvious loops, edges included."""

import numpy as np
import pytest

from feeler.encoding import reconstruct
from feeler.encoding.convolution import (
    compute_activation_gram,
    compute_basis_gram,
    descend_activations,
    multiply_activations,
    multiply_bases,
)
from feeler.encoding.factorise import Data, Settings, factorise, learn_batch
from feeler.encoding.measures import l1_of_unit_vector

SHAPES = [(2, 3, 4, 5, 11), (1, 2, 3, 6, 6), (3, 2, 3, 1, 7), (2, 2, 3, 6, 8), (2, 1, 4, 9, 30)]


@pytest.fixture(params=SHAPES, ids=str)
def case(request):
    """(tensors, bases, activations) of trials, components, sensors, lags, times."""
    n_trials, n_components, n_sensors, n_lags, n_times = request.param
    rng = np.random.default_rng(7)
    activations = rng.random((n_trials, n_components, n_times)) * (
        rng.random((n_trials, n_components, n_times)) < 0.6
    )
    return (
        rng.random((n_trials, n_sensors, n_times)),
        rng.random((n_components, n_sensors, n_lags)),
        activations,
    )


def loop_reconstruct(bases, activations):
    tensors = np.zeros((activations.shape[0], bases.shape[1], activations.shape[2]))
    for n, x, t in np.ndindex(tensors.shape):
        for m in range(bases.shape[0]):
            for lag in range(bases.shape[2]):
                if t - lag >= 0:
                    tensors[n, x, t] += bases[m, x, lag] * activations[n, m, t - lag]
    return tensors


def loop_see(bases, tensors):
    seen = np.zeros((tensors.shape[0], bases.shape[0], tensors.shape[2]))
    for n, m, s in np.ndindex(seen.shape):
        for lag in range(bases.shape[2]):
            if s + lag < tensors.shape[2]:
                seen[n, m, s] += bases[m, :, lag] @ tensors[n, :, s + lag]
    return seen


def loop_gather(activations, tensors, n_lags):
    gathered = np.zeros((activations.shape[1], tensors.shape[1], n_lags))
    for m, x, lag in np.ndindex(gathered.shape):
        for t in range(lag, tensors.shape[2]):
            gathered[m, x, lag] += activations[:, m, t - lag] @ tensors[:, x, t]
    return gathered


def test_multiplicative_updates_equal_the_textbook(case):
    tensors, bases, activations = case
    activations = activations + 0.1
    model = loop_reconstruct(bases, activations)
    expected = activations * loop_see(bases, tensors) / loop_see(bases, model)
    updated = activations.copy()
    seen = loop_see(bases, tensors)
    multiply_activations(seen, *compute_basis_gram(bases), np.zeros_like(seen), updated, 1)
    np.testing.assert_allclose(updated, expected)
    n_lags = bases.shape[2]
    expected = (
        bases
        * loop_gather(activations, tensors, n_lags)
        / loop_gather(activations, model, n_lags)
    )
    gram = compute_activation_gram(activations, n_lags)
    new, shared, square = multiply_bases(
        bases, loop_gather(activations, tensors, n_lags), gram, 1
    )
    np.testing.assert_allclose(new, expected, atol=1e-12)
    rest = tensors - loop_reconstruct(new, activations)
    assert 0.5 * (tensors**2).sum() - shared + 0.5 * square == pytest.approx(
        0.5 * (rest**2).sum()
    )


@pytest.mark.parametrize("joint", [False, True])
def test_projected_step_equals_the_obvious_one(joint):
    """One sweep from zero: row by row, a step along the gradient, projected."""
    from feeler.encoding import project_to_sparseness

    rng = np.random.default_rng(11)
    tensors, bases = rng.random((3, 4, 25)), rng.random((2, 4, 5))
    kernel, fringe = compute_basis_gram(bases)
    seen, activations = loop_see(bases, tensors), np.zeros((3, 2, 25))
    size = 75 if joint else 25
    l1 = l1_of_unit_vector(size, 0.6)
    descend_activations(
        seen, kernel, fringe, activations, np.ones((1 if joint else 3, 2)), l1, joint, 1, 0.0
    )
    expected = np.zeros_like(activations)
    for m in range(2):
        slope = loop_see(bases, loop_reconstruct(bases, expected) - tensors)[:, m]
        moved = expected[:, m] - slope / np.abs(kernel[m, m]).sum()
        rows = [moved.ravel()] if joint else list(moved)
        expected[:, m] = np.reshape([project_to_sparseness(row, 0.6) for row in rows], (3, 25))
    np.testing.assert_allclose(activations, expected, atol=1e-12)


@pytest.mark.parametrize(("sparseness", "joint"), [(0.7, False), (0.7, True), (None, False)])
def test_loss_never_rises_and_is_the_true_one(touches, sparseness, joint):
    rng = np.random.default_rng(0)
    settings = Settings(
        n_components=3,
        n_lags=10,
        sparseness=sparseness,
        joint=joint,
        max_iter=40,
        tol=0,
        inner_steps=2,
    )
    start = rng.random((3, 14, 10)), rng.random((12, 3, 90))
    (factors,) = factorise(Data(touches, 10), [start], settings)
    assert (np.diff(factors.losses) <= 1e-12 * (touches**2).sum()).all()
    rest = touches - reconstruct(factors.components, factors.activations)
    assert factors.losses[-1] == pytest.approx(0.5 * (rest**2).sum(), rel=1e-8)
    assert factors.losses[-1] < 0.5 * factors.losses[0]


@pytest.mark.parametrize("forget", [0.0, 0.3, 1.0])
def test_earlier_batches_count_as_much_as_is_said_in_both_sums(forget):
    """The sums after a batch are ``forget`` times those before, and those of the batch alone."""
    rng = np.random.default_rng(8)
    first, second, bases = rng.random((3, 4, 20)), rng.random((5, 4, 20)), rng.random((2, 4, 6))
    more = {"max_iter": 1, "tol": 0.0, "inner_steps": 3}
    settings = Settings(n_components=2, n_lags=6, sparseness=None, joint=False, **more)
    bases, before = learn_batch(first, bases, (0.0, 0.0), settings, 0.77)
    _, alone = learn_batch(second, bases, (0.0, 0.0), settings, 0.77)
    found, after = learn_batch(second, bases, before, settings, forget)
    for mine, earlier, own in zip(after, before, alone, strict=True):
        assert np.abs(earlier).max() > 0.01 * np.abs(own).max()
        np.testing.assert_allclose(mine, forget * earlier + own, rtol=1e-9, atol=1e-12)
    expected = multiply_bases(bases, *after, settings.inner_steps)[0]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
