"""Task: what an antenna is to tell apart, in which noise, and by when; drawn three times, for three
purposes.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.stimulus.feature import Feature, parse_feature
from feeler.stimulus.ninety import LOCATIONS, make_features
from feeler.stimulus.sample import sample_trials
from feeler.stimulus.trial import LEAD, Trial

NOISES = ("relative", "common")
DRAWS = ("optimiser", "test", "final")
NUISANCES = {
    "location": 0.015,
    "size": 0.05,
    "approach": 4.0,
    "friction": (0.6, 1.0),
}  # [C] as in the tradeoff
MAX_CLASSES = 1000


@checked
@dataclass(frozen=True, kw_only=True)
class Task:
    """Classes (object × place) to be told apart at each speed, each touch drawn anew within its
    nuisances.

    Raises
    ------
    InvalidInput
        Fewer than two classes, or a field outside its range.
    """

    objects: tuple[Any, ...] = ()
    """What touches; default: the paper's six. Text such as ``"ball:radius=2"`` is read."""
    locations: tuple[float, ...] = LOCATIONS
    """Where, as shares of the antenna's length."""
    speeds: tuple[float, ...] = (0.3,)
    """[m/s]; the speed of a touch is known to the decoder, so each is a task of its own."""
    deadline: float = 100.0
    """Time since contact [ms] whose samples the decoder may use."""
    noise: str = "relative"
    """``relative``: sd as a share of each tensor's own peak; ``common``: sd in rad for all."""
    level: float = 1.0
    """The sd of the white noise on each sample of each sensor, in that unit."""
    nuisances: tuple[tuple[str, Any], ...] = tuple(NUISANCES.items())
    """± location [length], ± size [share], ± approach [degrees], friction from and to."""
    train: int = 4
    """Touches of each class that the decoder learns from."""
    test: int = 4
    """Other touches of each class that it is asked about."""
    timestep: float = 0.05
    """Integration step [ms]."""
    seeds: tuple[int, int, int] = (1, 2, 3)
    """Of the touches for the optimiser, for tests, and for the final judgement that is looked at
    once.
    """

    def __post_init__(self) -> None:
        given = self.objects or make_features()
        objects = tuple(
            parse_feature(item, 1.5) if isinstance(item, str) else item for item in given
        )
        if wrong := [
            item for item in objects if not (isinstance(item, Feature) and np.isfinite(item.size))
        ]:
            raise InvalidInput(
                "objects must be bounded features or text such as 'ball:radius=2', got"
                f" {str(wrong[0])[:60]}."
            )
        object.__setattr__(self, "objects", objects)
        object.__setattr__(self, "nuisances", tuple((NUISANCES | dict(self.nuisances)).items()))
        self._check_numbers()
        if len(set(self.seeds)) != 3:
            raise InvalidInput(
                f"the seeds of optimiser, test and final must differ, got {self.seeds}: else a"
                " result is no test."
            )
        if unknown := dict(self.nuisances).keys() - NUISANCES.keys():
            raise InvalidInput(f"unknown nuisance {min(unknown)!r}; valid: {', '.join(NUISANCES)}.")
        if self.noise not in NOISES:
            raise InvalidInput(f"noise must be one of {', '.join(NOISES)}, got {self.noise!r}.")
        if not 2 <= self.n_classes <= MAX_CLASSES:
            raise InvalidInput(
                f"a task needs 2 to {MAX_CLASSES} classes (objects × locations), got"
                f" {self.n_classes}: with one there is nothing to tell apart."
            )

    def _check_numbers(self) -> None:
        for name in ("deadline", "level", "timestep"):
            if not 0 < getattr(self, name) < np.inf:
                raise InvalidInput(f"{name} must be finite and > 0, got {getattr(self, name)}.")
        for name in ("locations", "speeds"):
            values = getattr(self, name)
            if not values or min(values) <= 0 or len(set(values)) < len(values):
                raise InvalidInput(
                    f"{name} must be different numbers > 0, at least one, got {values}."
                )
        if self.train < 2 or self.test < 1:
            raise InvalidInput(
                f"train must be ≥ 2 and test ≥ 1 touches of each class, got {self.train} and"
                f" {self.test}."
            )

    @property
    def n_classes(self) -> int:
        """Objects × locations."""
        return len(self.objects) * len(self.locations)

    @property
    def labels(self) -> list[str]:
        """What each class is called, location by location."""
        return [
            f"{f.name} {f.size:g} mm at {place:g}" for place in self.locations for f in self.objects
        ]

    @property
    def duration(self) -> float:
        """Recorded time of a touch [ms]; contact begins after ``LEAD``."""
        return LEAD + float(np.ceil(self.deadline))

    def replace(self, **changes: Any) -> "Task":
        """The same with some fields changed."""
        return replace(self, **changes)

    def draw(self, antenna: Antenna, purpose: str, speed: float) -> list[Trial]:
        """The touches for one of ``DRAWS``, class by class, ``train`` before ``test`` ones.

        They depend on the seed and the class alone, so that all antennas and speeds meet the same
        touches.
        """
        if purpose not in DRAWS:
            raise InvalidInput(f"touches are drawn for one of {', '.join(DRAWS)}, got {purpose!r}.")
        seed, by = self.seeds[DRAWS.index(purpose)], dict(self.nuisances)
        classes = [(place, feature) for place in self.locations for feature in self.objects]
        return [
            trial
            for number, (place, feature) in enumerate(classes)
            for trial in sample_trials(
                self.train + self.test,
                features=[feature],
                sizes=_widen(feature.size, by["size"] * feature.size),
                locations=_widen(place, by["location"], 1.0),
                speeds=speed,
                approach=_widen(90.0, by["approach"]),
                friction=tuple(by["friction"]),
                sides=("left",),
                antenna=antenna,
                seed=MAX_CLASSES * seed + number,
            )
        ]


def _widen(middle: float, half: float, most: float = np.inf) -> tuple[float, float]:
    return middle - half, min(middle + half, most)


def as_tuple(values: Any) -> tuple[Any, ...]:
    """A list, or one thing alone, as a tuple."""
    return (
        tuple(values) if isinstance(values, Sequence) and not isinstance(values, str) else (values,)
    )
