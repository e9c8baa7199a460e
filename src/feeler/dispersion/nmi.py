"""Normalised mutual information (NMI) of binned tensors, for all pairs at once."""

from typing import Any

import numba as nb
import numpy as np

from feeler.compiled import compiled
from feeler.dispersion.index import (
    BLOCK_SIZE,
    Block,
    Index,
    compare_pairs,
    fold_pairs,
    list_pairs,
)
from feeler.errors import InvalidInput
from feeler.records.checked import checked

_N_BINS = 256  # [C] the paper does not define its NMI; 32, 64 and 100 are its sensitivity
_ZEROS = ("keep", "drop")
_CHUNKS = 64  # pieces of the pair list that threads take


@checked
def compute_nmi(
    tensors: Any,
    *,
    n_bins: int = _N_BINS,
    data_range: tuple[float, float] | None = None,
    common_zeros: str = "keep",
    block: int = BLOCK_SIZE,
) -> Any:
    """Normalised mutual information between all pairs of tensors, entry against entry.

    NMI = 2 I(A; B) / (H(A) + H(B)), from the joint histogram over all sensors and samples, bins
    common to the set.

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time).
    n_bins
        Equal bins over ``data_range``, 2–256.
    data_range
        Lowest and highest bin edge; default: the set's own least and greatest entry. Entries
        outside go to the end bins. Give one range when sets are to be compared.
    common_zeros
        ``keep``; or ``drop`` the entries where both tensors lie in the bin of zero: the common
        background, which otherwise dominates the index.
    block
        Tensors per side of a block; bounds memory.

    Returns
    -------
    Matrix (trial, trial) in [0, 1]. As in scikit-learn, two tensors that fill one bin each have NMI
    1, and one such tensor against a varied one 0.

    Raises
    ------
    InvalidInput
        ``n_bins`` outside 2–256, an empty range, or an unknown ``common_zeros``.

    Notes
    -----
    The paper names NMI without defining it; this definition is a choice [C].
    """
    options = {"n_bins": n_bins, "data_range": data_range, "common_zeros": common_zeros}
    return compare_pairs(tensors, "nmi", _make_nmi, block, **options)


def _make_nmi(
    array: np.ndarray,
    *,
    n_bins: int = _N_BINS,
    data_range: tuple[float, float] | None = None,
    common_zeros: str = "keep",
) -> Block:
    """NMI of two slices of a set."""
    low, high = (array.min(), array.max()) if data_range is None else data_range
    _check(n_bins, low, high, common_zeros)
    zero = (
        int(digitise(np.zeros(1), n_bins, low, high)[0])
        if common_zeros == "drop" and low <= 0 <= high
        else -1
    )
    size = array[0].size
    counts = np.arange(size + 1.0)
    self_information = counts * np.log(np.maximum(counts, 1.0))  # c log c, 0 at 0
    gain = np.diff(self_information)

    def prepare(part: slice) -> tuple[np.ndarray, np.ndarray]:
        levels = digitise(array[part].reshape(-1, size), n_bins, low, high)
        return levels, np.stack([np.bincount(row, minlength=n_bins) for row in levels])

    def compute(rows: slice, columns: slice) -> np.ndarray:
        a = prepare(rows)
        b = a if rows == columns else prepare(columns)
        pairs = list_pairs(rows, columns)
        return fold_pairs(
            _compare_pairs(*a, *b, pairs, self_information, gain, zero), pairs, rows, columns
        )

    return compute


NMI = Index(label="NMI", make=_make_nmi, needs_range=True)


def digitise(values: np.ndarray, n_bins: int, low: float, high: float) -> np.ndarray:
    """Bin of each value, as bytes; values outside [low, high] go to the end bins."""
    if high <= low:
        return np.zeros(values.shape, dtype=np.uint8)
    scaled = np.floor((values - low) * (n_bins / (high - low)))
    return np.clip(scaled, 0, n_bins - 1).astype(np.uint8)


def _check(n_bins: int, low: float, high: float, common_zeros: str) -> None:
    if not 2 <= n_bins <= 256:
        raise InvalidInput(f"n_bins must be between 2 and 256, got {n_bins}.")
    if not low <= high:
        raise InvalidInput(f"data_range must run from low to high, got ({low}, {high}).")
    if common_zeros not in _ZEROS:
        raise InvalidInput(
            f"common_zeros must be one of {', '.join(_ZEROS)}, got {common_zeros!r}."
        )


@compiled(parallel=True)
def _compare_pairs(a, histogram_a, b, histogram_b, pairs, self_information, gain, zero):
    """NMI of each pair; entropies from Σ c log c over the cells, built up point by point."""
    values = np.empty(len(pairs))
    n_bins = histogram_a.shape[1]
    size = a.shape[1]
    n_chunks = min(_CHUNKS, len(pairs))
    for chunk in nb.prange(n_chunks):
        joint = np.zeros((n_bins, n_bins), dtype=np.int32)
        for p in range(chunk, len(pairs), n_chunks):
            i, j = pairs[p]
            joint[:] = 0
            together = 0.0
            for k in range(size):
                u, v = a[i, k], b[j, k]
                count = joint[u, v]
                together += gain[count]
                joint[u, v] = count + 1
            dropped = joint[zero, zero] if zero >= 0 else 0
            together -= self_information[dropped]
            alone_a, alone_b = 0.0, 0.0
            for level in range(n_bins):
                less = dropped if level == zero else 0
                alone_a += self_information[histogram_a[i, level] - less]
                alone_b += self_information[histogram_b[j, level] - less]
            values[p] = _normalise(together, alone_a, alone_b, size - dropped)
    return values


@compiled
def _normalise(together, alone_a, alone_b, n):
    """2 I / (H_A + H_B) of n points from the sums Σ c log c of the joint table and its margins."""
    if n == 0:
        return 1.0
    log_n = np.log(n)
    entropy_a, entropy_b = log_n - alone_a / n, log_n - alone_b / n
    if entropy_a + entropy_b <= 1e-12:
        return 1.0
    information = entropy_a + entropy_b - (log_n - together / n)
    return min(max(2.0 * information / (entropy_a + entropy_b), 0.0), 1.0)
