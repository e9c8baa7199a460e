"""Pearson correlation of flattened tensors."""

from typing import Any

import numpy as np

from feeler.dispersion.index import BLOCK_SIZE, Block, Index, compare_pairs, name_trials
from feeler.errors import InvalidInput
from feeler.records.checked import checked


@checked
def compute_pearson(tensors: Any, *, block: int = BLOCK_SIZE) -> Any:
    """Pearson r between all pairs of tensors, over all sensors and samples.

    r_ab = Σ (a − ā)(b − b̄) / √(Σ (a − ā)² · Σ (b − b̄)²)

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time).
    block
        Tensors per side of a block; bounds memory.

    Returns
    -------
    Matrix (trial, trial) in [−1, 1], ones on the diagonal.

    Raises
    ------
    InvalidInput
        A constant tensor: its correlation is undefined.

    Notes
    -----
    Paper, "Dataset dispersion evaluation".
    """
    return compare_pairs(tensors, "pearson", _make_pearson, block)


def _make_pearson(array: np.ndarray) -> Block:
    """Pearson r of two slices of a set; checks once that it is defined for all of them."""
    spread = np.array([np.ptp(tensor) for tensor in array])
    if (constant := np.flatnonzero(spread == 0)).size:
        raise InvalidInput(
            f"trial(s) {name_trials(constant)} are constant (no contact, or all zero after"
            " rectifying), so their correlation is undefined. Leave them out, or use compute_mse"
            " or compute_nmi, which are defined for them."
        )

    def standardise(part: slice) -> np.ndarray:
        flat = array[part].reshape(part.stop - part.start, -1)
        # tiny angles squared must not underflow
        flat = flat / np.abs(flat).max(axis=1, keepdims=True)
        flat = flat - flat.mean(axis=1, keepdims=True)
        return flat / np.linalg.norm(flat, axis=1, keepdims=True)

    def compute(rows: slice, columns: slice) -> np.ndarray:
        a = standardise(rows)
        r = np.clip(a @ (a if rows == columns else standardise(columns)).T, -1.0, 1.0)
        if rows == columns:
            np.fill_diagonal(r, 1.0)
            r = (r + r.T) / 2
        return r

    return compute


PEARSON = Index(label="Pearson r", make=_make_pearson)
