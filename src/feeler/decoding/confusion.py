"""What is confused with what: feature, size or location."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated

import numpy as np

from feeler.decoding.labels import Labels
from feeler.errors import InvalidInput
from feeler.records.checked import checked


@dataclass(frozen=True, kw_only=True)
class Confused:
    """Shares of all test trials, by which attributes the predicted class has wrong.

    Attributes
    ----------
    correct : float
        Nothing wrong.
    wrong : dict[tuple[str, ...], float]
        ``wrong[("size",)]`` is the share in which only the size is wrong, and so on.
    accuracy : dict[str, float]
        accuracy["location"] is the share in which the location is right, whatever else is wrong.
    """

    correct: float
    wrong: dict[tuple[str, ...], float]
    accuracy: dict[str, float]

    def describe(self) -> str:
        """One line of words, greatest share first."""
        parts = sorted(
            ((share, key) for key, share in self.wrong.items() if share > 0), reverse=True
        )
        words = ", ".join(f"{' and '.join(key)} {100 * share:.1f} %" for share, key in parts)
        return f"right {100 * self.correct:.1f} %; wrong in {words}" if words else "all right"


@checked
def explain_confusion(
    confusion: Annotated[np.ndarray, "answer class"], attributes: Mapping[str, Labels]
) -> Confused:
    """Split a confusion matrix by the attributes of its classes.

    Parameters
    ----------
    confusion
        Counts (true class, predicted class).
    attributes
        Attribute values per class, e.g. ``{"feature": [...], "size": [...], "location": [...]}``.
    """
    confusion = np.asarray(confusion, dtype=float)
    n = len(confusion)
    if confusion.shape != (n, n) or confusion.sum() <= 0:
        raise InvalidInput(
            "expected a square matrix of counts with at least one trial, got shape"
            f" {confusion.shape}."
        )
    for name, values in attributes.items():
        if len(values) != n:
            raise InvalidInput(f"attribute {name!r} has {len(values)} values for {n} classes.")
    share = confusion / confusion.sum()
    differ = {
        name: np.not_equal.outer(v, v)
        for name, v in ((k, np.asarray(v)) for k, v in attributes.items())
    }
    names = tuple(attributes)
    wrong = {}
    for size in range(1, len(names) + 1):
        for key in combinations(names, size):
            mask = np.logical_and.reduce([differ[name] == (name in key) for name in names])
            wrong[key] = float(share[mask].sum())
    accuracy = {name: float(share[~differ[name]].sum()) for name in names}
    return Confused(correct=float(np.trace(share)), wrong=wrong, accuracy=accuracy)
