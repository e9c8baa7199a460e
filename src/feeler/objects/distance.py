"""How far an antenna is from an object, and where a moving object touches it."""

import numpy as np

from feeler.compiled import compiled, inlined, lean
from feeler.objects.shapes import Feature

# How far a segment is from a convex solid in space: a point, a line, or a body of flat faces.
#
# Two convex bodies are apart where some plane parts them. Of a segment and a polyhedron that
# overlap, the shallowest way out is along the normal of a face, or across an edge and the
# segment; of those that do not, the nearest points lie on an edge, or at an end of the segment
# above a face.

N_HULL = 13
_FLAT = 1e-12  # [C] one minus the cosine up to which two faces are one
_MIN_VALUE = 1e-15


def make_hull(corners: np.ndarray) -> tuple[np.ndarray, int]:
    """Rows (row, N_HULL) of a convex solid's faces and then of its edges, and how many are faces.

    A face is a triangle: normal (3), how far out, a corner (3), and two vectors (3) whose products
    with what lies beyond that corner are its shares of the two sides. An edge is its start (3), its
    vector (3), and the normals (3) of its two faces. A point or a line has an edge only.
    """
    from scipy.spatial import ConvexHull

    if len(corners) <= 2:
        return np.array([[*corners[0], *(corners[-1] - corners[0]), *np.zeros(7)]]), 0
    hull = ConvexHull(corners)
    a, b, c = (corners[hull.simplices[:, k]] for k in range(3))
    normal, out = hull.equations[:, :3], -hull.equations[:, 3:]
    sides = np.stack([b - a, c - a], axis=1)
    shares = np.linalg.solve(sides @ sides.transpose(0, 2, 1), sides)
    faces = np.concatenate([normal, out, a, shares[:, 0], shares[:, 1]], axis=1)
    edges = []
    for i, (simplex, beside) in enumerate(zip(hull.simplices, hull.neighbors, strict=True)):
        for k, j in enumerate(beside):
            if i < j and 1 - normal[i] @ normal[j] > _FLAT:
                p, q = corners[np.delete(simplex, k)]
                edges.append([*p, *(q - p), *normal[i], *normal[j], 0.0])
    return np.concatenate([faces, edges]), len(faces)


