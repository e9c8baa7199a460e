"""Bootstrap intervals of a mean and of a paired difference."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from feeler.errors import InvalidInput
from feeler.records.checked import checked

_N_RESAMPLES = 2000
_LEVEL = 0.95
_MOST_DRAWN = 10**8  # [C] values in all resamples, which are held at once


@dataclass(frozen=True, kw_only=True)
class Interval:
    """An estimate with its bootstrap percentile interval.

    Attributes
    ----------
    effect : float
        Of a difference: Cohen's d_z, the mean of the paired differences over their sd.
    """

    estimate: float
    low: float
    high: float
    effect: float = float("nan")

    def __str__(self) -> str:
        return f"{self.estimate:.3g} [{self.low:.3g}, {self.high:.3g}]"


@checked
def bootstrap_mean(
    values: np.ndarray,
    rng: np.random.Generator,
    *,
    n_resamples: int = _N_RESAMPLES,
    level: float = _LEVEL,
) -> Interval:
    """Mean of ``values`` (n,) with its percentile interval, resampling the values.

    For closest matches the values of neighbours depend on each other (two tensors are often each
    other's match), so the interval is somewhat too narrow; it describes this set of stimuli, not
    all possible stimuli.
    """
    values = _check(values, level)
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
    level: float = _LEVEL,
) -> Interval:
    """Mean of a − b over paired values, with interval and effect size."""
    a, b = np.asarray(a, dtype=float), np.asarray(b, dtype=float)
    if a.shape != b.shape:
        raise InvalidInput(
            f"paired values must match one to one, got shapes {a.shape} and {b.shape}."
        )
    mean = bootstrap_mean(a - b, rng, n_resamples=n_resamples, level=level)
    return Interval(
        estimate=mean.estimate, low=mean.low, high=mean.high, effect=_compute_effect(a - b)
    )


@checked
def student_mean(values: np.ndarray, *, level: float = _LEVEL) -> Interval:
    """Mean of a few ``values`` (n,) with Student's t interval; NaN for one value.

    Resampling two or three values gives hardly more than themselves.
    """
    values = _check(values, level)
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


def _check(values: np.ndarray, level: float) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    if values.ndim != 1 or values.size == 0 or not np.isfinite(values).all():
        raise InvalidInput(f"expected a list of finite values, got shape {values.shape}.")
    if not 0 < level < 1:
        raise InvalidInput(f"level must lie in (0, 1), got {level}.")
    return values
