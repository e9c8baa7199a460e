"""Mean squared error between tensors."""

from typing import Any

import numpy as np

from feeler.dispersion.index import BLOCK_SIZE, Block, Index, compare_pairs
from feeler.records.checked import checked

# below this share of the two tensors' energy, a² + b² − 2ab has lost digits: subtract directly
_CANCELLATION = 1e-4


@checked
def compute_mse(tensors: Any, *, block: int = BLOCK_SIZE) -> Any:
    """Mean squared error between all pairs of tensors: mean over sensors and samples of (a − b)².

    The only index of the four that grows with dispersion, and the only one with a unit: that of the
    input, squared. Compare sets only after scaling them by one common factor (``scale_common``).

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time).
    block
        Tensors per side of a block; bounds memory.

    Returns
    -------
    Matrix (trial, trial) ≥ 0, zeros on the diagonal.

    Notes
    -----
    Paper, "Dataset dispersion evaluation".
    """
    return compare_pairs(tensors, "mse", _make_mse, block)


def _make_mse(array: np.ndarray) -> Block:
    """Mean squared error of two slices of a set, by one matrix product.

    Pairs that are nearly identical are subtracted directly.
    """
    size = array[0].size

    def compute(rows: slice, columns: slice) -> np.ndarray:
        a = array[rows].reshape(-1, size)
        b = array[columns].reshape(-1, size)
        energy = (a**2).sum(axis=1)[:, None] + (b**2).sum(axis=1)[None, :]
        difference = energy - 2.0 * (a @ b.T)
        for i, j in np.argwhere(difference <= _CANCELLATION * energy):
            difference[i, j] = ((a[i] - b[j]) ** 2).sum()
        return difference / size

    return compute


MSE = Index(label="MSE", make=_make_mse, is_similarity=False)
