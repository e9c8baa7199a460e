"""Fits on a small antenna: what is planted comes back, and a fit is resumable and never silently
wrong.
"""

from dataclasses import replace

import numpy as np
import pytest

from feeler.calibration import (
    METHODS,
    Problem,
    Protocol,
    analyse_directions,
    bootstrap,
    compute_profiles,
    make_hinges,
    make_starts,
    make_targets,
    search,
    walk_sloppy_direction,
)
from feeler.calibration import problem as problem_module
from feeler.calibration import problem as protocol_module
from feeler.errors import InvalidInput, SimulationDivergedError
from feeler.presets import cockroach

from .small_antenna import make_small

NAMES = ("frequency", "damping_ratio")
PLANTED = np.array([1.3, 0.8])


@pytest.fixture(scope="module")
def targets():
    measured = Protocol(timestep=0.05).measure(make_small(*PLANTED), NAMES)
    return make_targets(
        **{
            name: (value, 0.05 * value)
            for name, value in zip(NAMES, measured.values, strict=True)
        }
    )


def make_problem(targets, **protocol):
    return Problem(
        hinges=make_hinges("scale", make_small()),
        targets=targets,
        protocol=Protocol(**({"timestep": 0.05} | protocol)),
    )


@pytest.mark.further
@pytest.mark.parametrize("method", METHODS)
def test_planted_factors_come_back(targets, method):
    minimum = search(make_problem(targets), np.ones(2), method, max_evaluations=200)
    assert minimum.error < 1e-3
    np.testing.assert_allclose(minimum.p, PLANTED, rtol=3e-3)
    assert minimum.evaluations <= 200 + 5


def test_the_published_constants_meet_the_reconstructed_targets():
    from feeler.antenna.animals import cockroach
    from feeler.calibration import load_targets

    goal = load_targets("cockroach")
    problem = Problem(hinges=make_hinges("exponential", cockroach()), targets=goal)
    measured, error, _ = problem.score((37.78, 25.24, -0.0827, -0.0533))
    np.testing.assert_allclose(measured.values, goal.values, rtol=0.03)
    assert error < 0.067


@pytest.mark.long
def test_engines_measure_the_same():
    names = (*NAMES, "ratio_71", "ratio_86")
    chain, mujoco = (
        Protocol(engine=engine).measure(make_small(), names).values
        for engine in ("chain", "mujoco")
    )
    np.testing.assert_allclose(chain, mujoco, rtol=1e-6)


def test_measuring_together_is_measuring_alone(targets):
    antennas = [make_small(k, 1.0) for k in (0.5, 1.0, 2.0)]
    together = Protocol().measure_many(antennas, NAMES)
    for antenna, one in zip(antennas, together, strict=True):
        np.testing.assert_array_equal(one.values, Protocol().measure(antenna, NAMES).values)


def test_a_cylinder_that_still_pushes_at_the_end_is_run_for_longer(monkeypatch):
    names, found = ("ratio_71", "ratio_86"), []
    for first in (0.02, 0.6):
        monkeypatch.setattr(protocol_module, "_IMPULSE_TRAVEL", (first, 0.6))
        found.append(Protocol().measure(make_small(), names).values)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


def test_the_forceps_hold_where_the_paper_says():
    assert Protocol().at == 10.0  # mm from the fixation [P]


def test_frequency_scales_as_the_square_root_of_stiffness_over_mass():
    """Stiffness ×4 and damping ×2 double every rate and keep every damping ratio."""
    slow, fast = (
        Protocol(timestep=0.01).measure(make_small(k, np.sqrt(k)), NAMES).values
        for k in (1.0, 4.0)
    )
    assert fast[0] / slow[0] == pytest.approx(2.0, rel=0.01)
    assert fast[1] == pytest.approx(slow[1], rel=0.01)


@pytest.mark.long
def test_an_overdamped_antenna_costs_a_number_and_says_so(targets):
    problem = make_problem(targets)
    measured = problem.measure(np.array([1.0, 30.0]))
    assert measured.overdamped and measured.values[0] == 0.0 and measured.values[1] > 1.0
    residuals = problem.compute_residuals(np.log([1.0, 30.0]))
    assert np.isfinite(residuals).all() and residuals[0] == 1.0
    assert search(problem, np.array([1.0, 10.0]), "nelder-mead").error < 1e-2


