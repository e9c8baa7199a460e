"""Fits on a small antenna: what is planted comes back, and a fit is resumable and never silently
wrong.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from feeler.calibration import (
    FAMILIES,
    METHODS,
    Hinges,
    Problem,
    Protocol,
    analyse_directions,
    bootstrap,
    fit,
    make_hinges,
    make_starts,
    make_targets,
    search,
)
from feeler.calibration import problem as protocol_module
from feeler.errors import InvalidInput

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


def test_a_cylinder_that_still_pushes_at_the_end_is_run_for_longer(monkeypatch):
    names, found = ("ratio_71", "ratio_86"), []
    for first in (0.02, 0.6):
        monkeypatch.setattr(protocol_module, "_IMPULSE_TRAVEL", (first, 0.6))
        found.append(Protocol().measure(make_small(), names).values)
    np.testing.assert_allclose(found[0], found[1], rtol=1e-9)


@pytest.mark.long
def test_an_overdamped_antenna_costs_a_number_and_says_so(targets):
    problem = make_problem(targets)
    measured = problem.measure(np.array([1.0, 30.0]))
    assert measured.overdamped and measured.values[0] == 0.0 and measured.values[1] > 1.0
    residuals = problem.compute_residuals(np.log([1.0, 30.0]))
    assert np.isfinite(residuals).all() and residuals[0] == 1.0
    assert search(problem, np.array([1.0, 10.0]), "nelder-mead").error < 1e-2


def test_bounds_that_exclude_the_start_are_refused(targets):
    with pytest.raises(InvalidInput, match="outside the bounds"):
        search(make_problem(targets), np.array([1e6, 1.0]))


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


def test_steps_of_a_jacobian_are_cut_at_the_bounds(targets):
    problem = make_problem(targets)
    problem.hinges = replace(problem.hinges, high=np.array([1.3, 10.0]))
    cut, free = (
        make.compute_jacobian(np.log(PLANTED), 0.02)
        for make in (problem, make_problem(targets))
    )
    np.testing.assert_allclose(cut, free, rtol=0.05)
    assert not np.array_equal(cut[:, 0], free[:, 0])


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


def test_bootstrap_needs_a_spread():
    with pytest.raises(InvalidInput, match="no spread"):
        bootstrap(make_problem(make_targets(frequency=0.02)), PLANTED, np.random.default_rng(0))


def test_an_optimiser_fits_an_antenna():
    def search_coordinates(problem, x, max_evaluations):
        minimize(
            problem.compute_error, x, method="COBYLA", options={"maxiter": max_evaluations}
        )

    METHODS.register("cobyla", search_coordinates)
    try:
        names = ("frequency", "damping_ratio")
        measured = Protocol(timestep=0.05).measure(make_small(1.2, 0.9), names)
        problem = Problem(
            hinges=make_hinges("scale", make_small()),
            targets=make_targets(
                **{name: (v, 0.05 * v) for name, v in zip(names, measured.values, strict=True)}
            ),
            protocol=Protocol(timestep=0.05),
        )
        found = fit(
            problem,
            make_starts(problem.hinges, 1, np.random.default_rng(0)),
            method="cobyla",
            max_evaluations=60,
        )
    finally:
        METHODS.unregister("cobyla")
    assert found.minima[0].method == "cobyla"
    np.testing.assert_allclose(found.p, (1.2, 0.9), rtol=0.02)
    with pytest.raises(
        InvalidInput,
        match=r"unknown method 'cobyla'; valid: least-squares, powell, nelder-mead",
    ):
        fit(problem, np.ones((1, 2)), method="cobyla")


@pytest.mark.long
def test_a_family_of_hinges_fits_an_antenna():
    """One factor for all hinges but the first, which stays: 1.3 is planted."""

    def make(antenna):
        share = np.array([0.0, *np.ones(antenna.n_segments - 1)])
        return Hinges(
            name="beyond the base",
            names=("factor",),
            units=("1",),
            positive=(True,),
            start=np.array([0.9]),
            low=np.array([0.3]),
            high=np.array([3.0]),
            build=lambda p: antenna.replace(stiffness=antenna.stiffness * p[0] ** share),
        )

    FAMILIES.register("beyond the base", make)
    try:
        hinges, protocol = make_hinges("beyond the base", make_small()), Protocol(timestep=0.05)
        measured = protocol.measure(hinges.build(np.array([1.3])), ("frequency",))
        targets = make_targets(frequency=float(measured.values[0]))
        problem = Problem(hinges=hinges, targets=targets, protocol=protocol)
        found = fit(problem, np.array([[0.9]]), max_evaluations=40)
    finally:
        FAMILIES.unregister("beyond the base")
    np.testing.assert_allclose(found.p, [1.3], rtol=1e-3)
    with pytest.raises(InvalidInput, match="unknown family of hinges 'beyond the base'; valid"):
        make_hinges("beyond the base", make_small())


def test_frequency_scales_as_the_square_root_of_stiffness_over_mass():
    """Stiffness ×4 and damping ×2 double every rate and keep every damping ratio."""
    slow, fast = (
        Protocol(timestep=0.01).measure(make_small(k, np.sqrt(k)), NAMES).values
        for k in (1.0, 4.0)
    )
    assert fast[0] / slow[0] == pytest.approx(2.0, rel=0.01)
    assert fast[1] == pytest.approx(slow[1], rel=0.01)
