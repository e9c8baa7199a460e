"""Separation: how far each tensor lies from the one that is most like it, in units of the noise."""

from typing import Annotated

import numpy as np

from feeler.checked import checked
from feeler.information.energy import compute_energy


@checked
def compute_separation(
    tensors: Annotated[np.ndarray, "trial ..."], sd: Annotated[float, "> 0"]
) -> np.ndarray:
    """d′ = ‖x_j − x_k‖ / σ of each tensor (trial,) to its nearest neighbour.

    Between two equally likely tensors alone, an ideal observer is right with probability Φ(d′/2).
    """
    energy = compute_energy(tensors)
    square = np.diag(energy)
    distance = np.maximum(square[:, None] + square - 2 * energy, 0.0)
    np.fill_diagonal(distance, np.inf)
    return np.sqrt(distance.min(axis=1)) / sd