@inlined
def dot3(a, b):
    """a · b."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@inlined
def cross3(a, b):
    """a × b."""
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


@inlined
def join3(k, a, b):
    """k a + b."""
    return k * a[0] + b[0], k * a[1] + b[1], k * a[2] + b[2]


@inlined
def _row3(table, i, k):
    """A vector in a row of a table."""
    return table[i, k], table[i, k + 1], table[i, k + 2]


@lean(forceinline=True)  # called from Python too
def measure(table, first, middle, stop, p, e, clear):
    """Distance of the segment from p to p + e from a solid (negative: how deep it is inside), the
    solid's point there, and the way out. More than ``clear``: only that they are so far apart.

    Its faces are rows ``first`` to ``middle`` of the table, its edges those up to ``stop``.
    """
    best, at, out = -np.inf, p, (1.0, 0.0, 0.0)
    for k in range(first, middle):
        n = _row3(table, k, 0)
        near, rise = dot3(n, p) - table[k, 3], dot3(n, e)
        gap = min(near, near + rise)
        if gap > best:
            best, out = gap, n
            at = join3(-gap, n, join3(0.0 if rise > 0.0 else 1.0, e, p))
            if gap > clear:
                return best, at, out
    if middle > first and best <= 0.0:
        best, at, out = _cross_edges(table, middle, stop, p, e, best, at, out)
    if middle > first and best <= 0.0:
        return best, at, out
    return _find_nearest(table, first, middle, stop, p, e, out)


@inlined
def _cross_edges(table, middle, stop, p, e, best, at, out):
    """The ways out across an edge and the segment, where they are better."""
    for k in range(middle, stop):
        a, d = _row3(table, k, 0), _row3(table, k, 3)
        one, other = _row3(table, k, 6), _row3(table, k, 9)
        m = cross3(d, e)
        size = np.sqrt(dot3(m, m))
        if size * size <= _MIN_VALUE * dot3(d, d) * dot3(e, e):
            continue
        first, second, lean = dot3(m, one), dot3(m, other), dot3(one, other)
        u, v = first - lean * second, second - lean * first
        if u * v < 0.0:  # no plane between the faces of the edge
            continue
        sign = 1.0 if u + v > 0.0 else -1.0
        m = (sign * m[0] / size, sign * m[1] / size, sign * m[2] / size)
        gap = dot3(m, join3(-1.0, a, p))
        if gap > best:
            best, out = gap, m
            r, _ = _clamp(a, d, p, e)
            at = join3(r, d, a)
    return best, at, out


@inlined
def _clamp(a, d, p, e):
    """Shares of the nearest points of the segments a + r d and p + t e (Ericson 2005, ch. 5)."""
    w = join3(-1.0, a, p)
    dd, ee, de = dot3(d, d), dot3(e, e), dot3(d, e)
    dw, ew = dot3(d, w), dot3(e, w)
    if dd <= 0.0:
        return 0.0, min(max(-ew / ee, 0.0), 1.0)
    det, r = dd * ee - de * de, 0.0
    if det > _MIN_VALUE * dd * ee:
        r = min(max((dw * ee - ew * de) / det, 0.0), 1.0)
    t = (r * de - ew) / ee
    if t < 0.0 or t > 1.0:
        t = min(max(t, 0.0), 1.0)
        r = min(max((dw + t * de) / dd, 0.0), 1.0)
    return r, t


@inlined
def _find_nearest(table, first, middle, stop, p, e, out):
    """Nearest points of a segment and a solid that are apart."""
    best, at, way = np.inf, p, (0.0, 0.0, 0.0)
    for k in range(middle, stop):
        a, d = _row3(table, k, 0), _row3(table, k, 3)
        r, t = _clamp(a, d, p, e)
        near = join3(r, d, a)
        apart = join3(-1.0, near, join3(t, e, p))
        square = dot3(apart, apart)
        if square < best:
            best, at, way = square, near, apart
    for k in range(first, middle):
        n, a = _row3(table, k, 0), _row3(table, k, 4)
        for end in (0.0, 1.0):
            q = join3(end, e, p)
            gap, beyond = dot3(n, q) - table[k, 3], join3(-1.0, a, q)
            u, v = dot3(_row3(table, k, 7), beyond), dot3(_row3(table, k, 10), beyond)
            if gap > 0.0 and gap * gap < best and u >= 0.0 and v >= 0.0 and u + v <= 1.0:
                best, at = gap * gap, join3(-gap, n, q)
                way = (gap * n[0], gap * n[1], gap * n[2])
    gap = np.sqrt(best)
    if gap > _MIN_VALUE:
        out = (way[0] / gap, way[1] / gap, way[2] / gap)
    return gap, at, out


@compiled
def find_gap(points, radius, table, n_faces):
    """Least distance of the surfaces of segments (segment + 1, 3) and a solid; of balls and lines
    the depth ends at the axis.
    """
    least = np.inf
    for i in range(radius.shape[0]):
        p = _row3(points, i, 0)
        e = join3(-1.0, p, _row3(points, i + 1, 0))
        gap, _, _ = measure(table, 0, n_faces, table.shape[0], p, e, np.inf)
        least = min(least, gap - radius[i])
    return least


# Where a feature that moves along a straight line touches an antenna: in closed form.
#
# A convex part overlaps a capsule where its frame's origin lies in the capsule's segment minus
# the part (Minkowski), grown by both radii. The rim of that convex set is covered by capsules:
# the segment moved by each corner, and each edge of the part moved by both ends of the segment.
# A line crosses each of these in one interval, and the whole in their union's span. Distances
# are counted back along the motion, from where the frame's origin is on the target.


@compiled
def find_touching(
    start, end, radius, corners, first, rounding, target_x, target_y, forward_x, forward_y
):
    """Distance back at which the feature just touches, and at which it touches again further back.

    Segments ``start``, ``end`` (segment, 2) with ``radius`` (segment,) [mm]; parts
    ``corners[first[k]:first[k + 1]]``. It touches where the overlap that holds distance 0 ends, or
    else the first overlap that it would meet beyond. NaN: never.
    """
    n_parts = first.shape[0] - 1
    low, high = np.empty(start.shape[0] * n_parts), np.empty(start.shape[0] * n_parts)
    for i in range(start.shape[0]):
        x, y = start[i, 0] - target_x, start[i, 1] - target_y
        ua, wa = (
            -x * forward_x - y * forward_y,
            y * forward_x - x * forward_y,
        )  # back along the motion, and to its left
        x, y = end[i, 0] - target_x, end[i, 1] - target_y
        ub, wb = -x * forward_x - y * forward_y, y * forward_x - x * forward_y
        for k in range(n_parts):
            part = corners[first[k] : first[k + 1]]
            low[n_parts * i + k], high[n_parts * i + k] = _cross_part(
                ua, wa, ub, wb, radius[i] + rounding, part
            )
    touching = np.nan
    for k in range(low.shape[0]):
        if low[k] <= 0.0 and not high[k] <= touching:
            touching = high[k]
    joined = touching >= 0.0
    while joined:  # overlaps that join on further back
        joined = False
        for k in range(low.shape[0]):
            if low[k] <= touching < high[k]:
                touching, joined = high[k], True
    again = np.inf
    for k in range(low.shape[0]):
        if high[k] > touching:
            again = min(again, low[k])
    return touching, again


@compiled
def _cross_part(ua, wa, ub, wb, reach, part):
    """Interval in which one part overlaps one segment; (inf, −inf) where it passes by."""
    low, high = np.inf, -np.inf
    for k in range(part.shape[0]):
        j = k + 1 if k + 1 < part.shape[0] else 0
        cu, cw, eu, ew = part[k, 0], -part[k, 1], part[j, 0], -part[j, 1]
        low, high = _cross_capsule(ua + cu, wa + cw, ub + cu, wb + cw, reach, low, high)
        if part.shape[0] > 1:
            low, high = _cross_capsule(ua + cu, wa + cw, ua + eu, wa + ew, reach, low, high)
            low, high = _cross_capsule(ub + cu, wb + cw, ub + eu, wb + ew, reach, low, high)
    return low, high


@compiled
def _cross_capsule(ua, wa, ub, wb, radius, low, high):
    """The interval, widened to hold the crossing of the line w = 0 with a capsule."""
    for u, w in ((ua, wa), (ub, wb)):
        if abs(w) <= radius:
            half = np.sqrt((radius - w) * (radius + w))
            low, high = min(low, u - half), max(high, u + half)
    du, dw = ub - ua, wb - wa
    if dw != 0.0:
        share = radius / np.sqrt(du * du + dw * dw)
        for sign in (-1.0, 1.0):  # the two straight sides
            u, w = ua + sign * dw * share, wa - sign * du * share
            t = -w / dw
            if 0.0 <= t <= 1.0:
                low, high = min(low, u + t * du), max(high, u + t * du)
    return low, high


# Clearance between an antenna and a feature: the smallest gap between their surfaces.


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
