"""Antennal angles, speed and exploration from tracks."""

import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any, ClassVar

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.signal import butter, filtfilt, find_peaks, periodogram

from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.records import Choice, Ge, Gt, Shown, Unit
from feeler.tracking.quality import STRAY, _find_doubts, leave_out_errors
from feeler.tracking.tracks import Tracks
from feeler.validation import checked

# Antennal angles from landmarks: between the antenna and the body, in every frame.

SIDES = ("left", "right")


@checked
def compute_antenna_angle(
    tracks: Tracks,
    *,
    tips: tuple[str, str] = ("left_tip", "right_tip"),
    head: str = "head",
    abdomen: str = "abdomen",
    bases: tuple[str, str] | None = None,
) -> np.ndarray:
    """Angle (side, frame) [rad] between the body (abdomen to head) and each antenna (its base to
    its tip).

    Without ``bases``, landmarks on the antennae's bases, they are taken to sit at the head, as in
    the paper. That is wrong by about the distance from head to base over the antenna's length: a
    speed of 204 °/s reads 190 °/s at 18 of 240 px.

    A side whose tip is called ``""`` is left out: NaN in every frame.

    0 is straight ahead and positive is away from the midline on both sides, so that the body's own
    walking and turning drop out; in space the angle has no sign and lies in [0, π]. NaN wherever
    one of the three landmarks is missing or two of them
    coincide. Angles are unwrapped within each stretch without NaN (Supplementary Methods, antenna
    slow exploration speed).
    """
    body = tracks.of(head) - tracks.of(abdomen)
    angles = []
    for tip, base, outward in zip(tips, bases or (head, head), (1.0, -1.0), strict=True):
        if not tip:
            angles.append(np.full(tracks.n_frames, np.nan))
            continue
        angles.append(_measure_angle(body, tracks.of(tip) - tracks.of(base or head), outward))
    angle = np.stack(angles)
    if not np.isfinite(angle).any():
        raise InvalidInput(
            "no frame holds head, abdomen and an antenna tip together: there is no angle to"
            " measure."
        )
    return angle


def _measure_angle(reference: np.ndarray, vector: np.ndarray, outward: float) -> np.ndarray:
    """Angle (frame,) from reference to vector: in a plane anticlockwise times ``outward``,
    unwrapped between gaps; in space without a sign.
    """
    dot = np.sum(reference * vector, axis=1)
    if reference.shape[1] == 3:
        cross = np.linalg.norm(np.cross(reference, vector), axis=1)
    else:
        cross = outward * (reference[:, 0] * vector[:, 1] - reference[:, 1] * vector[:, 0])
    angle = np.where((cross == 0) & (dot == 0), np.nan, np.arctan2(cross, dot))
    for run in _find_runs(angle):
        angle[run] = np.unwrap(angle[run])
    return angle


