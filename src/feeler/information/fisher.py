"""Fisher information about properties of a touch, and the least error it leaves."""

from typing import Annotated

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.scaling import check_squares, find_scale


@checked
def compute_fisher(
    derivatives: Annotated[np.ndarray, "parameter ..."], sd: Annotated[float, "> 0"]
) -> np.ndarray:
    """Fisher information (parameter, parameter) of a tensor x(θ) in white Gaussian noise.

    ∂x/∂θ_a · ∂x/∂θ_b / σ².

    Parameters
    ----------
    derivatives
        ∂x/∂θ (parameter, …) [unit of the tensor per unit of the parameter].
    sd
        Standard deviation of each entry's noise, in the unit of the tensor.
    """
    if np.size(derivatives) == 0:
        raise InvalidInput("derivatives must be of one parameter or more, and of some entries.")
    if not 1e-150 < sd < 1e150:
        raise InvalidInput(
            f"sd must be above 1e-150 and below 1e150, whose squares are numbers, got {sd:g}."
        )
    flat = np.asarray(derivatives, dtype=float).reshape(len(derivatives), -1)
    if not np.isfinite(flat).all():
        raise InvalidInput(
            "derivatives must be finite; a touch without contact has no information to give."
        )
    unit = find_scale(np.asarray(sd))  # exact: squares of very small numbers would underflow
    flat = flat / unit
    check_squares(flat, "derivatives over sd")
    return flat @ flat.T / (sd / unit) ** 2


@checked
def compute_bounds(
    fisher: Annotated[np.ndarray, "parameter parameter"], joint: bool = True
) -> np.ndarray:
    """Cramér–Rao bounds (parameter,): the least sd of an unbiased estimate.

    In the units of the parameters.

    ``joint``: the other parameters are unknown too, √(F⁻¹)_aa; otherwise they are known, 1/√F_aa,
    which is never greater. A parameter that the tensor does not tell, or not apart from the others,
    has the bound ∞.
    """
    fisher = np.asarray(fisher, dtype=float)
    diagonal = np.diag(fisher)
    with np.errstate(divide="ignore"):
        alone = 1 / np.sqrt(diagonal)
    if not joint or not np.all(diagonal > 0):
        return alone
    scaled = fisher * alone[:, None] * alone
    if np.linalg.matrix_rank(scaled, hermitian=True) < len(scaled):
        return np.full(len(scaled), np.inf)
    return alone * np.sqrt(np.diag(np.linalg.inv(scaled)))
