"""Wishes: what a page asks to be shown, as validated data. Whatever is shown follows from a wish
alone.
"""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from functools import lru_cache
from itertools import pairwise
from typing import Any, TypeVar

import numpy as np

from feeler.antenna.antenna import Antenna, make_even_sensors
from feeler.antenna.file import write_antenna
from feeler.antenna.parse import parse_antenna
from feeler.errors import InvalidInput
from feeler.presets import make_preset
from feeler.stimulus.feature import Feature, make_feature
from feeler.stimulus.object import Object
from feeler.stimulus.trial import Trial

KINDS = ("ball", "box", "triangle", "wall")
MAX_DURATION = 2000.0  # [C] ms
MAX_OBJECTS = 8  # [C]
MAX_HANDLES = 64  # [C]
# ms; the coarsest timestep that the contact allows, for what is shown while something is dragged
PREVIEW = 0.1
FACTOR = 50.0  # [C] an antenna may be stretched and shrunk by this
Handles = tuple[tuple[float, float], ...]
W = TypeVar("W", bound="Wish")


@dataclass(frozen=True, kw_only=True)
class Wish:
    """Base: plain data in, checked; unknown fields are refused."""

    @classmethod
    def read(cls: type[W], content: Any) -> W:
        """From the plain data of a message."""
        if not isinstance(content, Mapping):
            raise InvalidInput(
                f"{cls.__name__} must be an object with fields, got {str(content)[:40]!r}."
            )
        known = [item.name for item in fields(cls)]
        if unknown := [str(key)[:40] for key in content if key not in known]:
            raise InvalidInput(f"{cls.__name__} has no {unknown[0]!r}; valid: {', '.join(known)}.")
        return cls(**content)

    def to_plain(self) -> dict[str, Any]:
        """Plain data that :meth:`read` takes."""
        return asdict(self)

    def _number(self, name: str, low: float, high: float) -> None:
        object.__setattr__(
            self, name, read_number(getattr(self, name), f"{type(self).__name__}.{name}", low, high)
        )

    def _text(self, name: str, most: int) -> None:
        if not isinstance(getattr(self, name), str) or len(getattr(self, name)) > most:
            raise InvalidInput(
                f"{type(self).__name__}.{name} must be text of at most {most} characters."
            )


@dataclass(frozen=True, kw_only=True)
class AntennaWish(Wish):
    """A preset or an antenna file, and what was changed of it."""

    preset: str = "exponential"
    """Name of a preset; what is not changed is the preset's own, to the last bit."""
    toml: str = ""
    """The text of an antenna file, in place of the preset."""
    stiffness: Handles | None = None
    """Handles (share of the hinges from the base, N·mm/rad); between them straight lines of the
    logarithm.
    """
    damping: Handles | None = None
    """The same for damping [N·mm·ms/rad]."""
    length: float | None = None
    """Length [mm]; segments and their masses are stretched alike."""
    sensors: int | None = None
    """How many sensors, spread evenly over the hinges."""
    matched: bool = False
    """Whether stiffness is scaled so that the total compliance Σ 1/k stays that of the preset."""
    name: str = ""

    def __post_init__(self) -> None:
        self._text("preset", 40)
        self._text("toml", 400_000)
        self._text("name", 80)
        for name in ("stiffness", "damping"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _read_handles(getattr(self, name), name))
        if self.length is not None:
            self._number("length", 0.01, 1e5)
        if self.sensors is not None and not (
            type(self.sensors) is int and 1 <= self.sensors <= 1000
        ):
            raise InvalidInput(
                f"AntennaWish.sensors must be a whole number from 1 to 1000, got {self.sensors!r}."
            )
        if not isinstance(self.matched, bool):
            raise InvalidInput("AntennaWish.matched must be true or false.")

    def make_original(self) -> Antenna:
        """The preset, or what the file holds."""
        return _read_original(self.preset, self.toml)

    def make(self) -> Antenna:
        """The antenna that is wished for."""
        return _make_antenna(self)