def test_a_simulation_that_fails_costs_a_large_number(targets, monkeypatch):
    problem = make_problem(targets)
    failed = [SimulationDivergedError("step", 1.0)]
    monkeypatch.setattr(
        Protocol, "measure_many", lambda self, antennas, names: failed * len(antennas)
    )
    assert problem.compute_residuals(np.zeros(2)).tolist() == [problem_module.FAILED] * 2
    assert problem.failures == 1


def test_bounds_that_exclude_the_start_are_refused(targets):
    with pytest.raises(InvalidInput, match="outside the bounds"):
        search(make_problem(targets), np.array([1e6, 1.0]))
    hinges = make_hinges("scale", make_small())
    with pytest.raises(InvalidInput, match="p1 starts at 1, outside its bounds 2 to 3"):
        type(hinges)(
            **{**vars(hinges), "low": np.array([2.0, 0.1]), "high": np.array([3.0, 10.0])}
        )
    with pytest.raises(InvalidInput, match="p2 starts at 1, outside its bounds 1 to 1"):
        type(hinges)(
            **{**vars(hinges), "low": np.array([0.1, 1.0]), "high": np.array([3.0, 1.0])}
        )


@pytest.mark.parametrize(
    "call",
    [lambda p: search(p, np.ones(2), "magic"), lambda p: make_hinges("cubic", make_small())],
)
def test_unknown_names_list_the_valid_ones(targets, call):
    with pytest.raises(InvalidInput, match="valid: "):
        call(make_problem(targets))


def test_families_are_the_profiles_that_they_name():
    n, small = np.arange(12), make_small()
    build = {
        name: make_hinges(name, small).build
        for name in ("exponential", "linear", "uniform", "scale", "tilt")
    }
    x = n / 12 - 0.5  # of the hinges, from the middle
    expected = {
        "exponential": ((3.0, 2.0, -0.1, -0.2), 3.0 * np.exp(-0.1 * n), 2.0 * np.exp(-0.2 * n)),
        "linear": ((3.0, 1.0, 2.0, 0.5), np.linspace(3.0, 1.0, 12), np.linspace(2.0, 0.5, 12)),
        "uniform": ((3.0, 2.0), np.full(12, 3.0), np.full(12, 2.0)),
        "scale": ((3.0, 2.0), 3.0 * small.stiffness, 2.0 * small.damping),
        "tilt": (
            (3.0, 2.0, 0.5, -1.0),
            3.0 * small.stiffness * np.exp(0.5 * x),
            2.0 * small.damping * np.exp(-x),
        ),
    }
    for name, (p, stiffness, damping) in expected.items():
        antenna = build[name](np.array(p))
        np.testing.assert_allclose(antenna.stiffness, stiffness)
        np.testing.assert_allclose(antenna.damping, damping)
        np.testing.assert_array_equal(antenna.segment_mass, small.segment_mass)


def test_residuals_jacobian_and_scores_are_those_written_out(targets):
    problem = make_problem(targets)
    x = np.log([1.1, 0.9])
    measured = Protocol(timestep=0.05).measure(make_small(1.1, 0.9), NAMES).values
    residual = 1 - measured / targets.values
    np.testing.assert_allclose(problem.compute_residuals(x), residual, rtol=1e-9)
    assert problem.compute_error(x) == pytest.approx(np.sqrt(np.sum(residual**2)))
    assert problem.evaluations == 2 and problem.best_error == pytest.approx(
        np.linalg.norm(residual)
    )
    _, distance, accuracy = problem.score(np.array([1.1, 0.9]))
    assert distance == pytest.approx(np.linalg.norm(residual))
    assert accuracy == pytest.approx(
        np.expm1(np.mean(np.abs(np.log(measured / targets.values))))
    )  # of two: the mean
    slopes = []
    for k in range(2):
        ends = [
            Protocol(timestep=0.05).measure(
                make_small(*np.exp(x + way * 0.02 * np.eye(2)[k])), NAMES
            )
            for way in (1, -1)
        ]
        slopes.append(-(ends[0].values - ends[1].values) / 0.04 / targets.values)
    np.testing.assert_allclose(
        problem.compute_jacobian(x, 0.02), np.transpose(slopes), rtol=1e-7
    )


