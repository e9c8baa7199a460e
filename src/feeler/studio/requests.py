"""Requests of a page as validated data, its choices, and touches sent piece by piece."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import field
from functools import lru_cache
from importlib.metadata import version
from itertools import pairwise
from threading import Event
from typing import Annotated, Any, Literal

import numpy as np

from feeler.antenna.animals import FACTS
from feeler.antenna.files import SOURCE_TAGS, parse_antenna, write_antenna
from feeler.antenna.segments import Antenna, compute_modes, make_even_sensors, require_plane
from feeler.errors import InvalidInput
from feeler.objects.bodies import Object
from feeler.objects.shapes import Feature, make_feature, trace_rim
from feeler.objects.trials import HALF_SIZES, LOCATIONS, SPEEDS, Trial
from feeler.physics.simulation import Simulations, build_scene
from feeler.presets import PRESETS, make_preset
from feeler.records import Ge, Le, Len, Record, Unit
from feeler.robot.description import ROBOT_FACTS

# Wishes: what a page asks to be shown, as validated data. Whatever is shown follows from a wish
# alone.

_MAX_DURATION = 2000.0  # [C] ms
# ms; the coarsest timestep that the contact allows, for what is shown while something is dragged
PREVIEW = 0.1
_FACTOR = 50.0  # [C] an antenna may be stretched and shrunk by this
_Kind = Literal["ball", "box", "triangle", "wall"]
_Handles = Annotated[
    tuple[tuple[Annotated[float, Ge(0), Le(1)], Annotated[float, Ge(1e-12), Le(1e9)]], ...],
    Len(1, 64),
]
_HalfWidth = Annotated[float, Ge(0.01), Le(1e3), Unit("mm")]
_Friction = Annotated[float, Ge(0), Le(100)]
_Place = Annotated[float, Ge(-1e4), Le(1e4), Unit("mm")]


class AntennaRequest(Record):
    """A preset or an antenna file, and what was changed of it.

    Attributes
    ----------
    preset : str
        Name of a preset; what is not changed is the preset's own, to the last bit.
    toml : str
        The text of an antenna file, in place of the preset.
    stiffness : Handles | None
        Handles (share of the hinges from the base, N·mm/rad); between them straight lines of the
        logarithm.
    damping : Handles | None
        The same for damping [N·mm·ms/rad].
    length : float | None
        Length [mm]; segments and their masses are stretched alike.
    sensors : int | None
        How many sensors, spread evenly over the hinges.
    matched : bool
        Whether stiffness is scaled so that the total compliance Σ 1/k stays that of the preset.
    name : str
        What the antenna is called; default: as the preset or the file says.
    """

    preset: Annotated[str, Len(0, 40)] = "exponential"
    toml: Annotated[str, Len(0, 400_000)] = ""
    stiffness: _Handles | None = None
    damping: _Handles | None = None
    length: Annotated[float, Ge(0.01), Le(1e5), Unit("mm")] | None = None
    sensors: Annotated[int, Ge(1), Le(1000)] | None = None
    matched: bool = False
    name: Annotated[str, Len(0, 80)] = ""

    def _check(self) -> None:
        for name in ("stiffness", "damping"):
            if any(b[0] <= a[0] for a, b in pairwise(getattr(self, name) or ())):
                raise InvalidInput(f"the handles of {name} must rise from base to tip.")

    def make(self) -> Antenna:
        """The antenna that is wished for, where it must lie in one plane."""
        antenna = _make_antenna(self)
        require_plane(antenna, "this part of the studio")
        return antenna

    def make_any(self) -> Antenna:
        """The antenna that is wished for, also one in space."""
        return _make_antenna(self)


@lru_cache(maxsize=16)
def _read_original(preset: str, toml: str) -> Antenna:
    return parse_antenna(toml, "the antenna file").antenna if toml else make_preset(preset)


@lru_cache(maxsize=64)
def _make_antenna(wish: AntennaRequest) -> Antenna:
    original = _read_original(wish.preset, wish.toml)
    changes: dict[str, Any] = {}
    if original.spatial and (wish.stiffness or wish.damping):
        raise InvalidInput(
            f"handles change a profile in one plane, and {original.name!r} is an antenna in space:"
            " change its file, which has a row for each plane."
        )
    for name in ("stiffness", "damping"):
        if (handles := getattr(wish, name)) is not None:
            # one value per segment (segment,): straight lines of the logarithm between handles,
            # level beyond them
            at, values = [pair[0] for pair in handles], [pair[1] for pair in handles]
            changes[name] = np.exp(
                np.interp(np.linspace(0.0, 1.0, original.n_segments), at, np.log(values))
            )
    if wish.matched and "stiffness" in changes:
        changes["stiffness"] *= _compute_compliance(changes["stiffness"]) / _compute_compliance(
            original.stiffness
        )
    if wish.length is not None:
        factor = wish.length / original.length
        if not 1 / _FACTOR <= factor <= _FACTOR:
            raise InvalidInput(
                f"length must lie within {original.length / _FACTOR:.3g} and"
                f" {original.length * _FACTOR:.3g} mm."
            )
        changes["segment_length"] = factor * original.segment_length
        changes["segment_mass"] = factor * original.segment_mass
    if wish.sensors is not None:
        changes["sensors"] = make_even_sensors(original.n_segments, wish.sensors)
    if wish.name:
        changes["name"] = wish.name
    return original.replace(**changes) if changes else original


def _compute_compliance(stiffness: np.ndarray) -> float:
    """Σ 1/k [rad/(N·mm)] of all hinges in series; infinite with a free hinge."""
    with np.errstate(divide="ignore"):
        return float(np.sum(1 / stiffness))


class ObjectRequest(Record):
    """One more object, which stands somewhere or moves by itself.

    Attributes
    ----------
    kind, size, friction
        Shape, radius or half-width [mm], and coefficient of friction.
    x, y : float
        Place of its foremost point [mm], x across and y along the antenna at rest.
    heading : float
        Where its front points [degrees], from +y towards +x.
    speed : float
        [mm/ms], the way its front points.
    """

    kind: _Kind = "ball"
    size: _HalfWidth = 1.5
    x: _Place = 4.0
    y: _Place = 20.0
    heading: Annotated[float, Ge(-360), Le(360), Unit("degrees")] = 90.0
    speed: Annotated[float, Ge(0), Le(10), Unit("mm/ms")] = 0.0
    friction: _Friction = 1.0

    def make(self, number: int) -> Object:
        """The object, with a name of its own."""
        turn = np.radians(self.heading)
        forward = (float(np.sin(turn)), float(np.cos(turn)))
        return Object(
            feature=make_shape(self.kind, self.size),
            place=(self.x, self.y),
            forward=forward,
            velocity=(self.speed * forward[0], self.speed * forward[1]),
            friction=self.friction,
            name=f"object {number + 1}",
        )


class TouchRequest(Record):
    """One touch of an antenna: a trial, and objects beside it.

    Attributes
    ----------
    antenna : AntennaRequest
        What is touched.
    kind, size, location, speed, approach, side, friction, lead
        As in :class:`feeler.Trial`.
    azimuth : float
        Of an antenna in space [degrees], as in :class:`feeler.Trial`; in the plane there is none.
    duration : float
        Recorded time [ms], in whole samples.
    objects : tuple[ObjectRequest, ...]
        What stands or moves beside it.
    preview : bool
        Whether coarse steps will do, because the next wish is already on its way.
    """

    antenna: AntennaRequest = field(default_factory=AntennaRequest)
    kind: _Kind = "ball"
    size: _HalfWidth = 1.5
    location: Annotated[float, Ge(1e-3), Le(1)] = 0.7
    speed: Annotated[float, Ge(1e-3), Le(4), Unit("m/s")] = 0.06
    approach: Annotated[float, Ge(1), Le(179), Unit("degrees")] = 90.0
    side: Literal["left", "right"] = "left"
    friction: _Friction = 1.0
    lead: Annotated[float, Ge(0.1), Le(500), Unit("ms")] = 5.0
    azimuth: Annotated[float, Ge(-180), Le(180), Unit("degrees")] = 0.0
    duration: Annotated[float, Ge(2), Le(_MAX_DURATION), Unit("ms")] = 380.0
    objects: Annotated[tuple[ObjectRequest, ...], Len(0, 8)] = ()
    preview: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        vars(self)["duration"] = float(round(self.duration))

    def make_trial(self) -> Trial:
        """The trial."""
        return Trial(
            feature=make_shape(self.kind, self.size),
            location=self.location,
            speed=self.speed,
            approach=self.approach,
            side=self.side,
            friction=self.friction,
            lead=self.lead,
            azimuth=self.azimuth if self.antenna.make_any().spatial else 0.0,
        )

    def make_objects(self) -> list[Trial | Object]:
        """The trial and the objects beside it."""
        return [
            self.make_trial(),
            *(item.make(number) for number, item in enumerate(self.objects)),
        ]


def make_shape(kind: str, size: float) -> Feature:
    """A feature of one size: box and triangle as high as wide, as in the paper; a wall has none."""
    if kind == "wall":
        return make_feature("wall")
    return (
        make_feature(kind, size, half_height=size)
        if kind == "box"
        else make_feature(kind, size)
    )


def read_number(value: object, name: str, low: float, high: float) -> float:
    """A finite number within a range."""
    if (
        isinstance(value, bool)
        or not isinstance(value, int | float)
        or not low <= value <= high
    ):
        raise InvalidInput(
            f"{name} must be a number from {low:g} to {high:g}, got {str(value)[:40]}."
        )
    return float(value)


def wish_for(antenna: Antenna | str) -> AntennaRequest:
    """The wish for a preset by name, or for an antenna as it is."""
    if isinstance(antenna, Antenna):
        return AntennaRequest(toml=write_antenna(antenna), name=antenna.name)
    wish = AntennaRequest(preset=antenna)
    wish.make_any()
    return wish


# A touch, sent piece by piece while it is simulated: the same bits as ``feeler.touch``.

SAMPLE_INTERVAL = 1.0  # ms between samples
_FIRST, _PIECE = (
    12,
    46,
)  # samples; the first is short, so that something is seen at once; each costs 2 ms on its way
_REACH = 400.0  # mm; faces without end are drawn as far as this


def read_sample(simulation: Simulations) -> dict[str, np.ndarray]:
    """What a page is shown of a simulation of one lane, now.

    Raises
    ------
    SimulationDivergedError
        There is nothing to read any more.
    """
    if simulation.failed[0] is not None:
        raise simulation.failed[0]
    state = simulation.state
    turn = np.arctan2(state.forward[0, :, 0], state.forward[0, :, 1])
    return {
        "angle": state.angle[0],
        "place": np.column_stack([state.place[0], turn]),
        "force": state.force[0],
        "base": state.base[0],
        "contact": state.contact_place[0],
        "moment": state.base_moment[0],
    }


def join_samples(samples: list[dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
    """Arrays (sample, …) of what came one by one."""
    return {name: np.array([one[name] for one in samples]) for name in samples[0]}


def make_simulation(wish: TouchRequest) -> Simulations:
    """The simulation of a wish at time 0."""
    scene = build_scene(wish.antenna.make(), wish.make_objects())
    return Simulations(
        [scene], timestep=scene.contact.scale_timestep(PREVIEW) if wish.preview else None
    )


def simulate_pieces(
    wish: TouchRequest, stop: Event
) -> Iterator[tuple[int, dict[str, np.ndarray]]]:
    """Number of the first sample and readings of each piece; ends early when ``stop`` is set."""
    simulation, n_samples, piece = make_simulation(wish), count_samples(wish), []
    done, size = 0, _FIRST
    for k in range(n_samples):
        if stop.is_set():
            return
        if k:
            simulation.step(SAMPLE_INTERVAL)
        piece.append(read_sample(simulation))
        if len(piece) == size or k == n_samples - 1:
            yield done, join_samples(piece)
            done, size, piece = k + 1, _PIECE, []


def count_samples(wish: TouchRequest) -> int:
    """Samples of a whole touch."""
    return round(wish.duration / SAMPLE_INTERVAL)


def describe_antenna(antenna: Antenna) -> dict[str, Any]:
    """What a page needs to draw an antenna and to label its tensor; in space profiles are those of
    bending towards x.
    """
    profiles = {
        "stiffness": antenna.stiffness,
        "damping": antenna.damping,
        "rest": antenna.rest_angle,
    }
    own = {"planes": list(antenna.planes)} if antenna.spatial else {}
    return own | {
        "name": antenna.name,
        "length": antenna.length,
        "segments": antenna.segment_length.tolist(),
        "radius": float(antenna.radius.mean()),
        "sensors": antenna.sensors.tolist(),
        **{name: np.atleast_2d(rows)[0].tolist() for name, rows in profiles.items()},
    }


@lru_cache(maxsize=64)
def describe_mode(antenna: Antenna) -> dict[str, float | None]:
    """Damped frequency [kHz] and damping ratio of the first mode; no frequency where it does not
    swing.
    """
    modes = compute_modes(antenna, 1)
    ratio = float(modes.damping_ratio[0])
    swings = ratio < 1 and modes.frequency[0] > 0
    return {
        "frequency": float(modes.frequency[0] * np.sqrt(1 - ratio**2)) if swings else None,
        "damping_ratio": ratio if np.isfinite(ratio) else None,
    }


def describe_scene(wish: TouchRequest) -> dict[str, Any]:
    """What a page needs to draw a touch: the antenna, and each object's outlines."""
    features = [
        item.shape if isinstance(item, Trial) else item.feature for item in wish.make_objects()
    ]
    return {
        "antenna": describe_antenna(wish.antenna.make()),
        "rims": [draw_feature(feature) for feature in features],
        "preview": wish.preview,
    }


