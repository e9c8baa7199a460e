"""What a stranger looks like: touches of things that are not to be known, as one broad cloud."""

from collections.abc import Hashable, Sequence

import numpy as np

_FREEDOM = 50.0  # [C] of both clouds that are weighed here; small: touches far out are common
_DIRECTIONS = 20  # [C] in which strangers may lie further out than what robots differ by


class Strangers:
    """A t cloud around each kind's mean, wide where strangers differ among each other.

    Parameters
    ----------
    places
        Strangers (trial, coordinate), in coordinates in which each known class is round.
    kinds
        What each shares with others, such as place and speed of the touch.
    """

    def __init__(self, places: np.ndarray, kinds: Sequence[Hashable]) -> None:
        names = sorted(set(kinds), key=repr)
        number = np.array([names.index(kind) for kind in kinds])
        self._means = np.array([places[number == k].mean(axis=0) for k in range(len(names))])
        off = places - self._means[number]
        spread, along = np.linalg.eigh(off.T @ off / max(len(off) - len(names), 1))
        self._spread = np.maximum(spread[::-1][:_DIRECTIONS], 1.0)
        self._along = along[:, ::-1][:, :_DIRECTIONS]

    def weigh(self, places: np.ndarray, nearest: np.ndarray) -> np.ndarray:
        """How much likelier each place (trial, coordinate) is of a stranger than of a class, whose
        squared distance is ``nearest`` (trial,) [nat].
        """
        off = places[:, None] - self._means
        own = off @ self._along
        squared = np.sum(off * off, axis=2) - np.sum(own * own * (1 - 1 / self._spread), axis=2)
        weight = 0.5 * (_FREEDOM + places.shape[1])
        strange = -weight * np.log1p(squared.min(axis=1) / _FREEDOM)
        known = -weight * np.log1p(nearest / _FREEDOM)
        return np.asarray(strange - known - 0.5 * np.log(self._spread).sum())
