"""Fit: searches from several starts, with progress, and a checkpoint that makes them resumable."""

import hashlib
import json
import os
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from feeler.calibration.hinges import Hinges
from feeler.calibration.optimise import Minimum, search
from feeler.calibration.problem import Problem
from feeler.calibration.protocol import Measured
from feeler.errors import InvalidInput

Progress = Callable[[int, int, Minimum, float], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class Fit:
    """The best of several searches, and all of them."""

    names: tuple[str, ...]
    p: np.ndarray
    """Best parameters."""
    error: float
    """Normalised Euclidean distance."""
    symmetric_accuracy: float
    """Median symmetric accuracy (fraction)."""
    measured: Measured
    """Quantities at the best parameters."""
    minima: tuple[Minimum, ...]
    """Where each search ended, in the order of the starts."""


def make_starts(hinges: Hinges, n_starts: int, rng: np.random.Generator, *, spread: float = 0.7) -> np.ndarray:
    """Starts (start, parameter): the family's own first, then ones perturbed by ``spread`` (sd, in logs; a rate by a
    fiftieth of it), kept inside the bounds. A large ``spread`` makes them random starts."""
    if n_starts < 1:
        raise InvalidInput(f"n_starts must be ≥ 1, got {n_starts}.")
    low, high = hinges.bounds
    own = hinges.to_x(hinges.start)
    others = own + spread * hinges.scale * rng.standard_normal((n_starts - 1, own.size))
    return np.array([hinges.to_p(x) for x in np.clip(np.vstack([own, others]), low, high)])


def fit(
    problem: Problem,
    starts: np.ndarray | None = None,
    *,
    method: str = "least-squares",
    max_evaluations: int = 400,
    checkpoint: Path | None = None,
    progress: Progress = lambda done, total, minimum, best: None,
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
        File that takes each finished search; with the same problem, starts and method the fit goes on from it.
    progress
        Called after each search with the number done, their total, the minimum found and the best error so far.
    """
    starts = problem.hinges.start[None] if starts is None else np.atleast_2d(np.asarray(starts, dtype=float))
    key = _describe(problem, starts, method, max_evaluations)
    minima = _load(checkpoint, key)
    for k in range(len(minima), len(starts)):
        minima.append(search(problem, starts[k], method, max_evaluations))
        _save(checkpoint, key, minima)
        progress(k + 1, len(starts), minima[-1], min(m.error for m in minima))
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


def _describe(problem: Problem, starts: np.ndarray, method: str, max_evaluations: int) -> str:
    """A short text that changes with anything that changes the result."""
    antenna = problem.hinges.build(problem.hinges.start)
    arrays = (antenna.segment_length, antenna.segment_mass, antenna.radius, antenna.stiffness, antenna.damping, starts)
    parts = [np.ascontiguousarray(a, dtype=float).tobytes() for a in (*arrays, *problem.hinges.bounds)]
    words = json.dumps(
        [problem.hinges.name, asdict(problem.protocol), asdict(problem.targets), method, max_evaluations]
    )
    return hashlib.sha256(b"".join([*parts, words.encode()])).hexdigest()[:16]


def _load(checkpoint: Path | None, key: str) -> list[Minimum]:
    if checkpoint is None or not Path(checkpoint).is_file():
        return []
    try:
        table = json.loads(Path(checkpoint).read_text(encoding="utf-8"))
        minima = [Minimum(**{**m, "start": tuple(m["start"]), "p": tuple(m["p"])}) for m in table["minima"]]
    except (json.JSONDecodeError, KeyError, TypeError) as error:
        raise InvalidInput(f"{checkpoint} is no checkpoint of a fit ({error}). Remove it or name another.") from error
    if table["key"] != key:
        raise InvalidInput(
            f"{checkpoint} belongs to another fit (antenna, targets, starts or method). Remove it, or name another."
        )
    return minima


def _save(checkpoint: Path | None, key: str, minima: list[Minimum]) -> None:
    if checkpoint is None:
        return
    path = Path(checkpoint)
    part = path.with_name(path.name + ".part")
    part.write_text(json.dumps({"key": key, "minima": [asdict(m) for m in minima]}, indent=1), encoding="utf-8")
    os.replace(part, path)
