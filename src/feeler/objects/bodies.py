"""Objects with a name that stand somewhere and move as they are told: bodies, walls and object
files.
"""

import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.files import read_toml
from feeler.objects.distance import compute_clearance
from feeler.objects.meshes import compute_gap_in_space
from feeler.objects.motion import BaseMotion, Vector, lift, lift_turn
from feeler.objects.shapes import SHAPES, Feature, make_feature, name_by_extent
from feeler.objects.trials import FRICTION, Trial, place
from feeler.records import Ge, Record, freeze
from feeler.validation import checked

# Objects: features that stand somewhere in the world, move and turn as they are told, and have
# a name.


class Object(Record):
    """A feature with a place and a motion; nothing that it touches can slow it.

    ``place`` is where the foremost point of the shape is (its surface, not its middle): a ball of
    radius r around the point c, facing ``forward``, has ``place`` = c + r · ``forward``.
    ``centre`` says where the middle is.

    In space its vectors have three numbers; ``left`` then says how it is turned about ``forward``.
    An antenna in space also meets an object with vectors of two.

    Plain data, as ``to_plain`` gives it, makes the same object: ``Object(**plain)``.

    Attributes
    ----------
    feature : Feature
        What it is.
    place : tuple[float, float] | tuple[float, float, float]
        Its foremost point at time 0 [mm]: the origin of its frame, about which it turns.
    forward : tuple[float, float] | tuple[float, float, float]
        Unit vector: the first axis of its frame at time 0.
    velocity : tuple[float, float] | tuple[float, float, float]
        Velocity of its ``place`` [mm/ms]; it does not turn with the object.
    turn : float | tuple[float, float, float]
        Turn rate about its ``place`` [rad/ms], positive from +y towards +x, as angles are; in space
        its angular velocity.
    left : tuple[float, float, float] | None
        Unit vector: the second axis of its frame in space, at right angles to ``forward``; default:
        in the plane of x and y, to the left.
    friction : float
        Coefficient of sliding friction.
    name : str
        What it is called among the objects of a scene; default: the feature's name.

    Raises
    ------
    InvalidInput
        No feature, numbers that are not finite, a negative friction, or axes that are no rotation.
    """

    feature: Feature
    place: Vector = (0.0, 0.0)
    forward: Vector = (1.0, 0.0)
    velocity: Vector = (0.0, 0.0)
    turn: float | tuple[float, float, float] = 0.0
    left: tuple[float, float, float] | None = None
    friction: Annotated[float, Ge(0)] = FRICTION
    name: str = ""

    def _check(self) -> None:
        size = np.hypot.reduce(self.forward)
        if abs(size - 1) > 1e-6:
            raise InvalidInput(
                f"Object.forward must be a unit vector, got {self.forward} of length {size:g}."
            )
        vars(self)["name"] = self.name or self.feature.name
        if self.left is None:
            return
        size, lean = np.hypot.reduce(self.left), float(np.dot(lift(self.forward), self.left))
        if abs(size - 1) > 1e-6 or abs(lean) > 1e-6:
            raise InvalidInput(
                "Object.forward and Object.left are no rotation: they must be unit vectors at a"
                f" right angle, got {self.forward} and {self.left}."
            )

    @property
    def spatial(self) -> bool:
        """Whether anything of it has three numbers."""
        vectors = (self.place, self.forward, self.velocity)
        return self.left is not None or np.ndim(self.turn) == 1 or 3 in map(len, vectors)

    def lift(self) -> "Object":
        """The same object in space, all its vectors of three numbers."""
        forward = lift(self.forward)
        level = np.hypot(*forward[:2])
        flat = (
            (-forward[1] / level, forward[0] / level, 0.0) if level > 1e-9 else (1.0, 0.0, 0.0)
        )
        return self.replace(
            place=lift(self.place),
            forward=forward,
            velocity=lift(self.velocity),
            turn=lift_turn(self.turn),
            left=self.left or flat,
        )

    @property
    def axes(self) -> np.ndarray:
        """Its frame in space at time 0 (3, 3), one axis a row: forward, left, up."""
        own = self.lift()
        return np.array([own.forward, own.left, np.cross(own.forward, own.left or ())])

    @property
    def extent(self) -> float:
        """The greatest distance of its surface from its ``place`` [mm]."""
        corners = np.concatenate(self.feature.parts)
        flat = float(np.hypot(*corners.T).max()) + self.feature.rounding
        return float(np.hypot(flat, self.feature.half_depth)) if self.spatial else flat

    @property
    def centre(self) -> np.ndarray:
        """The middle (2,) [mm] of its shape's bounding box at time 0; in space (3,)."""
        if self.spatial:
            corners = np.concatenate(self.feature.parts)
            middle = [*(corners.min(axis=0) + corners.max(axis=0)) / 2, 0.0]
            return lift(self.place) + middle @ self.axes
        corners, (x, y) = np.concatenate(self.feature.parts), self.forward[:2]
        along, across = (corners.min(axis=0) + corners.max(axis=0)) / 2
        return np.add(self.place, (along * x - across * y, along * y + across * x))


