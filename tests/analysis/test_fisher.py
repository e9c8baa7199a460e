"""Fisher information against the linear channel; the engine's differences against each other."""

import numpy as np
import pytest

import feeler
from feeler.analysis import (
    compute_bounds,
    compute_fisher,
    differentiate_touches,
    scale_derivatives,
    scale_peaks,
)
from feeler.analysis.information import PARAMETERS
from feeler.errors import InvalidInput


def test_bounds_are_what_least_squares_reaches():
    """x = A θ + noise: the bound is the error of the least-squares estimate, σ² (AᵀA)⁻¹."""
    rng = np.random.default_rng(0)
    design, sd = rng.standard_normal((40, 3)), 0.3
    fisher = compute_fisher(design.T, sd)
    noisy = sd * rng.standard_normal((20_000, 40))
    reached = (noisy @ np.linalg.pinv(design).T).std(axis=0)
    assert compute_bounds(fisher) == pytest.approx(reached, rel=0.03)
    assert compute_bounds(fisher, joint=False) == pytest.approx(
        sd / np.linalg.norm(design, axis=0)
    )
    assert np.all(compute_bounds(fisher) >= compute_bounds(fisher, joint=False))


def test_what_cannot_be_told_has_no_bound():
    twice = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0]])
    assert np.all(np.isinf(compute_bounds(compute_fisher(twice, 1.0))))
    assert np.isinf(compute_bounds(compute_fisher(np.array([[1.0], [0.0]]), 1.0))[1])
    with pytest.raises(InvalidInput, match="finite"):
        compute_fisher(np.array([[np.nan]]), 1.0)
    for sd in (1e308, 1e-200, np.inf):
        with pytest.raises(InvalidInput, match="sd must be"):
            compute_fisher(np.array([[1.0]]), sd)


def test_parameters_move_a_touch_by_millimetres_and_per_cent():
    antenna = feeler.presets.cockroach()
    trial = feeler.Trial(feature=feeler.Ball(radius=1.5), location=0.7, speed=0.3)
    moved = {
        name: PARAMETERS[name].move(antenna, trial, 4.0)
        for name in ("location", "size", "speed")
    }
    found = {name: (one.location, one.feature.size, one.speed) for name, one in moved.items()}
    assert found["location"] == pytest.approx((0.7 + 4.0 / 42.0, 1.5, 0.3))
    assert found["size"] == pytest.approx((0.7, 5.5, 0.3))
    assert found["speed"] == pytest.approx((0.7, 1.5, 0.3 * 1.04))


@pytest.fixture(scope="module")
def derived():
    trials = [
        feeler.Trial(feature=feature, location=0.7, speed=0.3)
        for feature in (feeler.Ball(radius=1.5), feeler.Box(half_width=1.5, half_height=1.5))
    ]
    return differentiate_touches(feeler.presets.cockroach(), trials, duration=40.0)


def test_differences_converge(derived):
    assert derived["derivative"].shape == (3, 2, 56, 40)
    assert float(derived["change"].max()) < 0.05


def test_differences_are_per_millimetre_and_per_cent(derived):
    """Against plain differences of touches of our own: 0.04 mm of 42, 0.04 mm of half-width, half a
    per cent of speed.
    """
    antenna, ball = feeler.presets.cockroach(), feeler.Ball
    changes = {
        "location": (0.08, [{"location": 0.7 + way * 0.04 / 42.0} for way in (1, -1)]),
        "size": (0.08, [{"feature": ball(radius=1.5 + way * 0.04)} for way in (1, -1)]),
        "speed": (1.0, [{"speed": 0.3 * (1 + way * 0.005)} for way in (1, -1)]),
    }
    usual = {"feature": ball(radius=1.5), "location": 0.7, "speed": 0.3}
    trials = [
        feeler.Trial(**(usual | change)) for _, pair in changes.values() for change in pair
    ]
    angle = feeler.touch(antenna, trials, duration=40.0)["angle"].values
    for k, (name, (apart, _)) in enumerate(changes.items()):
        expected = (angle[2 * k] - angle[2 * k + 1]) / apart
        got = derived["derivative"].sel(parameter=name).values[0]
        assert np.linalg.norm(got - expected) < 0.03 * np.linalg.norm(expected)
    assert derived["unit"].values.tolist() == ["mm", "mm", "%"]


def test_no_change_before_contact(derived):
    assert (
        abs(
            derived["derivative"].sel(parameter=["location", "size"]).isel(time=slice(0, 5))
        ).max()
        == 0
    )


def test_what_has_no_size_is_refused():
    with pytest.raises(InvalidInput, match="leave the parameter 'size' out"):
        differentiate_touches(
            feeler.presets.cockroach(),
            feeler.Trial(feature=feeler.Wall(), location=0.9, speed=0.3),
            ["size"],
        )
    with pytest.raises(InvalidInput, match="unknown parameter of a touch"):
        differentiate_touches(
            feeler.presets.cockroach(),
            feeler.Trial(feature=feeler.Wall(), location=0.9, speed=0.3),
            ["mass"],
        )


def test_derivatives_of_scaled_tensors():
    """Against differences of the scaled tensors themselves."""
    rng = np.random.default_rng(1)
    tensors = rng.standard_normal((3, 4, 5))
    moves = rng.standard_normal((2, 3, 4, 5))
    step = 1e-6
    found = scale_derivatives(moves, tensors)
    for move, derivative in zip(moves, found, strict=True):
        difference = (
            scale_peaks(tensors + step * move) - scale_peaks(tensors - step * move)
        ) / (2 * step)
        assert derivative == pytest.approx(difference, abs=1e-7)
    with pytest.raises(InvalidInput, match="with a peak"):
        scale_derivatives(moves, np.zeros((3, 4, 5)))
    with pytest.raises(InvalidInput, match="with a peak"):
        scale_derivatives(moves, tensors * np.array([1.0, 0.0, 1.0])[:, None, None])


def test_faster_is_earlier():
    """For a quasi-static touch, one per cent of speed moves the tensor along time by one per cent
    of the time since contact.
    """
    antenna = feeler.presets.cockroach()
    trial = feeler.Trial(feature=feeler.Ball(radius=3), location=0.6, speed=0.06)
    found = differentiate_touches(antenna, trial, ["speed"], duration=80.0)[
        "derivative"
    ].values[0, 0]
    angle = feeler.touch(antenna, [trial] * 2, duration=80.0)["angle"].values[
        0
    ]  # lanes as above, compiled already
    shift = np.gradient(angle, axis=1) * (np.arange(80.0) - trial.lead) / 100
    late = slice(30, 78)
    assert np.corrcoef(found[:, late].ravel(), shift[:, late].ravel())[0, 1] > 0.98


def test_what_is_confused_leaves_the_bounds_of_the_others():
    """Against the inverse of the matrix of those that are told."""
    rng = np.random.default_rng(3)
    told = compute_fisher(rng.standard_normal((2, 9)), 1.0)
    expected = np.sqrt(np.diag(np.linalg.inv(told)))
    fisher = np.zeros((4, 4))
    fisher[:2, :2], fisher[2:, 2:] = told, 5.0  # 2 and 3 only as their sum
    assert compute_bounds(fisher) == pytest.approx([*expected, np.inf, np.inf])
    fisher[3] = fisher[:, 3] = 0.0
    assert compute_bounds(fisher) == pytest.approx([*expected, 1 / np.sqrt(5.0), np.inf])
    for wrong in (np.nan, -1.0):
        with pytest.raises(InvalidInput, match="negative in no direction"):
            compute_bounds(np.diag([1.0, wrong]))
