"""Fronts: designs of which none is better than another in everything, and how fast an antenna comes
to rest.
"""

from typing import Annotated

import numpy as np

from feeler.antenna.modes import compute_mass_matrix
from feeler.antenna.segments import Antenna

REST = 0.05  # of the deflection, at which an antenna is said to be at rest


def find_front(costs: Annotated[np.ndarray, "design cost"]) -> np.ndarray:
    """Numbers (…,) of the designs that no other beats in one cost without being worse in another,
    by rising first cost.
    """
    costs = np.asarray(costs, dtype=float)
    worse = np.all(costs[:, None] >= costs, axis=2) & np.any(costs[:, None] > costs, axis=2)
    front = np.flatnonzero(~np.any(worse, axis=1))
    return front[np.lexsort(costs[front].T[::-1])]


def compute_settling(antenna: Antenna) -> float:
    """Time [ms] in which the slowest motion of the straight antenna falls to 5 %: ln(1 / 0.05) /
    min |Re λ|.

    λ are the eigenvalues of M q̈ + C q̇ + K q = 0, damping as it is (no mode taken by itself).
    """
    n = antenna.n_segments
    inverse = np.linalg.inv(compute_mass_matrix(antenna))
    matrix = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-inverse * antenna.stiffness, -inverse * antenna.damping],
        ]
    )
    return float(np.log(1 / REST) / np.abs(np.linalg.eigvals(matrix).real).min())
