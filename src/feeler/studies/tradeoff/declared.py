"""What is measured, as declared.toml says: speeds, task, noise and windows."""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

from feeler.errors import InvalidInput


@dataclass(frozen=True, kw_only=True)
class Declared:
    """Every choice of the comparison of speeds; :func:`load_declared` reads those written down
    beforehand.
    """

    speeds: tuple[float, ...]
    """[m/s]"""
    reach: float
    """How far the object moves on after first contact, as a share of the antenna's length."""
    tail: float
    """Time recorded beyond that [ms]."""
    sample_interval: float
    """[ms]"""
    sets: int
    """How often all touches are drawn anew."""
    seed: int
    draws: int
    """Pairs of drawn noise per set, window and level."""
    jitter: Mapping[str, Any]
    """Ranges from which each touch is drawn: ± location, ± size, ± approach, friction from and to.
    """
    levels: Mapping[str, Sequence[float]]
    """Levels by kind: ``relative`` to each tensor's peak, ``common`` [rad]."""
    headline: Mapping[str, float]
    """The level of each kind that figures show."""
    windows: Mapping[str, Any]
    """``deadlines`` and ``matched_times`` [ms], ``distances`` and ``matched_distance`` [mm],
    ``matched_samples``.
    """

    def __post_init__(self) -> None:
        if len(self.speeds) < 1 or min(self.speeds) <= 0 or self.sets < 1:
            raise InvalidInput(
                f"give at least one speed > 0 m/s and one set, got {self.speeds} and {self.sets}."
            )
        object.__setattr__(self, "speeds", tuple(sorted(self.speeds)))

    @property
    def noises(self) -> list[tuple[str, float]]:
        """Kind and size of every level of noise."""
        return [
            (kind, float(size)) for kind in ("relative", "common") for size in self.levels[kind]
        ]

    def replace(self, **changes: Any) -> "Declared":
        """The same with some fields changed: fewer sets, other speeds."""
        return replace(self, **changes)


def load_declared(**changes: Any) -> Declared:
    """The choices of declared.toml, less what ``changes`` replace."""
    found = tomllib.loads(
        files("feeler.studies.tradeoff").joinpath("declared.toml").read_text(encoding="utf-8")
    )
    return Declared(**found | changes)
