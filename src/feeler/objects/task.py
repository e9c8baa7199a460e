"""Touches drawn at random from ranges, and tasks: families of objects with nuisances and seeds."""

import operator
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, TypeGuard, overload

import numpy as np

from feeler.antenna.animals import cockroach
from feeler.antenna.segments import Antenna
from feeler.draw import Drawn, LogRange, Spread, describe_spread, draw_shares, spread_out
from feeler.errors import InvalidInput
from feeler.objects.motion import BaseMotion
from feeler.objects.noise import Noise, Relative
from feeler.objects.shapes import Feature, make_feature, parse_feature
from feeler.objects.trials import LEAD, LOCATIONS, Trial, make_features, place
from feeler.provenance import compute_digest, to_jsonable
from feeler.records import Gt, Le, Len, Record, Unit, freeze
from feeler.validation import Seed, checked, show

# Sampled trials: random touches by the thousand or million, the k-th the same however many
# are drawn.

_ATTEMPTS = 20  # [C] draws of one touch before its ranges are said not to fit
_HOPELESS = 0.9  # [C] share of touches that do not fit from which no other draw is tried
_FIELDS = ("location", "speed", "approach", "friction", "lead")
TURNED = "azimuth"  # a field of trials in space, a column only where it is asked for
_BASE = ("x", "y", "turn")


@checked
class SampledTrials(Sequence[Trial]):
    """Random trials as columns; a Trial is made when it is asked for, so that a million take little
    memory.

    Attributes
    ----------
    columns
        Values (trial,) by name: ``feature`` (its number among ``features``), ``size``,
        ``location``, ``speed``, ``approach``, ``friction``, ``lead``, ``right`` and, where they are
        asked for, ``azimuth``, and ``x``, ``y`` and ``turn`` of the base.
    features
        What touches, at any size.
    antenna
        The antenna that each of them is known to fit.
    recipe
        Plain data that draw the same again.
    """

    def __init__(
        self,
        columns: dict[str, np.ndarray],
        features: tuple[Feature, ...],
        antenna: Antenna | None,
        recipe: dict[str, Any],
    ) -> None:
        self.columns, self.features, self.antenna, self.recipe = (
            columns,
            features,
            antenna,
            recipe,
        )

    def __len__(self) -> int:
        return len(self.columns["feature"])

    @overload
    def __getitem__(self, index: int) -> Trial: ...
    @overload
    def __getitem__(self, index: slice) -> "SampledTrials": ...
    def __getitem__(self, index: int | slice) -> "Trial | SampledTrials":
        if isinstance(index, slice):
            rows = range(len(self))[index]
            columns = {name: values[index] for name, values in self.columns.items()}
            chosen = {
                "first": self.recipe.get("first", 0) + rows.start * self.recipe.get("step", 1)
            }
            chosen["step"] = rows.step * self.recipe.get("step", 1)
            return SampledTrials(
                columns, self.features, self.antenna, {**self.recipe, **chosen}
            )
        row = {name: values[index].item() for name, values in self.columns.items()}
        feature = self.features[row["feature"]]
        if not np.isnan(row["size"]) and feature.size != row["size"]:
            feature = feature.scale(row["size"] / feature.size)
        base = (
            BaseMotion(velocity=(row["x"], row["y"]), turn=row["turn"]) if "x" in row else None
        )
        fields = {name: row[name] for name in (*_FIELDS, TURNED) if name in row}
        return Trial(
            feature=feature, side="right" if row["right"] else "left", base=base, **fields
        )

    def __repr__(self) -> str:
        spans = [
            f"{name} {self.columns[name].min():.3g} … {self.columns[name].max():.3g}"
            for name in ("size", *_FIELDS[:2])
        ]
        return (
            f"{len(self):,} sampled trials"
            f" ({', '.join(feature.name for feature in self.features)}): {', '.join(spans)}"
        )