def _find_runs(values: np.ndarray) -> list[slice]:
    """Stretches of finite values (frame,), in order."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], np.isfinite(values), [0]))))
    return [
        slice(int(start), int(stop))
        for start, stop in zip(edges[::2], edges[1::2], strict=True)
    ]


# Spectrum of an angle: how fast the motion is, and which low-pass keeps it and removes noise.

MIN_FRAMES = 10  # frames of the shortest stretch that is filtered
_N_CANDIDATES = 100
_HIGHEST = (
    0.48  # [C] highest cut-off, as a share of the frame rate (1/2 is the Nyquist frequency)
)
_ABOVE = 4.0  # [C] highest cut-off over the highest frequency of the motion
_OCTAVES = 1 / 3  # [C] width of the bands in which the motion is told from the noise
_OVER = 2.0  # [C] times the noise's power that a band with motion has on top of it
_CHANCE = 6.0  # [C] sd by which a band with motion is louder than noise would be by chance
_MOTION = 1.5  # [C] the motion lies below this multiple of the best cut-off


class _MotionSpectrum:
    """Power spectrum of an angle, as motion plus white noise of the tracker.

    The noise density N is the median over the upper half of the frequencies, where a camera that
    is fast enough sees no motion. The best cut-off minimises Stein's unbiased estimate of the
    squared error of the angular speed, Σ (2πf)² [(1 − G)² P + (2 G − 1) N], with P the periodogram
    and G the gain of the filter: what the filter takes from the motion, and what it leaves of the
    noise (Stein 1981, Ann Stat 9:1135). It is at most four times the highest frequency at which
    the motion stands out of the noise, because noise that is not quite white would raise it.

    Attributes
    ----------
    noise : float
        sd of the angle that comes from the tracker [rad].
    best_cutoff : float
        [kHz]
    frequency : float
        Mean frequency of the speed's spectrum [kHz]; NaN where there is no motion above the noise.
    """

    def __init__(self, stretches: list[np.ndarray], interval: float, rise: float = 1.0) -> None:
        """``stretches`` of finite angles (frame,) [rad], ``interval`` between frames [ms]; ``rise``
        of the noise's density from the upper half of the frequencies to the lower one.
        """
        self._interval = interval
        pieces, spectra = _list_spectra(stretches, interval)
        highest = _HIGHEST / interval
        self.noise, self.best_cutoff, self.frequency = 0.0, highest, float("nan")
        self._f = self._weight = self._power = np.zeros(0)
        if not pieces:
            return
        frequency = self._f = np.concatenate([f for f, _ in spectra])
        self._power = np.concatenate([power for _, power in spectra])
        # a density becomes a variance by the width of a bin; long stretches count more
        self._weight = (2 * np.pi * frequency) ** 2 * np.concatenate(
            [
                np.full(f.size, piece.size * f[0])
                for (f, _), piece in zip(spectra, pieces, strict=True)
            ]
        )
        upper = self._power[frequency > 0.25 / interval]
        density = rise * float(np.median(upper) / np.log(2))
        self.noise = float(np.sqrt(0.5 * density / interval))
        lowest = min(3 / (interval * max(piece.size for piece in pieces)), 0.5 * highest)
        highest = max(lowest, min(highest, _ABOVE * _find_edge(spectra, density)))
        candidates = np.geomspace(lowest, highest, _N_CANDIDATES)[::-1]
        error = [
            np.sum(self._weight * ((1 - gain) ** 2 * self._power + (2 * gain - 1) * density))
            for gain in map(self._compute_gain, candidates)
        ]
        self.best_cutoff = float(candidates[np.argmin(error)])
        self._motion = np.where(
            frequency < _MOTION * self.best_cutoff, self._weight * (self._power - density), 0.0
        )
        if (total := self._motion.sum()) > 0:
            self.frequency = float(np.clip(self._motion @ frequency / total, 0, 0.5 / interval))

    def _compute_gain(self, cutoff: float) -> np.ndarray:
        """Gain of :func:`feeler.tracking.kinematics.smooth` at the spectrum's frequencies."""
        warp = np.tan(np.pi * self._f * self._interval) / np.tan(
            np.pi * cutoff * self._interval
        )
        return 1 / (1 + warp**4)

    def find_loss(self, cutoff: float) -> tuple[float, float]:
        """Share of the speed's rms that a low-pass takes from the motion, and the frequency [kHz]
        at which it takes most.
        """
        if not np.isfinite(self.frequency):
            return 0.0, float("nan")
        gain = self._compute_gain(cutoff)
        kept = np.clip((gain**2 @ self._motion) / self._motion.sum(), 0, 1)
        return float(1 - np.sqrt(kept)), float(self._f[np.argmax((1 - gain**2) * self._motion)])


def _list_spectra(
    stretches: list[np.ndarray], interval: float
) -> tuple[list[np.ndarray], list[list[np.ndarray]]]:
    """The stretches that are long enough, and frequencies and power of each."""
    pieces = [piece for piece in stretches if piece.size >= MIN_FRAMES]
    found = [periodogram(piece, 1 / interval, "hann", detrend="linear") for piece in pieces]
    return pieces, [[values[1:-1] for values in pair] for pair in found]


