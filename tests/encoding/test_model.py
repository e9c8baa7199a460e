"""ConvolutiveNMF: laws of the fit and of the code."""

import warnings

import numpy as np
import pytest
import xarray as xr
from sklearn.decomposition import NMF
from sklearn.exceptions import ConvergenceWarning

from feeler.encoding import (
    ConvolutiveNMF,
    encode,
    hoyer_sparseness,
    match_components,
    reconstruct,
)
from feeler.errors import InvalidInput

CODES = ["sparse", "ridge", "nonnegative"]


@pytest.mark.parametrize("constraint", ["trial", "all"])
@pytest.mark.parametrize("sparseness", [0.5, 0.8, 0.9])
def test_sparseness_reached_is_the_one_asked(touches, constraint, sparseness):
    model = ConvolutiveNMF(
        2, 10, sparseness, constraint=constraint, n_restarts=1, random_state=1, tol=1e-2
    ).fit(touches)
    found = model.activations_
    if constraint == "all":
        found = found.transpose(1, 0, 2).reshape(2, -1)
    reached = hoyer_sparseness(found)
    active = found.any(axis=-1)
    assert active.mean() > 0.5
    np.testing.assert_allclose(reached[active], sparseness, atol=1e-6)


def test_what_is_learned_fits_together(touches, fitted):
    assert fitted.components_.shape == (3, 14, 12)
    assert fitted.activations_.shape == (12, 3, 90)
    assert (fitted.components_ >= 0).all()
    assert (fitted.activations_ >= 0).all()
    assert (np.diff(fitted.loss_curve_) <= 1e-12).all()
    assert len(fitted.loss_curve_) == fitted.n_iter_
    rest = touches - reconstruct(fitted.components_, fitted.activations_)
    assert fitted.reconstruction_err_ == pytest.approx(np.linalg.norm(rest))
    assert fitted.relative_residual_ == pytest.approx(
        np.linalg.norm(rest) / np.linalg.norm(touches)
    )
    assert fitted.restarts_[0] == fitted.relative_residual_ <= fitted.restarts_[1]


@pytest.mark.long
def test_planted_bases_come_back(planted):
    tensors, bases, _ = planted
    model = ConvolutiveNMF(3, 12, None, n_restarts=4, random_state=0, tol=3e-3).fit(tensors)
    assert match_components(bases, model.components_)[1].min() > 0.99
    assert model.relative_residual_ < 0.1


def test_planted_sparse_bases_come_back(planted):
    tensors, bases, activations = planted
    sparseness = hoyer_sparseness(activations).mean()
    model = ConvolutiveNMF(3, 12, sparseness, n_restarts=4, random_state=0, tol=1e-4).fit(
        tensors
    )
    assert match_components(bases, model.components_)[1].min() > 0.99
    assert model.stability_ > 0.8


def test_one_lag_without_sparseness_is_scikit_learns_nmf():
    rng = np.random.default_rng(4)
    tensors = rng.random((3, 6, 20))
    bases = rng.random((2, 6, 1))
    activations = rng.random((3, 2, 20))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ConvergenceWarning)
        ours = ConvolutiveNMF(2, 1, None, max_iter=50, tol=0).fit(
            tensors, components=bases, activations=activations
        )
        theirs = NMF(2, solver="mu", init="custom", max_iter=50, tol=0)
        flat = np.ascontiguousarray(tensors.transpose(0, 2, 1).reshape(60, 6))
        codes = np.ascontiguousarray(activations.transpose(0, 2, 1).reshape(60, 2))
        codes = theirs.fit_transform(flat, W=codes, H=np.ascontiguousarray(bases[:, :, 0]))
    expected = (codes @ theirs.components_).reshape(3, 20, 6).transpose(0, 2, 1)
    np.testing.assert_allclose(
        reconstruct(ours.components_, ours.activations_), expected, rtol=1e-8
    )
    assert ours.reconstruction_err_ == pytest.approx(theirs.reconstruction_err_, rel=1e-8)


def test_thread_count_does_not_change_the_fit(touches):
    first, second = (
        ConvolutiveNMF(2, 9, n_jobs=n, max_iter=30, tol=1e-2, random_state=3).fit(touches)
        for n in (1, 2)
    )
    np.testing.assert_array_equal(first.components_, second.components_)


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("shift", [1, 5])
def test_a_shifted_tensor_has_a_shifted_code(fitted, code, shift):
    """The touch lasts long: a code that is sparser than asked by itself gets filled up, best near
    the window's ends.
    """
    activations = np.zeros((1, 3, 90))
    activations[0, :, 10:65] = np.random.default_rng(0).uniform(0.5, 1, (3, 55))
    tensor = reconstruct(fitted.components_, activations)
    moved = np.zeros_like(tensor)
    moved[..., shift:] = tensor[..., :-shift]
    codes = fitted.transform(np.concatenate([tensor, moved]), code=code)
    tolerance = 1e-6 if code == "ridge" else 1e-3  # without the ridge, rounding grows
    np.testing.assert_allclose(
        codes[1, :, shift:], codes[0, :, :-shift], atol=tolerance * codes.max()
    )


