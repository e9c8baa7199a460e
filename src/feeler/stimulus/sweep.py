"""Where a feature that moves along a straight line touches an antenna: in closed form.

A convex part overlaps a capsule where its frame's origin lies in the capsule's segment minus the
part (Minkowski), grown by both radii. The rim of that convex set is covered by capsules: the
segment moved by each corner, and each edge of the part moved by both ends of the segment. A line
crosses each of these in one interval, and the whole in their union's span. Distances are counted
back along the motion, from where the frame's origin is on the target.
"""

import numpy as np

from feeler.compiled import compiled


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
