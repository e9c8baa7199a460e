"""Dispersion indices: ways to say how alike two tensors are.

An index works on two slices of a set at a time, so that memory does not grow with the set.
"""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.record import Record
from feeler.records.registry import Registry
from feeler.tensors.scaling import fold_planes, label_like, refuse_masked

BLOCK_SIZE = 256  # tensors per side of a block: 256 of 56 × 380 are 44 MB

Block = Callable[[slice, slice], np.ndarray]
"""Similarities of the tensors in one slice with those in another, (row, column)."""


class Index(Record):
    """One way to say how alike two tensors are.

    Attributes
    ----------
    label : str
        What figures and tables call it.
    make : Callable[..., Block]
        ``make(tensors, **options)`` for a set (trial, sensor, time): a function of two slices of
        its trials that gives the index of each pair, (row, column).
    is_similarity : bool
        Whether the closest match has the greatest value; False for a distance, which is least
        there.
    needs_range : bool
        Whether ``make`` takes ``data_range``, the least and the greatest entry of all sets.
    """

    label: str
    make: Callable[..., Block]
    is_similarity: bool = True
    needs_range: bool = False

    @property
    def sign(self) -> float:
        """1 for similarities, −1 for distances: what makes the greatest the closest."""
        return 1.0 if self.is_similarity else -1.0


INDICES: Registry[Index] = Registry(
    "dispersion index",
    {
        name: f"feeler.dispersion.{name}:{name.upper()}"
        for name in ("pearson", "ssim", "mse", "nmi")
    },
)
"""Every known index by its name; ``INDICES.register(name, Index(...))`` adds one."""


def check_tensors(tensors: Any, *, least: int = 2) -> np.ndarray:
    """Tensors or codes as a finite float array (trial, vector, time), a view if possible.

    Raises
    ------
    InvalidInput
        Not three dimensions of numbers (tensors of unequal shapes cannot form such an array), an
        empty dimension, fewer than ``least`` trials, or NaN or infinite entries.
    """
    tensors = fold_planes(tensors)
    if hasattr(tensors, "data_vars"):
        raise InvalidInput('expected one variable of a Dataset, as tensors["angle"]; got all.')
    dims = getattr(tensors, "dims", None)
    if dims is not None and {"trial", "time"} <= set(dims) and dims[0] != "trial":
        tensors = tensors.transpose("trial", ..., "time")
    refuse_masked(tensors)
    try:
        array = np.asarray(tensors, dtype=float)
    except (ValueError, TypeError, OverflowError) as error:
        raise InvalidInput(
            f"the tensors do not form one array (trial, sensor, time): {error}. They must all have"
            " the same number of sensors and samples; crop or pad them to a common length first."
        ) from None
    if array.ndim != 3 or 0 in array.shape:
        raise InvalidInput(
            f"expected tensors or codes (trial, vector, time), got shape {array.shape}."
        )
    if array.shape[0] < least:
        raise InvalidInput(
            f"{array.shape[0]} tensor(s) given, at least {least} are needed to compare them."
        )
    if not np.isfinite(array).all():
        bad = np.flatnonzero(~np.isfinite(array).all(axis=(1, 2)))
        raise InvalidInput(
            f"trial(s) {name_trials(bad)} hold NaN or infinite entries; drop or repair them first."
        )
    return array


def iterate_blocks(n: int, block: int = BLOCK_SIZE) -> Iterator[tuple[slice, slice]]:
    """Slices (rows, columns) that cover the upper triangle of an n × n matrix."""
    if block < 1:
        raise InvalidInput(f"block must be ≥ 1 tensor, got {block}.")
    edges = [slice(start, min(start + block, n)) for start in range(0, n, block)]
    for k, rows in enumerate(edges):
        for columns in edges[k:]:
            yield rows, columns


def compare_pairs(
    tensors: Any, name: str, make: Callable[..., Block], block: int = BLOCK_SIZE, **options: Any
) -> Any:
    """The symmetric matrix (trial, other) of an index; labelled where the tensors are."""
    array = check_tensors(tensors)
    compute, matrix = make(array, **options), np.empty((len(array), len(array)))
    for rows, columns in iterate_blocks(len(array), block):
        values = compute(rows, columns)
        matrix[rows, columns] = values
        matrix[columns, rows] = values.T
    return label_like(matrix, tensors, ("trial", "other"), name)


def list_pairs(rows: slice, columns: slice) -> np.ndarray:
    """Positions (pair, 2) within two slices; the upper triangle where they are the same."""
    n_rows, n_columns = rows.stop - rows.start, columns.stop - columns.start
    if rows == columns:
        return np.stack(np.triu_indices(n_rows), axis=1)
    return np.stack(np.divmod(np.arange(n_rows * n_columns), n_columns), axis=1)


def fold_pairs(
    values: np.ndarray, pairs: np.ndarray, rows: slice, columns: slice
) -> np.ndarray:
    """The block (row, column) that the values of ``list_pairs`` belong to."""
    block = np.empty((rows.stop - rows.start, columns.stop - columns.start))
    block[pairs[:, 0], pairs[:, 1]] = values
    if rows == columns:
        block[pairs[:, 1], pairs[:, 0]] = values
    return block


def name_trials(indices: np.ndarray) -> str:
    """Positions for a message, the first eight."""
    shown = ", ".join(str(i) for i in indices[:8])
    return shown + (f" and {indices.size - 8} more" if indices.size > 8 else "")
