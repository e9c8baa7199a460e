"""Profiles: one quantity along the antenna as a function of segment number, described by a few
numbers.
"""

from typing import Any, Protocol, runtime_checkable

import numpy as np

from feeler.antenna.formula import evaluate, list_names
from feeler.errors import InvalidInput
from feeler.records.record import Record


@runtime_checkable
class Profile(Protocol):
    """Anything that gives one value per segment, base to tip."""

    def sample(self, n_segments: int) -> np.ndarray:
        """Values (segment,) for segments 1..n_segments."""
        ...


def _check_count(n_segments: int) -> None:
    if n_segments < 1:
        raise InvalidInput(f"a profile needs at least 1 segment, got n_segments={n_segments}.")


class Exponential(Record):
    """``base * exp(rate * (n - 1))`` for segment n = 1, 2, … (Methods, antenna model).

    base: value at segment 1. rate: change of the logarithm per segment; negative falls towards the
    tip.
    """

    base: float
    rate: float

    def sample(self, n_segments: int) -> np.ndarray:
        """Values (segment,)."""
        _check_count(n_segments)
        return self.base * np.exp(self.rate * np.arange(n_segments))


class Linear(Record):
    """A straight line in segment number from ``base`` (segment 1) to ``tip`` (last segment)."""

    base: float
    tip: float

    def sample(self, n_segments: int) -> np.ndarray:
        """Values (segment,)."""
        _check_count(n_segments)
        return np.linspace(self.base, self.tip, n_segments)


class Constant(Record):
    """The same ``value`` in every segment."""

    value: float

    def sample(self, n_segments: int) -> np.ndarray:
        """Values (segment,)."""
        _check_count(n_segments)
        return np.full(n_segments, float(self.value))


class Sigmoid(Record):
    """``low + rise / (1 + exp(-slope * (x - centre)))`` at the segment's relative number x = (n -
    0.5) / N.
    """

    low: float
    rise: float
    slope: float
    centre: float

    def sample(self, n_segments: int) -> np.ndarray:
        """Values (segment,)."""
        _check_count(n_segments)
        return self.at((np.arange(n_segments) + 0.5) / n_segments)

    def at(self, x: np.ndarray) -> np.ndarray:
        """Values at relative segment numbers ``x`` between 0 and 1."""
        return self.low + self.rise / (
            1.0 + np.exp(-self.slope * (np.asarray(x, dtype=float) - self.centre))
        )


class Tabulated(Record):
    """Measured ``values`` at relative segment numbers ``x`` (rising, in [0, 1]), straight lines
    between them.
    """

    x: tuple[float, ...]
    values: tuple[float, ...]

    def _check(self) -> None:
        if len(self.x) != len(self.values) or len(self.x) < 2:
            raise InvalidInput(
                f"Tabulated needs x and values of one length ≥ 2, got {len(self.x)} and"
                f" {len(self.values)}."
            )
        if np.any(np.diff(self.x) <= 0):
            raise InvalidInput(
                f"Tabulated.x must rise strictly, got {tuple(self.x)}. Sort the table by x."
            )

    def sample(self, n_segments: int) -> np.ndarray:
        """Values (segment,); outside the table the nearest end's value."""
        _check_count(n_segments)
        return np.interp((np.arange(n_segments) + 0.5) / n_segments, self.x, self.values)


PROFILES = {
    cls.__name__.lower(): cls for cls in (Exponential, Linear, Constant, Sigmoid, Tabulated)
}


def sample_quantity(
    value: Any, n_segments: int, segment_length: np.ndarray | None = None
) -> np.ndarray:
    """Values (segment,) of a number, an array, a profile or a formula."""
    _check_count(n_segments)
    if isinstance(value, Profile):
        return value.sample(n_segments)
    found = (
        evaluate(value, list_names(n_segments, segment_length))
        if isinstance(value, str)
        else np.asarray(value, float)
    )
    return np.full(n_segments, found) if found.ndim == 0 else found