def test_ridge_code_does_not_depend_on_where_it_starts_and_moves_little(touches, fitted):
    """Strict convexity: half the tensor's change bounds the code's; and the optimality conditions
    hold.
    """
    bump = 1e-6 * np.random.default_rng(0).random(touches.shape)
    codes = [encode(t, fitted.components_, "ridge")[0] for t in (touches, touches + bump)]
    bound = np.linalg.norm(bump) * np.sqrt(3 * 12) / 0.1
    assert np.linalg.norm(codes[0] - codes[1]) < bound
    rest = touches - reconstruct(fitted.components_, codes[0])
    seen = np.stack(
        [
            sum(
                fitted.components_[m, :, lag]
                @ np.pad(tensor, ((0, 0), (0, 12)))[:, lag : lag + 90]
                for lag in range(12)
            )
            for tensor in rest
            for m in range(3)
        ]
    ).reshape(12, 3, 90)
    slope = 0.1 * codes[0] - seen
    assert slope.min() > -1e-6
    assert np.abs(slope[codes[0] > 0]).max() < 1e-6


def test_sparse_code_has_the_sparseness(touches, fitted):
    codes = fitted.transform(touches)
    np.testing.assert_allclose(hoyer_sparseness(codes)[codes.any(axis=2)], 0.8, atol=1e-6)


def test_a_trial_of_zeros_has_a_code_of_zeros(touches):
    tensors = touches.copy()
    tensors[3] = 0
    model = ConvolutiveNMF(2, 8, n_restarts=1, random_state=0, tol=1e-2).fit(tensors)
    assert not model.activations_[3].any()
    for code in CODES:
        assert not model.transform(tensors, code=code)[3].any()


def test_nothing_but_zeros():
    model = ConvolutiveNMF(2, 5, n_restarts=2, random_state=0).fit(np.zeros((2, 4, 20)))
    assert np.isfinite(model.components_).all()
    assert not model.transform(np.zeros((1, 4, 20))).any()
    assert model.reconstruction_err_ == 0


def test_trials_do_not_leak_into_each_other():
    """What ends one trial must not start the next: coding them together or apart is the same."""
    rng = np.random.default_rng(1)
    tensors = rng.random((2, 5, 30))
    bases = rng.random((2, 5, 10))
    together, _ = encode(tensors, bases, "ridge")
    apart = [encode(tensor[None], bases, "ridge")[0][0] for tensor in tensors]
    np.testing.assert_array_equal(together, apart)
    lonely = np.zeros((2, 2, 30))
    lonely[0, :, 25] = 1
    assert not reconstruct(bases, lonely)[1].any()


def test_fit_transform_is_fit_and_then_transform(touches):
    model = ConvolutiveNMF(2, 8, random_state=0, n_restarts=1, tol=1e-2)
    np.testing.assert_array_equal(model.fit_transform(touches), model.transform(touches))


def test_reads_dataset_and_dataarray(touches, fitted):
    array = xr.DataArray(touches, dims=("trial", "sensor", "time"), name="angle")
    expected = fitted.transform(touches)
    for given in (array, array.transpose("time", "trial", "sensor"), array.to_dataset()):
        np.testing.assert_array_equal(fitted.transform(given), expected)


def test_learning_in_batches_approaches_the_full_fit(touches):
    full = ConvolutiveNMF(3, 10, random_state=0, n_restarts=1, tol=1e-3).fit(touches)
    stream = ConvolutiveNMF(3, 10, random_state=0).fit_stream(
        touches, batch_size=4, n_epochs=10
    )
    assert stream.score(touches) > full.score(touches) - 0.1
    assert stream.components_.shape == (3, 14, 10)


