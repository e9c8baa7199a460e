"""Responses of a recorded motion: frequency, damping, deflection ratios, strain."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
import xarray as xr
from scipy.optimize import least_squares

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.records import Gt
from feeler.tensors.transforms import in_unit, project_planes, require_variables
from feeler.validation import checked

# Traces: one displacement over evenly sampled time, checked at the door; ratios of deflections.

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


def _find_extrema(
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


# A damped cosine fitted to a whole record: another frequency and damping ratio.


@dataclass(frozen=True, kw_only=True)
class DampedCosine:
    """``offset + amplitude · exp(−ζ ω₀ t) · cos(2π f t + phase)``, ω₀ = 2π f / √(1 − ζ²).

    t runs from the first sample.

    Attributes
    ----------
    frequency : float
        Damped frequency f [kHz].
    damping_ratio : float
        ζ [1].
    residual : float
        Root-mean-square residual over the root-mean-square signal [1].
    """

    frequency: float
    damping_ratio: float
    amplitude: float
    phase: float
    offset: float
    residual: float

    @property
    def r_squared(self) -> float:
        """Share of the trace's variance that the cosine explains."""
        return 1 - self.residual**2


@checked
def fit_damped_cosine(
    time: np.ndarray,
    signal: np.ndarray,
    frequency: Annotated[float, Gt(0)],
    damping_ratio: Annotated[float, Gt(0)] = 0.3,
) -> DampedCosine:
    """Least-squares damped cosine over the whole record, from a first guess.

    Only decay rate and frequency are searched; amplitude, phase and offset are linear and solved
    for exactly (variable projection, Golub & Pereyra 1973, doi:10.1137/0710036).
    """
    time, signal = check_trace(time, signal)
    t = time - time[0]
    omega = 2 * np.pi * frequency
    start = np.log([omega * damping_ratio / np.sqrt(1 - min(damping_ratio, 0.95) ** 2), omega])

    def residual(x: np.ndarray) -> np.ndarray:
        basis = _basis(t, x)
        return basis @ np.linalg.lstsq(basis, signal, rcond=None)[0] - signal

    if not np.isfinite(start).all():
        raise InvalidInput(
            f"frequency {frequency:g} kHz and damping_ratio {damping_ratio:g} are no first guess:"
            " give what the trace shows, roughly."
        )
    limit = np.log([1e-4, 1e4])
    bounds = (start + limit[0], start + limit[1])
    best = least_squares(residual, start, bounds=bounds, x_scale=0.1, xtol=1e-12, ftol=1e-12)
    cosine, sine, offset = np.linalg.lstsq(_basis(t, best.x), signal, rcond=None)[0]
    decay, omega = np.exp(best.x)
    return DampedCosine(
        frequency=float(omega / (2 * np.pi)),
        damping_ratio=float(decay / np.hypot(decay, omega)),
        amplitude=float(np.hypot(cosine, sine)),
        phase=float(np.arctan2(-sine, cosine)),
        offset=float(offset),
        residual=float(np.sqrt(np.mean(best.fun**2) / np.mean((signal - signal.mean()) ** 2))),
    )


def _basis(t: np.ndarray, x: np.ndarray) -> np.ndarray:
    decay, omega = np.exp(x)
    envelope = np.exp(-decay * t)
    return np.stack(
        [envelope * np.cos(omega * t), envelope * np.sin(omega * t), np.ones_like(t)], axis=1
    )


# Free response: what a released antenna's tip tells about frequency, damping and settling.

_MIN_HALF = (
    2.5  # [C] samples that half a cycle must have for its turning points to be discriminated
)
# [C] share of the first deflection under which a turning point is taken for noise
_PEAK_FLOOR = 1e-3


