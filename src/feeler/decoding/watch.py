"""A watch over a touch that goes on: whether it is, so far, unlike any touch that was learned."""

from collections.abc import Sequence

import numpy as np

from feeler.decoding.clouds import CloudReader, Others
from feeler.decoding.labels import Labels
from feeler.errors import InvalidInput

_MOMENTS = (50, 100, 200, 400, 800, 1600)  # [C] samples after contact at which it is asked


class Watch:
    """Clouds of touches up to several moments, with one limit for all of these moments together.

    Of the known touches that were held out, ``alarm`` are called strange at any moment.

    Parameters
    ----------
    alarm
        Share of the known touches that may be called strange before they are over.

    Attributes
    ----------
    readers_ : dict[int, CloudReader]
        Samples after contact → the clouds of touches up to then.
    limit_ : float
        What the strangeness at one moment may be.
    """

    def __init__(self, alarm: float = 0.05) -> None:
        self.alarm = alarm

    def fit(
        self,
        X: np.ndarray,
        y: Labels,
        groups: Sequence[int],
        strangers: Others | None = None,
        most: int = _MOMENTS[-1],
    ) -> "Watch":
        """Learn from tensors (trial, sensor, window) that begin with contact. No moment lies later
        than ``most`` samples after contact, because the shortest recording ends there.
        """
        moments = [moment for moment in _MOMENTS if moment <= min(most, X.shape[2])]
        if not moments:
            raise InvalidInput(
                f"a watch needs touches of {_MOMENTS[0]} samples after contact, got"
                f" {min(most, X.shape[2])}."
            )
        self.readers_ = {}
        for moment in moments:
            reader = CloudReader(alarm=self.alarm)
            self.readers_[moment] = reader.fit(X[:, :, :moment], y, groups, strangers)
        held = np.array([reader.held_out_ for reader in self.readers_.values()]).max(axis=0)
        self.limit_ = float(np.nanquantile(held, 1 - self.alarm))
        return self

    def judge(
        self, tensor: np.ndarray, since: int, classes: Sequence
    ) -> tuple[float, np.ndarray] | None:
        """Strangeness of samples (sensor, time) up to ``since``, > 1: unlike any that was learned;
        and the probability of each of ``classes``.

        None between moments, NaN where a channel has no sample. Missing samples are bridged, also
        from those of ``tensor`` that came after ``since``.
        """
        if since + 1 not in self.readers_:
            return None
        reader, seen = self.readers_[since + 1], _bridge(tensor)[None, :, : since + 1]
        probability = dict(zip(reader.classes_, reader.predict_proba(seen)[0], strict=True))
        strange = float(reader.measure_strangeness(seen)[0]) / self.limit_
        return strange, np.array([probability.get(label, 0.0) for label in classes])


def _bridge(tensor: np.ndarray) -> np.ndarray:
    """Each gap as a straight line; a channel without samples stays NaN."""
    bridged, time = tensor.copy(), np.arange(tensor.shape[1])
    for row in bridged:
        known = np.isfinite(row)
        if known.any():
            row[~known] = np.interp(time[~known], time[known], row[known])
    return bridged