def _find_rise(is_bridged: np.ndarray, runs: list[slice], max_gap: int) -> float:
    """Density of white noise at the lower half of the frequencies over that at the upper half,
    after these frames (frame,) of it were bridged: by made-up noise.
    """
    white = np.random.default_rng(0).normal(0.0, 1e-3, is_bridged.size)
    filled = _bridge_gaps(np.where(is_bridged, np.nan, white), max_gap)[0]
    _, spectra = _list_spectra([filled[run] for run in runs], 1.0)
    if not (is_bridged.any() and spectra):
        return 1.0
    frequency, power = (np.concatenate(part) for part in zip(*spectra, strict=True))
    upper = frequency > 0.25
    return float(np.median(power[~upper]) / np.median(power[upper]))


def _find_edge(spectra: list[list[np.ndarray]], density: float) -> float:
    """Highest frequency [kHz] of a band with motion; 0 without one."""
    frequency = np.concatenate([f for f, _ in spectra])
    power = np.concatenate([p for _, p in spectra])
    band = np.floor(np.log2(frequency / frequency.min()) / _OCTAVES).astype(int)
    count = np.bincount(band)
    mean = np.bincount(band, power) / np.maximum(count, 1)
    least = 1 + np.maximum(_OVER, _CHANCE / np.sqrt(np.maximum(count, 1)))
    loud = np.flatnonzero(mean > least * density)
    return float(frequency[band == loud[-1]].max()) if loud.size else 0.0


# Angular speed of an antenna: gaps, zero-phase low-pass, derivative, peaks.

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
    interval : float
        Between frames [ms].
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
    interval: float = float("nan")

    @property
    def time(self) -> np.ndarray:
        """Time (frame,) [ms]."""
        return np.arange(self.angle.size) * self.interval

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


def _bridge_gaps(angle: np.ndarray, max_gap: int) -> tuple[np.ndarray, int]:
    """Angle (frame,) in which gaps of at most ``max_gap`` frames are filled by a cubic spline
    through the measured frames, and the number of frames filled.

    A straight line would take the speed's peak out of a gap: in the middle of a sweep at 1/6 of
    the frame rate, 16 % of it with a single frame.
    """
    filled = np.array(angle, dtype=float)
    is_bridged = np.zeros(filled.shape, dtype=bool)
    runs = _find_runs(filled)
    for before, after in pairwise(runs):
        if after.start - before.stop <= max_gap:
            # the gap may hide the wrap at ±π
            turn = np.round((filled[after.start] - filled[before.stop - 1]) / (2 * np.pi))
            filled[after.start :] -= turn * 2 * np.pi
            is_bridged[before.stop : after.start] = True
    for run in _find_runs(np.where(is_bridged, 0.0, filled)):
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
    for run in _find_runs(angle):
        if run.stop - run.start > padding:
            smoothed[run] = filtfilt(b, a, angle[run], padlen=padding)
    return smoothed


def _differentiate(angle: np.ndarray, interval: float) -> np.ndarray:
    """Derivative (frame,) [rad/ms] of the quintic spline through each stretch without NaN.

    Its error is 0.1 % at 6 frames a cycle, where that of five-point differences is 3 %.
    """
    speed = np.full(np.shape(angle), np.nan)
    for run in _find_runs(angle):
        if run.stop - run.start >= 3:
            speed[run] = (
                _make_derivative(angle[run])(np.arange(run.stop - run.start)) / interval
            )
    return speed


def _make_derivative(values: np.ndarray) -> Any:
    """Derivative of the spline through values (frame,), a function of the frame."""
    order = min(5, values.size - 1)
    return make_interp_spline(np.arange(values.size), values, k=order).derivative()