@checked
def sample_trials(
    n: Drawn,
    *,
    features: Sequence[Any] = ("ball", "box", "triangle"),
    sizes: Spread | None = LogRange(1.0, 4.0),
    locations: Spread = (0.4, 0.95),
    speeds: Spread = LogRange(0.06, 0.6),
    approach: Spread = (70.0, 110.0),
    friction: Spread = (0.5, 1.0),
    lead: Spread = LEAD,
    azimuth: Spread = 0.0,
    sides: Sequence[str] = ("left", "right"),
    base: Mapping[str, Any] | None = None,
    antenna: Antenna | None = None,
    seed: Seed = 0,
) -> SampledTrials:
    """Random touches by ranges or distributions; the k-th is the same however many are drawn.

    Each of ``sizes``, ``locations``, ``speeds``, ``approach``, ``friction``, ``lead`` and
    ``azimuth`` is a number, a range (low, high), a list of choices, a ``LogRange``, or a frozen
    distribution of scipy.stats. Every parameter has a random stream of its own, so that another
    range for one leaves the others as they were. A touch that cannot be placed is drawn again. The
    defaults are choices [C] around the paper's ninety touches.

    Parameters
    ----------
    features
        Kinds, or features, all equally likely.
    sizes
        Half-widths [mm]; None leaves features as large as they were given.
    locations, speeds, approach, friction, lead, azimuth
        As in :class:`feeler.Trial`.
    sides
        ``("left",)`` for one side only.
    base
        Spreads of the base's constant velocity, ``{"x": (-0.1, 0.1), "y": 0.0, "turn": 0.0}``
        [mm/ms, rad/ms]; default: it is clamped.
    antenna
        What must be touched; default: the cockroach's.

    Raises
    ------
    InvalidInput
        A value that no trial may have, or ranges in which touches cannot be placed; the message
        says why.
    """
    antenna = antenna or cockroach()
    if isinstance(features, str) or not len(features):
        raise InvalidInput(f"features must be a list of kinds or features, got {features!r}.")
    known = tuple(f if isinstance(f, Feature) else make_feature(f, 1.0) for f in features)
    if endless := [f.name for f in known if not np.isfinite(f.size)]:
        raise InvalidInput(
            f"{endless[0]} has no size to be drawn; list bounded shapes, or make its trials one by"
            " one."
        )
    if not sides or not {*sides} <= {"left", "right"}:
        raise InvalidInput(f"sides must be left, right or both, got {[*sides]}.")
    fields = (locations, speeds, approach, friction, lead)
    spreads: dict[str, Spread] = dict(zip(_FIELDS, fields, strict=True))
    spreads |= {"size": sizes} if sizes is not None else {}
    flat = isinstance(azimuth, int | float | np.number) and azimuth == 0
    spreads |= {} if flat else {TURNED: azimuth}
    if base is not None:
        if not {*base} <= {*_BASE}:
            raise InvalidInput(
                f"base has spreads of {', '.join(_BASE)}, got {', '.join(map(str, base))}."
            )
        spreads |= {name: base.get(name, 0.0) for name in _BASE}
    columns = _draw(n, spreads, len(known), [*sides], seed)
    _check_ends(columns, known)
    recipe = {
        "features": [to_jsonable(feature) for feature in known],
        **{name: describe_spread(spread) for name, spread in spreads.items()},
        "sides": [*sides],
        "antenna": compute_digest(antenna)[:16],
        "seed": int(seed),
    }
    trials = SampledTrials(columns, known, antenna, recipe)
    _redraw(trials, antenna, lambda again: _draw(n, spreads, len(known), [*sides], seed, again))
    return trials


def _draw(
    n: Drawn,
    spreads: dict[str, Spread],
    n_features: int,
    sides: list[str],
    seed: Seed,
    again: int = 0,
) -> dict:
    columns = {
        name: spread_out(s, name, draw_shares(seed, name, n, again))
        for name, s in spreads.items()
    }
    columns.setdefault("size", np.full(n, np.nan))
    columns["feature"] = (draw_shares(seed, "feature", n, again) * n_features).astype(np.int32)
    side = (draw_shares(seed, "side", n, again) * len(sides)).astype(int)
    return columns | {"right": np.array([name == "right" for name in sides])[side]}


