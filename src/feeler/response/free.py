"""Free response: what a released antenna's tip tells about frequency, damping and settling."""

from dataclasses import dataclass

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.response.decay import fit_damped_cosine
from feeler.response.trace import check_trace, find_extrema

_MIN_HALF = (
    2.5  # [C] samples that half a cycle must have for its turning points to be told apart
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
    fitted_frequency : float | None
        Damped frequency [kHz] of a damped cosine fitted to the whole record.
    fitted_damping_ratio : float | None
        ζ [1] of that cosine; another definition, and on a chain with many modes another number.
    fit_residual : float | None
        Relative root-mean-square residual of that cosine [1].
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
    fitted_frequency: float | None = None
    fitted_damping_ratio: float | None = None
    fit_residual: float | None = None
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
    fit: bool = True,
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
    fit
        Whether to fit the damped cosine too.

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
            "Give release=<time of release> and rest."
        )
    share = moved / moved[0]
    times, heights = _opposite_turns(time, share, floor)
    settle = [_settle_time(time, share, level) for level in (0.10, 0.05)]
    if not len(times):
        return _without_cycle(time, share, settle)
    if len(times) == 1:
        return _with_one_turn(time, share, times, heights, settle)
    half = times[1] - times[0]
    if (
        half < _MIN_HALF * (time[1] - time[0])
        or _count_crossings(time, share, times, floor) != 1
    ):
        raise InvalidInput(
            f"between peak and trough there are not {_MIN_HALF} samples of {time[1] - time[0]:g}"
            " ms, or several swings: the frequency lies beyond the sampling rate, or the time is in"
            " the wrong unit (ms are expected)."
        )
    decrement = np.log(abs(heights[0] / heights[1]))
    frequency, ratio = 0.5 / half, float(decrement / np.hypot(decrement, np.pi))
    cosine = (
        fit_damped_cosine(time, share, frequency, float(np.clip(ratio, 0.01, 0.9)))
        if fit
        else None
    )
    return FreeResponse(
        overdamped=False,
        frequency=float(frequency),
        damping_ratio=ratio,
        fitted_frequency=cosine.frequency if cosine else None,
        fitted_damping_ratio=cosine.damping_ratio if cosine else None,
        fit_residual=cosine.residual if cosine else None,
        settle_10=settle[0],
        settle_5=settle[1],
        rejected=_rejected(time, share, 2 * half),
        peak_time=float(times[0] - time[0]),
        peak=float(heights[0]),
        trough=float(heights[1]),
    )


def _opposite_turns(
    time: np.ndarray, share: np.ndarray, floor: float
) -> tuple[np.ndarray, np.ndarray]:
    """First opposite peak and the trough after it: the largest turns of two half cycles."""
    times, heights = find_extrema(time, share, floor)
    after = np.flatnonzero(heights < 0)
    if not len(after):
        return times[:0], heights[:0]
    times, heights = times[after[0] :], heights[after[0] :]
    lobe = np.concatenate(([0], np.cumsum(np.diff(np.sign(heights)) != 0)))
    lobes = (np.flatnonzero(lobe == k) for k in (0, 1))
    best = [int(turns[np.argmax(np.abs(heights[turns]))]) for turns in lobes if turns.size]
    return times[best], heights[best]


def _count_crossings(
    time: np.ndarray, share: np.ndarray, times: np.ndarray, floor: float
) -> int:
    """Sign changes between peak and trough, leaving out what is below the floor."""
    between = share[(time >= times[0]) & (time <= times[1]) & (np.abs(share) > floor)]
    ends = np.concatenate(([-1.0], np.sign(between), [1.0]))
    return int(np.sum(np.diff(ends) != 0))


def _without_cycle(
    time: np.ndarray, share: np.ndarray, settle: list[float | None]
) -> FreeResponse:
    if settle[0] is None:
        raise InvalidInput(
            f"the trace ({time[-1] - time[0]:g} ms) is too short to hold one cycle: it ends at"
            f" {share[-1]:.0%} of its first deflection without having turned. Record longer, or"
            " check that time is in ms and rest is right."
        )
    return FreeResponse(overdamped=True, settle_10=settle[0], settle_5=settle[1])


def _with_one_turn(time, share, times, heights, settle: list[float | None]) -> FreeResponse:
    """One opposite turn and no trough: overdamped, or cut too early."""
    if settle[1] is None or abs(share[-1]) > 0.05:
        raise InvalidInput(
            f"the trace ({time[-1] - time[0]:g} ms) is too short to hold one cycle: it ends at"
            f" {share[-1]:.0%} of its first deflection, before the trough that follows the first"
            " opposite peak. Record longer."
        )
    return FreeResponse(
        overdamped=True,
        settle_10=settle[0],
        settle_5=settle[1],
        peak_time=float(times[0] - time[0]),
        peak=float(heights[0]),
    )


def _settle_time(time: np.ndarray, share: np.ndarray, level: float) -> float | None:
    outside = np.flatnonzero(np.abs(share) > level)
    last = outside[-1]
    if last == len(share) - 1:
        return None
    inside = np.sign(share[last]) * level
    part = (share[last] - inside) / (share[last] - share[last + 1])
    return float(time[last] + part * (time[last + 1] - time[last]) - time[0])


def _rejected(time: np.ndarray, share: np.ndarray, period: float) -> float | None:
    """1 − largest |deflection| from the end of the first cycle on."""
    later = np.abs(share[time >= time[0] + period])
    return float(1 - later.max()) if later.size else None
