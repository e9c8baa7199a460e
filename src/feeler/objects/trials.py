"""Trials: one object meets the antenna at one location, with one speed, from one side; and where
it stands at each moment.
"""

from bisect import bisect_left
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal

import numpy as np

from feeler.antenna.segments import Antenna, to_matrix
from feeler.errors import InvalidInput
from feeler.objects.distance import compute_clearance, find_touching
from feeler.objects.meshes import compute_gap_in_space, place_in_space
from feeler.objects.motion import BaseMotion, read_base
from feeler.objects.shapes import Ball, Box, Feature, Triangle, trace_rim
from feeler.records import Ge, Gt, Le, Lt, Record, Unit, make_picture
from feeler.validation import checked

# A trial: one feature meets the antenna at one place, with one speed, from one side.

FRICTION = 1.0  # [D] fits the published video best
LEAD = 5.0  # [C] ms before contact


class Trial(Record):
    """One touch, as data.

    The feature starts clear of the antenna, its foremost point meets the antenna's surface at
    ``location`` exactly ``lead`` ms after time 0, and it moves on at constant velocity. Where the
    base moves, the antenna is taken to be carried unbent until then. Plain data, as ``to_plain``
    gives it, makes the same trial: ``Trial(**plain)``.

    Attributes
    ----------
    feature : Feature
        What touches: Ball, Box, Triangle, Outline, Wall, or any shape that was registered.
    location : float
        Where, as a fraction of the antenna's length from the base.
    speed : float
        How fast the feature moves [m/s = mm/ms].
    lead : float
        Time before contact [ms].
    approach : float
        Angle between the motion and the antenna's base-to-tip direction at the location [degrees];
        90 is perpendicular.
    azimuth : float
        Of an antenna in space: angle by which the whole approach is turned about the touched
        segment [degrees], 0 as in the plane; at 90 what comes from the left moves towards z.
    side : Literal[left, right]
        The side the feature comes from: ``left`` moves towards +x (angles positive), ``right`` is
        its mirror image.
    friction : float
        Coefficient of sliding friction.
    base : BaseMotion | None
        How the antenna's base moves, given for the side ``left``; default: it is clamped.
    name : str
        What the object is called; default: the feature's name.

    Raises
    ------
    InvalidInput
        A field outside its range; the message names it.
    """

    feature: Feature
    location: Annotated[float, Gt(0), Le(1), "a fraction of the length"]
    speed: Annotated[float, Gt(0), Unit("m/s")]
    lead: Annotated[float, Gt(0), Unit("ms")] = LEAD
    approach: Annotated[float, Gt(0), Lt(180), Unit("degrees"), "90 is perpendicular"] = 90.0
    azimuth: Annotated[float, Ge(-360), Le(360), Unit("degrees")] = 0.0
    side: Literal["left", "right"] = "left"
    friction: Annotated[float, Ge(0)] = FRICTION
    base: BaseMotion | None = None
    name: str = ""

    def _check(self) -> None:
        vars(self)["base"] = read_base(self.base)
        vars(self)["name"] = self.name or self.feature.name

    def to_plain(self) -> dict[str, Any]:
        """The trial as plain data; an azimuth of 0 is left out, as in the plane there is none."""
        return {k: v for k, v in super().to_plain().items() if k != "azimuth" or v}

    @property
    def shape(self) -> Feature:
        """The feature as it meets the antenna: mirrored where it comes from the right."""
        return self.feature.mirror() if self.side == "right" else self.feature

    @property
    def base_motion(self) -> BaseMotion | None:
        """The base's motion as it happens: from the right, it is mirrored with everything else."""
        return self.base.mirror() if self.base and self.side == "right" else self.base

    @property
    def label(self) -> str:
        """One readable line for messages and titles."""
        measure = "radius" if self.feature.kind in ("ball", "peg") else "half-width"
        size = (
            f" ({measure} {self.feature.size:g} mm)" if np.isfinite(self.feature.size) else ""
        )
        side = ", from the right" if self.side == "right" else ""
        return f"{self.feature.name}{size} at {self.location:g} L, {self.speed:g} m/s{side}"

    def _repr_html_(self) -> str:
        """The feature on its way to a stretch of an antenna that points up."""
        reach = 3 * self.feature.size if np.isfinite(self.feature.size) else 10.0
        turn = np.radians(self.approach) * (1.0 if self.side == "left" else -1.0)
        forward = np.array([np.sin(turn), np.cos(turn)])
        frame = np.stack([forward, [-forward[1], forward[0]]])
        rims = [
            trace_rim(part, self.feature.rounding).clip(-reach, reach)
            for part in self.shape.parts
        ]
        way = np.array([[0.0, 0.0], 0.3 * reach * forward]) - 0.4 * reach * forward
        antenna = np.array([[0.0, -reach], [0.0, reach]])
        return make_picture(
            self.label,
            [(antenna, 0.45), (way, 0.0)],
            [rim @ frame - 0.4 * reach * forward for rim in rims],
        )


