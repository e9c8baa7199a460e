"""The closest match of every tensor, with or without ever holding the full matrix."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from feeler.dispersion.index import BLOCK_SIZE, INDICES, check_tensors, iterate_blocks
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.scaling import label_like


@dataclass(frozen=True, kw_only=True, eq=False)
class Closest:
    """Each tensor's closest match among the others; labelled where the tensors were.

    Attributes
    ----------
    trial : Any
        Position of the match (trial,).
    value : Any
        Index between the tensor and its match (trial,).
    """

    trial: Any
    value: Any


@checked
def find_closest(matrix: np.ndarray, *, greatest: bool = True) -> Closest:
    """Each tensor's closest match in a full matrix of pairs, itself left out; the first of equals.

    Parameters
    ----------
    matrix
        (trial, trial), from one of the ``compute_`` functions.
    greatest
        True for similarities (Pearson, SSIM, NMI), False for distances (MSE).
    """
    matrix = np.asarray(matrix, dtype=float)
    if matrix.ndim != 2 or matrix.shape[0] != matrix.shape[1] or len(matrix) < 2:
        raise InvalidInput(
            f"expected a square matrix of at least 2 tensors, got shape {matrix.shape}."
        )
    score = matrix.copy() if greatest else -matrix
    np.fill_diagonal(score, -np.inf)
    match = score.argmax(axis=1)
    return Closest(trial=match, value=matrix[np.arange(len(matrix)), match])


@checked
def search_closest(
    tensors: Any, index: str = "pearson", *, block: int = BLOCK_SIZE, **options: Any
) -> Closest:
    """Each tensor's closest match by one index, in memory that does not grow with the pairs.

    For sets whose full matrix would not fit: 10,000 tensors have 50 million pairs, but only 10,000
    matches.

    Parameters
    ----------
    tensors
        (trial, sensor, time).
    index
        The name of a registered ``Index``: ``pearson``, ``ssim``, ``mse``, ``nmi`` …
    block
        Tensors per side of a block.
    **options
        Those of the index: ``border``, ``data_range``, ``n_bins``, ``common_zeros``.
    """
    array = check_tensors(tensors)
    sign, compute = INDICES[index].sign, INDICES[index].make(array, **options)
    best = np.full(len(array), -np.inf)
    match = np.full(len(array), -1)
    for rows, columns in iterate_blocks(len(array), block):
        score = sign * compute(rows, columns)
        if rows == columns:
            np.fill_diagonal(score, -np.inf)
        else:
            _improve(best[columns], match[columns], score.T, rows.start)
        _improve(best[rows], match[rows], score, columns.start)
    trial, value = (
        label_like(values, tensors, ("trial",), index) for values in (match, sign * best)
    )
    return Closest(trial=trial, value=value)


def _improve(best: np.ndarray, match: np.ndarray, score: np.ndarray, start: int) -> None:
    """Take over the better matches of a block, in place; of equals the earlier stays."""
    candidate = score.argmax(axis=1)
    value = score[np.arange(len(score)), candidate]
    better = value > best
    best[better], match[better] = value[better], candidate[better] + start
