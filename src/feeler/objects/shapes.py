"""Shapes of objects: convex parts and a rounding, in a frame of their own."""

import hashlib
import inspect
import re
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import MISSING, fields
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from feeler.errors import InvalidInput
from feeler.records import Len, Record, Registry, freeze
from feeler.validation import FieldError, checked, show

# Convex parts of a polygon, because contact is computed between convex bodies.


def measure_area(corners: np.ndarray) -> float:
    """Area of a polygon (corner, 2), positive where the corners run counter-clockwise."""
    x, y = np.asarray(corners).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def _is_convex(corners: np.ndarray, slack: float = 0.0) -> bool:
    """Whether a counter-clockwise polygon turns left at every corner, or right by no more than
    ``slack`` (an area).
    """
    edge = np.roll(corners, -1, axis=0) - corners
    before = np.roll(edge, 1, axis=0)
    return bool(np.all(before[:, 0] * edge[:, 1] - before[:, 1] * edge[:, 0] >= -slack))


def trace_rim(corners: np.ndarray, rounding: float) -> np.ndarray:
    """Points (point, 2) around a convex part grown by ``rounding``: 16 to each corner's arc, for
    drawing.
    """
    if rounding == 0:
        return corners
    turn = np.linspace(0.0, 2 * np.pi, 16 * max(len(corners), 4), endpoint=False)
    outward = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return corners[np.argmax(outward @ corners.T, axis=1)] + rounding * outward


@checked
def split_convex(corners: Annotated[np.ndarray, "corner 2"]) -> list[np.ndarray]:
    """Convex polygons (corner, 2) that together fill a simple counter-clockwise polygon.

    A convex polygon is its own single part; any other is cut into triangles by ear clipping and
    neighbouring parts are merged while they stay convex (Hertel & Mehlhorn 1983: at most four times
    the fewest parts).
    """
    corners = np.asarray(corners, dtype=float)
    if _is_convex(corners):
        return [corners]
    return [corners[part] for part in _merge(corners, _clip_ears(corners))]


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def _clip_ears(corners: np.ndarray) -> list[tuple[int, ...]]:
    ring, here = list(range(len(corners))), 0
    triangles: list[tuple[int, ...]] = []
    while len(ring) > 3:
        around = (
            *range(here, len(ring)),
            *range(here),
        )  # go on where the last ear was: its neighbours are often ears
        ear = next((i for i in around if _is_ear(corners, ring, i)), None)
        if ear is None:  # only corners on straight edges are left: drop the flattest
            ear = int(
                np.argmin([abs(_turn(*corners[_around(ring, i)])) for i in range(len(ring))])
            )
        else:
            triangles.append(tuple(_around(ring, ear)))
        del ring[ear]
        here = min(ear, len(ring) - 1)
    return [*triangles, tuple(ring)]


def _around(ring: list[int], i: int) -> list[int]:
    return [ring[i - 1], ring[i], ring[(i + 1) % len(ring)]]


