"""A new optimiser and a new family of hinges from outside the package fit an antenna."""

import numpy as np
import pytest
from scipy.optimize import minimize

from feeler.calibration import (
    FAMILIES,
    METHODS,
    Hinges,
    Problem,
    Protocol,
    fit,
    make_hinges,
    make_starts,
    make_targets,
)
from feeler.errors import InvalidInput

from .small_antenna import make_small


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