@checked
def find_sweeps(
    angle: Annotated[np.ndarray, "time"],
    interval: float,
    *,
    cutoff: float | str = "auto",
    max_gap: Annotated[int, Ge(0)] = MAX_GAP,
    min_prominence: Annotated[float, Ge(0), Unit("rad/ms")] = MIN_PROMINENCE,
) -> Sweeps:
    """Filter an angle (frame,) [rad], _differentiate it and find every peak of its absolute speed.

    Parameters
    ----------
    angle, interval
        NaN where it is not known; time between frames [ms].
    cutoff
        Of the low-pass [kHz]; ``auto``: chosen from the angle's spectrum
        (:class:`~feeler.tracking.kinematics._MotionSpectrum`); ``paper``: 6 Hz.
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
    filled, _ = _bridge_gaps(np.asarray(angle, dtype=float), max_gap)
    is_bridged = np.isfinite(filled) & np.isnan(angle)
    runs = _find_runs(filled)
    rise = _find_rise(is_bridged, runs, max_gap)
    spectrum = _MotionSpectrum([filled[run] for run in runs], interval, rise)
    cutoff = _read_cutoff(cutoff, spectrum)
    smoothed = smooth(filled, interval, cutoff=cutoff)
    # sd of the speed [rad/ms] that white noise of the angle, of this sd [rad], leaves
    # behind filter and derivative.
    half = max(200, round(5 / (cutoff * interval)))
    pulse = np.zeros(2 * half + 1)
    pulse[half] = spectrum.noise
    noise = float(
        np.linalg.norm(_differentiate(smooth(pulse, interval, cutoff=cutoff), interval))
    )
    least = max(min_prominence, _MIN_NOISES * noise, np.finfo(float).tiny)
    times, peaks = [], []
    for run in _find_runs(smoothed):
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
        speed=_differentiate(smoothed, interval),
        peak_time=time[measured],
        peak_speed=peak[measured],
        is_bridged=is_bridged & np.isfinite(smoothed),
        missing=int(np.isnan(smoothed).sum()),
        noise=noise,
        cutoff=cutoff,
        lost=spectrum.find_loss(cutoff),
        frequency=spectrum.frequency,
        unmeasured=int((~measured).sum()),
        interval=interval,
    )


def _read_cutoff(cutoff: float | str, spectrum: _MotionSpectrum) -> float:
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
    speed = np.abs(_make_derivative(smoothed)(place)) / interval
    index = find_peaks(speed, prominence=prominence)[0]
    refined = [_refine(speed[k - 1 : k + 2]) for k in index]
    return (
        np.array([(k + shift) / _FINE for k, (shift, _) in zip(index, refined, strict=True)]),
        np.array([top for _, top in refined]),
    )


def _find_long(is_bridged: np.ndarray, interval: float, frequency: float) -> np.ndarray:
    """Whether a frame (frame,) lies in a bridged gap that is long beside the motion's period."""
    long = np.zeros(is_bridged.shape, dtype=bool)
    for gap in _find_runs(np.where(is_bridged, 0.0, np.nan)):
        if (gap.stop - gap.start + 1) * interval * frequency > _MAX_CYCLE:
            long[gap] = True
    return long


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


# The speed of active touch: from tracked trials to the average maximum angular speed.

_MAX_LOSS = 0.05  # [C] of the speed that a chosen low-pass may take away without a remark
_MANY_BRIDGED = (
    0.3  # [C] share of bridged frames, from which on speeds are off by more than 5 %
)
_MIN_FRAMES = 3.0  # [C] frames in a cycle, below which peak speeds come out too low
_MANY = 0.06  # [C] share of stray places from which the rest is not trusted either
_MAX_MISSING = 0.2  # [C] of an antenna's frames, beyond which no mean over trials is given
_LONGEST = 1000.0  # [C] ms for which a landmark of the body may be lost
_SHIFT = 0.1  # [C] of the body's length, by which it may have moved meanwhile


