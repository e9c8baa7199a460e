"""A calibration whose every answer is known: an oscillator in place of the simulation."""

from dataclasses import replace
from itertools import count

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from feeler.calibration import (
    METHODS,
    Problem,
    analyse_directions,
    bootstrap,
    compute_profiles,
    fit,
    make_hinges,
    make_targets,
    search,
    walk_sloppy_direction,
)
from feeler.calibration.hinges import Hinges
from feeler.calibration.problem import FAILED, Measured
from feeler.errors import InvalidInput

from .small_antenna import make_small

FREQUENCY, RATIO = 0.02, 0.4
SPREADS = (0.002, 0.08)


class Oscillator:
    """Factors p1 on stiffness and p2 on damping give the frequency √p1 f and the damping ratio p2 /
    √p1 ζ.
    """

    asked = 0

    def measure_many(self, antennas, names):
        self.asked += 1
        return [self._measure(a, names) for a in antennas]

    def _measure(self, antenna, names):
        own = make_small()
        p1, p2 = antenna.stiffness[0] / own.stiffness[0], antenna.damping[0] / own.damping[0]
        if p1 > 100:
            return InvalidInput("too stiff to be measured")
        values = {
            "frequency": np.sqrt(p1) * FREQUENCY,
            "damping_ratio": p2 / np.sqrt(p1) * RATIO,
        }
        return Measured(names=tuple(names), values=np.array([values[name] for name in names]))

    def measure(self, antenna, names):
        return self._measure(antenna, names)


@pytest.fixture
def problem():
    targets = make_targets(frequency=(FREQUENCY, SPREADS[0]), damping_ratio=(RATIO, SPREADS[1]))
    return Problem(
        hinges=make_hinges("scale", make_small()), targets=targets, protocol=Oscillator()
    )


def compute_residuals(x):
    """1 − √p1 and 1 − p2 / √p1, for the logarithms of p1 and p2."""
    return np.array([1 - np.exp(x[0] / 2), 1 - np.exp(x[1] - x[0] / 2)])


AT = np.array([0.3, -0.2])
JACOBIAN = np.array([[-np.exp(0.15) / 2, 0.0], [np.exp(-0.35) / 2, -np.exp(-0.35)]])


def test_residuals_errors_and_scores(problem):
    np.testing.assert_allclose(problem.compute_residuals(AT), compute_residuals(AT), rtol=1e-12)
    assert problem.compute_error(AT) == pytest.approx(np.hypot(*compute_residuals(AT)))
    measured, distance, accuracy = problem.score(np.exp(AT))
    np.testing.assert_allclose(
        measured.values, [FREQUENCY * np.exp(0.15), RATIO * np.exp(-0.35)]
    )
    assert distance == pytest.approx(np.hypot(*compute_residuals(AT)))
    assert accuracy == pytest.approx(np.expm1((0.15 + 0.35) / 2))


def test_a_jacobian_is_the_derivative_and_costs_two_antennas_a_parameter(problem):
    np.testing.assert_allclose(
        problem.compute_jacobian(AT, 1e-3), JACOBIAN, rtol=1e-6, atol=1e-9
    )
    assert problem.evaluations == 4


def test_what_cannot_be_measured_is_counted_and_costs_more_than_any_other(problem):
    found = problem.compute_many(np.array([[0.0, 0.0], [5.0, 0.0], AT]))
    np.testing.assert_allclose(found[:2], [[0, 0], [FAILED, FAILED]], atol=1e-12)
    assert (problem.evaluations, problem.failures) == (3, 1)
    np.testing.assert_array_equal(problem.best_x, [0, 0])
    assert problem.best_error == pytest.approx(0.0, abs=1e-12)
    problem.compute_many(AT[None])
    assert problem.best_error == pytest.approx(0.0, abs=1e-12)  # a worse one is not remembered


