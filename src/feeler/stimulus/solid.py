"""Features as solids in space: convex bodies, and walls without end; how near an antenna they are,
and where a trial's feature starts.
"""

from functools import lru_cache
from typing import Any

import numpy as np

from feeler.antenna.space import find_frames
from feeler.errors import InvalidInput
from feeler.stimulus.feature import Feature

_MARCHES = 200  # [C] steps of a search for the place where surfaces meet


def list_solids(feature: Feature) -> list[np.ndarray]:
    """Corners (corner, 3) [mm] of a feature's convex solids in its frame, all grown by
    ``rounding``: one is a ball, two are a capsule, more a body of flat faces. A wall without end
    is none.

    Raises
    ------
    InvalidInput
        A shape that has corners in the plane and no depth, or nothing to touch.
    """
    if feature.unbounded:
        return []
    solids = feature.make_solids()
    for corners in solids:
        flat = len(corners) > 2 and not np.ptp(corners, axis=0).all()
        if flat or (len(corners) <= 2 and feature.rounding == 0):
            raise InvalidInput(
                f"the {feature.kind} {feature.name!r} has no solid in space: give it a depth"
                " (half_length), or a rounding where it has no faces; or use antenna.flatten()."
            )
    return solids


def is_box(corners: np.ndarray) -> bool:
    """Whether a solid is a box along the axes of its frame."""
    return len(corners) == 8 and all(np.unique(row).size == 2 for row in corners.T)


def compute_gap_in_space(
    points: np.ndarray, radius: np.ndarray, feature: Feature, origin: Any, axes: np.ndarray
) -> float:
    """Smallest gap [mm] between surfaces, negative where they overlap: of an antenna's points
    (segment + 1, 3) and radii, and a feature whose frame stands at ``origin`` with ``axes``.
    """
    if feature.unbounded:
        gap = (points - origin) @ axes[0]
        return float(np.min(np.minimum(gap[:-1], gap[1:]) - radius))
    from feeler.stimulus.hull import find_gap  # numba is slow to load

    own = (points - origin) @ axes.T
    gaps = [find_gap(own, radius, *hull) for hull in _list_hulls(feature)]
    return float(np.min(gaps) - feature.rounding)


@lru_cache(maxsize=8)
def _list_hulls(feature: Feature) -> list[tuple[np.ndarray, int]]:
    from feeler.stimulus.hull import make_hull

    return [make_hull(corners) for corners in list_solids(feature)]


def place_in_space(antenna: Any, trial: Any) -> tuple[np.ndarray, np.ndarray]:
    """Where a trial's feature just touches an antenna in space at rest (3,), and its axes there
    (3, 3): forward, left, up.

    It comes as in the plane of the touched segment's first two axes, and all is then turned about
    that segment by ``azimuth``. Drawn back from its aim along its motion until it is clear.

    Raises
    ------
    InvalidInput
        It would meet the antenna elsewhere before its start.
    """
    arc = trial.location * antenna.length
    n = min(
        int(np.searchsorted(antenna.hinge_position, arc * (1 - 1e-12)) - 1), antenna.n_segments
    )
    points, (x, y, z) = antenna.shape(), find_frames(antenna.rest_angle)[max(n, 0)]
    aim = points[max(n, 0)] + (arc - antenna.hinge_position[max(n, 0)]) * y
    turn, angle = np.radians(trial.azimuth), np.radians(trial.approach)
    side = 1.0 if trial.side == "left" else -1.0
    across, up = np.cos(turn) * x + np.sin(turn) * z, np.cos(turn) * z - np.sin(turn) * x
    forward = side * np.sin(angle) * across + np.cos(angle) * y
    axes = np.array([forward, np.cross(up, forward), up])

    def measure(back: float) -> float:
        where = aim - back * forward
        return compute_gap_in_space(points, antenna.radius, trial.shape, where, axes)

    back = 0.0
    for _ in range(_MARCHES):
        gap = measure(back)
        if gap > -1e-13:
            break
        back -= gap  # the least way out, never beyond it
    if trial.shape.unbounded:
        return aim - back * forward, axes
    near, far = back + 1e-9, back + trial.speed * trial.lead
    while near < far:
        gap = measure(near)
        if gap <= 0:
            raise InvalidInput(
                "the feature starts in contact with the antenna, or meets another part of it first"
                f" ({trial.label}, approach {trial.approach:g}°). Choose an approach nearer to 90°,"
                " a shorter lead, or a straighter antenna."
            )
        near += max(gap, 1e-6)
    return aim - back * forward, axes