@dataclass(frozen=True, kw_only=True, eq=False)
class Exploration(Shown):
    """Average maximum angular speeds of several trials.

    Attributes
    ----------
    mean_peak : np.ndarray
        (trial, side) [rad/ms]; NaN where a side made no sweep.
    n_peaks : np.ndarray
        (trial, side).
    sweeps : tuple[tuple[Sweeps, Sweeps], ...]
        Motion of (left, right) in each trial.
    length : float | None
        Antenna length [mm], where it was given.
    error : np.ndarray
        (trial, side) one standard error of ``mean_peak`` [rad/ms]: the peaks' spread over √n, and
        the noise of one speed, by about which a peak, the largest of several noisy values, comes
        out too high; NaN with fewer than two peaks.
    source : str
        ``tracked``, or ``synthetic`` if any trial is made up.
    left_out : tuple[dict[str, int], ...]
        Per trial: what is wrong with places that were left out → in how many frames.
    remarks : tuple[tuple[str, ...], ...]
        Per trial: what makes its numbers invalid or is to be asked about.
    missing : np.ndarray
        (trial, side) share of frames without an angle; NaN of a side that was not asked for.
    """

    DRAWN: ClassVar[str] = "draw_exploration"

    mean_peak: np.ndarray
    n_peaks: np.ndarray
    sweeps: tuple[tuple[Sweeps, Sweeps], ...]
    length: float | None
    error: np.ndarray
    source: str
    left_out: tuple[dict[str, int], ...]
    remarks: tuple[tuple[str, ...], ...]
    missing: np.ndarray

    @property
    def mean(self) -> float:
        """Average over trials and sides [rad/ms]; NaN where more than a fifth of an antenna's
        frames are missing, because it would be an average over the frames that are easy to track.
        """
        return float("nan") if self.too_few.any() else float(np.nanmean(self.mean_peak))

    @property
    def too_few(self) -> np.ndarray:
        """Trials (trial,) in which more than a fifth of an antenna's frames are missing: they count
        in no mean.
        """
        return np.nanmax(self.missing, axis=1) > _MAX_MISSING

    @property
    def lateral_speed(self) -> float:
        """Equivalent lateral speed of the tip, mean · length [mm/ms = m/s]; NaN without a
        length.
        """
        return self.mean * (float("nan") if self.length is None else self.length)


