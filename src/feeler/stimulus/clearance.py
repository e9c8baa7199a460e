"""Clearance between an antenna and a feature: the smallest gap between their surfaces."""

import numpy as np

from feeler.stimulus.feature import Feature


def compute_clearance(
    points: np.ndarray,
    radius: np.ndarray,
    feature: Feature,
    origin: np.ndarray,
    forward: np.ndarray,
) -> float:
    """Smallest gap [mm] between the antenna's surface and the feature; negative where they overlap.

    Parameters
    ----------
    points
        Base, hinges and tip (segment + 1, 2) [mm].
    radius
        Collision radius (segment,) [mm].
    origin, forward
        The feature frame's origin [mm] and its unit first axis.
    """
    turn = np.stack([forward, [-forward[1], forward[0]]])
    if feature.unbounded:
        gap = (points - origin) @ forward
        return float(np.min(np.minimum(gap[:-1], gap[1:]) - radius))
    start, end = points[:-1], points[1:]
    gaps = [_part_segments(origin + part @ turn, start, end) - radius for part in feature.parts]
    return float(np.min(gaps) - feature.rounding)


def _part_segments(corners: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distance (segment,) of each segment to a point, segment or polygon; 0 where they meet."""
    to_corners = _point_segments(corners, start, end).min(axis=0)
    if len(corners) == 1:
        return to_corners
    following = np.roll(corners, -1, axis=0)
    to_edges = [_point_segments(ends, corners, following).min(axis=1) for ends in (start, end)]
    meets = _crossing(corners, following, start, end)
    if len(corners) > 2:
        meets |= _inside(corners, start) | _inside(corners, end)
    return np.where(meets, 0.0, np.minimum(to_corners, np.minimum(*to_edges)))


def _point_segments(points: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distance (point, segment) of each point to each segment."""
    along, x, y = end - start, points[:, 0, None], points[:, 1, None]
    dx, dy = x - start[:, 0], y - start[:, 1]
    t = np.clip((dx * along[:, 0] + dy * along[:, 1]) / (along**2).sum(axis=1), 0.0, 1.0)
    return np.hypot(dx - t * along[:, 0], dy - t * along[:, 1])


def _inside(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether each point (point,) lies inside the polygon: a ray from it crosses an odd number of
    edges.
    """
    (x0, y0), (x1, y1) = corners.T, np.roll(corners, -1, axis=0).T
    x, y = points[:, 0, None], points[:, 1, None]
    rise = np.where(y1 == y0, 1.0, y1 - y0)  # a level edge spans no ray
    crosses = ((y0 > y) != (y1 > y)) & (x < (x1 - x0) * (y - y0) / rise + x0)
    return crosses.sum(axis=1) % 2 == 1


def _crossing(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Whether each segment c–d (segment,) crosses any of the edges a–b (edge,)."""

    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (
            r[..., 0] - p[..., 0]
        )

    a, b = a[:, None], b[:, None]
    return ((side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)).any(
        axis=0
    )
