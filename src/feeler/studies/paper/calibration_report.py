"""Numbers of the calibration: what the published constants give, what refits find, what is
determined.
"""

import csv
from collections.abc import Callable, Iterable
from dataclasses import asdict, dataclass, fields
from importlib.resources import files
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.antenna.cockroach import cockroach
from feeler.calibration import (
    Directions,
    Fit,
    Measured,
    Problem,
    Profiles,
    Protocol,
    analyse_directions,
    bootstrap,
    compute_profiles,
    fit,
    load_targets,
    make_hinges,
    make_starts,
    walk_loose,
)
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.studies.scale import Scale

PAPER_P = (37.78, 25.24, -0.0827, -0.0533)  # [P] p1…p4
PAPER_ERROR = 0.067  # [P]
LEVERS = (None, 20.0)  # mm; the impactor on a straight path, and on a lever
WALK = np.array(
    [-1.0, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 1.0]
)  # [C] typical changes along the loosest direction
FAMILIES = ("exponential", "linear", "constant")

COMPARED = ("powell", "nelder-mead", "least-squares")
KEPT = "optimisers.csv"


@dataclass(frozen=True, kw_only=True)
class Search:
    """One line of the comparison of optimisers."""

    method: str
    start: int
    """Number of the start, from 1."""
    evaluations: int
    """Antennas simulated."""
    seconds: float
    """Processor time of the simulations."""
    error: float
    accuracy: float
    """Median symmetric accuracy."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Calibration:
    """Everything the report shows."""

    published: tuple[Measured, float, float]
    """Quantities, error and symmetric accuracy of p1…p4."""
    presets: dict[str, tuple[Measured, float, float]]
    """The same of the shipped profiles."""
    refits: Fit | None
    """Least squares from the perturbed starts."""
    controls: dict[str, Fit]
    compared: tuple[Search, ...]
    """Every optimiser from every start; measured in this run, or ``kept`` from the benchmark."""
    kept: bool
    directions: Directions
    walked: tuple[np.ndarray, np.ndarray]
    """Parameters (step, parameter) and errors (step,) along the loosest direction from the
    published constants.
    """
    profiles: Profiles | None
    draws: np.ndarray
    """Bootstrapped parameters (draw, parameter)."""
    ratios: list[tuple[float, float | None, np.ndarray]]
    """Speed [mm/ms], lever [mm] and the published constants' deflection ratios there."""

    @property
    def widest_spread(self) -> float:
        """Largest factor by which one base parameter differs among fits at least as good as the
        paper's 0.067.
        """
        found = [PAPER_P, *self.walked[0][self.walked[1] <= PAPER_ERROR]]
        if self.refits is not None:
            found += [m.p for m in self.refits.minima if m.error <= PAPER_ERROR]
        if self.profiles is not None:
            good = self.profiles.error <= PAPER_ERROR
            found += list(self.profiles.others[good])
        base = np.abs(np.array(found))
        return float((base.max(axis=0) / base.min(axis=0)).max())

    def describe(self) -> str:
        """A plain sentence on what the targets determine."""
        p, error = self.walked
        good = np.vstack([PAPER_P, p[error <= PAPER_ERROR]])
        pairs = zip(self.directions.names, good.min(axis=0), good.max(axis=0), strict=True)
        ranges = ", ".join(f"{name} {low:.3g} to {high:.3g}" for name, low, high in pairs)
        return (
            f"{self.directions.describe()} Along that least determined line the model stays at or"
            f" below the paper's error of {PAPER_ERROR} over {ranges}."
        )

    def describe_bands(self) -> str:
        """Where along the antenna the animals' spread leaves stiffness and damping best known."""
        words = []
        for name, base, rate in (("stiffness", 0, 2), ("damping", 1, 3)):
            hinge, factor = find_best_known(self.draws[:, base], self.draws[:, rate])
            words.append(
                f"the {name} of hinge {hinge} (95 % of the draws within a factor of {factor:.2g})"
            )
        return (
            f"Between the animals, the targets fix {' and '.join(words)} best; away from there they"
            " fix less."
        )


def find_best_known(base: np.ndarray, rate: np.ndarray, n_hinges: int = 140) -> tuple[int, float]:
    """Hinge (from 1) at which profiles base · exp(rate (n − 1)) agree best, and the factor between
    their 95 % ends.
    """
    logs = np.log(base)[:, None] + rate[:, None] * np.arange(n_hinges)
    low, high = np.percentile(logs, [2.5, 97.5], axis=0)
    best = int(np.argmin(high - low))
    return best + 1, float(np.exp(high - low)[best])


def compute(
    effort: Scale, *, antenna: Antenna | None = None, seed: int = 0, engine: str = DEFAULT_ENGINE
) -> Calibration:
    """Score, refit and analyse with some ``effort``."""
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
    return Calibration(
        published=problem.score(PAPER_P),
        presets={name: _score_preset(name, make("scale")) for name in FAMILIES},
        refits=refits,
        controls=_fit_controls(make, effort.control_starts, rng),
        compared=list_searches(problem, fits) if fits else load_kept(),
        kept=not fits,
        directions=directions,
        walked=walk_loose(problem, directions, WALK),
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
    for name in ("linear", "constant"):
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
        for method in COMPARED
    }


def list_searches(problem: Problem, fits: dict[str, Fit]) -> tuple[Search, ...]:
    """One line per optimiser and start."""
    return tuple(
        Search(
            method=method,
            start=number,
            evaluations=minimum.evaluations,
            seconds=minimum.seconds,
            error=minimum.error,
            accuracy=problem.score(minimum.p)[2],
        )
        for method, found in fits.items()
        for number, minimum in enumerate(found.minima, 1)
    )


def write_searches(searches: Iterable[Search], path) -> None:
    """Keep a comparison as a table (``benchmarks/calibration.py`` writes the one that ships)."""
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Search)])
        writer.writeheader()
        writer.writerows(
            {k: f"{v:.4g}" if isinstance(v, float) else v for k, v in asdict(s).items()}
            for s in searches
        )


def load_kept() -> tuple[Search, ...]:
    """The comparison that the benchmark kept."""
    text = (files("feeler.calibration") / "data" / KEPT).read_text(encoding="utf-8")
    kinds: dict[str, Any] = {field.name: field.type for field in fields(Search)}
    return tuple(
        Search(**{name: kinds[name](cell) for name, cell in row.items()})
        for row in csv.DictReader(text.splitlines())
    )


def _sweep(make, effort: Scale) -> list[tuple[float, float | None, np.ndarray]]:
    rows = []
    for lever in LEVERS:
        for speed in effort.impact_speeds:
            problem = make("exponential")
            problem.protocol = Protocol(speed=speed, lever=lever, engine=problem.protocol.engine)
            problem.targets = problem.targets.only("ratio_71", "ratio_86")
            rows.append((speed, lever, problem.measure(PAPER_P).values))
    return rows
