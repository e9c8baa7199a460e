"""What an encoder takes: tensors, masks, weights and settings; what it refuses says what to do."""

from typing import Any

import numpy as np
import xarray as xr

from feeler.errors import InvalidInput
from feeler.tensors.transforms import find_dims, stack_planes

_CONSTRAINTS = ("trial", "all")
FIXED_CODES = ("sparse", "ridge", "nonnegative")
LABELS = {
    "joint": "joint fit (paper)",
    "sparse": "fixed bases, sparse",
    "ridge": "fixed bases, ridge",
    "nonnegative": "fixed bases, least squares",
    "raw": "tensors",
}
"""What figures and tables call each kind of code; ``raw`` is no code at all."""
_STARTS = ("windows", "random")


def _order(values: Any, dims: tuple[str, ...]) -> Any:
    named = isinstance(values, xr.DataArray | xr.Variable)
    return values.transpose(*dims).values if named else values


def read_tensors(X: Any, mask: Any = None) -> tuple[np.ndarray, np.ndarray | None]:
    """Tensors (trial, sensor, time) as an array of non-negative floats, and which of their entries
    do not count, or None.

    Parameters
    ----------
    X : np.ndarray, np.ma.MaskedArray, xr.DataArray or xr.Dataset
        An array, a DataArray with three dims, or feeler's Dataset, of which ``angle`` is read.
    mask : np.ndarray or xr.DataArray of bool, optional
        True where an entry does not count, as in NumPy's masked arrays, whose own is added. What
        stands there may be NaN; it is set to 0.

    Raises
    ------
    InvalidInput
        Other dims, nothing in it, NaN, infinite or negative entries that count, a mask of another
        shape, or one that hides a whole trial or a whole sensor.
    """
    if hasattr(X, "data_vars"):
        if "angle" not in X:
            raise InvalidInput(
                f"The Dataset has no variable 'angle'; it has {sorted(X.data_vars)}. Pass one of"
                " them."
            )
        X = X["angle"]
    X = stack_planes(X)
    dims = find_dims(X)
    _check_labels(X, mask)
    own = np.ma.getmask(X) if isinstance(X, np.ma.MaskedArray) else np.ma.nomask
    try:
        tensors = np.ma.getdata(_order(X, dims))
    except ValueError as error:
        raise InvalidInput(
            "The tensors do not form one array (trial, sensor, time): they must all have the same"
            " numbers of sensors and samples. Crop or pad them."
        ) from error
    if tensors.dtype.kind not in "fiub":
        raise InvalidInput(f"The tensors need numbers; got an array of {tensors.dtype}.")
    if tensors.ndim != 3:
        hint = " One tensor is X[None]." if tensors.ndim == 2 else ""
        raise InvalidInput(
            f"The tensors need the shape (trial, sensor, time); got {tensors.shape}.{hint}"
        )
    if 0 in tensors.shape:
        raise InvalidInput(
            f"The tensors are empty: shape {tensors.shape} (trial, sensor, time)."
        )
    hidden = _read_mask(
        None if mask is None else _order(stack_planes(mask), dims), own, tensors
    )
    tensors = np.ascontiguousarray(tensors, dtype=float)
    if hidden is not None:
        tensors = np.where(hidden, 0.0, tensors)
    _check_values(tensors)
    return tensors, hidden


def _check_labels(X: Any, mask: Any) -> None:
    """Refuse a mask with other labels than the tensors have, and times uneven or falling."""
    indexes = getattr(X, "indexes", {})
    for dim, index in getattr(mask, "indexes", {}).items():
        if dim in indexes and not index.equals(indexes[dim]):
            raise InvalidInput(
                f"The mask has other labels along {dim} than the tensors, or in another order;"
                " mask.reindex_like(X) puts equal ones in theirs."
            )
    if "time" in indexes and indexes["time"].dtype.kind in "fiumM":
        steps = np.diff(indexes["time"].to_numpy()).astype(float)
        if steps.size and not (steps.min() > 0 and np.ptp(steps) <= 0.5 * np.median(steps)):
            raise InvalidInput(
                f"The samples are not evenly spaced: steps in time from {steps.min():.4g} to"
                f" {steps.max():.4g}. Take them at even, rising times, X.interp(time=…)."
            )


def _read_mask(mask: Any, own: Any, tensors: np.ndarray) -> np.ndarray | None:
    """Which entries do not count, of the mask given and the tensors' own; None where all do."""
    hidden = np.zeros(tensors.shape, dtype=bool) if mask is None else np.asarray(mask)
    if hidden.dtype != bool or hidden.shape != tensors.shape:
        raise InvalidInput(
            f"The mask needs True or False for each entry, shape {tensors.shape}; got"
            f" {hidden.dtype} of {hidden.shape}."
        )
    hidden = hidden | own
    if not hidden.any():
        return None
    for axes, name in (((1, 2), "trial"), ((0, 2), "sensor")):
        whole = np.flatnonzero(hidden.all(axis=axes))
        if whole.size:
            raise InvalidInput(
                f"The mask hides every entry of {name} {whole[0]}"
                + (f" and of {whole.size - 1} more" if whole.size > 1 else "")
                + f"; nothing can be learned of it. Leave the {name} out."
            )
    return hidden