@checked
def make_grid(
    features: list[Feature], locations: list[float], speeds: list[float], **fields: Any
) -> list[Trial]:
    """Every feature at every location and speed, speeds slowest to change; other Trial fields
    shared.
    """
    return [
        Trial(feature=feature, location=location, speed=speed, **fields)
        for speed in speeds
        for location in locations
        for feature in features
    ]


# Placement: from a trial to where its feature stands at time 0 and how it moves.

# mm [C]; left at the lead, so that rounding never decides whether the step then is in contact yet
_ROOM = 1e-12


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Where a feature stands at time 0 and how it moves.

    Attributes
    ----------
    origin : np.ndarray
        The frame's origin (2,) [mm]; in space (3,), as all vectors are then.
    heading : float
        Direction of the frame's first axis [degrees], from +y towards +x.
    forward : np.ndarray
        The same as a unit vector (2,).
    velocity : np.ndarray
        Velocity (2,) [mm/ms].
    left : np.ndarray | None
        The frame's second axis in space (3,).
    """

    origin: np.ndarray
    heading: float
    forward: np.ndarray
    velocity: np.ndarray
    left: np.ndarray | None = None

    @property
    def axes(self) -> np.ndarray:
        """The frame's axes in space, one a row."""
        assert self.left is not None
        return np.array([self.forward, self.left, np.cross(self.forward, self.left)])


@checked
def place(antenna: Antenna, trial: Trial) -> Placement:
    """Where the trial's feature starts so that contact begins ``trial.lead`` ms after time 0.

    The feature is drawn back along its motion until it just touches the antenna at rest
    (perpendicular approach of a straight antenna: the foremost point is one collision radius away
    from the axis), and further by speed · lead.

    Raises
    ------
    InvalidInput
        The feature is bigger than the antenna, misses it, would touch another part of it first, or
        starts in contact.
    """
    size = trial.feature.size
    if not trial.feature.wide and 2 * size > antenna.length:
        raise InvalidInput(
            f"the feature is bigger than the antenna: {trial.feature.name} of half-width {size:g}"
            f" mm, antenna {antenna.length:g} mm long. Use a half-width up to"
            f" {antenna.length / 2:g} mm, or Wall()."
        )
    if antenna.spatial:
        return _place_solid(antenna, trial)
    if trial.azimuth or (trial.base is not None and trial.base.spatial):
        raise InvalidInput(
            f"the trial leaves the plane (azimuth={trial.azimuth:g}°, or its base does), but"
            f" {antenna.name!r} lies in it. Give its stiffness a row for each plane."
        )
    rest = _lay_out(antenna)
    x, y, along = rest.find(trial.location * antenna.length)
    heading = along + (trial.approach if trial.side == "left" else -trial.approach)
    forward = _point(heading)
    shape = trial.shape
    if shape.unbounded:
        back = ((rest.ends - (x, y)) @ forward - rest.end_radius).min()
        touching, again = -float(back), np.inf
    else:
        corners, first = shape.stack
        part = (corners, first, shape.rounding)
        touching, again = find_touching(
            rest.start, rest.end, rest.radius, *part, x, y, *forward
        )
    back = touching + _ROOM + trial.speed * trial.lead
    if np.isnan(touching):
        raise InvalidInput(
            f"the feature misses the antenna ({trial.label}, approach {trial.approach:g}°); aim"
            " nearer."
        )
    if again <= back:
        raise InvalidInput(
            "the feature starts in contact with the antenna, or meets another part of it first"
            f" ({trial.label}, approach {trial.approach:g}°). Choose an approach nearer to 90°, a"
            " shorter lead, or a straighter antenna."
        )
    placement = Placement(
        origin=np.array((x - back * forward[0], y - back * forward[1])),
        heading=heading,
        forward=np.array(forward),
        velocity=np.array((trial.speed * forward[0], trial.speed * forward[1])),
    )
    return placement if trial.base is None else _carry(antenna, trial, placement)


def _point(heading: float) -> tuple[float, float]:
    """The unit vector of a heading [degrees], from +y towards +x."""
    if abs(heading) == 90.0:
        return heading / 90.0, 0.0
    from scipy.special import cosdg, sindg  # slow to load

    # no −0, which would turn an engine's frame round
    return float(sindg(heading)), float(cosdg(heading)) + 0.0


