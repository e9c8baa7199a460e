"""Costs: how far simulated quantities are from their targets."""

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput


@checked
def compute_residuals(simulated: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Relative deviations (target,) = (target − simulated) / target, of the paper's cost."""
    simulated, target = np.asarray(simulated, dtype=float), np.asarray(target, dtype=float)
    if simulated.shape != target.shape:
        raise InvalidInput(
            f"one simulated value per target is needed, got {simulated.shape} and {target.shape}."
        )
    if not (np.isfinite(simulated).all() and np.isfinite(target).all()):
        raise InvalidInput(
            f"a cost of missing numbers is no number: simulated {simulated}, targets {target}."
        )
    if np.any(target == 0):
        raise InvalidInput(
            "a target of 0 has no relative deviation; choose a quantity that is not 0."
        )
    return (target - simulated) / target


@checked
def compute_distance(simulated: np.ndarray, target: np.ndarray) -> float:
    """Normalised Euclidean distance ``√ Σ ((target − simulated) / target)²`` (Methods)."""
    return float(np.linalg.norm(compute_residuals(simulated, target)))


@checked
def compute_symmetric_accuracy(simulated: np.ndarray, target: np.ndarray) -> float:
    """Median symmetric accuracy ``exp(median |ln(simulated / target)|) − 1``, as a fraction.

    Morley et al. 2018, doi:10.1002/2017SW001669; infinite where half the simulated quantities or
    more have no logarithm.
    """
    compute_residuals(simulated, target)
    ratio = np.asarray(simulated, dtype=float) / np.asarray(target, dtype=float)
    size = np.where(ratio > 0, np.abs(np.log(np.where(ratio > 0, ratio, 1.0))), np.inf)
    return float(np.expm1(np.median(size)))
