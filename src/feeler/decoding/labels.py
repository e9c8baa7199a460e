"""Class labels of trials: feature × size × location."""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.rules import show

Labels = Sequence[Any] | Annotated[np.ndarray, "trial ..."]
"""One class per trial."""
# [P] six features (three shapes, two sizes) at five locations: 30 classes
_CLASS = ("feature", "size", "location")


@checked
def make_labels(trials: Any, by: Sequence[str] = _CLASS) -> np.ndarray:
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


def read_labels(values: Labels, what: str = "labels") -> np.ndarray:
    """Labels as an array (trial,) whose values can be told apart and sorted.

    Raises
    ------
    InvalidInput
        Not one for each trial, or of several kinds, None among them.
    """
    try:
        found = np.asarray(values)
        np.unique(found)
    except (TypeError, ValueError) as error:
        raise InvalidInput(
            f"{what} must be texts or numbers, all of one kind, got {show(values)}."
        ) from error
    if found.ndim != 1:
        raise InvalidInput(f"{what} must be one for each trial, got shape {found.shape}.")
    return found


def write_label(label: Any) -> Any:
    """A label of several parts as one text; any other as it is."""
    return " ".join(_write(part) for part in label) if isinstance(label, tuple) else label


def _write(value: Any) -> str:
    return f"{value:g}" if isinstance(value, float | np.floating) else str(value)