def _check_ends(columns: dict[str, np.ndarray], features: tuple[Feature, ...]) -> None:
    """Refuse values that no trial may have; these are intervals, so that the ends tell."""
    for pick in (np.min, np.max):
        names = [name for name in (*_FIELDS, TURNED) if name in columns]
        fields: dict[str, Any] = {name: float(pick(columns[name])) for name in names}
        Trial(feature=features[0], **fields)
        if not np.isnan(columns["size"][0]) and not pick(columns["size"]) > 0:
            raise InvalidInput(f"sizes must be > 0 mm, got {pick(columns['size']):.3g}.")


def _redraw(trials: SampledTrials, antenna: Antenna, draw: Any) -> None:
    """Draw again what cannot be placed."""
    left, reason = np.flatnonzero(~_fits_surely(trials, antenna)), ""
    for again in range(1, _ATTEMPTS + 1):
        bad = []
        for index in left:
            try:
                place(antenna, trials[int(index)])
            except InvalidInput as error:
                bad.append(index)
                reason = str(error)
        left = np.array(bad, dtype=int)
        if not left.size:
            return
        if left.size > _HOPELESS * len(trials) > _HOPELESS * _ATTEMPTS:
            break
        fresh = draw(again)
        for name, values in fresh.items():
            trials.columns[name][left] = values[left]
    raise InvalidInput(
        f"{left.size:,} of {len(trials):,} touches cannot be placed in these ranges. The last"
        f" reason: {reason} Narrow the ranges."
    )


def _fits_surely(trials: SampledTrials, antenna: Antenna) -> np.ndarray:
    """Touches (trial,) known to fit without looking: a convex thing no wider than a straight,
    clamped antenna of one radius.

    Drawn back from it along a line, one convex body leaves another and does not meet it again.
    """
    straight = not antenna.rest_angle.any() and np.all(antenna.radius == antenna.radius[0])
    if not straight or antenna.spatial or {"x", TURNED} & trials.columns.keys():
        return np.zeros(len(trials), bool)
    convex = np.array([len(feature.parts) == 1 for feature in trials.features])
    own = np.array([feature.size for feature in trials.features])
    code, size = trials.columns["feature"], trials.columns["size"]
    size = np.where(np.isnan(size), own[code], size)
    return convex[code] & (2 * size <= antenna.length)


# Tasks: what is to be discriminated, within which nuisances, in which noise and by when.

# Nuisances: how much the touches of one class differ in what is not asked for.

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
        from scipy.special import ndtri  # slow to load

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
            value = _read_spread(getattr(self, name), f"Nuisances.{name}")
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
        """These nuisances, all others zero."""
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
        about = {
            "size": self._about(self.size, trial.feature.size, share=True),
            "location": self._about(self.location, trial.location, low=small, high=1.0),
            "speed": self._about(self.speed, trial.speed, share=True),
            "approach": self._about(self.approach, trial.approach, low=wide[0], high=wide[1]),
            "friction": self._about(self.friction, trial.friction, share=True),
        }
        if self._turns:
            about[TURNED] = self._about(self.azimuth, trial.azimuth, low=-360.0, high=360.0)
        return about

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


def _read_spread(value: Any, name: str) -> Spread:
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


# Task: what is to be discriminated, in which noise and by when; touches are drawn from it.

_PEAK = Relative(1.0)
_MAX_CLASSES = 1000  # [C]
_SETS = 1 << 64  # what a set's number is multiplied by in a seed