def draw_feature(feature: Feature) -> list[list[list[float]]]:
    """Outlines (point, 2) [mm] of a feature's parts in its own frame: first axis forwards, second
    to the left.
    """
    rims = (trace_rim(part, feature.rounding) for part in feature.parts)
    return [np.clip(rim, -_REACH, _REACH).round(4).tolist() for rim in rims]


def hash_tensor(tensor: np.ndarray) -> str:
    """SHA-256 of a tensor (sensor, time) as float32."""
    return hashlib.sha256(np.ascontiguousarray(tensor, dtype="<f4").tobytes()).hexdigest()


# The catalogue: what a page can choose from, and where each number comes from.

_HANDLES = 5  # [C] of a profile that is not changed yet


def make_catalogue(first: AntennaRequest) -> dict[str, Any]:
    """Presets, shapes, the paper's grid, facts and their tags, as plain data."""
    return {**_make_fixed(), "first": first.to_plain()}


@lru_cache(maxsize=1)
def _make_fixed() -> dict[str, Any]:
    known = {name: make_preset(name) for name in PRESETS if name != "cockroach"}
    return {
        "version": version("feeler"),
        "speeds": SPEEDS,
        "locations": LOCATIONS,
        "sizes": HALF_SIZES,
        "presets": {name: describe_original(antenna) for name, antenna in known.items()},
        "tags": SOURCE_TAGS,
        "facts": {
            name: {"value": fact.value, "unit": fact.unit, "tag": fact.tag, "note": fact.note}
            for name, fact in FACTS.items()
        },
        "robot facts": {
            name: {"unit": fact.unit, "tag": fact.tag, "note": fact.note}
            for name, fact in ROBOT_FACTS.items()
        },
    }


def describe_original(antenna: Antenna) -> dict[str, Any]:
    """An unchanged antenna: what is drawn, and handles from which it may be changed; in space of
    bending towards x.
    """
    shown = describe_antenna(antenna)
    return {
        **shown,
        "compliance": _compute_compliance(np.array(shown["stiffness"])),
        "handles": {name: _make_handles(shown[name]) for name in ("stiffness", "damping")},
    }


def _make_handles(values: Sequence[float]) -> list[list[float]]:
    """Handles on a profile, evenly spaced, four digits; every hinge where there are few."""
    n = len(values)
    at = np.unique(np.round(np.linspace(0, n - 1, min(_HANDLES, n))).astype(int))
    share = at / max(n - 1, 1)
    return [
        [float(x), float(f"{max(values[i], 1e-12):.4g}")]
        for x, i in zip(share, at, strict=True)
    ]
