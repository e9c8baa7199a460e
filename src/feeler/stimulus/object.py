"""Objects: features that stand somewhere in the world, move and turn as they are told, and have a
name.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Annotated

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.record import Ge, Record
from feeler.stimulus.base import BaseMotion, Vector, lift, lift_turn
from feeler.stimulus.clearance import compute_clearance
from feeler.stimulus.feature import Feature
from feeler.stimulus.placement import place
from feeler.stimulus.solid import compute_gap_in_space
from feeler.stimulus.trial import FRICTION, Trial


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
                f"the object {item.name!r} starts inside the antenna, or touching it (clearance"
                f" {gap:.3g} mm). Move its place away from the antenna; that is its foremost point,"
                f" and its middle is at ({', '.join(f'{x:.3g}' for x in item.centre)}) mm."
            )