class Task(Record):
    """Classes (object × place) to be discriminated at each speed, each touch drawn within
    nuisances.

    Attributes
    ----------
    objects : Any
        What touches: bounded features, or text such as ``"ball:radius=2"``.
    locations : tuple[Annotated[float, Gt(0), Le(1)], ...]
        Where, as shares of the antenna's length.
    speeds : tuple[Annotated[float, Gt(0)], ...]
        [m/s]; the speed of a touch is known to who is asked, so each is a task of its own.
    nuisances : Nuisances
        How touches of one class differ.
    noise : Noise
        On each sample of each sensor; text such as ``"relative:0.1"`` is read.
    deadline : float
        Time since contact [ms] whose samples may be used.
    lead : Spread
        Time before contact [ms].
    seeds : Any
        A seed for each purpose for which touches are drawn; they differ.

    Raises
    ------
    InvalidInput
        No object, two of one name, a nuisance that no touch can have, or a field outside its range.
    """

    objects: Any = field(default_factory=make_features)
    locations: Annotated[tuple[Annotated[float, Gt(0), Le(1)], ...], Len(1)] = LOCATIONS
    speeds: Annotated[tuple[Annotated[float, Gt(0)], ...], Len(1)] = (0.3,)
    nuisances: Nuisances = field(default_factory=Nuisances)
    noise: Noise = _PEAK
    deadline: Annotated[float, Gt(0), Unit("ms")] = 100.0
    lead: Spread = LEAD
    seeds: Any = (("train", 1), ("test", 2), ("final", 3))

    def _check(self) -> None:
        items = (
            (self.objects,)
            if isinstance(self.objects, str | Feature | Mapping)
            else self.objects
        )
        vars(self).update(
            objects=tuple(
                map(_read_object, items if isinstance(items, Iterable) else (items,))
            ),
            lead=_read_spread(self.lead, "lead"),
            seeds=_read_seeds(self.seeds),
        )
        self._check_classes()
        for location in self.locations:
            trial = Trial(feature=self.objects[0], location=location, speed=self.speeds[0])
            for name, spread in self.nuisances.spread(trial).items():
                for end in spread if name != "size" and isinstance(spread, tuple) else ():
                    try:
                        trial.replace(**{name: end})
                    except InvalidInput as error:
                        raise InvalidInput(
                            f"the nuisance {name} cannot be placed at {location:g}: {error}"
                        ) from error
        numbers = [number for _, number in self.seeds]
        if not numbers or len({*numbers}) < len(numbers):
            raise InvalidInput(
                f"the seeds of the purposes must differ, got {dict(self.seeds)}: else a result is"
                " no test."
            )

    def _check_classes(self) -> None:
        if not self.objects:
            raise InvalidInput(
                "a task needs an object: give objects=, such as ['ball:radius=2']."
            )
        if self.n_classes > _MAX_CLASSES:
            raise InvalidInput(
                f"a task has at most {_MAX_CLASSES} classes (objects × locations), got"
                f" {self.n_classes}."
            )
        for name, values in (("locations", self.locations), ("speeds", self.speeds)):
            if len({*values}) < len(values):
                raise InvalidInput(f"{name} must be different numbers, got {values}.")
        if twice := [label for label, count in Counter(self.labels).items() if count > 1]:
            raise InvalidInput(f"two objects are called {twice[0]!r}; give each its own name=.")

    @property
    def n_classes(self) -> int:
        """Objects × locations."""
        return len(self.objects) * len(self.locations)

    @property
    def labels(self) -> list[str]:
        """What each class is called, location by location."""
        return [
            f"{item.name} {item.size:g} mm at {place:g}"
            for place in self.locations
            for item in self.objects
        ]

    @property
    def duration(self) -> float:
        """Recorded time of a touch [ms]: the longest lead, and on to the deadline."""
        lead: Any = self.lead
        lead = lead if isinstance(lead, int | float) else max(lead)
        return lead + float(np.ceil(self.deadline))

    def to_plain(self) -> dict[str, Any]:
        """The task as plain data; ``type(task)(**plain)`` is equal."""
        return super().to_plain() | {
            "lead": describe_spread(self.lead),
            "seeds": dict(self.seeds),
        }

    def draw(
        self,
        antenna: Antenna | None = None,
        purpose: str = "train",
        *,
        set: int = 0,
        speed: float | None = None,
        each: int = 1,
    ) -> tuple[list[Trial], np.ndarray]:
        """Touches for a purpose, and the label of each: class by class, ``each`` of every class.

        The k-th touch of a class depends on the purpose's seed, the set and the class alone. So all
        antennas and speeds meet the same touches; one that cannot be placed on the antenna is drawn
        again.

        Parameters
        ----------
        antenna
            What is touched; default: the cockroach's.
        purpose
            One of those that ``seeds`` names.
        set
            Number of the set of touches, ≥ 0.
        speed
            [m/s]; default: each of the task's speeds, one after the other.
        each
            Touches of each class.

        Raises
        ------
        InvalidInput
            No such purpose, or touches that cannot be placed.
        """
        seeds = dict(self.seeds)
        if purpose not in seeds:
            raise InvalidInput(
                f"touches are drawn for one of {', '.join(seeds)}, got {purpose!r}."
            )
        if set < 0:
            raise InvalidInput(f"the number of a set must be ≥ 0, got {set}.")
        first = _SETS * set + _MAX_CLASSES * seeds[purpose]
        speeds = self.speeds if speed is None else (speed,)
        trials = [
            trial
            for now in speeds
            for number in range(self.n_classes)
            for trial in self._draw_class(antenna, number, first + number, now, each)
        ]
        return trials, np.tile(np.repeat(self.labels, each), len(speeds))

    def mix(self, n: int, antenna: Antenna | None = None, *, seed: int = 0) -> SampledTrials:
        """``n`` touches of objects drawn at random, for who is not told which speed or place it is.

        All are at the first speed. ``nuisances`` say where size and location lie, as a range or
        other spread of the value itself; a size nuisance of 0 leaves objects as large as they are.

        Raises
        ------
        InvalidInput
            More than one location, a share of the size, or touches that cannot be placed.
        """
        by = self.nuisances
        if len(self.locations) > 1 or (is_number(by.size) and by.size):
            raise InvalidInput(
                "touches of all objects together need one location and sizes as a range [mm]: give"
                " Nuisances(location=(0.5, 0.9), size=(1.0, 2.0)), or size=0."
            )
        nominal = Trial(
            feature=self.objects[0], location=self.locations[0], speed=self.speeds[0]
        )
        spreads = by.spread(nominal)
        if is_number(by.size):
            spreads["size"] = None
        return self._sample(n, self.objects, spreads, antenna, seed)

    def _draw_class(
        self, antenna: Antenna | None, number: int, seed: int, speed: float, each: int
    ) -> list[Trial]:
        place, which = divmod(number, len(self.objects))
        nominal = Trial(
            feature=self.objects[which], location=self.locations[place], speed=speed
        )
        spreads = self.nuisances.spread(nominal)
        try:
            return [*self._sample(each, [nominal.feature], spreads, antenna, seed)]
        except InvalidInput as error:
            raise InvalidInput(f"{self.labels[number]} cannot be drawn: {error}") from error

    def _sample(
        self,
        n: int,
        objects: Sequence[Feature],
        spreads: dict[str, Spread],
        antenna: Antenna | None,
        seed: int,
    ) -> SampledTrials:
        return sample_trials(
            n,
            features=objects,
            sizes=spreads["size"],
            locations=spreads["location"],
            speeds=spreads["speed"],
            approach=spreads["approach"],
            friction=spreads["friction"],
            azimuth=spreads.get("azimuth", 0.0),
            lead=self.lead,
            sides=("left",),
            antenna=antenna,
            seed=seed,
        )


def _read_seeds(value: Any) -> tuple[tuple[str, int], ...]:
    """Purposes and their seeds, from a table or from pairs."""
    try:
        pairs = tuple((str(name), seed) for name, seed in dict(value).items())
        if all(operator.index(seed) >= 0 and not isinstance(seed, bool) for _, seed in pairs):
            return tuple((name, int(seed)) for name, seed in pairs)
    except (TypeError, ValueError):
        pass
    raise InvalidInput(f"seeds must be whole numbers ≥ 0 by purpose, got {show(value)}.")


def _read_object(item: Any) -> Feature:
    if isinstance(item, Mapping):
        item = make_feature(item)
    made = parse_feature(item, 1.5) if isinstance(item, str) else item
    if not (isinstance(made, Feature) and np.isfinite(made.size)):
        raise InvalidInput(
            "objects must be bounded features or text such as 'ball:radius=2', got"
            f" {str(made)[:60]}."
        )
    return made
