"""Nuisances: how much the touches of one class differ in what is not asked for."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeGuard

import numpy as np
from scipy.special import ndtri

from feeler.draw import LogRange, Spread, describe_spread, spread_out
from feeler.errors import InvalidInput
from feeler.records.record import Record, freeze
from feeler.stimulus.sample import TURNED
from feeler.stimulus.trial import Trial

NAMES = ("location", "size", "approach", "friction", "speed")
_NEAREST = 0.05  # [C] of the length; nearer the base a normal spread does not go
_OBLIQUE = (30.0, 150.0)  # [C] degrees; an approach beyond them misses many antennas


@dataclass(frozen=True)
class Normal:
    """A normal spread about ``middle`` within limits; log-normal if ``sd`` is a share of it."""

    middle: float
    sd: float
    share: bool = False
    low: float = -np.inf
    high: float = np.inf

    @property
    def args(self) -> tuple[float, ...]:
        """Its numbers, as a distribution of scipy.stats shows them."""
        return (self.middle, self.sd, float(self.share), self.low, self.high)

    def ppf(self, share: np.ndarray) -> np.ndarray:
        """Values below which these shares of the draws lie."""
        by = self.sd * ndtri(share)
        values = self.middle * np.exp(by) if self.share else self.middle + by
        return np.clip(values, self.low, self.high)


class Nuisances(Record):
    """How far place, size, speed, approach and friction of a touch, and in space its azimuth, may
    lie from what was asked for.

    A number is a half-width about the nominal value (``kind="uniform"``) or a standard deviation
    (``"normal"``; shares are then log-normal). Anything else says where the value itself lies,
    whatever is nominal: a range (low, high), a list of three or more choices, a
    :class:`feeler.LogRange` or a distribution of scipy.stats. The defaults are choices [C].

    Attributes
    ----------
    location : Spread
        ± fraction of the antenna's length.
    size : Spread
        ± share of the half-width; otherwise the half-width itself [mm].
    approach : Spread
        ± degrees.
    friction : Spread
        ± share; otherwise the coefficient itself.
    speed : Spread
        ± share; otherwise the speed itself [m/s].
    azimuth : Spread
        ± degrees, of touches in space.
    kind : Literal[uniform, normal]
        ``uniform`` or ``normal``: what a number means.
    """

    location: Spread = 0.015
    size: Spread = 0.05
    approach: Spread = 4.0
    friction: Spread = (0.6, 1.0)
    speed: Spread = 0.0
    azimuth: Spread = 0.0
    kind: Literal["uniform", "normal"] = "uniform"

    def _check(self) -> None:
        for name in (*NAMES, TURNED):
            value = read_spread(getattr(self, name), f"Nuisances.{name}")
            if is_number(value) and not 0 <= value < np.inf:
                raise InvalidInput(f"Nuisances.{name} must be finite and ≥ 0, got {value}.")
            share = name not in ("approach", TURNED)
            if is_number(value) and self.kind == "uniform" and share and value >= 1:
                raise InvalidInput(
                    f"Nuisances.{name} must be < 1, as it is a share, got {value}."
                )
            vars(self)[name] = value

    @classmethod
    def only(cls, **asked: Any) -> "Nuisances":
        """These nuisances, and none beside them."""
        return cls(**{**dict.fromkeys(NAMES, 0.0), **asked})

    def to_plain(self) -> dict[str, Any]:
        """The fields as plain data; ``Nuisances(**plain)`` is equal."""
        names = (*NAMES, TURNED) if self._turns else NAMES
        return {name: describe_spread(getattr(self, name)) for name in names} | {
            "kind": self.kind
        }

    @property
    def _turns(self) -> bool:
        """Whether touches leave the plane."""
        return describe_spread(self.azimuth) != 0

    def spread(self, trial: Trial) -> dict[str, Spread]:
        """Where size [mm], location, speed, approach and friction of touches like this one lie, and
        their azimuth where they leave the plane.
        """
        small, wide = min(_NEAREST, trial.location), _OBLIQUE
        wide = (min(wide[0], trial.approach), max(wide[1], trial.approach))
        return {
            "size": self._about(self.size, trial.feature.size, share=True),
            "location": self._about(self.location, trial.location, low=small, high=1.0),
            "speed": self._about(self.speed, trial.speed, share=True),
            "approach": self._about(self.approach, trial.approach, low=wide[0], high=wide[1]),
            "friction": self._about(self.friction, trial.friction, share=True),
        } | self._turn(trial)

    def _turn(self, trial: Trial) -> dict[str, Spread]:
        about = self._about(self.azimuth, trial.azimuth, low=-360.0, high=360.0)
        return {TURNED: about} if self._turns else {}

    def _about(
        self,
        by: Spread,
        middle: float,
        share: bool = False,
        low: float = 0.0,
        high: float = np.inf,
    ) -> Spread:
        if not is_number(by):
            return by
        if by == 0:
            return middle
        if self.kind == "normal":
            return Normal(middle, by, share, low, high)
        half = by * middle if share else by
        return middle - half, min(middle + half, high)

    def jitter(
        self, trials: Sequence[Trial], rng: np.random.Generator, n_each: int = 1
    ) -> list[Trial]:
        """Touches like the given ones, ``n_each`` of each, the set in turn.

        Five numbers are drawn for every touch, so that one nuisance more leaves the others as they
        were. A feature without end keeps its size.
        """
        if n_each < 1:
            raise InvalidInput(f"n_each must be ≥ 1, got {n_each}.")
        return [self._move(trial, rng) for _ in range(n_each) for trial in trials]

    def _move(self, trial: Trial, rng: np.random.Generator) -> Trial:
        shares = dict(zip(NAMES, rng.random((len(NAMES), 1)), strict=True))
        shares[TURNED] = rng.spawn(1)[0].random(1) if self._turns else np.zeros(1)
        spreads = self.spread(trial)
        feature, size = trial.feature, spreads.pop("size")
        if np.isfinite(feature.size):
            factor = float(spread_out(size, "size", shares["size"])[0]) / feature.size
            feature = feature.scale(factor) if factor != 1 else feature
        drawn = {
            name: float(spread_out(spread, name, shares[name])[0])
            for name, spread in spreads.items()
        }
        return trial.replace(feature=feature, **drawn)


def read_spread(value: Any, name: str) -> Spread:
    """A spread, also from its plain data; a list of two is a range, as TOML writes it."""
    if isinstance(value, Mapping):
        plain = {**value}
        limits = plain.get("logarithmic", ())
        pair = isinstance(limits, list | tuple) and len(limits) == 2
        value = LogRange(*limits) if pair else plain.get("choices")
    elif isinstance(value, list | tuple) and len(value) == 2:
        value = tuple(value)
    if isinstance(value, list):
        value = freeze(value)
    spread_out(value, name, np.array([0.5]))
    return value


def is_number(value: object) -> TypeGuard[float]:
    """Whether a spread is a single number."""
    return isinstance(value, int | float | np.number) and not isinstance(value, bool)
