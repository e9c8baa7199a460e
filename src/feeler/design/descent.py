"""L-BFGS on the engine's own gradients: for spaces of many knots, where CMA-ES would need thousands
of antennas.
"""

from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from feeler.design.constraints import Constraints
from feeler.design.problem import DesignProblem
from feeler.design.slope import differentiate_score
from feeler.errors import SimulationDiverged

COST = 6  # simulated antennas that a score with its gradient counts as
WEIGHT = 20.0  # [C] bits for each squared logarithm of what a constraint misses
# [C] how much tighter the penalty's constraints are, so that its minimum keeps the true ones
MARGIN = 1.03
STEP = 1e-4  # of the constraints' forward differences


def descend(
    problem: DesignProblem, x: np.ndarray, evaluations: int, _rng: np.random.Generator
) -> None:
    """L-BFGS-B in the box ±1 (Byrd et al. 1995), constraints as a penalty; what ends outside goes
    back towards the start.
    """
    limits = tighten(problem.constraints)

    def cost(at: np.ndarray) -> tuple[float, np.ndarray]:
        design = problem.space.build(at)
        try:
            bits, _, slopes = differentiate_score(
                design.antenna, problem.at_speed(design), "optimiser", **problem.options
            )
        except SimulationDiverged:
            problem.counts["diverged"] += COST
            return 10 * problem.ceiling, np.zeros_like(at)
        problem.counts["simulated"] += COST - 1  # look counts one more
        problem.look(pull_inside(problem, x, at))
        penalty, push = penalise(problem, limits, at)
        return problem.ceiling - bits + penalty, push - problem.space.pull_back(at, slopes)

    left = (evaluations - problem.evaluations) // COST
    minimize(
        cost,
        x,
        jac=True,
        method="L-BFGS-B",
        bounds=[(-1, 1)] * len(x),
        options={"maxfun": max(left, 1), "maxiter": left},
    )


def tighten(limits: Constraints) -> Constraints:
    """The same constraints with a margin; the peak angle is no part of the penalty."""
    ratio, share, softest = (
        None if value is None else MARGIN * value
        for value in (limits.damping_ratio, limits.damping_share, limits.softest)
    )
    return replace(limits, damping_ratio=ratio, damping_share=share, softest=softest)


def penalise(
    problem: DesignProblem, limits: Constraints, x: np.ndarray
) -> tuple[float, np.ndarray]:
    """The penalty and its slope by forward differences: constraints need no simulation."""

    def measure(at: np.ndarray) -> float:
        broken = limits.check(problem.space.build(at).antenna, problem.space.reference).values()
        return WEIGHT * sum(one**2 for one in broken)

    here = measure(x)
    if not here:
        return 0.0, np.zeros_like(x)
    sign = np.where(x > 0, -STEP, STEP)  # stays in the box
    return here, np.array([(measure(x + one) - here) / one.sum() for one in np.diag(sign)])


def pull_inside(problem: DesignProblem, start: np.ndarray, x: np.ndarray) -> np.ndarray:
    """x, or the farthest point towards it from the start that keeps the constraints (by halves)."""
    if not problem.measure_violation(problem.space.build(x)):
        return x
    low, high = 0.0, 1.0
    for _ in range(8):
        middle = 0.5 * (low + high)
        kept = not problem.measure_violation(problem.space.build(start + middle * (x - start)))
        low, high = (middle, high) if kept else (low, middle)
    return start + low * (x - start)