def _is_ear(corners: np.ndarray, ring: list[int], i: int) -> bool:
    triangle = _around(ring, i)
    a, b, c = corners[triangle]
    if _turn(a, b, c) <= 0:
        return False
    x, y = corners[ring].T
    inside = np.ones(len(ring), dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (q[0] - p[0]) * (y - p[1]) >= (q[1] - p[1]) * (x - p[0])
    inside[[i - 1, i, (i + 1) % len(ring)]] = False  # its own corners
    return not inside.any()


def _merge(corners: np.ndarray, triangles: list[tuple[int, ...]]) -> list[list[int]]:
    """Take out each inner edge between two parts that are convex together, in one pass over the
    edges.
    """
    parts = {number: list(triangle) for number, triangle in enumerate(triangles)}
    owner = {edge: number for number, ring in parts.items() for edge in _edges(ring)}
    for a, b in list(owner):
        first, second = owner.get((a, b)), owner.get((b, a))
        if first is None or second is None or first == second:
            continue
        joined = _join(parts[first], parts[second], a, b)
        if _is_convex(corners[joined]):
            parts[first] = joined
            owner |= dict.fromkeys(_edges(parts.pop(second)), first)
            del owner[a, b], owner[b, a]
    return list(parts.values())


def _edges(ring: list[int]) -> list[tuple[int, int]]:
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def _join(first: list[int], second: list[int], a: int, b: int) -> list[int]:
    """Two rings without their common edge, which runs a → b in the first."""
    i, j = first.index(b), second.index(a)
    return first[i:] + first[:i] + (second[j:] + second[:j])[1:-1]


# Features: the things an antenna touches. A feature is convex parts and a rounding, in a frame
# of its own.
#
# In a feature's frame the first axis points the way the feature moves, the second to its left;
# the foremost point stands at first coordinate 0, so that everything else lies at first
# coordinates ≤ 0. Engines, placement and drawing read only ``parts``, ``rounding`` and
# ``unbounded``. A new shape is one class, registered under its name:
#
#     @SHAPES.register("capsule")
#     class Capsule(Feature):
#         half_length: float
#         rounding: float
#         kind: ClassVar[str] = "capsule"
#         symmetric: ClassVar[bool] = True
#
#         def make_parts(self):
#             return [[(0.0, -self.half_length), (0.0, self.half_length)]]


class Feature(Record, ABC):
    """Base of all shapes: convex parts, each grown by ``rounding``.

    Stated lengths are those of the core, and ``rounding`` comes on top: it makes the outer surface
    larger on every side and the corners round. It does not move the foremost point, which stays at
    0: the parts are set back by it.

    Attributes
    ----------
    name : str
        The label that its touches carry; default: the shape's word.

    Raises
    ------
    InvalidInput
        A length that is not finite and > 0, a rounding < 0, or a name that is no short text.
    """

    name: Annotated[str, Len(0, 200)] = ""

    if (
        TYPE_CHECKING
    ):  # each shape states these two, as a constant of its class, a field or a property

        @property
        def kind(self) -> str:
            """The shape's word, under which it is registered in ``SHAPES``."""

        @property
        def rounding(self) -> float:
            """Distance [mm] by which every part is grown, ≥ 0."""

    @property
    def symmetric(self) -> bool:
        """Whether the shape is its own mirror image about the line of motion; of a new shape not,
        unless it says so.
        """
        return False

    @property
    def unbounded(self) -> bool:
        """Whether the foremost face goes on without end; its parts are then as large as an engine
        needs.
        """
        return False

    @property
    def wide(self) -> bool:
        """Whether it may be larger than the antenna."""
        return False

    @property
    def only_in_space(self) -> bool:
        """Whether it has no shape in the plane."""
        return False

    @property
    def half_depth(self) -> float:
        """Half the core's extent across the plane [mm], which is read in space only."""
        return getattr(self, "half_length", 0.0)

    def _check(self) -> None:
        for name, value in vars(self).items():
            if isinstance(value, float) and not (
                value > 0 or (name == "rounding" and value == 0)
            ):
                sign = "≥" if name == "rounding" else ">"
                raise InvalidInput(
                    f"{type(self).__name__}.{name} must be {sign} 0 mm, got {value}."
                )
        if not self.name.isprintable():
            raise InvalidInput(
                f"{type(self).__name__}.name must be one line, got {self.name!r}."
            )
        # replace() keeps a name that was made of old numbers
        own = rf"{self.kind} (?:[\d.e+x -]+ mm \()?[0-9a-f]{{6}}\)?"
        given = "" if re.fullmatch(own, self.name) else self.name
        vars(self)["name"] = given or self.make_name()

    @classmethod
    def from_plain(cls, value: Any) -> "Feature":
        """A feature, also from its plain data."""
        if isinstance(value, Mapping):
            return make_feature(value)
        if not isinstance(value, Feature):
            raise FieldError(f"must be a {', '.join(SHAPES)}, got {show(value)}")
        return value

    @abstractmethod
    def make_parts(self) -> Sequence[Any]:
        """Corners (corner, 2) [mm] of each convex part: one is a point, two are a segment, more a
        polygon's, in order.

        Only places across the motion and relative ones along it matter: ``parts`` sets them back
        from the front.
        """

    def make_solids(self) -> list[np.ndarray]:
        """Corners (corner, 3) [mm] of each convex solid in space: the parts, made deep."""
        deep = self.half_depth
        sides = (-deep, deep) if deep else (0.0,)
        return [
            np.concatenate([np.insert(part, 2, side, axis=1) for side in sides])
            for part in self.parts
        ]

    def make_name(self) -> str:
        """The name of a feature that was given none."""
        return self.kind

    @cached_property
    def parts(self) -> tuple[np.ndarray, ...]:
        """Convex parts (corner, 2) [mm], read-only, counter-clockwise; the foremost point of the
        grown shape is at 0.

        Raises
        ------
        InvalidInput
            ``make_parts`` of a new shape gave something that is no list of convex parts.
        """
        cores = [_order(np.asarray(core, dtype=float), self.kind) for core in self.make_parts()]
        if not cores:
            raise InvalidInput(
                f"make_parts of the shape {self.kind!r} gave no part; give at least one."
            )
        front = max(core[:, 0].max() for core in cores) + self.rounding
        return tuple(freeze(core - [front, 0.0]) for core in cores)

    @cached_property
    def stack(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners (corner, 2) of all parts one after the other, and the number of each part's first
        (part + 1,).
        """
        return freeze(np.concatenate(self.parts)), freeze(
            np.cumsum([0, *map(len, self.parts)]), dtype=np.int64
        )

    @cached_property
    def size(self) -> float:
        """Half the extent across the motion [mm], rounding included; infinite without end."""
        if self.unbounded:
            return float("inf")
        across = np.concatenate([part[:, 1] for part in self.parts])
        return float(np.ptp(across) / 2 + self.rounding)

    def mirror(self) -> "Feature":
        """The mirror image about the line of motion."""
        return self if self.symmetric else _Mirrored(of=self)

    def scale(self, factor: float) -> "Feature":
        """The same shape with every length times ``factor``."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        scaled: dict[str, Any] = {
            name: factor * v for name, v in values.items() if isinstance(v, float | np.ndarray)
        }
        return self.replace(**scaled)

    def to_plain(self) -> dict[str, Any]:
        """The feature as plain data: its kind and fields; :func:`make_feature` gives it back."""
        return {"kind": self.kind, **super().to_plain()}


class _Mirrored(Feature):
    """The mirror image of a feature that is not its own."""

    of: Feature

    @property
    def kind(self) -> str:
        return self.of.kind

    @property
    def rounding(self) -> float:
        return self.of.rounding

    @property
    def wide(self) -> bool:
        return self.of.wide

    @property
    def only_in_space(self) -> bool:
        return self.of.only_in_space

    def make_solids(self) -> list[np.ndarray]:
        """The solids with their second axis turned round."""
        return [corners * [1.0, -1.0, 1.0] for corners in self.of.make_solids()]

    def make_name(self) -> str:
        return self.of.name

    def make_parts(self) -> list[np.ndarray]:
        """The parts with their second axis turned round."""
        return [part[::-1] * [1.0, -1.0] for part in self.of.parts]

    def mirror(self) -> Feature:
        return self.of


SHAPES: Registry[type[Feature]] = Registry(
    "shape",
    {
        "ball": "feeler.objects.shapes:Ball",
        "box": "feeler.objects.shapes:Box",
        "triangle": "feeler.objects.shapes:Triangle",
        "outline": "feeler.objects.outlines:Outline",
        "wall": "feeler.objects.bodies:Wall",
        "peg": "feeler.objects.shapes:Peg",
        "mesh": "feeler.objects.meshes:Mesh",
    },
)
"""Every shape by its word; register a new one to use it everywhere."""


@checked
def make_feature(
    kind: str | Mapping[str, Any], size: float | None = None, **values: Any
) -> Feature:
    """A feature by name: every length that must be given and is not among ``values`` becomes
    ``size`` [mm].

    So ``make_feature("ball", 1.5)`` has radius 1.5 mm, and ``make_feature("box", 1.5,
    half_height=3)`` half-width 1.5 mm. The plain data of ``Feature.to_plain`` may stand for all of
    it. A shape that can be read from a drawing takes ``file`` and that method's parameters instead.

    Raises
    ------
    InvalidInput
        No shape of this name, an unknown field, or a field that is missing.
    """
    values = {**kind, **values} if isinstance(kind, Mapping) else {"kind": kind, **values}
    word: Any = values.pop("kind", None)
    shape: Any = SHAPES[word]
    if "file" in values and hasattr(shape, "from_file"):
        return _read_drawing(shape.from_file, values)
    known = {field.name: field for field in fields(shape)}
    if unknown := values.keys() - known.keys():
        raise InvalidInput(
            f"a {word} has no {min(map(str, unknown))!r}; it has {', '.join(known)}."
        )
    needed = [
        name for name, field in known.items() if field.default is MISSING and name not in values
    ]
    if needed and size is None:
        raise InvalidInput(
            f"feature {word!r} needs {', '.join(needed)} [mm], or one size for all of them."
        )
    if other := [name for name in needed if known[name].type not in (float, "float")]:
        raise InvalidInput(
            f"feature {word!r} needs its {', '.join(other)}; a size is not enough."
        )
    return shape(**values, **dict.fromkeys(needed, size))


@checked
def parse_feature(text: str, size: float | None = None) -> Feature:
    """A feature from one line: its kind and, after a colon, its fields, as in
    ``box:half_height=3,rounding=0.2``.

    What must be given and is not becomes ``size``. An outline may be read from a drawing:
    ``outline:file=leaf.svg,width=3``.

    Raises
    ------
    InvalidInput
        No shape of this name, or fields that it does not have.
    """
    kind, _, rest = text.partition(":")
    pairs = [pair.partition("=") for pair in rest.split(",") if pair.strip()]
    if wrong := [name for name, equals, _ in pairs if not equals]:
        raise InvalidInput(
            f"{text!r} must be kind:field=value,field=value; {wrong[0]!r} has no value."
        )
    values = {name.strip(): _parse_value(value.strip()) for name, _, value in pairs}
    return make_feature({**values, "kind": kind}, size)


def _read_drawing(read: Callable[..., Feature], values: dict[str, Any]) -> Feature:
    known = [*inspect.signature(read).parameters][1:]
    if unknown := values.keys() - {"file", *known}:
        raise InvalidInput(
            f"a drawing has no {min(unknown)!r}; valid: file, {', '.join(known)}."
        )
    return read(str(values.pop("file")), **values)


def _parse_value(text: str) -> float | int | str:
    for read in (int, float):
        try:
            return read(text)
        except ValueError:
            pass
    return text


def name_by_extent(kind: str, corners: np.ndarray, *values: object) -> str:
    """A name such as ``outline 4 x 3 mm (1f09ab)``: how far the corners (corner, axis) extend, and
    six digits that differ where the numbers do (but for one pair in 17 million).
    """
    numbers = b"".join(np.asarray(v, dtype=float).tobytes() for v in (corners, *values))
    extent = " x ".join(f"{one:.3g}" for one in np.ptp(corners, axis=0))
    return f"{kind} {extent} mm ({hashlib.sha256(numbers).hexdigest()[:6]})"


def _order(core: np.ndarray, kind: str) -> np.ndarray:
    """A convex part with its corners counter-clockwise."""
    if core.ndim != 2 or core.shape[0] < 1 or core.shape[1] != 2 or not np.isfinite(core).all():
        raise InvalidInput(
            f"a part of the shape {kind!r} must be finite corners (corner, 2), got shape"
            f" {core.shape}."
        )
    if len(core) > 2 and measure_area(core) < 0:
        core = core[::-1]
    if len(core) > 2 and not _is_convex(core, slack=1e-9 * np.ptp(core, axis=0).max() ** 2):
        raise InvalidInput(
            f"a part of the shape {kind!r} is not convex; split it with"
            " feeler.objects.split_convex."
        )
    return core


# Ball, peg, box and triangle.


class Ball(Feature):
    """A ball (in the plane: a disc): a point grown by its radius.

    Attributes
    ----------
    radius : float
        Radius [mm], > 0.
    """

    radius: float
    kind: ClassVar[str] = "ball"
    symmetric: ClassVar[bool] = True

    @property
    def rounding(self) -> float:
        """The radius [mm]: the core is a point, or in space an axis."""
        return self.radius

    def make_parts(self) -> list:
        """The one point in the plane, which is set back by the radius."""
        return [[(0.0, 0.0)]]


class Peg(Ball):
    """A peg: a cylinder with round ends, upright on the plane, in which it is a disc.

    In space its axis is the third of its frame, at right angles to the way it moves; the ends
    matter where the antenna reaches beyond ``half_length``.

    Attributes
    ----------
    radius : float
        Radius [mm], > 0.
    half_length : float
        Half the length of the cylinder, without its round ends [mm], > 0.
    """

    half_length: float = 20.0
    kind: ClassVar[str] = "peg"


class Prism(Feature):
    """A shape with corners in the plane; in space an upright prism over it.

    Attributes
    ----------
    half_length : float
        Half the prism's length along the third axis of its frame [mm], > 0; read in space only.
    """

    half_length: float = 20.0

    def to_plain(self) -> dict[str, Any]:
        """The plain data, without a length that nobody gave."""
        plain = super().to_plain()
        return {k: v for k, v in plain.items() if k != "half_length" or v != Prism.half_length}


class Box(Prism):
    """A box whose face leads; its outer half-width is ``half_width + rounding``.

    Attributes
    ----------
    half_width : float
        Half the core's extent across the motion [mm], > 0.
    half_height : float
        Half the core's extent along the motion [mm], > 0.
    rounding : float
        Radius [mm] of the edges, added outside the core, ≥ 0.
    """

    half_width: float
    half_height: float
    rounding: float = 0.0
    kind: ClassVar[str] = "box"
    symmetric: ClassVar[bool] = True

    def make_parts(self) -> list:
        """The core's corners."""
        w, h = self.half_width, 2.0 * self.half_height
        return [[(0.0, -w), (0.0, w), (-h, w), (-h, -w)]]


class Triangle(Prism):
    """A triangle whose vertex leads; its outer half-width is ``half_width + rounding``.

    Attributes
    ----------
    half_width : float
        Half the core's base, across the motion [mm], > 0.
    half_height : float | None
        Half the core's height, along the motion [mm], > 0; default: ``half_width``.
    rounding : float
        Radius [mm] of the edges, added outside the core, ≥ 0.
    """

    half_width: float
    half_height: float | None = None
    rounding: float = 0.0
    kind: ClassVar[str] = "triangle"
    symmetric: ClassVar[bool] = True

    def _check(self) -> None:
        if self.half_height is None:
            vars(self)["half_height"] = self.half_width
        super()._check()

    def make_parts(self) -> list:
        """The core's corners, the leading one first."""
        assert self.half_height is not None  # _check has filled it
        w, h = self.half_width, 2.0 * self.half_height
        return [[(0.0, 0.0), (-h, w), (-h, -w)]]