@pytest.mark.parametrize("method", METHODS)
def test_every_method_finds_the_root_and_says_what_it_cost(problem, method, monkeypatch):
    monkeypatch.setattr(
        "feeler.calibration.problem.time.process_time", count().__next__
    )  # a second for every group
    found = search(problem, (2.0, 0.5), method, max_evaluations=300)
    np.testing.assert_allclose(found.p, [1.0, 1.0], rtol=5e-3)
    assert (found.method, found.start) == (method, (2.0, 0.5))
    assert (
        found.error
        == problem.best_error
        == pytest.approx(np.hypot(*compute_residuals(np.log(found.p))), abs=1e-12)
    )
    assert found.evaluations == problem.evaluations <= 300
    again = search(problem, (1.5, 0.5), method, max_evaluations=300)
    assert found.evaluations + again.evaluations == problem.evaluations
    assert found.seconds + again.seconds == pytest.approx(problem.seconds)
    # Powell asks for one point twice: the journal gives it, and it counts as it did at first
    assert round(problem.seconds) - problem.protocol.asked == (method == "powell")
    assert min(found.seconds, again.seconds) >= 1


@pytest.mark.parametrize("order", [1, -1])
def test_of_several_searches_the_one_of_least_error_is_the_fit(problem, order):
    starts = np.array([[1.0, 1.0], [8.0, 0.1], [3.0, 0.4]])[::order]
    found = fit(problem, starts, method="powell", max_evaluations=3)
    assert [m.start for m in found.minima] == [tuple(start) for start in starts]
    assert (
        found.error == min(m.error for m in found.minima) < max(m.error for m in found.minima)
    )


def test_one_target_without_spread_leaves_the_others_to_draw_from(problem):
    targets = make_targets(frequency=(FREQUENCY, 0.0), damping_ratio=(RATIO, SPREADS[1]))
    drawn = bootstrap(
        replace(problem, targets=targets), np.ones(2), np.random.default_rng(0), n_draws=50
    )
    assert np.ptp(drawn[:, 0]) < 1e-6 < np.ptp(drawn[:, 1])


@pytest.mark.parametrize("end", ["low", "high"])
def test_a_search_may_begin_at_its_bounds(problem, end):
    start = np.where([True, False], getattr(problem.hinges, end), 1.0)
    assert search(problem, start, max_evaluations=5).start == tuple(start)


@pytest.mark.parametrize("method", ["powell", "nelder-mead"])
def test_a_search_ends_when_its_antennas_are_spent(problem, method):
    assert search(problem, (8.0, 0.1), method, max_evaluations=7).evaluations == 7


def test_directions_are_the_singular_vectors_of_the_derivative(problem):
    found = analyse_directions(problem, np.exp(AT), step=1e-3)
    _, sizes, rows = np.linalg.svd(JACOBIAN)
    np.testing.assert_allclose(found.sensitivity, sizes, rtol=1e-6)
    np.testing.assert_allclose(np.abs(found.direction), np.abs(rows), atol=1e-6)
    assert found.condition == pytest.approx(sizes[0] / sizes[1], rel=1e-6)
    np.testing.assert_allclose(found.p, np.exp(AT))


def test_a_walk_along_the_loosest_direction_has_the_errors_of_its_places(problem):
    found = analyse_directions(problem, np.exp(AT), step=1e-3)
    steps = np.array([-0.5, 0.0, 2.0])
    p, errors = walk_sloppy_direction(problem, found, steps)
    np.testing.assert_allclose(np.log(p), AT + steps[:, None] * found.direction[-1], atol=1e-9)
    np.testing.assert_allclose(
        errors, [np.hypot(*compute_residuals(x)) for x in np.log(p)], rtol=1e-9
    )
    far, _ = walk_sloppy_direction(problem, found, np.array([1e3]))
    assert np.all((far >= 1e-3 - 1e-12) & (far <= 1e3 + 1e-9))


