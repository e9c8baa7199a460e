"""Numbers of the calibration: what the published constants give, what refits find, what is
determined.
"""

from types import SimpleNamespace

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
_WALK = np.array([-1.0, -0.6, -0.4, -0.2, 0.2, 0.4, 0.6, 1.0])
"""[C] Typical changes along the loosest direction."""
_FAMILIES = ("exponential", "linear", "uniform")


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
        least squares from the perturbed starts. ``directions``
        (:class:`~feeler.calibration.EigenParameters`). ``walked``: parameters (step, parameter) and
        errors (step,) along the loosest direction from the published constants. ``profiles``
        (:class:`~feeler.calibration.Profiles` or None). ``draws``: bootstrapped parameters (draw,
        parameter).
    """
    rng = np.random.default_rng(seed)
    antenna = cockroach() if antenna is None else antenna
    targets, protocol = load_targets("cockroach"), Protocol(engine=engine)

    def make(name: str) -> Problem:
        return Problem(hinges=make_hinges(name, antenna), targets=targets, protocol=protocol)

    problem = make("exponential")
    refits = None
    if effort.fit_starts:
        starts = make_starts(problem.hinges, effort.fit_starts + 1, rng)[1:]
        refits = fit(make("exponential"), starts, method="least-squares", max_evaluations=3000)
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
