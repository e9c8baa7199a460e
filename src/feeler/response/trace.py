"""Traces: one displacement over evenly sampled time, checked at the door; ratios of deflections."""

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked

_MIN_SAMPLES = 8
_MAX_JITTER = 1e-3  # largest deviation of a sample interval from the mean, as a share of it


@checked
def check_trace(
    time: np.ndarray, signal: np.ndarray, name: str = "trace"
) -> tuple[np.ndarray, np.ndarray]:
    """Time (sample,) [ms] and signal (sample,) as floats, or the reason why they cannot be used.

    Raises
    ------
    InvalidInput
        Different lengths, too few samples, gaps (NaN), decreasing or unevenly sampled time, or a
        constant signal.
    """
    time, signal = np.asarray(time, dtype=float), np.asarray(signal, dtype=float)
    if time.ndim != 1 or time.shape != signal.shape:
        raise InvalidInput(
            f"{name}: time and signal must be rows of one length, got {time.shape} and"
            f" {signal.shape}."
        )
    if time.size < _MIN_SAMPLES:
        raise InvalidInput(
            f"{name} is too short: {time.size} samples; at least {_MIN_SAMPLES} are needed."
        )
    _check_time(time, name)
    missing = ~np.isfinite(signal)
    if missing.any():
        first = time[np.argmax(missing)]
        raise InvalidInput(
            f"{name} has {missing.sum()} missing samples of {time.size}, the first at {first:g} ms."
            " Interpolate the gaps, or cut the trace to a part without any."
        )
    if np.ptp(signal) <= 1e-12 * max(1.0, np.abs(signal).max()):
        raise InvalidInput(
            f"{name} is constant at {signal[0]:g}: nothing moves. Give the trace of a released"
            " antenna."
        )
    return time, signal


def _check_time(time: np.ndarray, name: str) -> None:
    if not np.isfinite(time).all():
        raise InvalidInput(
            f"{name}: time has {np.sum(~np.isfinite(time))} missing values; every sample needs its"
            " time."
        )
    step = np.diff(time)
    if np.any(step <= 0):
        where = int(np.argmax(step <= 0))
        raise InvalidInput(
            f"{name}: time must rise, but {time[where]:g} is followed by {time[where + 1]:g} ms."
            " Sort the samples."
        )
    jitter = np.abs(step - step.mean()).max() / step.mean()
    if jitter > _MAX_JITTER:
        raise InvalidInput(
            f"{name} is not evenly sampled: intervals of {step.min():g} to {step.max():g} ms."
            " Resample it to one interval first."
        )


def find_extrema(
    time: np.ndarray, signal: np.ndarray, floor: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """Times and heights of the inner maxima of |signal| beyond ``floor``.

    Each is that of a parabola through three samples.

    The parabola is what keeps a cost smooth: peaks that jump from sample to sample make it a
    staircase.
    """
    size = np.abs(signal)
    middle = (
        np.flatnonzero(
            (size[1:-1] > size[:-2]) & (size[1:-1] >= size[2:]) & (size[1:-1] > floor)
        )
        + 1
    )
    before, here, after = signal[middle - 1], signal[middle], signal[middle + 1]
    share = _find_vertex(before, here, after)
    step = time[1] - time[0]
    return time[middle] + share * step, here - 0.25 * (before - after) * share


def _find_vertex(before: np.ndarray, here: np.ndarray, after: np.ndarray) -> np.ndarray:
    """Where the parabola through three samples turns, in samples from the middle one.

    0 where all but their last bit is one.
    """
    bend = before - 2 * here + after
    return np.where(bend == 0, 0.0, 0.5 * (before - after) / np.where(bend == 0, 1.0, bend))


@checked
def measure_deflection_ratios(
    time: np.ndarray, deflection: np.ndarray, tip: np.ndarray
) -> np.ndarray:
    """Deflections (point,) over the tip's at the moment when the tip is farthest out.

    Parameters
    ----------
    time
        (sample,) [ms].
    deflection
        (point, sample), from rest, in the tip's unit.
    tip
        (sample,), from rest.

    Notes
    -----
    The moment is interpolated between samples (parabola through the three samples around the
    largest |tip|), and so are the points, so that the ratios change smoothly with the mechanics.
    """
    time, tip = check_trace(time, tip, "tip")
    deflection = np.atleast_2d(np.asarray(deflection, dtype=float))
    if deflection.shape[1:] != tip.shape:
        raise InvalidInput(
            f"deflection must be (point, sample) with {tip.size} samples, got shape"
            f" {deflection.shape}."
        )
    if not np.isfinite(deflection).all():
        raise InvalidInput(
            "deflection has missing samples; interpolate the gaps or leave the point out."
        )
    k = int(np.argmax(np.abs(tip)))
    if k in (0, tip.size - 1):
        raise InvalidInput(
            f"the tip is farthest out at the {'first' if k == 0 else 'last'} sample ({time[k]:g}"
            " ms): the trace does not hold the whole deflection. Record longer."
        )
    share = float(_find_vertex(*tip[k - 1 : k + 2]))
    return _parabola(deflection[:, k - 1 : k + 2], share) / _parabola(
        tip[None, k - 1 : k + 2], share
    )


def _parabola(three: np.ndarray, share: float) -> np.ndarray:
    before, here, after = three.T
    return here + 0.5 * share * (after - before) + 0.5 * share**2 * (before - 2 * here + after)
