"""Contacts of a segment with a box in space, as MuJoCo finds them: at the point of the segment that
is nearest to the box, and at a second one where it lies along a face or an edge.

Places on the segment run from −1 at its far end to +1 at its hinge, as MuJoCo's capsule does; it
decides ties. A corner is a number whose bits say on which side it lies.
"""

import numpy as np

from feeler.compiled import inlined
from feeler.physics.chain.narrow import MIN_VALUE
from feeler.stimulus.hull import dot3, join3

NONE = -4.0  # no second point


@inlined
def find_box_points(x, h, size):
    """Place of the nearest point on the segment (middle x, half axis h, in the box's axes), and how
    much further along the second lies, or NONE.
    """
    best, first, kind, face, r, corner, edge = np.inf, 0.0, 0, -1, 0.0, 0, 0
    for end in (-1.0, 1.0):
        square, beyond, axis = 0.0, 0, -1
        for k in range(3):
            over = abs(x[k] + end * h[k]) - size[k]
            if over > 0.0:
                square, beyond, axis = square + over * over, beyond + 1, k
        if beyond <= 1 and square < best:
            best, first, kind, face = square, end, -1, axis
    for axis in range(3):
        for low in range(8):
            if low & (1 << axis) == 0:
                square, t, s, side = _approach(x, h, size, axis, low)
                if square < best - MIN_VALUE:
                    best, first, r, kind, edge = square, t, s, side, axis
                    corner = low + (1 << axis if side == 2 else 0)
    if kind < 0:
        return first, _go_along_face(x, h, size, first, face)
    if kind == 1:
        return first, _go_from_edge(h, size, first, r, corner, edge)
    return first, _go_from_corner(h, size, first, corner)


@inlined
def _approach(x, h, size, axis, low):
    """Squared distance of the segment and the edge along an axis from a corner, the places on both,
    and where the edge's lies: 0 and 2 at its ends, 1 between. Infinite where they are parallel.
    """
    a = (
        (size[0] if low & 1 else -size[0]) if axis != 0 else 0.0,
        (size[1] if low & 2 else -size[1]) if axis != 1 else 0.0,
        (size[2] if low & 4 else -size[2]) if axis != 2 else 0.0,
    )
    away, half = join3(-1.0, x, a), size[axis]
    ma, mb, mc = half * half, -half * h[axis], dot3(h, h)
    u, v = -half * away[axis], dot3(h, away)
    det = ma * mc - mb * mb
    if abs(det) < MIN_VALUE:
        return np.inf, 0.0, 0.0, 1
    s, t, side = (mc * u - mb * v) / det, (ma * v - mb * u) / det, 1
    if s > 1.0 or s < -1.0:
        s, side = (1.0, 2) if s > 1.0 else (-1.0, 0)
        t = (v - mb * s) / mc
    if t > 1.0 or t < -1.0:
        t = 1.0 if t > 1.0 else -1.0
        s = (u - mb * t) / ma
        if s > 1.0 or s < -1.0:
            s, side = (1.0, 2) if s > 1.0 else (-1.0, 0)
    gap = join3(-t, h, away)
    along = gap[axis] + half * s
    return dot3(gap, gap) - gap[axis] * gap[axis] + along * along, t, s, side


@inlined
def _cross_bits(h, corner):
    """On which axes the segment runs away from a corner's side."""
    bits = (1 if h[0] > 0.0 else 0) + (2 if h[1] > 0.0 else 0) + (4 if h[2] > 0.0 else 0)
    return bits ^ corner


@inlined
def _go_from_corner(h, size, first, corner):
    bits = _cross_bits(h, corner)
    if bits == 0 or bits == 7:  # it points to the corner or away from it
        return NONE
    single = bits == 1 or bits == 2 or bits == 4
    way = 1.0 if single else -1.0
    bits = bits if single else 7 - bits
    axis = 0 if bits == 1 else (1 if bits == 2 else 2)
    if h[axis] * h[axis] > 0.5 * dot3(h, h):  # along the edge
        return way * min(1.0 - way * first, 2.0 * size[axis] / abs(h[axis]))
    second = 1.0 + way * first  # along the face
    for k in range(3):
        if k != axis:
            second = min(second, 2.0 * size[k] / abs(h[k]))
    return -way * second


@inlined
def _go_from_edge(h, size, first, r, corner, edge):
    bits = _cross_bits(h, corner) & (7 - (1 << edge))
    if bits != 1 and bits != 2 and bits != 4:  # it stands on the edge as a T
        return NONE
    one, other = (edge + 1) % 3, (edge + 2) % 3
    axis = one if abs(h[one]) > abs(h[other]) else other
    ahead = bits & (1 << axis) != 0
    way = 1.0 if ahead else -1.0
    second = min(1.0 - way * first, 2.0 * size[axis] / abs(h[axis]))
    left = 1.0 - r if (h[edge] > 0.0) == ahead else 1.0 + r
    return way * min(second, size[edge] * left / abs(h[edge]))


@inlined
def _go_along_face(x, h, size, first, face):
    if face < 0:  # it is inside
        return NONE
    way, second = -first, 2.0
    for k in range(3):
        if k != face:
            end = x[k] + first * h[k]
            for side in (size[k], -size[k]):
                reach = (side - end) / h[k] * way
                if 0.0 < reach < second:
                    second = reach
    return second * way


@inlined
def leave_box(at, size):
    """The box's point nearest to a place, the way out there, and how far; negative inside."""
    near = (
        min(max(at[0], -size[0]), size[0]),
        min(max(at[1], -size[1]), size[1]),
        min(max(at[2], -size[2]), size[2]),
    )
    apart = join3(-1.0, near, at)
    gap = np.sqrt(dot3(apart, apart))
    if gap > MIN_VALUE:
        return near, (apart[0] / gap, apart[1] / gap, apart[2] / gap), gap
    depth, axis, side = np.inf, 0, -1.0
    for k in range(3):
        for way in (-1.0, 1.0):
            if size[k] - way * at[k] < depth:
                depth, axis, side = size[k] - way * at[k], k, way
    out = (
        side if axis == 0 else 0.0,
        side if axis == 1 else 0.0,
        side if axis == 2 else 0.0,
    )
    return join3(depth, out, at), out, -depth