@lru_cache(maxsize=16)
def _read_original(preset: str, toml: str) -> Antenna:
    return parse_antenna(toml, "the antenna file").antenna if toml else make_preset(preset)


@lru_cache(maxsize=64)
def _make_antenna(wish: AntennaWish) -> Antenna:
    original = wish.make_original()
    changes: dict[str, Any] = {}
    for name in ("stiffness", "damping"):
        if (handles := getattr(wish, name)) is not None:
            changes[name] = sample_handles(handles, original.n_segments)
    if wish.matched and "stiffness" in changes:
        changes["stiffness"] *= compute_compliance(changes["stiffness"]) / compute_compliance(
            original.stiffness
        )
    if wish.length is not None:
        factor = wish.length / original.length
        if not 1 / FACTOR <= factor <= FACTOR:
            raise InvalidInput(
                f"length must lie within {original.length / FACTOR:.3g} and"
                f" {original.length * FACTOR:.3g} mm."
            )
        changes["segment_length"] = factor * original.segment_length
        changes["segment_mass"] = factor * original.segment_mass
    if wish.sensors is not None:
        changes["sensors"] = make_even_sensors(original.n_segments, wish.sensors)
    if wish.name:
        changes["name"] = wish.name
    return original.replace(**changes) if changes else original


def sample_handles(handles: Sequence[tuple[float, float]], n_segments: int) -> np.ndarray:
    """One value per segment (segment,): straight lines of the logarithm between handles, level
    beyond them.
    """
    at, values = [pair[0] for pair in handles], [pair[1] for pair in handles]
    return np.exp(np.interp(np.linspace(0.0, 1.0, n_segments), at, np.log(values)))


def compute_compliance(stiffness: np.ndarray) -> float:
    """Σ 1/k [rad/(N·mm)] of all hinges in series; infinite with a free hinge."""
    with np.errstate(divide="ignore"):
        return float(np.sum(1 / stiffness))


@dataclass(frozen=True, kw_only=True)
class ObjectWish(Wish):
    """One more object, which stands somewhere or moves by itself."""

    kind: str = "ball"
    size: float = 1.5
    """Radius or half-width [mm]."""
    x: float = 4.0
    """Place of its foremost point [mm], x across and y along the antenna at rest."""
    y: float = 20.0
    heading: float = 90.0
    """Where its front points [degrees], from +y towards +x."""
    speed: float = 0.0
    """[mm/ms], the way its front points."""
    friction: float = 1.0

    def __post_init__(self) -> None:
        _check_kind(self.kind)
        self._number("size", 0.01, 1e3)
        self._number("friction", 0.0, 100.0)
        self._number("speed", 0.0, 10.0)
        for name in ("x", "y"):
            self._number(name, -1e4, 1e4)
        self._number("heading", -360.0, 360.0)

    def make(self, number: int) -> Object:
        """The object, with a name of its own."""
        turn = np.radians(self.heading)
        forward = (float(np.sin(turn)), float(np.cos(turn)))
        return Object(
            feature=_make_shape(self.kind, self.size),
            place=(self.x, self.y),
            forward=forward,
            velocity=(self.speed * forward[0], self.speed * forward[1]),
            friction=self.friction,
            name=f"object {number + 1}",
        )


