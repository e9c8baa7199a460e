"""Objects: features that stand somewhere in the world, move and turn as they are told, and have a
name.
"""

from collections import Counter
from collections.abc import Sequence
from typing import Annotated

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.record import Ge, Record
from feeler.stimulus.clearance import compute_clearance
from feeler.stimulus.feature import Feature
from feeler.stimulus.placement import place
from feeler.stimulus.trial import FRICTION, Trial


class Object(Record):
    """A feature with a place and a motion; nothing that it touches can slow it.

    ``place`` is where the foremost point of the shape is (its surface, not its middle): a ball of
    radius r around the point c, facing ``forward``, has ``place`` = c + r · ``forward``.
    ``centre`` says where the middle is.

    Plain data, as ``to_plain`` gives it, makes the same object: ``Object(**plain)``.

    Attributes
    ----------
    feature : Feature
        What it is.
    place : tuple[float, float]
        Its foremost point at time 0 [mm]: the origin of its frame, about which it turns.
    forward : tuple[float, float]
        Unit vector: the first axis of its frame at time 0.
    velocity : tuple[float, float]
        Velocity of its ``place`` [mm/ms]; it does not turn with the object.
    turn : float
        Turn rate about its ``place`` [rad/ms], positive from +y towards +x, as angles are.
    friction : float
        Coefficient of sliding friction.
    name : str
        What it is called among the objects of a scene; default: the feature's name.

    Raises
    ------
    InvalidInput
        No feature, numbers that are not finite, or a negative friction.
    """

    feature: Feature
    place: tuple[float, float] = (0.0, 0.0)
    forward: tuple[float, float] = (1.0, 0.0)
    velocity: tuple[float, float] = (0.0, 0.0)
    turn: float = 0.0
    friction: Annotated[float, Ge(0)] = FRICTION
    name: str = ""

    def _check(self) -> None:
        size = np.hypot(*self.forward)
        if abs(size - 1) > 1e-6:
            raise InvalidInput(
                f"Object.forward must be a unit vector, got {self.forward} of length {size:g}."
            )
        vars(self)["name"] = self.name or self.feature.name

    @property
    def centre(self) -> np.ndarray:
        """The middle (2,) [mm] of its shape's bounding box at time 0."""
        corners, (x, y) = np.concatenate(self.feature.parts), self.forward
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
    if twice := [name for name, count in Counter(one.name for one in made).items() if count > 1]:
        raise InvalidInput(
            f"two objects are called {twice[0]!r}; give each its own name=, as forces are told"
            " apart by it."
        )
    pose = np.zeros(3) if not bases or bases[0] is None else bases[0].compute_pose(np.zeros(1))[0]
    check_clear(antenna, made, pose=pose)
    return made


@checked
def check_clear(
    antenna: Antenna,
    objects: Sequence[Object],
    angle: np.ndarray | None = None,
    pose: Sequence[float] | np.ndarray = (0.0, 0.0, 0.0),
) -> None:
    """Refuse objects that overlap the antenna with hinge angles (segment,) [rad], by default at
    rest.

    ``pose`` is where the base stands: x, y [mm] and heading [rad].
    """
    points = antenna.shape(angle, pose[2]) + np.asarray(pose[:2])
    for item in objects:
        where = np.asarray(item.place), np.asarray(item.forward)
        gap = compute_clearance(points, antenna.radius, item.feature, *where)
        if gap <= 0:
            raise InvalidInput(
                f"the object {item.name!r} starts inside the antenna, or touching it (clearance"
                f" {gap:.3g} mm). Move its place away from the antenna; that is its foremost point,"
                f" and its middle is at ({item.centre[0]:.3g}, {item.centre[1]:.3g}) mm."
            )