@checked
def measure_exploration(
    trials: Sequence[Tracks],
    *,
    length: Annotated[float, Gt(0), Unit("mm")] | None = None,
    cutoff: float | str = "auto",
    max_gap: Annotated[int, Ge(0)] = MAX_GAP,
    min_prominence: Annotated[float, Ge(0), Unit("rad/ms")] = MIN_PROMINENCE,
    landmarks: Mapping[str, Any] | None = None,
    outliers: Annotated[str, Choice(("remove", "keep"))] = "remove",
) -> Exploration:
    """Average maximum angular speed per trial and side, and the lateral speed that it amounts to.

    Per trial and side: places that cannot be are left out, short gaps bridged; angle between
    antenna and body, second-order zero-phase Butterworth low-pass, derivative, peaks of the
    absolute speed, their mean (Supplementary Methods, antenna slow exploration speed).

    Parameters
    ----------
    trials
        Tracks with the landmarks left_tip, right_tip, head, abdomen.
    length
        Antenna length [mm], for the lateral speed.
    cutoff, max_gap, min_prominence
        As :func:`find_sweeps` takes them: low-pass [kHz], ``auto`` or ``paper``; longest gap
        bridged [frames]; least prominence of a peak [rad/ms]. None is stated in the paper. A
        landmark of the body that comes back within 1 s and within a tenth of the body's length
        is bridged by a straight line, however many frames that are.
    landmarks
        What the landmarks are called, as for :func:`compute_antenna_angle`: ``tips``, ``bases``,
        ``head``, ``abdomen``.
    outliers
        ``remove`` leaves out what :func:`~feeler.tracking.quality.leave_out_errors` finds
        (jumps, repeated places, exchanged landmarks); ``keep`` takes every place as it is.

    Returns
    -------
    Exploration
        A trial's remarks are warned of as well.

    Raises
    ------
    InvalidInput
        No trial, or not one peak in any of them.
    """
    if not trials:
        raise InvalidInput("measure_exploration needs at least one trial, got none.")
    options: dict[str, Any] = {
        "cutoff": cutoff,
        "max_gap": max_gap,
        "min_prominence": min_prominence,
    }
    found = [_measure_trial(trial, landmarks or {}, outliers, options) for trial in trials]
    sweeps = tuple(pair for pair, _, _ in found)
    mean_peak = np.array([[side.mean_peak for side in pair] for pair in sweeps])
    if np.isnan(mean_peak).all():
        raise InvalidInput(_explain_nothing(trials, sweeps, min_prominence))
    remarks = tuple(tuple(words) for _, _, words in found)
    if said := dict.fromkeys(words for trial in remarks for words in trial):
        text = "the speeds of a trial may be off, as its remarks say."
        warnings.warn(ModelValidityWarning(text, " ".join(said)), stacklevel=3)
    tips = (landmarks or {}).get("tips", ("left", "right"))
    missing = [
        [
            side.missing / side.angle.size if tip else np.nan
            for tip, side in zip(tips, pair, strict=True)
        ]
        for pair in sweeps
    ]
    return Exploration(
        mean_peak=mean_peak,
        n_peaks=np.array([[side.peak_speed.size for side in pair] for pair in sweeps]),
        sweeps=sweeps,
        length=length,
        error=np.array([[side.error for side in pair] for pair in sweeps]),
        source="synthetic"
        if any(tracks.source == "synthetic" for tracks in trials)
        else "tracked",
        left_out=tuple(left_out for _, left_out, _ in found),
        remarks=remarks,
        missing=np.array(missing),
    )


def _measure_trial(
    tracks: Tracks, landmarks: Mapping[str, Any], outliers: str, options: dict[str, Any]
) -> tuple[tuple[Sweeps, Sweeps], dict[str, int], list[str]]:
    """Sweeps of (left, right), frames that were left out, and remarks."""
    names = {"tips": ("left_tip", "right_tip"), "head": "head", "abdomen": "abdomen"} | {
        name: value for name, value in landmarks.items() if value is not None
    }
    bases = names.get("bases", (names["head"],) * 2)
    left_out: dict[str, int] = {}
    remarks: list[str] = []
    if outliers == "remove":
        names["bases"] = bases
        tracks, left_out, remarks = leave_out_errors(
            tracks, **names, max_gap=options["max_gap"]
        )
    tracks, is_bridged = _bridge_body(
        tracks, names["head"], names["abdomen"], bases, options["max_gap"]
    )
    angle = compute_antenna_angle(tracks, **names)
    remarks += _find_doubts(
        angle,
        tips=names["tips"],
        head=names["head"],
        abdomen=names["abdomen"],
        flat=tracks.position.shape[2] == 2,
    )
    pair = []
    for tip, row in zip(names["tips"], angle, strict=True):
        side = find_sweeps(row, tracks.interval, **options)
        remarks += _list_remarks(tip, side, options["cutoff"]) if tip else []
        side = replace(
            side, is_bridged=(side.is_bridged | is_bridged) & np.isfinite(side.angle)
        )
        stray = sum(left_out.get(f"{tip} {words}", 0) for words in STRAY)
        if stray > _MANY * row.size:
            remarks.append(
                f"of {tip} {stray} of {row.size} places are errors that were left out: where there"
                " are so many, others remain. Do not trust its peak speeds; check its track."
            )
        pair.append(side)
    return (pair[0], pair[1]), left_out, remarks