@dataclass(frozen=True, kw_only=True)
class TouchWish(Wish):
    """One touch of an antenna: a trial, and objects beside it."""

    antenna: AntennaWish = field(default_factory=AntennaWish)
    kind: str = "ball"
    size: float = 1.5
    """Radius or half-width [mm]."""
    location: float = 0.7
    """Where it meets the antenna, as a share of its length."""
    speed: float = 0.06
    """[mm/ms = m/s]"""
    approach: float = 90.0
    """Angle to the antenna [degrees]."""
    side: str = "left"
    friction: float = 1.0
    lead: float = 5.0
    """Time before contact [ms]."""
    duration: float = 380.0
    """[ms]"""
    objects: tuple[ObjectWish, ...] = ()
    preview: bool = False
    """Whether coarse steps will do, because the next wish is already on its way."""

    def __post_init__(self) -> None:
        if not isinstance(self.antenna, AntennaWish):
            object.__setattr__(self, "antenna", AntennaWish.read(self.antenna))
        _check_kind(self.kind)
        self._number("size", 0.01, 1e3)
        for name, low, high in (
            ("location", 1e-3, 1.0),
            ("speed", 1e-3, 4.0),
            ("approach", 1.0, 179.0),
        ):
            self._number(name, low, high)
        for name, low, high in (
            ("friction", 0.0, 100.0),
            ("lead", 0.1, 500.0),
            ("duration", 2.0, MAX_DURATION),
        ):
            self._number(name, low, high)
        object.__setattr__(self, "duration", float(round(self.duration)))
        if self.side not in ("left", "right"):
            raise InvalidInput(
                f"TouchWish.side must be left or right, got {str(self.side)[:40]!r}."
            )
        if not isinstance(self.objects, list | tuple) or len(self.objects) > MAX_OBJECTS:
            raise InvalidInput(f"TouchWish.objects must be a list of at most {MAX_OBJECTS}.")
        items = (
            item if isinstance(item, ObjectWish) else ObjectWish.read(item) for item in self.objects
        )
        object.__setattr__(self, "objects", tuple(items))
        if not isinstance(self.preview, bool):
            raise InvalidInput("TouchWish.preview must be true or false.")

    def make_trial(self) -> Trial:
        """The trial."""
        return Trial(
            feature=_make_shape(self.kind, self.size),
            location=self.location,
            speed=self.speed,
            approach=self.approach,
            side=self.side,
            friction=self.friction,
            lead=self.lead,
        )

    def make_objects(self) -> list[Trial | Object]:
        """The trial and the objects beside it."""
        return [self.make_trial(), *(item.make(number) for number, item in enumerate(self.objects))]


def _make_shape(kind: str, size: float) -> Feature:
    """A feature of one size: box and triangle as high as wide, as in the paper; a wall has none."""
    if kind == "wall":
        return make_feature("wall")
    return make_feature(kind, size, half_height=size) if kind == "box" else make_feature(kind, size)


def _check_kind(kind: object) -> None:
    """Refuse what the page has no shape for."""
    if not isinstance(kind, str) or kind not in KINDS:
        raise InvalidInput(f"kind must be one of {', '.join(KINDS)}, got {str(kind)[:40]!r}.")


def read_number(value: object, name: str, low: float, high: float) -> float:
    """A finite number within a range."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
        raise InvalidInput(
            f"{name} must be a number from {low:g} to {high:g}, got {str(value)[:40]}."
        )
    return float(value)


def _read_handles(value: object, name: str) -> Handles:
    """Handles that rise along the antenna, at least one."""
    if not isinstance(value, list | tuple) or not 1 <= len(value) <= MAX_HANDLES:
        raise InvalidInput(f"{name} must be 1 to {MAX_HANDLES} handles (place, value).")
    pairs = []
    for item in value:
        if not isinstance(item, list | tuple) or len(item) != 2:
            raise InvalidInput(
                f"a handle of {name} is a pair (place, value), got {str(item)[:40]}."
            )
        place = read_number(item[0], f"{name}: place", 0.0, 1.0)
        pairs.append((place, read_number(item[1], f"{name}: value", 1e-12, 1e9)))
    if any(b[0] <= a[0] for a, b in pairwise(pairs)):
        raise InvalidInput(f"the handles of {name} must rise from base to tip.")
    return tuple(pairs)


def wish_for(antenna: Antenna | str) -> AntennaWish:
    """The wish for a preset by name, or for an antenna as it is."""
    if isinstance(antenna, Antenna):
        return AntennaWish(toml=write_antenna(antenna), name=antenna.name)
    wish = AntennaWish(preset=antenna)
    wish.make()
    return wish
