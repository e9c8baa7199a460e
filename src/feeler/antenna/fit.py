"""Fit the sigmoid of segment lengths to measured antennae."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from feeler.antenna.profile import Sigmoid
from feeler.errors import InvalidInput

_MIN_SEGMENTS = 8


@dataclass(frozen=True, kw_only=True, eq=False)
class SigmoidFit:
    """A sigmoid of length shares, and the data it was fitted to.

    Attributes
    ----------
    x : np.ndarray
        Relative segment numbers (segment,), (n − 0.5) / N.
    share : np.ndarray
        Length shares (antenna, segment) of an antenna of N segments; an antenna with another count
        is interpolated.
    squared_residual : float
        Squared norm of the residual of the antennae's mean, Σ (mean − sigmoid)².
    """

    sigmoid: Sigmoid
    x: np.ndarray
    share: np.ndarray
    squared_residual: float


def fit_sigmoid(lengths: Sequence[np.ndarray], n_segments: int | None = None) -> SigmoidFit:
    """Least-squares sigmoid through the segment lengths of several antennae (Supplementary Methods;
    Fig. S1).

    Parameters
    ----------
    lengths
        Segment lengths (segment,) of each antenna, base to tip, any unit; counts may differ.
    n_segments
        Count N that shares refer to; default: the largest count.

    Raises
    ------
    InvalidInput
        No antenna, fewer than 8 segments, or lengths that are not finite and > 0.
    """
    arrays = [
        _check(np.asarray(values, dtype=float), number)
        for number, values in enumerate(lengths, 1)
    ]
    if not arrays:
        raise InvalidInput("give the segment lengths of at least one antenna.")
    n = max(a.size for a in arrays) if n_segments is None else n_segments
    x = (np.arange(n) + 0.5) / n
    share = np.stack([_rescale(values, x) for values in arrays])
    mean = share.mean(axis=0)
    rise = max(mean[-1] - mean[0], 1e-3 / n)
    start = np.array([max(mean[0], 1e-6), rise, 10.0, 0.5])
    scale = np.array([1 / n, 1 / n, 10.0, 0.5])

    def residual(p: np.ndarray) -> np.ndarray:
        return (_make(p * scale).at(x) - mean) * n

    best = least_squares(residual, start / scale, xtol=1e-14, ftol=1e-14, gtol=1e-14)
    sigmoid = _make(best.x * scale)
    return SigmoidFit(
        sigmoid=sigmoid,
        x=x,
        share=share,
        squared_residual=float(np.sum((mean - sigmoid.at(x)) ** 2)),
    )


def _make(p: np.ndarray) -> Sigmoid:
    low, rise, slope, centre = map(float, p)
    return Sigmoid(low=low, rise=rise, slope=slope, centre=centre)


def _check(values: np.ndarray, number: int) -> np.ndarray:
    if values.ndim != 1 or values.size < _MIN_SEGMENTS:
        raise InvalidInput(
            f"antenna {number} needs a row of at least {_MIN_SEGMENTS} lengths, got shape"
            f" {values.shape}."
        )
    if not (np.isfinite(values).all() and np.all(values > 0)):
        raise InvalidInput(
            f"antenna {number} has segment lengths that are not finite and > 0. Leave the antenna"
            " out."
        )
    return values


def _rescale(values: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Shares at relative numbers ``x`` that add to one, for an antenna of ``x.size`` segments."""
    own = (np.arange(values.size) + 0.5) / values.size
    share = np.interp(x, own, values)
    return share / share.sum()
