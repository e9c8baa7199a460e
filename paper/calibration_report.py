"""Numbers of the calibration: what the published constants give, what refits find, what is
determined.
"""

import csv
from collections.abc import Callable, Mapping
from importlib.resources import files
from types import SimpleNamespace
from typing import Any

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.calibration import (
    Fit,
    Measured,
    Problem,
    Protocol,
    analyse_directions,
    bootstrap,
    compute_profiles,
    fit,
    load_targets,
    make_hinges,
    make_starts,
    walk_sloppy_direction,
)
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.presets import cockroach
from paper.scale import Scale

PAPER_P = (37.78, 25.24, -0.0827, -0.0533)  # [P] p1…p4
PAPER_ERROR = 0.067  # [P]
_LEVERS = (None, 20.0)  # mm; the impactor on a straight path, and on a lever
_WALK = np.array([-1.0, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 1.0])
"""[C] Typical changes along the loosest direction."""
_FAMILIES = ("exponential", "linear", "uniform")

_COMPARED = ("powell", "nelder-mead", "least-squares")
KEPT_SEARCHES = "optimisers.csv"
SEARCH_COLUMNS: dict[str, Callable[[str], Any]] = {
    "method": str,
    "start": int,
    "evaluations": int,
    "seconds": float,
    "error": float,
    "accuracy": float,
}
"""What each search of the comparison of optimisers says: number of the start, from 1; antennas
simulated; processor time [s]; least error and its median symmetric accuracy."""


def calibrate(
    effort: Scale,
    *,
    antenna: Antenna | None = None,
    seed: int = 0,
    engine: str = DEFAULT_ENGINE,
) -> SimpleNamespace:
    """Score, refit and analyse with some ``effort``.

    Returns
    -------
    SimpleNamespace
        ``scores``: quantities, error and symmetric accuracy of the published constants, the shipped
        presets and every refit, by name. ``refits`` (:class:`~feeler.calibration.Fit` or None):
        least squares from the perturbed starts. ``compared``: a row (``SEARCH_COLUMNS``) per
        optimiser and start, ``kept`` from the benchmark or measured in this run. ``directions``
        (:class:`~feeler.calibration.EigenParameters`). ``walked``: parameters (step, parameter) and
        errors (step,) along the loosest direction from the published constants. ``profiles``
        (:class:`~feeler.calibration.Profiles` or None). ``draws``: bootstrapped parameters (draw,
        parameter). ``ratios``: speed [mm/ms], lever [mm] and the published constants' deflection
        ratios there.
    """
    rng = np.random.default_rng(seed)
    antenna = cockroach() if antenna is None else antenna
    targets, protocol = load_targets("cockroach"), Protocol(engine=engine)

    def make(name: str) -> Problem:
        return Problem(hinges=make_hinges(name, antenna), targets=targets, protocol=protocol)

    problem = make("exponential")
    fits = (
        run_methods(make, make_starts(problem.hinges, effort.fit_starts + 1, rng)[1:])
        if effort.fit_starts
        else {}
    )
    refits = fits.get("least-squares")
    best = np.array(PAPER_P) if refits is None else refits.p
    directions = analyse_directions(problem, np.array(PAPER_P))
    scores = {"published p1…p4": problem.score(PAPER_P)}
    scores |= {f"preset {name}": _score_preset(name, make("scale")) for name in _FAMILIES}
    controls = {"": refits} | _fit_controls(make, effort.control_starts, rng)
    scores |= {
        f"refitted {name}": (found.measured, found.error, found.symmetric_accuracy)
        for name, found in controls.items()
        if found is not None
    }
    return SimpleNamespace(
        scores=scores,
        refits=refits,
        compared=list_searches(problem, fits) if fits else _load_searches(),
        kept=not fits,
        directions=directions,
        walked=walk_sloppy_direction(problem, directions, _WALK),
        profiles=(
            compute_profiles(problem, best, n_places=effort.error_places, refits=6)
            if effort.error_places
            else None
        ),
        draws=bootstrap(
            problem,
            np.array(PAPER_P),
            rng,
            n_draws=effort.draws,
            refits=effort.refits,
            directions=directions,
        ),
        ratios=_sweep(make, effort),
    )


def _score_preset(name: str, problem: Problem) -> tuple[Measured, float, float]:
    same = Problem(
        hinges=make_hinges("scale", cockroach(name)),
        targets=problem.targets,
        protocol=problem.protocol,
    )
    return same.score((1.0, 1.0))


def _fit_controls(make, n_starts: int, rng: np.random.Generator) -> dict[str, Fit]:
    if not n_starts:
        return {}
    fits = {}
    for name in ("linear", "uniform"):
        problem = make(name)
        fits[name] = fit(
            problem, make_starts(problem.hinges, n_starts, rng, spread=0.5), max_evaluations=60
        )
    return fits


def run_methods(make: Callable[[str], Problem], starts: np.ndarray) -> dict[str, Fit]:
    """The exponential family fitted by every optimiser from the same starts, each to its own
    convergence.
    """
    return {
        method: fit(make("exponential"), starts, method=method, max_evaluations=3000)
        for method in _COMPARED
    }


def list_searches(problem: Problem, fits: Mapping[str, Fit]) -> list[dict[str, Any]]:
    """A row (``SEARCH_COLUMNS``) per optimiser and start."""
    return [
        {
            "method": method,
            "start": number,
            "evaluations": minimum.evaluations,
            "seconds": minimum.seconds,
            "error": minimum.error,
            "accuracy": problem.score(minimum.p)[2],
        }
        for method, found in fits.items()
        for number, minimum in enumerate(found.minima, 1)
    ]


def _load_searches() -> list[dict[str, Any]]:
    """The comparison that the benchmark kept."""
    text = (files("feeler.calibration") / "data" / KEPT_SEARCHES).read_text(encoding="utf-8")
    return [
        {name: kind(row[name]) for name, kind in SEARCH_COLUMNS.items()}
        for row in csv.DictReader(text.splitlines())
    ]


def _sweep(make, effort: Scale) -> list[tuple[float, float | None, np.ndarray]]:
    rows = []
    for lever in _LEVERS:
        for speed in effort.impact_speeds:
            problem = make("exponential")
            problem.protocol = Protocol(
                speed=speed, lever=lever, engine=problem.protocol.engine
            )
            problem.targets = problem.targets.only("ratio_71", "ratio_86")
            rows.append((speed, lever, problem.measure(PAPER_P).values))
    return rows
