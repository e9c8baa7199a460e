"""Features as solids in space: balls, capsules, and walls without end; how near an antenna they
are, and where a trial's feature starts.
"""

from typing import Any

import numpy as np

from feeler.antenna.space import find_frames
from feeler.errors import InvalidInput
from feeler.stimulus.feature import Feature

MARCHES = 200  # [C] steps of a search for the place where surfaces meet


def list_solids(feature: Feature) -> np.ndarray:
    """Axes (solid, end, 3) [mm] of a feature's capsules in its frame, a ball's of no length; all
    are grown by ``rounding``. A wall without end is none.

    Raises
    ------
    InvalidInput
        A shape that has corners: boxes, triangles and outlines have no solid yet.
    """
    if feature.unbounded:
        return np.zeros((0, 2, 3))
    axes = []
    for part in feature.parts:
        if len(part) > 2 or feature.rounding == 0 or (len(part) == 2 and feature.half_depth):
            raise InvalidInput(
                f"the {feature.kind} {feature.name!r} has no solid in space yet: antennae in space"
                " meet balls, pegs and flat walls. Use one of them, or antenna.flatten()."
            )
        ends = np.zeros((2, 3))
        ends[:, :2], ends[:, 2] = part[[0, -1]], (-feature.half_depth, feature.half_depth)
        axes.append(ends)
    return np.array(axes)


def compute_gap_in_space(
    points: np.ndarray, radius: np.ndarray, feature: Feature, origin: Any, axes: np.ndarray
) -> float:
    """Smallest gap [mm] between surfaces, negative where they overlap: of an antenna's points
    (segment + 1, 3) and radii, and a feature whose frame stands at ``origin`` with ``axes``.
    """
    solids = list_solids(feature)
    if not len(solids):
        gap = (points - origin) @ axes[0]
        return float(np.min(np.minimum(gap[:-1], gap[1:]) - radius))
    ends = np.asarray(origin) + solids @ axes
    gaps = [_measure_gaps(points[:-1], points[1:], *pair) - radius for pair in ends]
    return float(np.min(gaps) - feature.rounding)


def _measure_gaps(start: np.ndarray, end: np.ndarray, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Distances (segment,) of segments to the one from ``a`` to ``b`` (Ericson 2005, ch. 5)."""
    d, e, r = end - start, b - a, start - a
    dd, ee, de = (d**2).sum(axis=1), float(e @ e), d @ e
    dr, er = (d * r).sum(axis=1), r @ e
    if ee == 0:
        s, t = np.clip(-dr / dd, 0, 1), np.zeros(len(d))
    else:
        det = dd * ee - de**2
        s = np.clip((de * er - dr * ee) / np.where(det > 0, det, 1), 0, 1) * (det > 0)
        t = np.clip((de * s + er) / ee, 0, 1)
        s = np.clip((de * t - dr) / dd, 0, 1)
    return np.linalg.norm(start + s[:, None] * d - a - t[:, None] * e, axis=1)


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
    n = min(int(np.searchsorted(antenna.hinge_position, arc * (1 - 1e-12)) - 1), antenna.n_segments)
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
    for _ in range(MARCHES):
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
