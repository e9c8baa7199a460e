"""Dispersion of groups of tensors: closest matches, their average, and bootstrap intervals."""

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np
import xarray as xr
from scipy.stats import t as student

from feeler.analysis.indices import BLOCK_SIZE, INDICES, check_tensors, iterate_blocks
from feeler.errors import InvalidInput
from feeler.records import Gt, Lt
from feeler.tensors.transforms import label_like, stack_planes
from feeler.validation import Seed, checked

# Bootstrap intervals of a mean and of a paired difference.

_N_RESAMPLES = 2000
_LEVEL = 0.95
_Level = Annotated[float, Gt(0), Lt(1)]
_MOST_DRAWN = 10**8  # [C] values in all resamples, which are held at once


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate with its bootstrap percentile interval.

    Attributes
    ----------
    effect : float | None
        Of a difference: Cohen's d_z, the mean of the paired differences over their sd.
    """

    estimate: float
    low: float
    high: float
    effect: float | None = None

    def __str__(self) -> str:
        return f"{self.estimate:.3g} [{self.low:.3g}, {self.high:.3g}]"


@checked
def bootstrap_mean(
    values: np.ndarray,
    rng: np.random.Generator,
    *,
    n_resamples: int = _N_RESAMPLES,
    level: _Level = _LEVEL,
) -> Interval:
    """Mean of ``values`` (n,) with its percentile interval, resampling the values.

    For closest matches the values of neighbours depend on each other (two tensors are often each
    other's match), so the interval is somewhat too narrow; it describes this set of stimuli, not
    all possible stimuli.
    """
    values = _check_values(values)
    if not 1 <= n_resamples * values.size <= _MOST_DRAWN:
        most = _MOST_DRAWN // values.size
        raise InvalidInput(f"n_resamples must be 1 to {most:,} here, got {n_resamples}.")
    picks = rng.integers(values.size, size=(n_resamples, values.size))
    low, high = np.quantile(values[picks].mean(axis=1), [(1 - level) / 2, (1 + level) / 2])
    return Interval(estimate=float(values.mean()), low=float(low), high=float(high))


@checked
def bootstrap_difference(
    a: np.ndarray,
    b: np.ndarray,
    rng: np.random.Generator,
    *,
    n_resamples: int = _N_RESAMPLES,
    level: _Level = _LEVEL,
) -> Interval:
    """Mean of a − b over paired values, with interval and effect size."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape:
        raise InvalidInput(
            f"paired values must match one to one, got shapes {a.shape} and {b.shape}."
        )
    mean = bootstrap_mean(a - b, rng, n_resamples=n_resamples, level=level)
    return replace(mean, effect=_compute_effect(a - b))


@checked
def student_mean(values: np.ndarray, *, level: _Level = _LEVEL) -> Interval:
    """Mean of a few ``values`` (n,) with Student's t interval; NaN for one value.

    Resampling two or three values gives hardly more than themselves.
    """
    values = _check_values(values)
    spread = values.std(ddof=1) / np.sqrt(values.size) if values.size > 1 else np.nan
    half = student.ppf((1 + level) / 2, max(values.size - 1, 1)) * spread
    mean = float(values.mean())
    return Interval(estimate=mean, low=float(mean - half), high=float(mean + half))


def _compute_effect(difference: np.ndarray) -> float:
    spread = difference.std(ddof=1) if difference.size > 1 else 0.0
    mean = float(difference.mean())
    if spread <= 1e-12 * max(abs(mean), 1e-300):
        return float(np.sign(mean)) * np.inf if mean else 0.0
    return mean / float(spread)


def _check_values(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    if values.ndim != 1 or values.size == 0 or not np.isfinite(values).all():
        raise InvalidInput(f"expected a list of finite values, got shape {values.shape}.")
    return values


# The closest match of every tensor, with or without ever holding the full matrix.


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
    square = matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1] >= 2
    if not square or np.isnan(matrix).any():
        raise InvalidInput(
            "expected a square matrix of at least 2 tensors without NaN, got shape"
            f" {matrix.shape}."
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


# Dispersion of groups of tensors: closest matches, their average and its interval.


@dataclass(frozen=True, kw_only=True, eq=False)
class Dispersion:
    """The indices of each group: closest match per tensor, group average, interval.

    Attributes
    ----------
    groups : tuple[Hashable, ...]
        Group names, in order of appearance.
    closest : dict[str, dict[Hashable, Closest]]
        ``closest[index][group]``; trials counted within the group.
    average : dict[str, dict[Hashable, Interval]]
        ``average[index][group]``: mean of the group's closest matches, with its interval.
    """

    groups: tuple[Hashable, ...]
    closest: dict[str, dict[Hashable, Closest]] = field(repr=False)
    average: dict[str, dict[Hashable, Interval]]

    def values(self, index: str, group: Hashable) -> Any:
        """Each tensor's index with its closest match in the group (trial,)."""
        return self.closest[index][group].value


@checked
def compute_dispersion(
    tensors: Any,
    groups: Sequence[Hashable] | np.ndarray | None = None,
    *,
    indices: Sequence[str] | None = None,
    options: dict[str, dict[str, Any]] | None = None,
    scale: bool = True,
    random_state: Seed = 0,
    block: int = BLOCK_SIZE,
) -> Dispersion:
    """How alike each tensor is to its closest match within its group, averaged over the group.

    Lower Pearson, SSIM and NMI and higher MSE mean a more dispersed group.

    Parameters
    ----------
    tensors
        (trial, sensor, time), or activations (trial, component, time); or one such array per group
        by its name, which may differ in sensors and samples: matches are sought within groups only.
    groups
        One name per trial, for instance its speed; None takes the whole set as one group.
    indices
        Names of registered indices; all by default: pearson, ssim, mse, nmi.
    options
        Options per index, e.g. ``{"nmi": {"n_bins": 64}}``.
    scale
        Divide the whole set by one common factor first (``scale_common``). NMI bins span the whole
        set either way.
    random_state
        Seed of the bootstrap.

    Raises
    ------
    InvalidInput
        A group with fewer than two tensors, groups of another length, or tensors an index cannot
        take.

    Notes
    -----
    Paper, "Dataset dispersion evaluation".
    """
    sets = _split(tensors, groups)
    least, greatest = (
        min(array.min() for array in sets.values()),
        max(array.max() for array in sets.values()),
    )
    if scale:
        largest = max(-least, greatest)
        if largest == 0:
            raise InvalidInput(
                "every tensor is zero: there is nothing to scale. Did any contact take place?"
            )
        sets = {name: array / largest for name, array in sets.items()}
        least, greatest = least / largest, greatest / largest
    closest: dict[str, dict[Hashable, Closest]] = {}
    for index in INDICES if indices is None else indices:
        given = (
            {"data_range": (float(least), float(greatest))}
            if INDICES[index].needs_range
            else {}
        )
        given |= (options or {}).get(index, {})
        closest[index] = {
            name: search_closest(array, index, block=block, **given)
            for name, array in sets.items()
        }
    average = {  # the same draws for every group, so that equal groups have equal intervals
        i: {
            n: bootstrap_mean(c.value, np.random.default_rng(random_state))
            for n, c in by_group.items()
        }
        for i, by_group in closest.items()
    }
    return Dispersion(groups=tuple(sets), closest=closest, average=average)


def _split(tensors: Any, groups: Any) -> dict[Hashable, Any]:
    """The tensors of each group, at least two."""
    if isinstance(tensors, Mapping) and not hasattr(tensors, "dims"):
        sets = {name: _check(array) for name, array in tensors.items()}
    else:
        array = _check(tensors)
        given = getattr(groups, "values", groups)
        if groups is not None and not np.ndim(given):
            raise InvalidInput(f"groups must be one label per tensor, got {groups!r}.")
        labels = [""] * len(array) if groups is None else list(given)
        if len(labels) != len(array):
            raise InvalidInput(
                f"{len(labels)} group names for {len(array)} tensors; give one per tensor."
            )
        sets = {
            name: array[[label == name for label in labels]] for name in dict.fromkeys(labels)
        }
    for name, array in sets.items():
        if len(array) < 2:
            raise InvalidInput(
                f"group {name!r} has one tensor; a closest match needs at least two."
            )
    return sets


def _check(tensors: Any) -> Any:
    """Tensors (trial, vector, time) of finite numbers, with their labels if they have any."""
    tensors = stack_planes(tensors)
    array = np.ascontiguousarray(check_tensors(tensors, least=1))
    if not isinstance(tensors, xr.DataArray):
        return array
    return (
        tensors.transpose("trial", ..., "time").copy(data=array)
        if {"trial", "time"} <= {*tensors.dims}
        else array
    )
