"""Draws: numbers within ranges or of distributions; each is the same however many are drawn."""

from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from annotated_types import Ge, Le

from feeler.errors import InvalidInput
from feeler.validation import Seed, checked, is_array, show

Drawn = Annotated[int, Ge(1), Le(100_000_000)]
"""How many are drawn."""


@checked
@dataclass(frozen=True)
class LogRange:
    """From ``low`` to ``high`` (0 < low ≤ high), uniform in the logarithm: each doubling is as
    likely as any other.
    """

    low: float
    high: float

    def __post_init__(self) -> None:
        numbers = all(isinstance(end, int | float | np.number) for end in (self.low, self.high))
        if not (numbers and 0 < self.low <= self.high < np.inf):
            got = f"{show(self.low)} and {show(self.high)}"
            raise InvalidInput(f"LogRange needs numbers 0 < low ≤ high, got {got}.")

    def ppf(self, share: np.ndarray) -> np.ndarray:
        """Values below which these shares of the draws lie."""
        return self.low * (self.high / self.low) ** share


Spread = float | tuple[float, float] | list | LogRange | Any
"""A number; a range (low, high), uniform; a list of choices; a LogRange; or a frozen distribution
of scipy.stats.
"""


def check_seed(seed: object) -> int:
    """A root of seeds: a whole number ≥ 0."""
    if isinstance(seed, bool) or not (isinstance(seed, int | np.integer) and seed >= 0):
        raise InvalidInput(f"seed must be a whole number ≥ 0, got {seed!r}.")
    return int(seed)


def draw_shares(seed: Seed, name: str, n: int, again: int = 0) -> np.ndarray:
    """``n`` numbers (n,) uniform in [0, 1) of the stream of this name; a longer stream begins with
    a shorter one.

    The streams are Philox counters (Salmon et al. 2011, doi:10.1145/2063384.2063405), one for each
    seed, name and ``again``, so that nothing that is drawn depends on what else is.
    """
    root = np.random.SeedSequence([check_seed(seed), *name.encode()], spawn_key=(again,))
    return np.random.Generator(np.random.Philox(root)).random(n)


def spread_out(spread: Spread, name: str, share: np.ndarray) -> np.ndarray:
    """The values of a spread at shares of its distribution.

    Raises
    ------
    InvalidInput
        No spread, or one with values that are not finite.
    """
    try:
        values = _evaluate(spread, share)
    except (TypeError, ValueError, IndexError, OverflowError) as error:
        raise InvalidInput(_explain(spread, name)) from error
    if values.shape != share.shape or not np.isfinite(values).all():
        raise InvalidInput(_explain(spread, name))
    return values


def _evaluate(spread: Spread, share: np.ndarray) -> np.ndarray:
    if isinstance(spread, list | tuple | str) and not is_array(spread):
        raise TypeError("no numbers")
    if isinstance(spread, list | np.ndarray):
        return np.asarray(spread, dtype=float)[(share * len(spread)).astype(int)]
    if isinstance(spread, tuple):
        low, high = map(float, spread)
        if low > high:
            raise ValueError("low > high")
        return low + (high - low) * share
    if hasattr(spread, "ppf"):
        return np.asarray(spread.ppf(share), dtype=float)
    return np.full(share.shape, float(spread))


def _explain(spread: Spread, name: str) -> str:
    return (
        f"{name} must be a finite number, a range (low, high), a list of choices, a LogRange or a"
        f" frozen distribution of scipy.stats, got {show(spread)}."
    )


def describe_spread(spread: Spread) -> Any:
    """A spread as plain data."""
    if isinstance(spread, LogRange):
        return {"logarithmic": [spread.low, spread.high]}
    if isinstance(spread, list | np.ndarray):
        return {"choices": np.asarray(spread, dtype=float).tolist()}
    if isinstance(spread, tuple):
        return [float(value) for value in spread]
    if hasattr(spread, "ppf"):
        known = getattr(getattr(spread, "dist", spread), "name", type(spread).__name__)
        numbers = [*getattr(spread, "args", ()), *getattr(spread, "kwds", {}).items()]
        return {"distribution": str(known), "parameters": [str(number) for number in numbers]}
    return float(spread)
