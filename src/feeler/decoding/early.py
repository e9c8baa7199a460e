"""How early a streaming decoder is right."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from feeler.decoding.decoder import StreamDecoder


@dataclass(frozen=True, kw_only=True, eq=False)
class EarlyAccuracy:
    """Accuracy against time since contact; arrays (moment,)."""

    since_contact: np.ndarray
    """Samples since contact was noticed."""
    accuracy: np.ndarray
    """Share of touches whose most probable class is right."""
    decided: np.ndarray
    """Share of touches that are decided."""
    decided_right: np.ndarray
    """Share right among the decided; NaN where none is."""
    noticed: float
    """Share of touches in which contact was noticed at all."""


def measure_early_accuracy(
    decoder: StreamDecoder, X: Sequence[np.ndarray], y: Sequence[tuple], moments: Sequence[int]
) -> EarlyAccuracy:
    """Replay touches (sensor, time), score the answers at moments after contact; unnoticed touches
    count as wrong.
    """
    at = np.asarray(moments, dtype=int)
    right, decided = np.zeros((2, len(X), at.size), dtype=bool)
    noticed = 0
    for k, (touch, label) in enumerate(zip(X, y, strict=True)):
        states = [state for state in decoder.replay(touch) if state.since_contact >= 0]
        noticed += bool(states)
        for j, moment in enumerate(at):
            if states:
                state = states[min(moment, len(states) - 1)]
                right[k, j] = state.label == label
                decided[k, j] = state.probability >= decoder.threshold
    count = decided.sum(axis=0)
    with np.errstate(invalid="ignore"):
        decided_right = np.where(count > 0, (right & decided).sum(axis=0) / count, np.nan)
    return EarlyAccuracy(
        since_contact=at,
        accuracy=right.mean(axis=0),
        decided=decided.mean(axis=0),
        decided_right=decided_right,
        noticed=noticed / len(X),
    )
