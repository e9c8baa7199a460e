"""What one recorded trace shows in spite of its noise: where it is released, where it comes to
rest, damped frequency and damping ratio.
"""

from typing import Annotated

import numpy as np
from scipy.signal import savgol_filter

from feeler.errors import FeelerError, InvalidInput
from feeler.records.checked import checked
from feeler.response import FreeResponse, check_trace, measure_free_response

_MIN_FREQUENCY, _MAX_FREQUENCY = (
    5e-4,
    1.0,
)  # kHz [C]; cricket and cockroach antennae swing at tens of Hz
# [C] white noise, as a share of the first deflection, beyond which no turning point can be trusted
_MAX_JUMP = 0.25
_TAIL = 0.2  # [C] share of the trace at its end that is taken for rest
_HELD = 5  # samples at the beginning, at least, that are taken for held
_LEAVES = 0.01  # [C] share of the held displacement that counts as having left it
_UNCLEAR = 4.0  # [C] a step must be so many times the noise of the held part and of the end


@checked
def measure_trace(time: np.ndarray, trace: np.ndarray, name: str = "trace"):
    """Free response of a recorded trace; turning points within its noise do not count.

    Raises
    ------
    InvalidInput
        Over-damped: there is no frequency to fit. Or a trace that cannot be measured, or in another
        unit of time.
    """
    free = measure_free_trace(time, trace, name)
    if free.frequency is None:
        raise InvalidInput(
            f"trace {name!r} is over-damped: it settles without a cycle, so it has no damped"
            " frequency to fit. Fit it by trace, or leave it out."
        )
    if free.frequency > _MAX_FREQUENCY:
        raise InvalidInput(
            f"trace {name!r} swings at {free.frequency:g} kHz, which no antenna does: its time is"
            " probably in s, not ms. Name the column time_s."
        )
    if free.frequency < _MIN_FREQUENCY:
        raise InvalidInput(
            f"trace {name!r} swings at {1e3 * free.frequency:g} Hz, which no antenna does: its time"
            " is probably in ms, not s. Name the column time_ms."
        )
    return free


def measure_free_trace(time: np.ndarray, trace: np.ndarray, name: str) -> FreeResponse:
    """Free response of a trace that is not too noisy."""
    check_trace(time, trace, f"trace {name!r}")
    noise = float(
        np.std(np.diff(trace, 2))
        / np.sqrt(6.0)
        / max(abs(trace[0]), 0.05 * np.abs(trace).max())
    )
    if noise > _MAX_JUMP:
        raise InvalidInput(
            f"trace {name!r} jumps from sample to sample by {noise:.0%} of its first deflection: it"
            f" swings faster than its sampling rate ({1 / (time[1] - time[0]):g} kHz) can show, or"
            " is too noisy. Sample faster, and check that the first sample is the release."
        )
    try:
        free = measure_free_response(
            time, _smooth(trace), floor=float(np.clip(4 * noise, 1e-3, 0.2)), fit=False
        )
    except FeelerError as error:
        raise InvalidInput(f"trace {name!r}: {error}") from error
    return free


def _smooth(trace: np.ndarray) -> np.ndarray:
    """The trace through a cubic Savitzky–Golay filter, so that noise moves no turning point.

    It spans 80 % of the time to the first zero crossing.
    """
    crossing = int(np.argmax(trace * np.sign(trace[0]) <= 0))
    window = 2 * int(0.4 * crossing) + 1
    return savgol_filter(trace, window, 3) if 5 <= window < trace.size else trace


@checked
def find_rest(signal: Annotated[np.ndarray, "sample"]) -> float:
    """Where a trace comes to rest: the median of its last fifth."""
    signal = np.asarray(signal, dtype=float)
    if signal.size == 0:
        raise InvalidInput("signal must hold one sample or more, got none.")
    return float(np.median(signal[-max(_HELD, int(_TAIL * signal.size)) :]))


@checked
def find_release(
    signal: Annotated[np.ndarray, "sample"], name: str = "trace"
) -> tuple[int, float]:
    """Number of the last held sample, and the position at rest, of a trace that is let go.

    Rest is :func:`find_rest`. Let go, a tip may first rise: the release is the last sample before
    the trace leaves the held displacement, by more than four standard deviations of the noise or 1
    %, for two samples.

    Raises
    ------
    InvalidInput
        No held part, or no step: what is held and what is at rest differ by less than four times
        the noise.
    """
    rest = find_rest(signal)
    signal = np.asarray(signal, dtype=float)
    shown = signal - rest
    held = float(np.median(shown[:_HELD]))
    noise = 1.4826 * float(np.median(np.abs(np.diff(shown, 2)))) / np.sqrt(6.0)
    if abs(held) <= _UNCLEAR * noise or held == 0.0:
        raise InvalidInput(
            f"{name}: no release is found: it begins at {signal[:_HELD].mean():.4g} and ends at"
            f" {rest:.4g}, with a noise of {noise:.2g}. Begin while the antenna is held and end"
            " when it has settled, or cut the trace at the release and say release='first'."
        )
    away = np.abs(shown - held) > max(_UNCLEAR * noise, _LEAVES * abs(held))
    last = int(np.argmax(away[:-1] & away[1:])) - 1
    if last < _HELD - 1:
        raise InvalidInput(
            f"{name}: the antenna is let go within the first {_HELD} samples, so how far it was"
            " held is not known. Begin earlier, or cut the trace at the release and say"
            " release='first'."
        )
    return last, rest