def test_a_tracker_is_told_how_far_a_fit_is(touches):
    told = []
    encoder = ConvolutiveNMF(n_components=2, n_lags=5, max_iter=20, n_restarts=2, n_jobs=1)
    encoder.fit(touches, progress=lambda *words: told.append(words))
    assert [done for done, _ in told] == [*range(1, len(told) + 1)]
    assert {total for _, total in told} == {40} and 2 < len(told) <= 40
    told.clear()
    encoder.fit_stream(touches, batch_size=7, n_epochs=2, progress=lambda *w: told.append(w))
    total = 2 * -(-len(touches) // 7)
    assert told == [(k, total) for k in range(1, total + 1)]


@pytest.mark.further
@pytest.mark.parametrize("n_jobs", [1, 3])
def test_of_the_finished_restarts_nothing_changes_and_the_others_stop_early(touches, n_jobs):
    settings = {"max_iter": 12, "tol": 0.0, "n_restarts": 4, "random_state": 1, "warn": False}
    whole = ConvolutiveNMF(3, 10, n_jobs=n_jobs, **settings).fit(touches)
    early = ConvolutiveNMF(3, 10, **settings | {"max_iter": 4}).fit(touches)
    told = []
    fitted = ConvolutiveNMF(3, 10, n_jobs=n_jobs, n_finished=2, **settings)
    fitted.fit(touches, progress=lambda *words: told.append(words))
    assert told[-1] == (2 * 12 + 2 * 4,) * 2
    assert set(fitted.restarts_[:2]) <= set(whole.restarts_)
    np.testing.assert_array_equal(np.sort(fitted.restarts_[2:]), early.restarts_[2:])
    assert fitted.n_iter_ == 12 and fitted.relative_residual_ == fitted.restarts_.min()
    for many in (4, 9, None):
        fitted.set_params(n_finished=many).fit(touches)
        np.testing.assert_array_equal(fitted.components_, whole.components_)
    for name, wrong in (("n_finished", 0), ("inner_steps", 2.5)):
        with pytest.raises(InvalidInput, match=f"{name} must be a whole number of at least 1"):
            ConvolutiveNMF(3, 10).set_params(**{name: wrong}).fit(touches)


def test_stream_reads_zarr_a_batch_at_a_time(touches, tmp_path):
    import zarr

    stored = zarr.create_array(
        tmp_path / "t.zarr", shape=touches.shape, chunks=(1, 14, 90), dtype="f8"
    )
    stored[:] = touches
    from_disk = ConvolutiveNMF(2, 10, random_state=0).fit_stream(
        stored, batch_size=5, n_epochs=2
    )
    from_memory = ConvolutiveNMF(2, 10, random_state=0).fit_stream(
        touches, batch_size=5, n_epochs=2
    )
    np.testing.assert_array_equal(from_disk.components_, from_memory.components_)


BAD_TENSORS = [
    (-np.ones((2, 4, 60)), r"negative entries \(100.0% of them.*rectify\(X\).*mirror_to_left"),
    (np.full((2, 4, 60), np.nan), "NaN or infinite entries, the first in trial 0"),
    (np.ones((4, 60)), r"One tensor is X\[None\]"),
    (np.ones((0, 4, 60)), "empty"),
    (np.ones((2, 4, 30)), "n_lags is 40, but a trial has 30 samples"),
    (np.array([[["a"]]]), "needs? numbers"),
]


@pytest.mark.parametrize(
    ("tensors", "message"),
    BAD_TENSORS,
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_bad_tensors_are_refused_with_what_to_do(tensors, message):
    with pytest.raises(InvalidInput, match=message):
        ConvolutiveNMF().fit(tensors)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"sparseness": 1.0}, r"sparseness must lie in \[0, 1\)"),
        ({"sparseness": -0.5}, r"sparseness must lie in \[0, 1\)"),
        ({"n_components": 0}, "n_components must be a whole number"),
        ({"n_components": 10}, "hold only 6 separate windows"),
        ({"constraint": "both"}, "one of 'trial', 'all'; got 'both'"),
        ({"code": "best"}, "one of 'sparse', 'ridge', 'nonnegative'; got 'best'"),
        ({"init": "nndsvd"}, "one of 'windows', 'random'"),
        ({"tol": -1}, "tol must be 0 or more"),
        ({"n_jobs": 0}, "n_jobs must be"),
    ],
)
def test_bad_parameters_are_refused(parameters, message):
    with pytest.raises(InvalidInput, match=message):
        ConvolutiveNMF(**{"n_lags": 20, **parameters}).fit(np.ones((2, 4, 60)))


def test_other_sensors_than_in_the_fit_are_refused(fitted):
    with pytest.raises(InvalidInput, match="have 8 sensors, but the bases were learned on 14"):
        fitted.transform(np.ones((1, 8, 90)))


def test_no_convergence_warns_and_says_what_to_change(touches):
    with pytest.warns(ConvergenceWarning, match="Raise max_iter"):
        ConvolutiveNMF(2, 10, max_iter=2, n_restarts=1).fit(touches)


def test_a_stream_of_signed_tensors_is_prepared_batch_by_batch():
    signed = np.random.default_rng(5).standard_normal((6, 4, 30))
    model = ConvolutiveNMF(n_components=2, n_lags=5, random_state=0)
    prepared = model.fit_stream(
        signed, batch_size=2, n_epochs=2, prepare=lambda batch: np.maximum(batch, 0)
    ).components_
    same = ConvolutiveNMF(n_components=2, n_lags=5, random_state=0).fit_stream(
        np.maximum(signed, 0), batch_size=2, n_epochs=2
    )
    np.testing.assert_array_equal(prepared, same.components_)
    with pytest.raises(InvalidInput, match="negative entries"):
        model.fit_stream(signed)
