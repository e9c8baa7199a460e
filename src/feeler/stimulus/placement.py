"""Placement: from a trial to where its feature stands at time 0 and how it moves."""

from bisect import bisect_left
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.special import cosdg, sindg

from feeler.antenna.antenna import Antenna
from feeler.antenna.space import to_matrix
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.stimulus.clearance import compute_clearance
from feeler.stimulus.solid import compute_gap_in_space, place_in_space
from feeler.stimulus.trial import Trial

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
    from feeler.stimulus.sweep import find_touching  # numba is slow to load

    size = trial.feature.size
    if not trial.feature.wide and 2 * size > antenna.length:
        raise InvalidInput(
            f"the feature is bigger than the antenna: {trial.feature.name} of half-width {size:g}"
            f" mm, antenna {antenna.length:g} mm long. Use a half-width up to"
            f" {antenna.length / 2:g} mm, or Wall()."
        )
    if antenna.spatial:
        return _place_in_space(antenna, trial)
    if trial.azimuth or (trial.base is not None and trial.base.spatial):
        raise InvalidInput(
            f"the trial leaves the plane (azimuth={trial.azimuth:g}°, or its base does), but"
            f" {antenna.name!r} lies in it. Give its stiffness a row for each plane."
        )
    rest = _lay_out(antenna)
    x, y, along = rest.find(trial.location * antenna.length)
    heading = along + (trial.approach if trial.side == "left" else -trial.approach)
    forward = (
        float(sindg(heading)),
        float(cosdg(heading)) + 0.0,
    )  # no −0, which would turn an engine's frame round
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


def _place_in_space(antenna: Antenna, trial: Trial) -> Placement:
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
