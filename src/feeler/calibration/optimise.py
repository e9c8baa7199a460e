"""Optimisers: from one start to a local minimum of the error."""

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import least_squares, minimize

from feeler.calibration.problem import Problem
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.registry import Registry

# [C] 0.1 % of a base parameter, 0.1 % of the error; the targets determine neither so well
_POWELL_TOLERANCE = 1e-3


@dataclass(frozen=True, kw_only=True)
class Minimum:
    """Where one search ended.

    Attributes
    ----------
    start : tuple[float, ...]
        Parameters it started from.
    p : tuple[float, ...]
        Parameters it found.
    error : float
        Normalised Euclidean distance there.
    evaluations : int
        Antennas simulated.
    seconds : float
        Processor time of its simulations.
    """

    method: str
    start: tuple[float, ...]
    p: tuple[float, ...]
    error: float
    evaluations: int
    seconds: float


@checked
def search(
    problem: Problem,
    start: Sequence[float] | np.ndarray,
    method: str = "least-squares",
    max_evaluations: int = 1500,
) -> Minimum:
    """Search from parameters ``start`` with one method and give the best point it saw."""
    optimise = METHODS[method]
    low, high = problem.hinges.bounds
    x = problem.hinges.to_x(start)
    if np.any((x < low - 1e-9) | (x > high + 1e-9)):
        raise InvalidInput(
            f"the start {np.round(start, 6).tolist()} lies outside the bounds"
            f" {problem.hinges.low.tolist()} to {problem.hinges.high.tolist()}. Move the start or"
            " widen the bounds."
        )
    before, spent = problem.evaluations, problem.seconds
    problem.best_x, problem.best_error = x, np.inf
    optimise(problem, np.clip(x, low, high), max_evaluations)
    return Minimum(
        method=method,
        start=tuple(map(float, start)),
        p=tuple(map(float, problem.hinges.to_p(problem.best_x))),
        error=problem.best_error,
        evaluations=problem.evaluations - before,
        seconds=problem.seconds - spent,
    )


_Optimiser = Callable[[Problem, np.ndarray, int], None]
"""``optimise(problem, x, max_evaluations)`` searches from ``x`` in the problem's coordinates; the
problem itself keeps the best point it was asked for."""
METHODS: Registry[_Optimiser] = Registry("method")
"""Every known optimiser by its name; ``METHODS.register(name, optimiser)`` adds one."""


class _Spent(Exception):
    """The evaluations are used up; the best point is in the problem."""


@METHODS.register("least-squares")
def _least_squares(problem: Problem, x: np.ndarray, max_evaluations: int) -> None:
    """Bounded trust region on the residuals (Branch, Coleman & Li 1999), Jacobians in lanes."""
    least_squares(
        problem.compute_residuals,
        x,
        jac=problem.compute_jacobian,
        bounds=problem.hinges.bounds,
        x_scale=problem.hinges.scale,
        xtol=1e-5,
        ftol=1e-6,
        gtol=1e-8,
        max_nfev=max(2, max_evaluations // (1 + 2 * len(x))),
    )


def _minimise(
    method: str,
    options: dict[str, object],
    problem: Problem,
    x: np.ndarray,
    max_evaluations: int,
) -> None:
    """One of SciPy's searches that ask for errors alone, on scaled parameters."""
    scale, (low, high) = problem.hinges.scale, problem.hinges.bounds
    stop = problem.evaluations + max_evaluations

    def error(scaled: np.ndarray) -> float:
        if problem.evaluations >= stop:
            raise _Spent
        return problem.compute_error(scaled * scale)

    bounds = list(zip(low / scale, high / scale, strict=True))
    with suppress(_Spent):
        minimize(error, x / scale, method=method, bounds=bounds, options=options)


METHODS.register(  # the paper's: line searches along conjugate directions (Powell 1964)
    "powell",
    partial(_minimise, "Powell", {"xtol": _POWELL_TOLERANCE, "ftol": _POWELL_TOLERANCE}),
)
METHODS.register(  # the simplex (Nelder & Mead 1965)
    "nelder-mead",
    partial(_minimise, "Nelder-Mead", {"xatol": 1e-4, "fatol": 1e-6, "adaptive": True}),
)