@dataclass(frozen=True, kw_only=True)
class FreeResponse:
    """What was measured on one free response; None where it has no such quantity.

    Attributes
    ----------
    overdamped : bool
        The response creeps back without crossing its rest position: it has no damped frequency.
    frequency : float | None
        Damped natural frequency [kHz], from first opposite peak to following trough.
    damping_ratio : float | None
        ζ [1] by logarithmic decrement, first opposite peak → following trough.
    settle_10 : float | None
        Time after release [ms] from which the tip stays within 10 % of its first deflection.
    settle_5 : float | None
        The same for 5 %.
    rejected : float | None
        Share of the step that is gone one damped period after release [1].
    peak_time : float | None
        Time of the first opposite peak [ms].
    peak : float | None
        Height of the first opposite peak relative to the first deflection [1], negative.
    trough : float | None
        Height of the following trough relative to the first deflection [1].
    """

    overdamped: bool
    frequency: float | None = None
    damping_ratio: float | None = None
    settle_10: float | None = None
    settle_5: float | None = None
    rejected: float | None = None
    peak_time: float | None = None
    peak: float | None = None
    trough: float | None = None


@checked
def measure_free_response(
    time: np.ndarray,
    tip: np.ndarray,
    *,
    rest: float = 0.0,
    release: float | None = None,
    floor: float = _PEAK_FLOOR,
) -> FreeResponse:
    """Frequency, damping, settling and rejection of one released tip.

    Parameters
    ----------
    time
        (sample,) [ms], evenly sampled.
    tip
        Tip displacement (sample,), any unit.
    rest
        Displacement at rest, in the same unit.
    release
        Time of release [ms]; default: the first sample.
    floor
        Turning points below this share of the first deflection do not count (set it above the noise
        of a recording).

    Returns
    -------
    FreeResponse
        With ζ = δ / √(δ² + π²), δ = ln |peak / trough|, and f = 1 / (2 (t_trough − t_peak)).

    Raises
    ------
    InvalidInput
        A trace that cannot be measured: gaps, uneven time, constant, shorter than a cycle, or
        faster than its sampling.
    """
    if not np.isfinite(rest):
        raise InvalidInput(f"rest must be finite, got {rest}.")
    time, tip = check_trace(time, tip)
    start = 0 if release is None else int(np.searchsorted(time, release - 1e-9))
    time, tip = check_trace(time[start:], tip[start:])
    moved = tip - rest
    if abs(moved[0]) < 0.05 * np.abs(moved).max():
        raise InvalidInput(
            f"the trace starts at its rest position ({tip[0]:g}): no step is released. "
            "Cut it at the release, or say when that was (release=) and where rest is (rest=)."
        )
    share = moved / moved[0]
    times, heights = _opposite_turns(time, share, floor)
    settle = [_settle_time(time, share, level) for level in (0.10, 0.05)]
    if len(times) < 2:
        return _describe_overdamped(time, share, times, heights, settle)
    half = times[1] - times[0]
    between = share[(time >= times[0]) & (time <= times[1]) & (np.abs(share) > floor)]
    signs = np.concatenate(([-1.0], np.sign(between), [1.0]))
    if half < _MIN_HALF * (time[1] - time[0]) or np.sum(np.diff(signs) != 0) != 1:
        raise InvalidInput(
            f"between peak and trough there are not {_MIN_HALF} samples of {time[1] - time[0]:g}"
            " ms, or several swings: the frequency lies beyond the sampling rate, or the time is in"
            " the wrong unit (ms are expected)."
        )
    decrement = np.log(abs(heights[0] / heights[1]))
    frequency, ratio = 0.5 / half, float(decrement / np.hypot(decrement, np.pi))
    # 1 − largest |deflection| from the end of the first cycle on.
    later = np.abs(share[time >= time[0] + (2 * half)])
    return FreeResponse(
        overdamped=False,
        frequency=float(frequency),
        damping_ratio=ratio,
        settle_10=settle[0],
        settle_5=settle[1],
        rejected=float(1 - later.max()) if later.size else None,
        peak_time=float(times[0] - time[0]),
        peak=float(heights[0]),
        trough=float(heights[1]),
    )


