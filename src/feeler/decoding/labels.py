"""Class labels of trials: feature × size × location."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput

Labels = Sequence[Any] | np.ndarray
"""One class per trial."""
# [P] six features (three shapes, two sizes) at five locations: 30 classes
CLASS = ("feature", "size", "location")


@checked
def make_labels(trials: Any, by: Sequence[str] = CLASS) -> np.ndarray:
    """One readable label per trial, e.g. ``ball 1.5 0.5``.

    Parameters
    ----------
    trials
        A Dataset (or anything indexed by name that gives one value per trial) with the coordinates
        in ``by``.
    by
        What makes a class.
    """
    columns = []
    for name in by:
        try:
            columns.append(np.asarray(trials[name]))
        except (KeyError, TypeError, IndexError):
            raise InvalidInput(
                f"the trials have no coordinate {name!r}; labels need {', '.join(by)}."
            ) from None
    return np.array([write_label(row) for row in zip(*columns, strict=True)])


def write_label(label: Any) -> Any:
    """A label of several parts as one text; any other as it is."""
    return " ".join(_write(part) for part in label) if isinstance(label, tuple) else label


def _write(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float | np.floating) else str(value)
