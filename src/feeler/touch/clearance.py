"""Clearance between an antenna at rest and a feature: where the feature must start for contact to begin on time."""

import numpy as np

from feeler.touch.feature import Feature, Wall


def compute_clearance(
    points: np.ndarray, radius: np.ndarray, feature: Feature, origin: np.ndarray, forward: np.ndarray
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
    left = np.array([-forward[1], forward[0]])
    if isinstance(feature, Wall):
        gap = (points - origin) @ forward
        return float(np.min(np.minimum(gap[:-1], gap[1:]) - radius))
    corners = origin + feature.vertices @ np.stack([forward, left])
    start, end = points[:-1], points[1:]
    if len(corners) == 1:
        return float(np.min(_point_segments(corners[0], start, end) - radius) - feature.rounding)
    return float(np.min(_polygon_segments(corners, start, end) - radius))


def _point_segments(point: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    along = end - start
    t = np.clip(np.einsum("ij,ij->i", point - start, along) / np.einsum("ij,ij->i", along, along), 0.0, 1.0)
    return np.linalg.norm(start + t[:, None] * along - point, axis=1)


def _polygon_segments(corners: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Distance (segment,) of each segment to the polygon; 0 where they meet."""
    distance = np.full(len(start), np.inf)
    following = np.roll(corners, -1, axis=0)
    for corner in corners:
        distance = np.minimum(distance, _point_segments(corner, start, end))
    for ends in (start, end):
        to_edges = np.array([_point_segments(p, corners, following).min() for p in ends])
        distance = np.minimum(distance, to_edges)
    distance[_inside(corners, start) | _inside(corners, end)] = 0.0
    for a, b in zip(corners, following, strict=True):
        distance[_crossing(a, b, start, end)] = 0.0
    return distance


def _inside(corners: np.ndarray, points: np.ndarray) -> np.ndarray:
    inside = np.zeros(len(points), dtype=bool)
    for (x0, y0), (x1, y1) in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        spans = (y0 > points[:, 1]) != (y1 > points[:, 1])
        if y0 != y1:
            inside ^= spans & (points[:, 0] < (x1 - x0) * (points[:, 1] - y0) / (y1 - y0) + x0)
    return inside


def _crossing(a: np.ndarray, b: np.ndarray, c: np.ndarray, d: np.ndarray) -> np.ndarray:
    def side(p: np.ndarray, q: np.ndarray, r: np.ndarray) -> np.ndarray:
        return (q[..., 0] - p[..., 0]) * (r[..., 1] - p[..., 1]) - (q[..., 1] - p[..., 1]) * (r[..., 0] - p[..., 0])

    return (side(a, b, c) * side(a, b, d) < 0) & (side(c, d, a) * side(c, d, b) < 0)
