"""The door of the encoder: what it takes, and what it says to what it cannot take."""

from typing import Any

import numpy as np

from feeler.encoding.sparseness import check_sparseness
from feeler.errors import InvalidInput
from feeler.tensors.scaling import fold_planes, refuse_masked

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


def as_tensors(X: Any) -> np.ndarray:
    """Tensors (trial, sensor, time) as an array of non-negative floats.

    Parameters
    ----------
    X : np.ndarray, xr.DataArray or xr.Dataset
        An array, a DataArray with these dims, or feeler's Dataset, of which ``angle`` is read.

    Raises
    ------
    InvalidInput
        Other dims, nothing in it, NaN, infinite, masked or negative entries.
    """
    if hasattr(X, "data_vars"):
        if "angle" not in X:
            raise InvalidInput(
                f"The Dataset has no variable 'angle'; it has {sorted(X.data_vars)}. Pass one of"
                " them."
            )
        X = X["angle"]
    X = fold_planes(X)
    if hasattr(X, "dims"):
        if set(X.dims) != {"trial", "sensor", "time"}:
            raise InvalidInput(
                f"The tensors need the dims trial, sensor, time; got {tuple(X.dims)}."
            )
        X = X.transpose("trial", "sensor", "time").values
    refuse_masked(X)
    tensors = np.asarray(X)
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
    tensors = np.ascontiguousarray(tensors, dtype=float)
    _check_values(tensors)
    return tensors


def _check_values(tensors: np.ndarray) -> None:
    # NaN carries through both, and no copy of the data is made
    low, high = tensors.min(), tensors.max()
    if not (np.isfinite(low) and np.isfinite(high)):
        trial = next(i for i, tensor in enumerate(tensors) if not np.isfinite(tensor).all())
        raise InvalidInput(
            f"The tensors hold NaN or infinite entries, the first in trial {trial}. Drop such"
            " trials, or fill the gaps before encoding."
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
    for name in ("n_components", "n_lags", "n_restarts", "max_iter"):
        value = getattr(estimator, name)
        if not isinstance(value, int | np.integer) or isinstance(value, bool) or value < 1:
            raise InvalidInput(f"{name} must be a whole number of at least 1; got {value!r}.")
    if estimator.sparseness is not None:
        check_sparseness(estimator.sparseness)
    check_choice("constraint", estimator.constraint, _CONSTRAINTS)
    check_choice("init", estimator.init, _STARTS)
    if estimator.code is not None:
        check_choice("code", estimator.code, FIXED_CODES)
    for name in ("tol", "ridge"):
        value = getattr(estimator, name)
        if not value >= 0:
            raise InvalidInput(f"{name} must be 0 or more; got {value!r}.")


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
