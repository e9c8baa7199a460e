"""Entries that do not count, weights, and what held-out entries say about an encoder."""

import numpy as np
import pytest
import xarray as xr

from feeler.encoding import (
    ConvolutiveNMF,
    compute_dissimilarity,
    compute_significance,
    match_components,
    reconstruct,
    select_encoder,
)
from feeler.encoding.factorise import Data, Settings, _cross, _smooth, factorise
from feeler.errors import InvalidInput


def make_sequences(n_events, noise=0.0, seed=0, n_times=1000, n_sensors=15, n_lags=12):
    """One recording in which three sequences of sensors recur: (bases, activations, tensors)."""
    rng = np.random.default_rng(seed)
    bases, activations = np.zeros((3, n_sensors, n_lags)), np.zeros((1, 3, n_times))
    for m, row in enumerate(activations[0]):
        for i in range(n_sensors // 3):
            bases[m, m * (n_sensors // 3) + i, 2 * i : 2 * i + 4] = [0.3, 1, 0.6, 0.3]
        row[rng.choice(n_times - n_lags, n_events, replace=False)] = rng.uniform(
            0.5, 1.5, n_events
        )
    clean = reconstruct(bases, activations)
    return bases, activations, np.maximum(clean + noise * rng.normal(size=clean.shape), 0)


def make(**more):
    how = {"n_components": 3, "n_lags": 12, "n_restarts": 1, "random_state": 0, "warn": False}
    return ConvolutiveNMF(**how | more)


@pytest.mark.further
@pytest.mark.parametrize("how", [{"sparseness": 0.85}, {"sparseness": None, "max_iter": 300}])
def test_what_a_mask_hides_has_no_influence_and_is_predicted(how):
    bases, _, tensors = make_sequences(20)
    mask = np.random.default_rng(1).random(tensors.shape) < 0.2
    spoilt = np.where(mask, np.nan, tensors)
    first = make(**how).fit(spoilt, mask=mask)
    second = make(**how).fit(np.ma.masked_array(np.where(mask, 1e6, tensors), mask))
    np.testing.assert_array_equal(first.components_, second.components_)
    predicted = reconstruct(first.components_, first.activations_)
    rest = (tensors - predicted)[mask]
    assert (rest**2).sum() < 0.15 * (tensors[mask] ** 2).sum()
    own = np.linalg.norm((tensors - predicted)[~mask])
    assert first.reconstruction_err_ == pytest.approx(own)
    assert (np.diff(first.loss_curve_) <= 1e-9 * (tensors**2).sum()).all()
    assert match_components(bases, first.components_)[1].min() > 0.7
    code = first.transform(spoilt, mask=mask, code="nonnegative")
    np.testing.assert_array_equal(
        code, first.transform(np.ma.masked_array(tensors, mask), code="nonnegative")
    )
    assert first.score(spoilt, mask=mask) > 0.9


def test_a_masked_code_is_the_least_of_the_entries_that_count():
    _, _, tensors = make_sequences(8, n_times=60)
    model = make().fit(tensors)
    mask = np.random.default_rng(2).random(tensors.shape) < 0.15
    code = model.transform(tensors, mask=mask, code="ridge")
    slope = 1e-4
    ridge = 0.1 * (model.components_**2).sum(axis=(1, 2)).mean()

    def loss(h):
        rest = (tensors - reconstruct(model.components_, h))[~mask]
        return 0.5 * (rest**2).sum() + 0.5 * ridge * (h**2).sum()

    for seed in range(20):
        step = np.random.default_rng(seed).normal(size=code.shape)
        other = np.maximum(code + 0.05 * step, 0)
        assert loss(other) > loss(code) * (1 - slope)
    empty = np.zeros(tensors.shape, bool)
    np.testing.assert_array_equal(
        model.transform(tensors, mask=empty), model.transform(tensors)
    )


@pytest.mark.parametrize("sparseness", [0.7, None])
def test_a_weight_of_two_is_the_trial_twice(touches, sparseness):
    rng = np.random.default_rng(3)
    start, codes = rng.random((3, 14, 12)), rng.random((12, 3, 90))
    twice = np.r_[np.arange(12), 4, 4]
    weights = np.bincount(twice).astype(float)
    how = {"sparseness": sparseness, "max_iter": 8, "tol": 0}
    begun = {"components": start, "activations": codes}
    one = make(**how).fit(touches, sample_weight=weights, **begun)
    begun["activations"] = codes[twice]
    two = make(**how).fit(touches[twice], **begun)
    np.testing.assert_allclose(one.components_, two.components_, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(one.activations_, two.activations_[:12], rtol=1e-6, atol=1e-9)
    assert one.score(touches, sample_weight=weights) == pytest.approx(one.score(touches[twice]))
    without = make(**how).fit(touches, sample_weight=np.arange(12) > 0)
    assert not without.activations_[0].any()


def test_the_penalty_is_seqnmf_s_and_is_lowered_with_the_loss():
    """Σ_{k≠m} Σ_t Σ_{|u|<T} A_k(t) H_m(t + u), by loops; the loss with it never rises."""
    _, _, tensors = make_sequences(6, 0.1, n_times=70)
    rng = np.random.default_rng(0)
    how = {"n_components": 3, "n_lags": 12, "joint": False, "max_iter": 12, "tol": 0.0}

    def penalise(bases, codes):
        seen = np.zeros(codes.shape)
        for t in range(70):
            for lag in range(min(12, 70 - t)):
                seen[:, :, t] += np.einsum(
                    "mx,nx->nm", bases[:, :, lag], tensors[:, :, t + lag]
                )
        return sum(
            (seen[:, k, t] * codes[:, m, max(t - 11, 0) : t + 12].sum(axis=1)).sum()
            for k in range(3)
            for m in range(3)
            for t in range(70)
            if k != m
        )

    for sparseness, steps in ((0.7, 3), (None, 1)):
        settings = Settings(sparseness=sparseness, inner_steps=steps, cross=0.002, **how)
        start = rng.random((3, 15, 12)), rng.random((1, 3, 70))
        (found,) = factorise(Data(tensors, 12), [start], settings)
        assert (np.diff(found.losses) <= 1e-9 * found.losses[0]).all()
        rest = tensors - reconstruct(found.components, found.activations)
        penalty = 0.002 * penalise(found.components, found.activations)
        assert penalty > 0
        assert found.losses[-1] == pytest.approx(0.5 * (rest**2).sum() + penalty, rel=1e-8)
    rows = rng.random((2, 3, 9))
    np.testing.assert_allclose(_smooth(rows, 1), rows)
    np.testing.assert_allclose(_cross(rows, 2.0)[:, 1], 2 * (rows[:, 0] + rows[:, 2]))


def test_under_a_mask_the_loss_with_its_penalty_never_rises():
    _, _, tensors = make_sequences(8, 0.1, n_times=70)
    for seed, share in ((0, 0.1), (0, 0.3), (1, 0.5)):
        mask = np.random.default_rng(seed).random(tensors.shape) < share
        how = {"n_components": 4, "init": "windows", "max_iter": 60, "tol": 0.0}
        fitted = make(cross_orthogonality=0.002, random_state=seed, **how).fit(
            tensors, mask=mask
        )
        losses = fitted.loss_curve_
        assert (np.diff(losses) <= 1e-9 * losses[0]).all()


def test_the_penalty_makes_needless_bases_fade():
    bases, _, tensors = make_sequences(20, 0.05)
    free, bound = (
        make(n_components=5, sparseness=0.85, cross_orthogonality=weight).fit(tensors)
        for weight in (0.0, 0.002)
    )
    power = [(one.activations_**2).sum(axis=(0, 2)) for one in (free, bound)]
    shares = [np.sort(one)[:2].sum() / one.sum() for one in power]
    assert shares[1] < 0.5 * shares[0]
    assert match_components(bases, bound.components_)[1].min() > 0.9


@pytest.mark.parametrize(
    ("n_events", "noise", "n_components"),
    [
        pytest.param(16, 0.0, (2, 3, 4), marks=pytest.mark.long),
        (16, 0.1, 3),
        pytest.param(110, 0.1, 3, marks=pytest.mark.long),
    ],
)
def test_the_choice_finds_the_sequences_at_any_sparseness(n_events, noise, n_components):
    """Sparseness near 0.9 and 0.7; without noise 0.8 has the wrong bases of 16 events."""
    bases, _, tensors = make_sequences(n_events, noise)
    found = select_encoder(
        tensors,
        n_components=n_components,
        sparseness=(0.6, 0.7, 0.8, 0.9),
        encoder=make(n_restarts=2, max_iter=50),
        n_masks=2,
    )
    assert found.params["n_components"] == 3
    assert match_components(bases, found.encoder.components_)[1].min() >= 0.97
    assert str(found).startswith("3 bases of 12 samples at sparseness 0.")
    assert found.table.chosen.sum() == 1
    assert len(found.plot().axes) == 2
    if n_components == 3:
        return
    wrong = make(sparseness=0.8, n_restarts=2).fit(tensors)
    assert match_components(bases, wrong.components_)[1].min() < 0.9
    assert wrong.relative_residual_ < 0.03
    assert wrong.stability_ > 0.95
    assert "n_components 2 +" in str(found)
    assert "n_components 4 " in str(found)
    assert found.table.held_out[found.table.n_components == 2].min() > 0.1


@pytest.mark.long
def test_of_starts_that_fit_alike_the_typical_one_is_kept():
    """Here the start of the lowest residual splits one pattern and mixes the others (0.82)."""
    rng = np.random.default_rng(3)
    bases, activations = np.zeros((3, 20, 16)), np.zeros((1, 3, 1500))
    for basis in bases:
        for i, sensor in enumerate(rng.permutation(20)[:10]):
            basis[sensor, int(1.3 * i) : int(1.3 * i) + 3] = [0.5, 1, 0.5]
    for row in activations[0]:
        row[rng.choice(1484, 25, replace=False)] = 1
    tensors = (rng.poisson(20 * reconstruct(bases, activations)) / 20).astype(np.float32)
    how = {"n_lags": 16, "sparseness": 0.875, "n_restarts": 10}
    lowest, typical = (make(**how, keep=keep).fit(tensors) for keep in ("lowest", "typical"))
    assert match_components(bases, typical.components_)[1].min() > 0.97
    assert typical.relative_residual_**2 <= lowest.relative_residual_**2 + 0.003
    np.testing.assert_array_equal(np.sort(typical.restarts_), lowest.restarts_)
    rest = tensors - reconstruct(typical.components_, typical.activations_)
    assert np.linalg.norm(rest) == pytest.approx(typical.reconstruction_err_, rel=1e-6)
    np.testing.assert_array_equal(typical.restart_components_[0], typical.components_)
    with pytest.raises(InvalidInput, match="keep must be one of 'lowest', 'typical'; got 'me'"):
        make(keep="me").fit(tensors)


def test_significance_holds_for_sequences_and_not_for_patterns_of_chance():
    bases, _, _ = make_sequences(1)
    _, _, held_out = make_sequences(20, 0.2, seed=9)
    rng = np.random.default_rng(4)
    chance = np.stack([rng.permuted(basis, axis=1) for basis in bases])
    found = compute_significance(np.concatenate([bases, chance]), held_out)
    assert (found[:3] < 0.05 / 3).all()
    assert (found[3:] > 0.05 / 3).all()
    assert compute_significance(np.zeros((1, 15, 12)), held_out)[0] == 1.0


def test_dissimilarity_counts_both_ways():
    first = np.eye(4)[:3, :, None] * np.ones(5)
    assert compute_dissimilarity([first, first[[2, 0, 1]]]) == pytest.approx(0)
    other = first.copy()
    other[2] = np.eye(4)[3][:, None]
    assert compute_dissimilarity([first, other]) == pytest.approx(1 / 3)
    assert np.isnan(compute_dissimilarity([first]))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda mask: mask[:, :4], r"shape \(12, 14, 90\); got bool of \(12, 4, 90\)"),
        (lambda mask: mask.astype(int), "True or False .*got int64"),
        (lambda mask: mask | (np.arange(14) == 3)[:, None], "every entry of sensor 3; nothing"),
        (lambda mask: mask | (np.arange(12) > 9)[:, None, None], "trial 10 and of 1 more"),
    ],
)
def test_masks_that_mean_nothing_are_refused(touches, change, message):
    mask = np.zeros(touches.shape, dtype=bool)
    with pytest.raises(InvalidInput, match=message):
        make().fit(touches, mask=change(mask))


def test_other_bad_input_is_refused(touches):
    for weights, message in (
        (np.ones(3), r"one number per trial, shape \(12,\); got \(3,\)"),
        (np.zeros(12), "not 0 for all trials"),
        (-np.ones(12), "at least 0"),
    ):
        with pytest.raises(InvalidInput, match=message):
            make().fit(touches, sample_weight=weights)
    with pytest.raises(InvalidInput, match="cross_orthogonality must be 0 or more"):
        make(cross_orthogonality=-1).fit(touches)
    with pytest.raises(InvalidInput, match="partial_fit and fit_stream know no cross"):
        make(cross_orthogonality=0.1).partial_fit(touches)
    with pytest.raises(InvalidInput, match=r"do not form one array .* Crop or pad"):
        make().fit([touches[0], touches[1][:, :-1]])
    for wrong in ({"held_out": 1}, {"n_masks": 1.5}, {"tolerance": -1}, {"refine": -1}):
        with pytest.raises(InvalidInput, match=f"{next(iter(wrong))} must be"):
            select_encoder(touches, **wrong)
    with pytest.raises(InvalidInput, match="each need one value"):
        select_encoder(touches, sparseness=[])
    with pytest.raises(InvalidInput, match=r"mask=np.isnan\(X\)"):
        make().fit(np.where(touches > 0.9, np.nan, touches))


def test_dims_may_have_other_names_and_masks_follow_them(touches):
    short = {"max_iter": 5}
    model = make(**short).fit(touches)
    mask = np.random.default_rng(0).random(touches.shape) < 0.05
    cells = xr.DataArray(touches, dims=("epoch", "neuron", "time"), coords={"epoch": range(12)})
    np.testing.assert_array_equal(make(**short).fit(cells).components_, model.components_)
    turned = cells.transpose("time", "epoch", "neuron")
    hidden = xr.DataArray(mask, dims=cells.dims).transpose("neuron", "epoch", "time")
    code = make(**short).fit(turned, mask=hidden).transform(turned, mask=hidden)
    expected = make(**short).fit(touches, mask=mask).transform(touches, mask=mask)
    assert code.dims == ("epoch", "component", "time")
    assert set(code.coords) == {"epoch"}
    np.testing.assert_array_equal(code, expected)
    assert model.inverse_transform(code).dims == ("epoch", "sensor", "time")
    with pytest.raises(InvalidInput, match=r"expand_dims\(\"trial\"\)"):
        make(**short).fit(cells[0])


def test_the_mean_of_rectified_noise_bounds_the_bases_and_can_be_subtracted():
    """Against least-squares bases for the true activations: no fit can be expected to do better."""
    bases, activations, tensors = make_sequences(20, 0.2, seed=9)
    lagged = [np.pad(row, (lag, 0))[: row.size] for row in activations[0] for lag in range(12)]
    solved = np.linalg.lstsq(np.transpose(lagged), tensors[0].T, rcond=None)[0]
    oracle = np.maximum(solved.T, 0).reshape(-1, 3, 12).transpose(1, 0, 2)
    known = match_components(bases, oracle)[1]
    encoder = make(sparseness=0.825, n_restarts=6, keep="typical")
    own = match_components(bases, encoder.fit(tensors).components_)[1]
    np.testing.assert_allclose(own, known, atol=0.02)
    assert known.max() < 0.98 and own.min() > 0.95
    free = encoder.fit(np.maximum(tensors - 0.2 / np.sqrt(2 * np.pi), 0))
    assert match_components(bases, free.components_)[1].min() >= 0.97