def test_steps_of_a_jacobian_are_cut_at_the_bounds(targets):
    problem = make_problem(targets)
    problem.hinges = replace(problem.hinges, high=np.array([1.3, 10.0]))
    cut, free = (
        make.compute_jacobian(np.log(PLANTED), 0.02)
        for make in (problem, make_problem(targets))
    )
    np.testing.assert_allclose(cut, free, rtol=0.05)
    assert not np.array_equal(cut[:, 0], free[:, 0])


@pytest.mark.parametrize("low", [(0.0, 1.0), (1.0, 0.0), (1.0, -0.5)])
def test_what_is_searched_as_a_logarithm_has_a_least_value(low):
    hinges = make_hinges("scale", make_small())
    with pytest.raises(InvalidInput, match="must be > 0: it is searched as a logarithm"):
        type(hinges)(**{**vars(hinges), "low": np.array(low)})


@pytest.mark.parametrize("profile", ["exponential", "linear", "uniform"])
def test_stiffness_and_damping_are_searched_as_logarithms(profile):
    hinges = make_hinges(profile, cockroach())
    assert hinges.positive == tuple(unit != "1/joint" for unit in hinges.units)


@pytest.mark.parametrize(("profile", "hinges_meant"), [("linear", [0, -1]), ("uniform", [0])])
def test_controls_start_near_what_was_fitted_and_are_bound_by_whole_decades(
    profile, hinges_meant
):
    hinges, control, own = make_hinges(profile, cockroach()), cockroach(profile), cockroach()
    fitted = [*control.stiffness[hinges_meant], *control.damping[hinges_meant]]
    np.testing.assert_allclose(hinges.start, fitted, rtol=0.15)
    softest = np.isclose(hinges.low, own.stiffness[-1], rtol=0.01) | np.isclose(
        hinges.low, own.damping[-1], rtol=0.01
    )
    assert softest.sum() == 2 * (
        len(hinges_meant) - 1
    )  # tips are no softer than the cockroach's
    ends = np.log10([*hinges.high, *hinges.low[~softest]])
    np.testing.assert_allclose(ends, np.round(ends), atol=1e-12)


@pytest.mark.parametrize("factor", [1.0, 2.0])
def test_the_exponential_family_starts_at_the_antenna_and_is_bound_in_proportion_to_it(factor):
    antenna = cockroach().replace(
        stiffness=factor * cockroach().stiffness, damping=factor * cockroach().damping
    )
    hinges = make_hinges("exponential", antenna)
    np.testing.assert_allclose(
        hinges.build(hinges.start).stiffness, antenna.stiffness, rtol=1e-9
    )
    np.testing.assert_allclose(hinges.build(hinges.start).damping, antenna.damping, rtol=1e-9)
    np.testing.assert_allclose(hinges.low[:2], factor * np.array([0.4, 0.25]), rtol=1e-9)
    np.testing.assert_allclose(hinges.high[:2], factor * np.array([4000.0, 2500.0]), rtol=1e-9)
    one = make_hinges("exponential", make_small()).start
    np.testing.assert_allclose(one, [0.8, 1.2, -0.55, -0.45])


def test_a_tilted_profile_may_rise_or_fall_from_base_to_tip_by_e_to_the_eighth():
    hinges = make_hinges("tilt", make_small())
    np.testing.assert_array_equal(
        [hinges.low, hinges.high], [[1e-3, 1e-3, -8, -8], [1e3, 1e3, 8, 8]]
    )
    np.testing.assert_array_equal(
        hinges.scale, [1, 1, 2, 2]
    )  # a factor e, and an eighth of the range


@pytest.mark.parametrize("name", ["exponential", "linear", "uniform", "scale", "tilt"])
def test_families_turn_parameters_to_logarithms_and_back(name):
    hinges = make_hinges(name, make_small())
    np.testing.assert_allclose(hinges.to_p(hinges.to_x(hinges.start)), hinges.start, rtol=1e-14)
    antenna = hinges.build(hinges.start)
    assert antenna.name == name and antenna.n_segments == 12
    low, high = hinges.bounds
    starts = make_starts(hinges, 20, np.random.default_rng(1), spread=5.0)
    assert all(
        np.all(hinges.to_x(p) >= low - 1e-9) and np.all(hinges.to_x(p) <= high + 1e-9)
        for p in starts
    )