def _place_solid(antenna: Antenna, trial: Trial) -> Placement:
    origin, axes = place_in_space(antenna, trial)
    if trial.base_motion is not None:
        poses = trial.base_motion.lift().compute_pose(np.array([0.0, trial.lead]))
        turn = to_matrix(poses[1, 3:])
        origin, axes = turn @ origin + poses[1, :3], axes @ turn.T
    velocity = trial.speed * axes[0]
    origin = origin - _ROOM * axes[0] - trial.lead * velocity
    if trial.base_motion is not None:
        points = antenna.shape(base_angle=poses[0, 3:]) + poses[0, :3]
        if compute_gap_in_space(points, antenna.radius, trial.shape, origin, axes) <= 0:
            raise InvalidInput(_STARTS_INSIDE.format(trial.label))
    return Placement(
        origin=origin,
        heading=float(np.degrees(np.arctan2(axes[0, 0], axes[0, 1]))),
        forward=axes[0],
        velocity=velocity,
        left=axes[1],
    )


_STARTS_INSIDE = (
    "the feature starts in contact with the antenna ({}): the base moves away from it faster than"
    " it comes near. Choose a faster feature, a shorter lead, or another base motion."
)


class _Rest:
    """An antenna at rest; a straight one of one radius counts as one segment."""

    def __init__(self, antenna: Antenna) -> None:
        points, radius = antenna.shape(), antenna.radius
        self.points = points.tolist()
        self.arc = [0.0, *np.cumsum(antenna.segment_length).tolist()]
        self.heading = np.degrees(np.cumsum(antenna.rest_angle)).tolist()
        if not antenna.rest_angle[1:].any() and np.all(radius == radius[0]):
            points, radius = points[[0, -1]], radius[:1]
        self.start = np.ascontiguousarray(points[:-1])
        self.end = np.ascontiguousarray(points[1:])
        self.radius = np.ascontiguousarray(radius)
        self.ends = np.concatenate([self.start, self.end])
        self.end_radius = np.tile(self.radius, 2)

    def find(self, arc: float) -> tuple[float, float, float]:
        """The point at an arc length [mm] and the direction there [degrees]."""
        n = min(bisect_left(self.arc, arc * (1 - 1e-12)) - 1, len(self.arc) - 2)
        (ax, ay), (bx, by) = self.points[n], self.points[n + 1]
        share = (arc - self.arc[n]) / (self.arc[n + 1] - self.arc[n])
        return ax + share * (bx - ax), ay + share * (by - ay), self.heading[n]


_lay_out = lru_cache(maxsize=64)(_Rest)


def _carry(antenna: Antenna, trial: Trial, placement: Placement) -> Placement:
    """The placement for a moving base, as if it carried the unbent antenna until contact."""
    assert trial.base_motion is not None
    (x0, y0, start), (x, y, turn) = trial.base_motion.compute_pose(np.array([0.0, trial.lead]))
    c, s = np.cos(turn), np.sin(turn)
    rotate = np.array([[c, s], [-s, c]])  # from +y towards +x
    forward = rotate @ placement.forward
    contact = rotate @ (placement.origin + trial.lead * placement.velocity) + [x, y]
    velocity = trial.speed * forward
    origin = contact - trial.lead * velocity
    points = antenna.shape(base_angle=start) + np.array([x0, y0])
    if compute_clearance(points, antenna.radius, trial.shape, origin, forward) <= 0:
        raise InvalidInput(_STARTS_INSIDE.format(trial.label))
    heading = placement.heading + float(np.degrees(turn))
    return Placement(origin=origin, heading=heading, forward=forward, velocity=velocity)


# The paper's ninety touches.

SPEEDS = {"fast": 0.6, "medium": 0.3, "slow": 0.06}  # m/s [P]
LOCATIONS = (0.5, 0.6, 0.7, 0.8, 0.9)  # fractions of length; the first [D], the others [C]
HALF_SIZES = {
    "small": 1.5,
    "large": 3.0,
}  # mm; ball of the video 1.53 [D], large about twice small [A], values [C]


def make_features() -> list[Feature]:
    """Ball, box and triangle, each small and large."""
    sizes = HALF_SIZES.values()
    return [
        *(Ball(radius=size) for size in sizes),
        *(Box(half_width=size, half_height=size) for size in sizes),
        *(Triangle(half_width=size, half_height=size) for size in sizes),
    ]


@checked
def trials(
    speeds: Sequence[float] | None = None,
    locations: Sequence[float] = LOCATIONS,
    features: Sequence[Feature] | None = None,
) -> list[Trial]:
    """Six features at five locations and three speeds (fast, medium, slow): 90 trials (Results,
    Fig. 2D).
    """
    return make_grid(
        make_features() if features is None else list(features),
        list(locations),
        list(SPEEDS.values() if speeds is None else speeds),
    )