def test_a_profile_holds_one_number_and_is_the_least_error_over_the_other(problem):
    """With the stiffness held the damping can still meet its ratio; with the damping held they
    share the error.
    """
    found = compute_profiles(problem, np.ones(2), span=0.6, n_places=5, refits=30)
    held = np.linspace(-0.6, 0.6, 5)
    np.testing.assert_allclose(found.value, np.exp([held, held]), rtol=1e-9)
    np.testing.assert_allclose(found.error[0], np.abs(1 - np.exp(held / 2)), atol=1e-5)

    def split(x):
        return minimize_scalar(
            lambda y: np.hypot(*compute_residuals(np.array([y, x]))),
            bounds=(-2, 2),
            method="bounded",
        ).fun

    np.testing.assert_allclose(found.error[1], [split(x) for x in held], atol=1e-4)
    np.testing.assert_allclose(found.others[0, :, 1], np.exp(held / 2), rtol=1e-3)
    usual = compute_profiles(
        problem, np.ones(2), refits=1
    ).value  # a typical change either way, at five places
    np.testing.assert_allclose(usual, np.exp([np.linspace(-1, 1, 5)] * 2), rtol=1e-9)
    away = compute_profiles(
        problem, np.array([1.2, 0.9]), refits=5
    )  # what was given is held in the middle, where the other one is refitted too
    np.testing.assert_allclose(away.value[:, 2], [1.2, 0.9], rtol=1e-12)
    np.testing.assert_allclose(away.others[0, 2, 1], 1.2**0.5, rtol=1e-3)


@pytest.mark.parametrize("n_animals", [1, 4])
def test_a_linear_bootstrap_has_the_covariance_of_error_propagation(problem, n_animals):
    found = np.log(
        bootstrap(
            problem, np.ones(2), np.random.default_rng(0), n_draws=20_000, n_animals=n_animals
        )
    )
    jacobian = np.array([[-0.5, 0.0], [0.5, -1.0]])
    relative = np.diag((np.array(SPREADS) / (FREQUENCY, RATIO)) ** 2 / n_animals)
    expected = np.linalg.inv(jacobian) @ relative @ np.linalg.inv(jacobian).T
    np.testing.assert_allclose(np.cov(found.T), expected, rtol=0.05)
    np.testing.assert_allclose(
        found.mean(axis=0), 0, atol=4 * np.sqrt(np.diag(expected).max() / 20_000)
    )


def test_a_refitted_bootstrap_meets_each_draw_exactly(problem):
    """p1 = (f / f₀)², p2 = ζ / ζ₀ · f / f₀ for the targets drawn."""
    found = bootstrap(
        problem, np.ones(2), np.random.default_rng(3), n_draws=6, n_animals=4, refits=30
    )
    drawn = 1 + np.array(SPREADS) / (FREQUENCY, RATIO) / 2 * np.random.default_rng(
        3
    ).standard_normal((6, 2))
    np.testing.assert_allclose(
        found, np.stack([drawn[:, 0] ** 2, drawn[:, 0] * drawn[:, 1]], axis=1), rtol=1e-4
    )


def test_a_bootstrap_knows_no_scale_of_the_search(problem):
    """One factor searched as itself, in steps of half of it, moves as its logarithm does."""
    own = vars(problem.hinges) | {
        "positive": (False, True),
        "low": np.array([0.0, 1e-3]),
        "high": np.array([4.0, 1e3]),
    }
    found = bootstrap(
        replace(problem, hinges=Hinges(**own)),
        np.ones(2),
        np.random.default_rng(0),
        n_draws=2000,
    )
    plain = bootstrap(problem, np.ones(2), np.random.default_rng(0), n_draws=2000)
    np.testing.assert_allclose(found[:, 0] - 1, np.log(plain[:, 0]), atol=2e-3)
    np.testing.assert_allclose(np.log(found[:, 1]), np.log(plain[:, 1]), atol=2e-3)
