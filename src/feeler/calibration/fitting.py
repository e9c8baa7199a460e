"""Fit: searches from several starts, with progress, and a checkpoint that makes them resumable."""

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np

from feeler.calibration.hinges import Hinges
from feeler.calibration.optimise import Minimum, search
from feeler.calibration.problem import Problem
from feeler.calibration.protocol import Measured
from feeler.disk.journal import Journal
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.shown import Shown

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
    n_starts: Annotated[int, "> 0"],
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