@checked
def make_object(antenna: Antenna, trial: Trial) -> Object:
    """The object of a trial, which touches the antenna ``trial.lead`` ms after time 0."""
    placement = place(antenna, trial)
    return Object(
        feature=trial.shape,
        place=tuple(placement.origin.tolist()),
        forward=tuple(placement.forward.tolist()),
        velocity=tuple(placement.velocity.tolist()),
        left=None if placement.left is None else tuple(placement.left.tolist()),
        friction=trial.friction,
        name=trial.name,
    )


@checked
def make_objects(antenna: Antenna, objects: Sequence[Object | Trial]) -> tuple[Object, ...]:
    """Objects to simulate, trials among them placed; each has a name of its own and starts clear of
    the antenna at rest.

    Raises
    ------
    InvalidInput
        Two objects of one name, trials with different base motions, one that starts inside the
        antenna, or none of these.
    """
    objects = list(objects)
    bases = [item.base_motion for item in objects if isinstance(item, Trial)]
    if any(base != bases[0] for base in bases):
        raise InvalidInput(
            "the trials move the base in different ways; an antenna has one base. Give all the same"
            " base."
        )
    made = tuple(
        make_object(antenna, item) if isinstance(item, Trial) else item for item in objects
    )
    if twice := [
        name for name, count in Counter(one.name for one in made).items() if count > 1
    ]:
        raise InvalidInput(
            f"two objects are called {twice[0]!r}; give each its own name=, as forces are told"
            " apart by it."
        )
    base = bases[0] if bases and bases[0] is not None else BaseMotion()
    base = base.lift() if antenna.spatial else base
    check_clear(antenna, made, pose=base.compute_pose(np.zeros(1))[0])
    return made


@checked
def check_clear(
    antenna: Antenna,
    objects: Sequence[Object],
    angle: np.ndarray | None = None,
    pose: Sequence[float] | np.ndarray | None = None,
) -> None:
    """Refuse objects that overlap the antenna with hinge angles (segment,) [rad], by default at
    rest.

    ``pose`` is where the base stands: x, y [mm] and heading [rad], or in space x, y, z and its
    rotation vector.
    """
    n = 6 if antenna.spatial else 3
    pose = np.zeros(n) if pose is None else np.asarray(pose, dtype=float)
    if pose.shape != (n,) or not np.isfinite(pose).all():
        raise InvalidInput(f"pose must be {n} finite numbers, got shape {pose.shape}.")
    dims = len(pose) // 3 + 1  # 2 in the plane, 3 in space
    points = antenna.shape(angle, pose[3:] if dims == 3 else pose[2]) + np.asarray(pose[:dims])
    for item in objects:
        if antenna.spatial:
            own = item.lift()
            gap = compute_gap_in_space(
                points, antenna.radius, item.feature, own.place, own.axes
            )
        elif item.spatial:
            raise InvalidInput(
                f"the object {item.name!r} is placed in space, but {antenna.name!r} lies in one"
                " plane: give two numbers each, or antenna.unflatten()."
            )
        else:
            where = np.asarray(item.place), np.asarray(item.forward)
            gap = compute_clearance(points, antenna.radius, item.feature, *where)
        if gap <= 0:
            raise InvalidInput(
                f"the object {item.name!r} starts inside the antenna {antenna.name!r}, or touching"
                f" it (clearance {gap:.3g} mm). Move its place away; that is its foremost point,"
                f" and its middle is at ({', '.join(f'{x:.3g}' for x in item.centre)}) mm."
            )


# The wall: a wide-field feature, plain or textured.

_REACH = 1e3  # mm; half extent of the box that stands for a face without end
# mm [C]; body of a textured wall below its lowest place; far more than contact sinks in
DEPTH = 10.0
_MAX_PLACES = 1000  # [C]