def test_starts_scatter_evenly_about_the_familys_own():
    hinges = make_hinges("scale", make_small())
    starts = np.log(np.array(make_starts(hinges, 2001, np.random.default_rng(1), spread=0.3)))
    np.testing.assert_array_equal(starts[0], 0.0)
    np.testing.assert_allclose(starts[1:].std(axis=0), 0.3, rtol=0.05)
    np.testing.assert_allclose(starts[1:].mean(axis=0), 0.0, atol=0.03)
    usual = np.log(np.array(make_starts(hinges, 2001, np.random.default_rng(1))))
    np.testing.assert_allclose(usual, starts * 0.7 / 0.3, atol=1e-9)


def test_two_targets_cannot_determine_four_numbers():
    """Frequency and damping alone leave two of the four exponential parameters free."""
    family = make_hinges("exponential", make_small())
    p = np.array([0.8, 1.2, -0.15, -0.1])
    values = Protocol().measure(family.build(p), NAMES).values
    goal = make_targets(frequency=values[0], damping_ratio=values[1])
    directions = analyse_directions(Problem(hinges=family, targets=goal), p)
    assert directions.sensitivity[:2].min() > 0.05
    np.testing.assert_array_equal(directions.sensitivity[2:], 0.0)
    np.testing.assert_allclose(
        directions.direction @ directions.direction.T, np.eye(4), atol=1e-12
    )
    assert "The targets determine" in directions.describe()


def test_the_loosest_direction_changes_the_error_least(targets):
    problem = make_problem(targets)
    directions = analyse_directions(problem, PLANTED)
    p, error = walk_sloppy_direction(problem, directions, np.array([-0.1, 0.0, 0.1]))
    np.testing.assert_allclose(p[1], PLANTED)
    assert error[1] < 1e-6
    np.testing.assert_allclose(error[[0, 2]], 0.1 * directions.sensitivity[-1], rtol=0.15)
    assert directions.sensitivity[0] > directions.sensitivity[-1]


def test_profiles_have_their_minimum_at_the_optimum(targets):
    problem = make_problem(targets)
    profiles = compute_profiles(problem, PLANTED, span=0.3, n_places=3, refits=4)
    assert profiles.error.shape == (2, 3)
    assert np.all(profiles.error[:, 1] < 1e-6) and np.all(profiles.error[:, [0, 2]] > 0.02)
    with pytest.raises(InvalidInput, match="odd"):
        compute_profiles(problem, PLANTED, n_places=4)


def test_bootstrap_spreads_as_the_targets_do(targets):
    """Two factors, two targets, each drawn with 5 % / √n. A mode's frequency goes with the root of
    stiffness, its damping ratio with damping over that root: a frequency f = f₀ √(1 − ζ²) then says
    ln p1 = 2 ln f + 2 ζ² / (1 − ζ²) ln ζ + …
    """
    draws = bootstrap(
        make_problem(targets), PLANTED, np.random.default_rng(5), n_draws=4000, n_animals=4
    )
    np.testing.assert_allclose(np.median(draws, axis=0), PLANTED, rtol=0.01)
    zeta = targets.values[1]
    expected = 2 * 0.05 / np.sqrt(4) * np.hypot(1.0, zeta**2 / (1 - zeta**2))
    assert np.log(draws[:, 0]).std() == pytest.approx(expected, rel=0.1)
    few = bootstrap(
        make_problem(targets), PLANTED, np.random.default_rng(5), n_draws=4000, n_animals=16
    )
    assert np.log(few).std(axis=0) == pytest.approx(np.log(draws).std(axis=0) / 2, rel=0.02)
    model = bootstrap(
        make_problem(targets),
        PLANTED,
        np.random.default_rng(5),
        n_draws=3,
        n_animals=4,
        refits=5,
    )
    np.testing.assert_allclose(model, draws[:3], rtol=0.02)


def test_bootstrap_needs_a_spread():
    with pytest.raises(InvalidInput, match="no spread"):
        bootstrap(make_problem(make_targets(frequency=0.02)), PLANTED, np.random.default_rng(0))
