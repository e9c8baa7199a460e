"""What is compared, as declared.toml says."""

import json
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any

import xarray as xr

from feeler.active.task import TouchTask
from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput


@dataclass(frozen=True, kw_only=True)
class Contest:
    """Every choice of the comparison of policies; :func:`load_contest` reads those written down
    beforehand.
    """

    sets: int
    """How often all touches are drawn anew."""
    known: int
    """Touches of a set."""
    copies: int
    """How often each is felt."""
    seed: int
    noise: float
    """[rad]"""
    duration: float
    """[ms]"""
    period: float
    """Between two decisions [ms]."""
    deadlines: tuple[float, ...]
    """[ms]"""
    budgets: tuple[float, ...]
    """[µJ]"""
    fixed: tuple[str, ...]
    """Policies that steering is held against."""
    steered: tuple[str, ...]
    ahead: tuple[str, ...]
    """Policies that look ahead, on ``ahead_sets`` sets with ``ahead_copies`` copies."""
    ahead_sets: int
    ahead_copies: int
    gain: float
    """Points that steering must gain to count."""
    confirm: Mapping[str, Any]
    """Fresh sets for the policies that were chosen."""
    places: Mapping[str, Any]
    """Where to touch next."""
    learning: Mapping[str, Any]
    """The learned policy."""
    wall: Mapping[str, Any]
    """Wall following."""

    def __post_init__(self) -> None:
        for name in ("deadlines", "budgets", "fixed", "steered", "ahead"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        if self.sets < 1 or self.known < 2 or self.copies < 1 or not self.deadlines:
            raise InvalidInput(
                "a comparison needs at least one set, two touches, one copy and one deadline."
            )
        if max(self.deadlines) > self.duration or any(d % self.period for d in self.deadlines):
            raise InvalidInput(
                f"deadlines must be multiples of {self.period:g} ms up to {self.duration:g} ms."
            )

    def make_task(self, antenna: Antenna, number: int) -> TouchTask:
        """Set ``number`` of touches; the same for all policies, and in place and size for all
        antennas.
        """
        seed = self.seed * 1000 + number
        return TouchTask(
            antenna, noise=self.noise, duration=self.duration, pool=self.known, seed=seed
        )

    def replace(self, **changes: Any) -> "Contest":
        """The same with some fields changed."""
        return replace(self, **changes)


def load_contest(**changes: Any) -> Contest:
    """The choices of declared.toml, less what ``changes`` replace."""
    found = tomllib.loads(
        files("feeler.studies.contests").joinpath("declared.toml").read_text(encoding="utf-8")
    )
    return Contest(**found | changes)


def load_stored(comparison: Contest) -> dict[str, Any]:
    """The stored results: ``measured`` and ``learned`` as Datasets, and what else there is, as
    plain data.

    Raises
    ------
    InvalidInput
        They were made with other choices than are declared now.
    """
    found = json.loads(
        files("feeler.studies.contests").joinpath("measured.json").read_text(encoding="utf-8")
    )
    for name in ("sets", "known", "copies", "seed", "noise", "duration", "period"):
        if found["declared"][name] != getattr(comparison, name):
            raise InvalidInput(
                f"the stored results were made with {name} {found['declared'][name]}, declared is"
                f" {getattr(comparison, name)}. Run: python benchmarks/active.py compare write"
            )
    datasets = {
        name: xr.Dataset.from_dict(found[name]) for name in ("measured", "learned") if name in found
    }
    return found | {
        name: one.map(lambda values: values.astype(float)) for name, one in datasets.items()
    }  # null is NaN