def _opposite_turns(
    time: np.ndarray, share: np.ndarray, floor: float
) -> tuple[np.ndarray, np.ndarray]:
    """First opposite peak and the trough after it: the largest turns of two half cycles."""
    times, heights = _find_extrema(time, share, floor)
    after = np.flatnonzero(heights < 0)
    if not len(after):
        return times[:0], heights[:0]
    times, heights = times[after[0] :], heights[after[0] :]
    lobe = np.concatenate(([0], np.cumsum(np.diff(np.sign(heights)) != 0)))
    lobes = (np.flatnonzero(lobe == k) for k in (0, 1))
    best = [int(turns[np.argmax(np.abs(heights[turns]))]) for turns in lobes if turns.size]
    return times[best], heights[best]


def _describe_overdamped(
    time: np.ndarray,
    share: np.ndarray,
    times: np.ndarray,
    heights: np.ndarray,
    settle: list[float | None],
) -> FreeResponse:
    """A response that turns once at most; one that has not come to rest may yet swing."""
    turned = len(times) == 1
    if settle[turned] is None or (turned and abs(share[-1]) > 0.05):
        where = (
            ", before the trough that follows the first opposite peak. Record longer."
            if turned
            else " without having turned. Record longer, or check that time is in ms and rest is"
            " right."
        )
        raise InvalidInput(
            f"the trace ({time[-1] - time[0]:g} ms) is too short to hold one cycle: it ends at"
            f" {share[-1]:.0%} of its first deflection{where}"
        )
    peak = {"peak_time": float(times[0] - time[0]), "peak": float(heights[0])} if turned else {}
    return FreeResponse(overdamped=True, settle_10=settle[0], settle_5=settle[1], **peak)


def _settle_time(time: np.ndarray, share: np.ndarray, level: float) -> float | None:
    outside = np.flatnonzero(np.abs(share) > level)
    last = outside[-1]
    if last == len(share) - 1:
        return None
    inside = np.sign(share[last]) * level
    part = (share[last] - inside) / (share[last] - share[last + 1])
    return float(time[last] + part * (time[last + 1] - time[last]) - time[0])


# Strain at the surface: what a sensor on a side of the antenna feels.


@checked
def compute_strain(
    touches: xr.Dataset,
    antenna: Antenna,
    around: float | Sequence[float] = 0.0,
    *,
    turn: float = 0.0,
) -> xr.DataArray:
    """Strain at the surface of each sensor's segment, positive where it is stretched.

    ε = −r (κ_x cos φ + κ_z sin φ) for curvature κ [1/mm], the antenna's radius r [mm] and a side at
    φ: what bends towards a side is compressed there (Euler and Bernoulli). Campaniform sensilla sit
    on sides, and answer to compression.

    Parameters
    ----------
    touches
        A Dataset with ``curvature``, in the plane or in space.
    antenna
        The antenna that was touched; its ``radius`` is the distance of the surface from the axis.
    around
        Where the sides lie: φ [degrees], 0 towards x and 90 towards z, in the segment's frame.
    turn
        How much farther around each sensor sits than the one before it [degrees].

    Returns
    -------
    xarray.DataArray
        ``strain`` [1] (trial, side, sensor, time), with the coordinate ``around`` (side) [deg].

    Raises
    ------
    InvalidInput
        Sensors that the antenna has not.
    """
    require_variables(touches, "segment", "curvature")
    segment = touches["segment"].values
    if segment.max() > antenna.n_segments:
        raise InvalidInput(
            f"the touches have a sensor on segment {segment.max()}, but {antenna.name!r} has"
            f" {antenna.n_segments}: give the antenna that was touched."
        )
    radius = xr.DataArray(antenna.radius[segment - 1], dims="sensor")
    found = -radius * project_planes(in_unit(touches["curvature"], "1/mm"), around, turn)
    found = found.transpose("trial", "side", "sensor", "time").rename("strain")
    found["around"].attrs = {
        "units": "deg",
        "long_name": "where the side lies, from x towards z",
    }
    return found.assign_attrs(
        units="1", long_name="strain at the surface, positive if stretched"
    )