def read_weights(sample_weight: Any, n_trials: int) -> np.ndarray | None:
    """Weights (trial,) ≥ 0, of which one at least is above 0; None for None."""
    if sample_weight is None:
        return None
    weights = np.asarray(sample_weight, dtype=float)
    if weights.shape != (n_trials,):
        raise InvalidInput(
            f"sample_weight needs one number per trial, shape ({n_trials},); got {weights.shape}."
        )
    if not (np.isfinite(weights).all() and (weights >= 0).all() and weights.any()):
        raise InvalidInput(
            "sample_weight must be finite, at least 0, and not 0 for all trials."
        )
    return weights


def _check_values(tensors: np.ndarray) -> None:
    # NaN carries through both, and no copy of the data is made
    low, high = tensors.min(), tensors.max()
    if not (np.isfinite(low) and np.isfinite(high)):
        trial = next(i for i, tensor in enumerate(tensors) if not np.isfinite(tensor).all())
        raise InvalidInput(
            f"The tensors hold NaN or infinite entries, the first in trial {trial}. Drop such"
            " trials, fill the gaps, or leave the entries out: fit(X, mask=np.isnan(X))."
        )
    if low < 0:
        share = float((tensors < 0).mean())
        raise InvalidInput(
            f"The tensors hold negative entries ({share:.1%} of them, the lowest {low:.3g}); the"
            " factorisation is non-negative. Rectify first (feeler.tensors): rectify(X) keeps"
            " bending one way, as the paper's does, of touches from the right after"
            " mirror_to_left(X); fold_signs(X) keeps both ways as twice the sensors."
        )


def check_settings(estimator: Any) -> None:
    """Refuse parameters that mean nothing, each with what would."""
    free = [one for one in ("n_finished", "inner_steps") if getattr(estimator, one) is not None]
    for name in ("n_components", "n_lags", "n_restarts", "max_iter", *free):
        value = getattr(estimator, name)
        if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 1:
            raise InvalidInput(f"{name} must be a whole number of at least 1; got {value!r}.")
    if estimator.sparseness is not None:
        check_sparseness(estimator.sparseness)
    check_choice("constraint", estimator.constraint, _CONSTRAINTS)
    check_choice("init", estimator.init, _STARTS)
    check_choice("keep", estimator.keep, ("lowest", "typical"))
    if estimator.code is not None:
        check_choice("code", estimator.code, FIXED_CODES)
    for name in ("tol", "ridge", "cross_orthogonality"):
        value = getattr(estimator, name)
        if not value >= 0:
            raise InvalidInput(f"{name} must be 0 or more; got {value!r}.")


def check_sparseness(sparseness: float) -> None:
    """Refuse what no vector can reach: outside [0, 1)."""
    if not 0 <= sparseness < 1:
        raise InvalidInput(
            f"sparseness must lie in [0, 1), or be None for no constraint; got {sparseness}. The"
            " paper uses 0.8; 1 would allow a single active moment only."
        )


def check_choice(name: str, value: Any, choices: tuple[str, ...]) -> None:
    """Refuse an unknown name and list the known ones."""
    if value not in choices:
        raise InvalidInput(
            f"{name} must be one of {', '.join(map(repr, choices))}; got {value!r}."
        )


def check_size(tensors: np.ndarray, n_components: int, n_lags: int) -> None:
    """Refuse bases longer than a trial, and more of them than the data can pin down."""
    n_trials, _, n_times = tensors.shape
    if n_lags > n_times:
        raise InvalidInput(
            f"n_lags is {n_lags}, but a trial has {n_times} samples; choose n_lags of at most "
            f"{n_times}, or longer trials."
        )
    most = max(n_trials * n_times // n_lags, 1)
    if n_components > most:
        raise InvalidInput(
            f"n_components is {n_components}, but {n_trials} trials of {n_times} samples hold only"
            f" {most} separate windows of n_lags = {n_lags} samples; more bases than that are not"
            f" determined. Choose at most {most}, or fewer lags."
        )


def check_tensors(tensors: np.ndarray, components: np.ndarray) -> np.ndarray:
    """The tensors, if these bases can be played on them."""
    _, n_sensors, n_lags = components.shape
    if tensors.shape[1] != n_sensors:
        raise InvalidInput(
            f"The tensors have {tensors.shape[1]} sensors, but the bases were learned on"
            f" {n_sensors}. Record the same sensors, or fit again."
        )
    if tensors.shape[2] < n_lags:
        raise InvalidInput(
            f"A trial has {tensors.shape[2]} samples, fewer than the {n_lags} lags of the bases."
        )
    return tensors