class Wall(Feature):
    """A wide-field feature: a straight face without end, or a textured one of the heights in
    ``profile``.

    Seen in its own frame, the textured face stands at first coordinate *height* − (greatest height)
    and second coordinate *place*, straight lines between the places; it ends with the profile.
    Parts: one for each stretch between two valleys.

    Attributes
    ----------
    profile : np.ndarray | None
        Pairs (place along the wall [mm], height towards the antenna [mm]), or two arrays of three
        or more values: places and heights; default: flat and without end. Place 0 is where the
        wall's axis runs.
    repeat : int
        How many times the profile is laid end to end, centred; more than 1 needs equal heights at
        its ends.
    rounding : float
        Distance [mm] by which the textured face is grown, ≥ 0.

    Raises
    ------
    InvalidInput
        A profile that is no function (places that do not rise), is not finite, or cannot be
        repeated.
    """

    profile: np.ndarray | None = None
    repeat: Annotated[int, Ge(1)] = 1
    rounding: float = 0.0
    kind: ClassVar[str] = "wall"
    wide: ClassVar[bool] = True

    def _check(self) -> None:
        if self.profile is not None:
            vars(self)["profile"] = freeze(_read_profile(self.profile, self.repeat))
        super()._check()
        if self.profile is None and (self.repeat > 1 or self.rounding > 0):
            raise InvalidInput(
                "Wall.repeat and Wall.rounding need a profile; a flat face without end has neither."
            )

    @property
    def unbounded(self) -> bool:
        """Whether the face is flat and goes on without end."""
        return self.profile is None

    symmetric = unbounded  # a flat face is its own mirror image

    def make_name(self) -> str:
        """``wall``, and for a textured one its extent and six digits that stand for its face."""
        if self.profile is None:
            return self.kind
        return name_by_extent("wall", self.profile, self.repeat, self.rounding)

    def make_parts(self) -> list:
        """A box so large that its other faces are out of reach, or the stretches of the
        profile with the body below.
        """
        if self.profile is None:
            return [
                [(0.0, -_REACH), (0.0, _REACH), (-2 * _REACH, _REACH), (-2 * _REACH, -_REACH)]
            ]
        place, height = self._lay_out()
        bottom = height.min() - DEPTH
        slope = np.diff(height) / np.diff(place)
        valleys = np.flatnonzero(np.diff(slope) > 0) + 1
        parts = []
        for first, last in zip([0, *valleys], [*valleys, len(place) - 1], strict=True):
            face = np.stack([height, place], axis=1)[first : last + 1]
            parts.append([*face, (bottom, place[last]), (bottom, place[first])])
        return parts

    def _lay_out(self) -> tuple[np.ndarray, np.ndarray]:
        """Places and heights of all repetitions."""
        place, height = np.asarray(self.profile).T
        shift = np.ptp(place) * (np.arange(self.repeat) - (self.repeat - 1) / 2)
        places = (shift[:, None] + place[1:]).ravel()
        return np.append(shift[0] + place[0], places), np.append(
            height[0], np.tile(height[1:], self.repeat)
        )


def _read_profile(pairs: np.ndarray, repeat: int) -> np.ndarray:
    if pairs.ndim == 2 and pairs.shape[0] == 2 and pairs.shape[1] > 2:
        pairs = pairs.T
    if (
        pairs.ndim != 2
        or pairs.shape[1] != 2
        or len(pairs) < 2
        or len(pairs) * repeat > _MAX_PLACES
    ):
        raise InvalidInput(
            f"Wall.profile must be 2 to {_MAX_PLACES} pairs (place, height), repetitions counted,"
            f" or two such arrays; got shape {pairs.shape}, repeated {repeat} times."
        )
    if (falling := np.flatnonzero(np.diff(pairs[:, 0]) <= 0)).size:
        where = falling[0]
        raise InvalidInput(
            f"Wall.profile is no function: its places must rise, but place {where + 2}"
            f" ({pairs[where + 1, 0]:g} mm) does not lie beyond place {where + 1}"
            f" ({pairs[where, 0]:g} mm). For an overhang use an Outline."
        )
    if repeat > 1 and pairs[0, 1] != pairs[-1, 1]:
        raise InvalidInput(
            f"Wall.profile is repeated, so it must end as high as it begins; got {pairs[0, 1]:g}"
            f" and {pairs[-1, 1]:g} mm."
        )
    return pairs + 0.0  # no −0: equal walls have equal names


# Object files: the things that are to be discriminated, as TOML.
#
# [[object]] name = "bolt" shape = "ball"              # ball, box, triangle, outline, or any
# shape that was registered radius = 3.0                # mm, and so on: the shape's own fields
#
# [[object]] name = "leaf" shape = "outline" file = "leaf.svg"           # beside this file; or
# vertices = [[0, -2], [0, 2], [-3, 0]] in mm width = 8.0

_MAX_OBJECTS = 1000  # [C]


@checked
def load_objects(path: str | os.PathLike) -> list[Feature]:
    """The features in a TOML file, each under a name of its own.

    Raises
    ------
    InvalidInput
        No such file, not TOML, no object, an unknown shape or field, or two objects of one name.
    """
    source = Path(path)
    content = read_toml(path)
    entries = content.get("object")
    if [*content] != ["object"] or not isinstance(entries, list) or len(entries) > _MAX_OBJECTS:
        raise InvalidInput(
            f"{source.name} must hold 1 to {_MAX_OBJECTS} tables [[object]] and nothing else; it"
            f" has {', '.join(map(str, list(content)[:5])) or 'nothing'}."
        )
    objects: list[Feature] = []
    for number, entry in enumerate(entries, 1):
        try:
            made = _make(entry, source.parent)
        except InvalidInput as error:
            raise InvalidInput(f"{source.name}, object {number}: {error}") from error
        if made.name in [one.name for one in objects]:
            raise InvalidInput(
                f"{source.name}: two objects are called {made.name!r}. Give each its own name."
            )
        objects.append(made)
    return objects


def _make(entry: Any, folder: Path) -> Feature:
    if not isinstance(entry, dict) or "shape" not in entry:
        raise InvalidInput(f"needs a shape; valid: {', '.join(SHAPES)}.")
    values = {name: value for name, value in entry.items() if name != "shape"}
    if "file" in values:
        values["file"] = str(folder / str(values["file"]))
    return make_feature(entry["shape"], **values)
