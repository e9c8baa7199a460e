"""A new optimiser from outside the package fits an antenna."""

import numpy as np
import pytest
from scipy.optimize import minimize

from feeler.calibration import (
    METHODS,
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
        minimize(problem.compute_error, x, method="COBYLA", options={"maxiter": max_evaluations})

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
        InvalidInput, match=r"unknown method 'cobyla'; valid: least-squares, powell, nelder-mead"
    ):
        fit(problem, np.ones((1, 2)), method="cobyla")
