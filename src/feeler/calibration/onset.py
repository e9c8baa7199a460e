"""Where a video's trace is released, and where it comes to rest: what a camera does not know."""

from typing import Annotated

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput

_TAIL = 0.2  # [C] share of the trace at its end that is taken for rest
_HELD = 5  # samples at the beginning, at least, that are taken for held
_LEAVES = 0.01  # [C] share of the held displacement that counts as having left it
_UNCLEAR = 4.0  # [C] a step must be so many times the noise of the held part and of the end


@checked
def find_rest(signal: Annotated[np.ndarray, "sample"]) -> float:
    """Where a trace comes to rest: the median of its last fifth."""
    signal = np.asarray(signal, dtype=float)
    if signal.size == 0:
        raise InvalidInput("signal must hold one sample or more, got none.")
    return float(np.median(signal[-max(_HELD, int(_TAIL * signal.size)) :]))


@checked
def find_release(signal: Annotated[np.ndarray, "sample"], name: str = "trace") -> tuple[int, float]:
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