def _list_remarks(tip: str, side: Sweeps, cutoff: float | str) -> list[str]:
    """What the low-pass, the frame rate and bridged gaps do to the speeds of one antenna."""
    remarks = []
    lost, at = side.lost
    if cutoff != "auto" and lost > _MAX_LOSS:
        remarks.append(
            f"the low-pass of {side.cutoff * 1e3:.3g} Hz takes away {lost:.0%} of the speed of"
            f" {tip}, whose angle moves at {at * 1e3:.3g} Hz. Give cutoff='auto', or a higher one."
        )
    share = side.is_bridged.mean()
    frames = (1 - share) / (side.frequency * side.interval) if side.frequency > 0 else np.inf
    if side.peak_speed.size and frames < _MIN_FRAMES:
        remarks.append(
            f"{tip} moves at {side.frequency * 1e3:.3g} Hz, which the track shows in"
            f" {frames:.2g} frames a cycle: its peak speeds come out too low. Film at"
            f" {4e3 * side.frequency:.0f} frames/s or more."
        )
    if share > _MANY_BRIDGED:
        remarks.append(
            f"{share:.0%} of the frames of {tip} are bridged: with so few frames seen, mean peak"
            " speeds may be up to 15 % off, and too low for fast motion. Track more frames."
        )
    return remarks


def _bridge_body(
    tracks: Tracks, head: str, abdomen: str, bases: tuple[str, str], max_gap: int
) -> tuple[Tracks, np.ndarray]:
    """Tracks in which the landmarks of the body are bridged, and where (frame,) they are."""
    is_bridged = np.zeros(tracks.n_frames, dtype=bool)
    if max_gap == 0:
        return tracks, is_bridged
    body = np.linalg.norm(tracks.of(head) - tracks.of(abdomen), axis=1)
    if not np.isfinite(body).any():
        return tracks, is_bridged
    near, longest = _SHIFT * float(np.nanmedian(body)), int(_LONGEST / tracks.interval)
    position = tracks.position.copy()
    for name in {head, abdomen, *bases} - {""}:
        place = position[:, tracks.landmarks.index(name)]
        seen = np.flatnonzero(np.isfinite(place).all(axis=1))
        for start, stop in pairwise(seen):
            lost = stop - start - 1
            moved = np.linalg.norm(place[stop] - place[start])
            if lost and (lost <= max_gap or (lost <= longest and moved <= near)):
                share = np.arange(1, lost + 1)[:, None] / (lost + 1)
                place[start + 1 : stop] = place[start] + share * (place[stop] - place[start])
                is_bridged[start + 1 : stop] = True
    return tracks.replace(position=position) if is_bridged.any() else tracks, is_bridged


def _explain_nothing(
    trials: Sequence[Tracks], sweeps: tuple[tuple[Sweeps, Sweeps], ...], least: float
) -> str:
    """Why no trial has a peak."""
    frames = sum(2 * trial.n_frames for trial in trials)
    missing = sum(side.missing for pair in sweeps for side in pair)
    lost: dict[str, int] = {}
    for trial in trials:
        for name, place in zip(trial.landmarks, np.moveaxis(trial.position, 1, 0), strict=True):
            lost[name] = lost.get(name, 0) + int(np.isnan(place).any(axis=1).sum())
    said = f"no sweep in {len(trials)} trials × {len(SIDES)} sides: "
    if missing > 0.5 * frames:
        worst = ", ".join(
            f"{name} {n}" for name, n in sorted(lost.items(), key=lambda item: -item[1]) if n
        )
        return (
            f"{said}{missing / frames:.0%} of the frames have no angle. Frames in which a landmark"
            f" is lost or its likelihood too low: {worst or 'none'}. Bridge longer gaps (max_gap=),"
            " or lower the threshold (min_likelihood=)."
        )
    return (
        f"{said}no peak of angular speed rises {np.rad2deg(least) * 1e3:.3g} °/s, or three times"
        " the tracking noise, above its neighbourhood. Is the frame rate right, and do the tips"
        " move?"
    )
