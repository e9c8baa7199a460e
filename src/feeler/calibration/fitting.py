"""Searches from several starts, and which combinations of parameters the targets determine."""

from collections.abc import Callable, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import xarray as xr
from scipy.optimize import least_squares, minimize

from feeler.calibration.hinges import Hinges
from feeler.calibration.problem import Measured, Problem
from feeler.errors import InvalidInput
from feeler.provenance import Journal
from feeler.records import Gt, Registry, Shown
from feeler.validation import Count, checked

# Optimisers: from one start to a local minimum of the error.

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


# ``optimise(problem, x, max_evaluations)`` searches from ``x`` in the problem's coordinates; the
# problem itself keeps the best point it was asked for.
_Optimiser = Callable[[Problem, np.ndarray, int], None]
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


# Fit: searches from several starts, with progress, and a checkpoint that makes them resumable.

_Progress = Callable[[int, int, Minimum, float], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit(Shown):
    """The best of several searches, and all of them.

    Attributes
    ----------
    p : np.ndarray
        Best parameters.
    error : float
        Normalised Euclidean distance.
    symmetric_accuracy : float
        Median symmetric accuracy (fraction).
    measured : Measured
        Quantities at the best parameters.
    minima : tuple[Minimum, ...]
        Where each search ended, in the order of the starts.
    """

    names: tuple[str, ...]
    p: np.ndarray
    error: float
    symmetric_accuracy: float
    measured: Measured
    minima: tuple[Minimum, ...]


@checked
def make_starts(
    hinges: Hinges,
    n_starts: Count,
    rng: np.random.Generator,
    *,
    spread: float = 0.7,
) -> np.ndarray:
    """Starts (start, parameter): the family's own first, then perturbed ones inside the bounds.

    ``spread`` is their sd in logs (a rate moves by a fiftieth of it); a large one makes random
    starts.
    """
    low, high = hinges.bounds
    own = hinges.to_x(hinges.start)
    others = own + spread * hinges.scale * rng.standard_normal((n_starts - 1, own.size))
    return np.array([hinges.to_p(x) for x in np.clip(np.vstack([own, others]), low, high)])


@checked
def fit(
    problem: Problem,
    starts: np.ndarray | None = None,
    *,
    method: str = "least-squares",
    max_evaluations: int = 1500,
    checkpoint: Path | None = None,
    progress: _Progress = lambda done, total, minimum, best: None,
) -> Fit:
    """Search from each start and keep the best.

    Parameters
    ----------
    starts
        Parameters (start, parameter); default: the family's own start alone.
    method
        ``least-squares`` (bounded, on residuals), ``powell`` (the paper's) or ``nelder-mead``.
    max_evaluations
        Antennas that one search may simulate.
    checkpoint
        File that takes every simulated antenna as soon as it is known. The same call on it goes on
        where it was stopped, by whatever, and ends with the same numbers; other starts and methods
        may share it.
    progress
        Called after each search with the number done, their total, the minimum found and the best
        error so far.
    """
    starts = np.atleast_2d(
        problem.hinges.start if starts is None else np.asarray(starts, float)
    )
    if not starts.size or starts.ndim != 2:
        raise InvalidInput(
            f"starts must be one or more (start, parameter), got an array of shape {starts.shape}."
        )
    minima: list[Minimum] = []
    with ExitStack() as stack:
        if checkpoint is not None:
            problem.journal = stack.enter_context(Journal(checkpoint, problem.describe()))
            stack.callback(setattr, problem, "journal", Journal())
        for start in starts:
            minima.append(search(problem, start, method, max_evaluations))
            progress(len(minima), len(starts), minima[-1], min(m.error for m in minima))
    best = min(minima, key=lambda minimum: minimum.error)
    measured, error, accuracy = problem.score(best.p)
    return Fit(
        names=problem.hinges.names,
        p=np.array(best.p),
        error=error,
        symmetric_accuracy=accuracy,
        measured=measured,
        minima=tuple(minima),
    )


# Identifiability: which combinations of parameters the targets determine, and how well.


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class EigenParameters:
    """Singular directions of the residuals at an optimum, stiffest first, in typical changes.

    Attributes
    ----------
    jacobian : np.ndarray
        (target, parameter), per typical change (a factor e, or 0.02 per joint for a rate).
    sensitivity : np.ndarray
        (direction,) change of the error per unit along the direction.
    direction : np.ndarray
        (direction, parameter), unit rows.
    """

    names: tuple[str, ...]
    p: np.ndarray
    jacobian: np.ndarray
    sensitivity: np.ndarray
    direction: np.ndarray

    @property
    def condition(self) -> float:
        """Strongest over weakest sensitivity."""
        return float(self.sensitivity[0] / max(self.sensitivity[-1], 1e-300))

    def describe(self, what: str = "targets") -> str:
        """A plain sentence for a report; ``what`` determines the parameters."""
        strong, weak = self.direction[0], self.direction[-1]
        return (
            f"The {what} determine the combination {_words(self.names, strong)} best and"
            f" {_words(self.names, weak)} least (per factor e, or 0.02 per joint): their effect on"
            f" the error differs {self.condition:.0f}-fold."
        )


def _words(names: tuple[str, ...], direction: np.ndarray) -> str:
    signed = direction * np.sign(direction[np.argmax(np.abs(direction))])
    kept = [k for k in np.argsort(-np.abs(signed)) if abs(signed[k]) > 0.2]
    if len(kept) == 1:
        return names[kept[0]]
    return " ".join(f"{signed[k]:+.2f} {names[k]}" for k in kept)


@checked
def analyse_directions(
    problem: Problem, p: np.ndarray, step: Annotated[float, Gt(0)] = 0.05
) -> EigenParameters:
    """Singular value decomposition of the residuals' Jacobian at ``p``."""
    jacobian = problem.compute_jacobian(problem.hinges.to_x(p), step) * problem.hinges.scale
    return decompose(problem.hinges.names, p, jacobian)


def decompose(names: tuple[str, ...], p: np.ndarray, jacobian: np.ndarray) -> EigenParameters:
    """Singular directions of a Jacobian (residual, parameter) in typical changes."""
    _, sensitivity, direction = np.linalg.svd(
        jacobian, full_matrices=jacobian.shape[0] <= jacobian.shape[1]
    )
    padded = np.zeros(len(direction))
    padded[: len(sensitivity)] = sensitivity
    return EigenParameters(
        names=names,
        p=np.asarray(p, float),
        jacobian=jacobian,
        sensitivity=padded,
        direction=direction,
    )


@checked
def walk_sloppy_direction(
    problem: Problem, directions: EigenParameters, steps: Annotated[np.ndarray, "step"]
) -> tuple[np.ndarray, np.ndarray]:
    """Parameters (step, parameter) and errors (step,) along the loosest direction.

    ``steps`` are typical changes (a factor e, or 0.02 per joint) away from where the directions
    were taken; points are cut at the bounds.
    """
    (low, high), scale = problem.hinges.bounds, problem.hinges.scale
    way = directions.direction[-1] * scale
    xs = np.clip(
        problem.hinges.to_x(directions.p) + np.asarray(steps)[:, None] * way, low, high
    )
    return problem.hinges.to_p(xs), np.linalg.norm(problem.compute_many(xs), axis=1)


@checked
def compute_profiles(
    problem: Problem, p: np.ndarray, *, span: float = 1.0, n_places: int = 5, refits: int = 4
) -> xr.Dataset:
    """Profile of the error: one parameter held at a value, the others refitted, ``span`` typical
    changes to either side of ``p``.

    The middle place holds ``p``'s own value; going outwards each refit starts from its neighbour's
    result. ``refits`` bounds its trust-region steps.

    Returns
    -------
    xarray.Dataset
        Held values ``value`` (parameter, place), the ``error`` of the best fit with that value held
        (parameter, place), and ``others``, all parameters of those fits (parameter, place, of).
    """
    if n_places < 3 or n_places % 2 == 0:
        raise InvalidInput(
            "n_places must be odd and ≥ 3 (the optimum and as many on either side), got"
            f" {n_places}."
        )
    best, n = problem.hinges.to_x(p), len(p)
    offsets = np.linspace(-span, span, n_places)
    xs, errors = np.empty((n, n_places, n)), np.empty((n, n_places))
    for k in range(n):
        middle = _refit(problem, best, k, refits)  # the least error there, too, if p is not it
        for side in (range(n_places // 2, n_places), range(n_places // 2, -1, -1)):
            x = middle.copy()
            for place in side:
                x[k] = best[k] + offsets[place] * problem.hinges.scale[k]
                x = _refit(problem, x, k, refits) if place != n_places // 2 else x
                xs[k, place], errors[k, place] = x, problem.compute_error(x)
    parameters = problem.hinges.to_p(xs)
    value = np.stack([parameters[k, :, k] for k in range(n)])
    return xr.Dataset(
        {
            "value": (("parameter", "place"), value),
            "error": (("parameter", "place"), errors),
            "others": (("parameter", "place", "of"), parameters),
        },
        {"parameter": list(problem.hinges.names)},
    )


def _refit(problem: Problem, x: np.ndarray, held: int, refits: int) -> np.ndarray:
    """Least squares over all searched numbers but one."""
    low, high = problem.hinges.bounds
    free = np.arange(x.size) != held
    if not free.any():
        return x

    def fill(part: np.ndarray) -> np.ndarray:
        whole = x.copy()
        whole[free] = part
        return whole

    start = np.clip(x[free], low[free], high[free])
    result = least_squares(
        lambda part: problem.compute_residuals(fill(part)),
        start,
        jac=lambda part: problem.compute_jacobian(fill(part), 0.03)[:, free],
        bounds=(low[free], high[free]),
        x_scale=problem.hinges.scale[free],
        max_nfev=refits,
    )
    return fill(result.x)


@checked
def bootstrap(
    problem: Problem,
    p: np.ndarray,
    rng: np.random.Generator,
    *,
    n_draws: int = 200,
    n_animals: int = 5,
    refits: int = 0,
    directions: EigenParameters | None = None,
) -> np.ndarray:
    """Parameters (draw, parameter) refitted to targets drawn from the animals' spread (parametric).

    Each draw's targets are means of ``n_animals`` normal values with the targets' spread. With
    ``refits=0`` a refit is one Gauss–Newton step from ``p`` with the Jacobian there, cut at the
    bounds: fast, and along loose directions only an indication, because the model is not linear
    that far; directions a thousand times looser than the stiffest are not moved at all. More refits
    run the model. ``directions`` taken at ``p`` save its Jacobian.
    """
    if np.all(problem.targets.spreads == 0):
        raise InvalidInput(
            "the targets carry no spread between animals: there is nothing to draw from. Give"
            " spreads."
        )
    x, (low, high), scale = problem.hinges.to_x(p), problem.hinges.bounds, problem.hinges.scale
    values, spreads = problem.targets.values, problem.targets.spreads / np.sqrt(n_animals)
    jacobian = (
        problem.compute_jacobian(x, 0.05) * scale if directions is None else directions.jacobian
    )
    gain = np.linalg.pinv(jacobian, rcond=1e-3)
    drawn = values + spreads * rng.standard_normal((n_draws, values.size))
    steps = ((drawn - values) / values) @ -gain.T
    xs = np.clip(x + steps * scale, low, high)
    if refits:
        xs = np.array([_refit_all(problem, drawn[k], xs[k], refits) for k in range(n_draws)])
    return problem.hinges.to_p(xs)


def _refit_all(problem: Problem, values: np.ndarray, x: np.ndarray, refits: int) -> np.ndarray:
    low, high = problem.hinges.bounds
    again = Problem(
        hinges=problem.hinges,
        targets=problem.targets.with_values(np.maximum(values, 1e-6)),
        protocol=problem.protocol,
    )
    least_squares(
        again.compute_residuals,
        np.clip(x, low, high),
        jac=again.compute_jacobian,
        bounds=(low, high),
        x_scale=problem.hinges.scale,
        max_nfev=refits,
    )
    return again.best_x
