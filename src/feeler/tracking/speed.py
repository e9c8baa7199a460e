"""Angular speed of an antenna: gaps, zero-phase low-pass, derivative, peaks."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

import numpy as np
from scipy.signal import butter, filtfilt, find_peaks

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tracking.angle import find_runs

_ORDER = 2  # [P] second-order Butterworth
CUTOFF = 6e-3  # [C] kHz (6 Hz); the paper does not state it
# [C] frames bridged by a straight line in the paper's measure; elsewhere none is unless asked for
MAX_GAP = 5
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
    bridged : int
        Frames that were missing and bridged by a straight line.
    missing : int
        Frames left without a value.
    noise : float
        sd of one speed that comes from tracking noise [rad/ms], from what the low-pass took away.
    """

    angle: np.ndarray
    speed: np.ndarray
    peak_time: np.ndarray
    peak_speed: np.ndarray
    bridged: int
    missing: int

    noise: float

    @property
    def error(self) -> float:
        """One standard error of ``mean_peak`` [rad/ms], its upward bias by tracking noise included;
        NaN without a peak.
        """
        n = self.peak_speed.size
        spread = self.peak_speed.std(ddof=1) / np.sqrt(n) if n > 1 else 0.0
        return float(np.hypot(spread, self.noise)) if n else float("nan")

    @property
    def mean_peak(self) -> float:
        """Average maximum angular speed [rad/ms]; NaN without a peak."""
        return float(self.peak_speed.mean()) if self.peak_speed.size else float("nan")


def bridge_gaps(angle: np.ndarray, max_gap: int) -> tuple[np.ndarray, int]:
    """Straight lines over gaps of at most ``max_gap`` frames between measured ones; the number of
    frames bridged.
    """
    if max_gap < 0:
        raise InvalidInput(f"max_gap must be ≥ 0 frames, got {max_gap}. 0 bridges nothing.")
    filled = np.array(angle, dtype=float)
    runs = find_runs(filled)
    bridged = 0
    for before, after in pairwise(runs):
        gap = after.start - before.stop
        if gap <= max_gap:
            ends = filled[before.stop - 1], filled[after.start]
            turn = (
                np.round((ends[1] - ends[0]) / (2 * np.pi)) * 2 * np.pi
            )  # the gap may hide the wrap at ±π
            filled[after.start :] -= turn
            filled[before.stop : after.start] = np.linspace(ends[0], ends[1] - turn, gap + 2)[
                1:-1
            ]
            bridged += gap
    return filled, bridged


def smooth(
    angle: np.ndarray, interval: float, *, cutoff: float = CUTOFF, order: int = _ORDER
) -> np.ndarray:
    """Zero-phase Butterworth low-pass (frame,) of each stretch without NaN.

    The filter runs forwards and backwards: no delay, and at ``cutoff`` [kHz] the gain is 1/2
    instead of 1/√2. Stretches too short to filter (under 3 (order + 1) + 1 frames) become NaN.
    """
    nyquist = 0.5 / interval
    if not 0 < cutoff < nyquist:
        raise InvalidInput(
            f"cutoff must lie between 0 and half the frame rate, {nyquist * 1e3:.4g} Hz; got"
            f" {cutoff * 1e3:.4g} Hz. Lower the cutoff."
        )
    b, a = butter(order, cutoff / nyquist)
    padding = 3 * (order + 1)
    smoothed = np.full(np.shape(angle), np.nan)
    for run in find_runs(angle):
        if run.stop - run.start > padding:
            smoothed[run] = filtfilt(b, a, angle[run], padlen=padding)
    return smoothed


def differentiate(angle: np.ndarray, interval: float) -> np.ndarray:
    """Derivative (frame,) [rad/ms]: five-point central differences, three-point at the two frames
    of each end.
    """
    speed = np.full(np.shape(angle), np.nan)
    for run in find_runs(angle):
        values = angle[run]
        if values.size < 3:
            continue
        slope = np.gradient(values, interval, edge_order=2)
        if values.size >= 5:
            slope[2:-2] = (values[:-4] - 8 * values[1:-3] + 8 * values[3:-1] - values[4:]) / (
                12 * interval
            )
        speed[run] = slope
    return speed


@checked
def find_sweeps(
    angle: Annotated[np.ndarray, "time"],
    interval: float,
    *,
    cutoff: float = CUTOFF,
    max_gap: int = 0,
    min_prominence: float = MIN_PROMINENCE,
) -> Sweeps:
    """Filter an angle (frame,) [rad], differentiate it and find every peak of its absolute speed.

    A peak is placed between frames by the parabola through its three highest samples.
    """
    if not min_prominence >= 0:
        raise InvalidInput(f"min_prominence must be ≥ 0 rad/ms, got {min_prominence}.")
    filled, bridged = bridge_gaps(np.asarray(angle, dtype=float), max_gap)
    smoothed = smooth(filled, interval, cutoff=cutoff)
    speed = differentiate(smoothed, interval)
    times, peaks = [], []
    for run in find_runs(speed):
        absolute = np.abs(speed[run])
        for index in find_peaks(absolute, prominence=max(min_prominence, np.finfo(float).tiny))[
            0
        ]:
            shift, top = _refine(absolute[index - 1 : index + 2])
            times.append((run.start + index + shift) * interval)
            peaks.append(top)
    return Sweeps(
        angle=smoothed,
        speed=speed,
        peak_time=np.array(times),
        peak_speed=np.array(peaks),
        bridged=bridged,
        missing=int(np.isnan(smoothed).sum()),
        noise=_measure_noise(filled - smoothed, interval, cutoff),
    )


def _measure_noise(rest: np.ndarray, interval: float, cutoff: float) -> float:
    """sd of the speed [rad/ms] that white noise in the angle leaves behind filter and derivative; 0
    without frames.

    ``rest`` (frame,) is what the filter took away. The noise's sd follows from the filter's
    response to one pulse. The median stands for the sd, because a bridged gap or a slip of the
    tracker is no noise.
    """
    pulse = np.zeros(401)
    pulse[200] = 1.0
    answer = smooth(pulse, interval, cutoff=cutoff)
    away = np.abs(rest[np.isfinite(rest)])
    sd = np.median(away) / 0.6745 / np.linalg.norm(pulse - answer) if away.size else 0.0
    return float(sd * np.linalg.norm(differentiate(answer, interval)))


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
