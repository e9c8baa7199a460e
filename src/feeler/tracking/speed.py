"""Angular speed of an antenna: gaps, zero-phase low-pass, derivative, peaks."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, filtfilt, find_peaks

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tracking.angle import find_runs
from feeler.tracking.spectrum import MIN_FRAMES, MotionSpectrum

_ORDER = 2  # [P] second-order Butterworth
# [C] kHz (6 Hz), our reading of the paper's measure of a cockroach, whose cut-off it does not
# state. It takes three quarters of a motion at 8 Hz.
CUTOFF = 6e-3
MAX_GAP = 5  # [C] frames that are bridged
_MAX_CYCLE = 0.25  # [C] of a cycle: peaks within a longer bridged gap are not measured
_AT_ENDS = 0.5  # [C] periods of the cut-off: peaks nearer to a stretch's ends are not counted
_FINE = 8  # times between frames at which peaks of the speed are looked for
_MIN_NOISES = 3.0  # [C] sd of the speed's noise by which a peak rises at least
MIN_PROMINENCE = (
    np.deg2rad(10.0) * 1e-3
)  # [C] rad/ms (10 °/s); smaller wiggles are tracking noise, not a sweep


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweeps:
    """Angular motion of one antenna: arrays (frame,) and the peaks of the absolute speed.

    Attributes
    ----------
    angle : np.ndarray
        Filtered angle [rad].
    speed : np.ndarray
        Angular speed, signed [rad/ms].
    peak_time : np.ndarray
        Time (peak,) [ms], between frames.
    peak_speed : np.ndarray
        Absolute speed (peak,) [rad/ms].
    is_bridged : np.ndarray
        Whether a frame was missing and bridged.
    missing : int
        Frames left without a value.
    noise : float
        sd of one speed that comes from tracking noise [rad/ms].
    cutoff : float
        Of the low-pass [kHz].
    lost : tuple[float, float]
        Share of the speed's rms that the low-pass takes away, and the frequency [kHz] at which it
        takes most.
    frequency : float
        Mean frequency of the speed's spectrum [kHz].
    unmeasured : int
        Peaks left out of ``peak_speed`` because they lie in a bridged gap that is long beside the
        motion's period.
    """

    angle: np.ndarray
    speed: np.ndarray
    peak_time: np.ndarray
    peak_speed: np.ndarray
    is_bridged: np.ndarray
    missing: int
    noise: float
    cutoff: float
    lost: tuple[float, float]
    frequency: float
    unmeasured: int = 0

    @property
    def bridged(self) -> int:
        """Number of frames that were missing and bridged."""
        return int(self.is_bridged.sum())

    @property
    def error(self) -> float:
        """One standard error of ``mean_peak`` [rad/ms], its upward bias by tracking noise included;
        NaN with fewer than two peaks, which have no spread.
        """
        n = self.peak_speed.size
        if n < 2:
            return float("nan")
        return float(np.hypot(self.peak_speed.std(ddof=1) / np.sqrt(n), self.noise))

    @property
    def mean_peak(self) -> float:
        """Average maximum angular speed [rad/ms]; NaN without a peak."""
        return float(self.peak_speed.mean()) if self.peak_speed.size else float("nan")


def bridge_gaps(angle: np.ndarray, max_gap: int) -> tuple[np.ndarray, int]:
    """Angle (frame,) in which gaps of at most ``max_gap`` frames are filled by a cubic spline
    through the measured frames, and the number of frames filled.

    A straight line would take the speed's peak out of a gap: in the middle of a sweep at 1/6 of
    the frame rate, 16 % of it with a single frame.
    """
    if max_gap < 0:
        raise InvalidInput(f"max_gap must be ≥ 0 frames, got {max_gap}. 0 bridges nothing.")
    filled = np.array(angle, dtype=float)
    is_bridged = np.zeros(filled.shape, dtype=bool)
    runs = find_runs(filled)
    for before, after in pairwise(runs):
        if after.start - before.stop <= max_gap:
            # the gap may hide the wrap at ±π
            turn = np.round((filled[after.start] - filled[before.stop - 1]) / (2 * np.pi))
            filled[after.start :] -= turn * 2 * np.pi
            is_bridged[before.stop : after.start] = True
    for run in find_runs(np.where(is_bridged, 0.0, filled)):
        gap, values = is_bridged[run], filled[run]
        if gap.any():
            known = np.flatnonzero(~gap)
            spline = make_interp_spline(known, values[known], k=min(3, known.size - 1))
            values[gap] = spline(np.flatnonzero(gap))
    return filled, int(is_bridged.sum())


def smooth(
    angle: np.ndarray, interval: float, *, cutoff: float = CUTOFF, order: int = _ORDER
) -> np.ndarray:
    """Zero-phase Butterworth low-pass (frame,) of each stretch without NaN.

    The filter runs forwards and backwards: no delay, and at ``cutoff`` [kHz] the gain is 1/2
    instead of 1/√2. Stretches too short to filter (under 10 frames) become NaN.
    """
    nyquist = 0.5 / interval
    if not 0 < cutoff < nyquist:
        raise InvalidInput(
            f"cutoff must lie between 0 and half the frame rate, {nyquist * 1e3:.4g} Hz; got"
            f" {cutoff * 1e3:.4g} Hz. Lower the cutoff."
        )
    b, a = butter(order, cutoff / nyquist)
    padding = MIN_FRAMES - 1
    smoothed = np.full(np.shape(angle), np.nan)
    for run in find_runs(angle):
        if run.stop - run.start > padding:
            smoothed[run] = filtfilt(b, a, angle[run], padlen=padding)
    return smoothed


def differentiate(angle: np.ndarray, interval: float) -> np.ndarray:
    """Derivative (frame,) [rad/ms] of the quintic spline through each stretch without NaN.

    Its error is 0.1 % at 6 frames a cycle, where that of five-point differences is 3 %.
    """
    speed = np.full(np.shape(angle), np.nan)
    for run in find_runs(angle):
        if run.stop - run.start >= 3:
            speed[run] = _differentiate(angle[run])(np.arange(run.stop - run.start)) / interval
    return speed


def _differentiate(values: np.ndarray) -> Any:
    """Derivative of the spline through values (frame,), a function of the frame."""
    order = min(5, values.size - 1)
    return make_interp_spline(np.arange(values.size), values, k=order).derivative()


@checked
def find_sweeps(
    angle: Annotated[np.ndarray, "time"],
    interval: float,
    *,
    cutoff: float | str = "auto",
    max_gap: int = MAX_GAP,
    min_prominence: float = MIN_PROMINENCE,
) -> Sweeps:
    """Filter an angle (frame,) [rad], differentiate it and find every peak of its absolute speed.

    Parameters
    ----------
    angle, interval
        NaN where it is not known; time between frames [ms].
    cutoff
        Of the low-pass [kHz]; ``auto``: chosen from the angle's spectrum
        (:class:`~feeler.tracking.spectrum.MotionSpectrum`); ``paper``: 6 Hz.
    max_gap
        Longest gap that is bridged by a cubic spline [frames]. A peak in a bridged gap of more
        than a quarter of the motion's period is not counted.
    min_prominence
        Least prominence of a peak [rad/ms], and at least three sd of the speed's noise.

    Returns
    -------
    Sweeps
        Peaks within half a period of the cut-off from the ends of a stretch are not counted: noise
        makes false ones there. A peak lies between frames, on the spline through the filtered
        angle.

    Raises
    ------
    InvalidInput
        A cut-off that is none of these or not below half the frame rate, or another option out of
        range.
    """
    if not min_prominence >= 0:
        raise InvalidInput(f"min_prominence must be ≥ 0 rad/ms, got {min_prominence}.")
    filled, _ = bridge_gaps(np.asarray(angle, dtype=float), max_gap)
    is_bridged = np.isfinite(filled) & np.isnan(angle)
    spectrum = MotionSpectrum([filled[run] for run in find_runs(filled)], interval)
    cutoff = _read_cutoff(cutoff, spectrum)
    smoothed = smooth(filled, interval, cutoff=cutoff)
    noise = _measure_noise(spectrum.noise, interval, cutoff)
    least = max(min_prominence, _MIN_NOISES * noise, np.finfo(float).tiny)
    times, peaks = [], []
    for run in find_runs(smoothed):
        place, height = _find_peaks(smoothed[run], interval, least)
        # nearer to an end than half a period of the cut-off, the filter has one side alone
        inner = (
            np.minimum(place, run.stop - 1 - run.start - place) * interval * cutoff > _AT_ENDS
        )
        times.append((run.start + place[inner]) * interval)
        peaks.append(height[inner])
    time, peak = np.concatenate([[], *times]), np.concatenate([[], *peaks])
    measured = ~_find_long(is_bridged, interval, spectrum.frequency)[
        np.round(time / interval).astype(int)
    ]
    return Sweeps(
        angle=smoothed,
        speed=differentiate(smoothed, interval),
        peak_time=time[measured],
        peak_speed=peak[measured],
        is_bridged=is_bridged & np.isfinite(smoothed),
        missing=int(np.isnan(smoothed).sum()),
        noise=noise,
        cutoff=cutoff,
        lost=spectrum.find_loss(cutoff),
        frequency=spectrum.frequency,
        unmeasured=int((~measured).sum()),
    )


def _read_cutoff(cutoff: float | str, spectrum: MotionSpectrum) -> float:
    """The cut-off [kHz] that a number or word stands for."""
    if isinstance(cutoff, str):
        known = {"auto": spectrum.best_cutoff, "paper": CUTOFF}
        if cutoff not in known:
            raise InvalidInput(
                f"cutoff= must be auto (chosen from the spectrum), paper (6 Hz) or a number, got"
                f" {cutoff!r}."
            )
        return known[cutoff]
    return cutoff


def _find_peaks(
    smoothed: np.ndarray, interval: float, prominence: float
) -> tuple[np.ndarray, np.ndarray]:
    """Frame (peak,) and height (peak,) [rad/ms] of the peaks of the absolute speed of one stretch
    of angles.
    """
    place = np.linspace(0, smoothed.size - 1, (smoothed.size - 1) * _FINE + 1)
    speed = np.abs(_differentiate(smoothed)(place)) / interval
    index = find_peaks(speed, prominence=prominence)[0]
    refined = [_refine(speed[k - 1 : k + 2]) for k in index]
    return (
        np.array([(k + shift) / _FINE for k, (shift, _) in zip(index, refined, strict=True)]),
        np.array([top for _, top in refined]),
    )


def _find_long(is_bridged: np.ndarray, interval: float, frequency: float) -> np.ndarray:
    """Whether a frame (frame,) lies in a bridged gap that is long beside the motion's period."""
    long = np.zeros(is_bridged.shape, dtype=bool)
    for gap in find_runs(np.where(is_bridged, 0.0, np.nan)):
        if (gap.stop - gap.start + 1) * interval * frequency > _MAX_CYCLE:
            long[gap] = True
    return long


def _measure_noise(noise: float, interval: float, cutoff: float) -> float:
    """sd of the speed [rad/ms] that white noise of the angle, of this sd [rad], leaves behind
    filter and derivative.
    """
    half = max(200, round(5 / (cutoff * interval)))
    pulse = np.zeros(2 * half + 1)
    pulse[half] = noise
    return float(
        np.linalg.norm(differentiate(smooth(pulse, interval, cutoff=cutoff), interval))
    )


def _refine(three: np.ndarray) -> tuple[float, float]:
    """Place (samples) and height of the vertex of the parabola through three samples around a
    maximum.
    """
    left, middle, right = three
    bend = left - 2 * middle + right
    if bend >= 0:
        return 0.0, float(middle)
    shift = 0.5 * (left - right) / bend
    return float(shift), float(middle - 0.25 * (left - right) * shift)
