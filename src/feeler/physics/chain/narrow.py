"""Contacts of the chain's capsules with an object's convex parts, as MuJoCo finds them, in the
object's own frame.
"""

import numpy as np

from feeler.compiled import inlined
from feeler.physics.chain import fields as f

MIN_VALUE = 1e-15  # MuJoCo's mjMINVAL


@inlined
def find_contacts(constants, work, obj, o, shapes, first, stop, place, table, count, lane):
    """Append one lane's contacts with object ``o``, base to tip; their number, or −1 if the table
    is too short.

    Its convex parts are numbers ``first`` to ``stop`` of ``shapes`` = (kind, corners, first corner,
    bounding box, and that of each ``BLOCK`` of parts).
    """
    kinds, corners, starts, boxes, blocks = shapes
    x, y, grown = place[o, f.P_X, lane], place[o, f.P_Y, lane], obj[o, f.O_ROUNDING, lane]
    cx, cy = place[o, f.P_FORWARD_X, lane], place[o, f.P_FORWARD_Y, lane]
    for i in range(int(place[o, f.P_FIRST, lane]), int(place[o, f.P_LAST, lane]) + 1):
        dx, dy, radius = (
            work[f.W_PX, i, lane] - x,
            work[f.W_PY, i, lane] - y,
            constants[f.C_RADIUS, i, lane],
        )
        px, py = cx * dx + cy * dy, cx * dy - cy * dx
        ex = cx * work[f.W_EX, i, lane] + cy * work[f.W_EY, i, lane]
        ey = cx * work[f.W_EY, i, lane] - cy * work[f.W_EX, i, lane]
        low_x, high_x, low_y, high_y = (
            min(px, px + ex),
            max(px, px + ex),
            min(py, py + ey),
            max(py, py + ey),
        )
        before, k = count, first
        while k < stop:
            if k % f.BLOCK == 0 and _clear(
                blocks, k // f.BLOCK, low_x, high_x, low_y, high_y, radius
            ):
                k += f.BLOCK
                continue
            apart = _clear(boxes, k, low_x, high_x, low_y, high_y, radius)
            k += 1
            if apart:
                continue
            if count + 2 > table.shape[0]:
                return -1
            start, end = starts[k - 1], starts[k]
            if kinds[k - 1] == f.KIND_BALL:
                bx, by = corners[start, 0], corners[start, 1]
                count = _touch_ball(table, count, px, py, ex, ey, radius, bx, by, grown)
            elif kinds[k - 1] == f.KIND_BOX:
                count = _touch_box(
                    table, count, px, py, ex, ey, radius, grown, corners[start:end]
                )
            else:
                count = _touch_polygon(
                    table, count, px, py, ex, ey, radius, grown, corners, start, end
                )
        for k in range(before, count):
            table[k, f.T_OBJECT] = o
            _to_world(table, k, i, cx, cy, x, y)
    return count


@inlined
def _clear(boxes, k, low_x, high_x, low_y, high_y, radius):
    """Whether a segment with this box stays clear of box number ``k``."""
    return (
        low_x > boxes[k, 2] + radius
        or high_x < boxes[k, 0] - radius
        or low_y > boxes[k, 3] + radius
        or high_y < boxes[k, 1] - radius
    )


@inlined
def _to_world(table, k, i, cx, cy, x, y):
    table[k, f.T_SEGMENT] = i
    px, py, nx, ny = table[k, f.T_X], table[k, f.T_Y], table[k, f.T_NX], table[k, f.T_NY]
    table[k, f.T_X], table[k, f.T_Y] = x + cx * px - cy * py, y + cy * px + cx * py
    table[k, f.T_NX], table[k, f.T_NY] = cx * nx - cy * ny, cy * nx + cx * ny


@inlined
def _put(table, count, x, y, nx, ny, distance):
    table[count, f.T_X], table[count, f.T_Y] = x, y
    table[count, f.T_NX], table[count, f.T_NY] = nx, ny
    table[count, f.T_DISTANCE] = distance
    return count + 1


@inlined
def _touch_ball(table, count, px, py, ex, ey, radius, bx, by, ball):
    """Closest point of the segment to the ball's centre."""
    t = ((bx - px) * ex + (by - py) * ey) / (ex * ex + ey * ey)
    t = min(max(t, 0.0), 1.0)
    dx, dy = px + t * ex - bx, py + t * ey - by
    centre = np.sqrt(dx * dx + dy * dy)
    distance = centre - ball - radius
    if distance >= 0.0:
        return count
    nx, ny = (dx / centre, dy / centre) if centre > MIN_VALUE else (1.0, 0.0)
    reach = ball + 0.5 * distance
    return _put(table, count, bx + reach * nx, by + reach * ny, nx, ny, distance)


@inlined
def _touch_box(table, count, px, py, ex, ey, radius, grown, corners):
    """MuJoCo's capsule–box test in the plane: the closest point of the capsule's core, and a
    sensible second one.

    Positions on the core run from −1 at the far end to +1 at the hinge, as MuJoCo's capsule does;
    it decides ties.
    """
    sx, sy = 0.5 * (corners[1, 0] - corners[2, 0]), 0.5 * (corners[1, 1] - corners[0, 1])
    mx, my = 0.5 * (corners[1, 0] + corners[2, 0]), 0.5 * (corners[1, 1] + corners[0, 1])
    hx, hy = -0.5 * ex, -0.5 * ey
    x, y = px - hx - mx, py - hy - my
    beside, width = (
        abs(x * hy - y * hx),
        sx * abs(hy) + sy * abs(hx),
    )  # of both, across the core, times half its length
    if beside > width and (beside - width) ** 2 > (radius + grown) ** 2 * (
        hx * hx + hy * hy
    ) * (1.0 + 1e-12):
        return count
    first, second = _box_points(x, y, hx, hy, sx, sy)
    count = _touch_box_sphere(
        table, count, x + first * hx, y + first * hy, radius, grown, sx, sy, mx, my
    )
    if second > -3.0:
        at = first + second
        count = _touch_box_sphere(
            table, count, x + at * hx, y + at * hy, radius, grown, sx, sy, mx, my
        )
    return count


@inlined
def _box_points(x, y, hx, hy, sx, sy):
    """Position of the closest point of the core, and how much further along the core the second
    lies (−4: none).
    """
    best, first, face, corner, at_end = np.inf, 0.0, np.int64(-1), np.int64(-1), np.int64(0)
    for end in (-1, 1):
        ax, ay = x + end * hx, y + end * hy
        ox, oy = max(abs(ax) - sx, 0.0), max(abs(ay) - sy, 0.0)
        if ox > 0.0 and oy > 0.0:
            continue
        square = ox * ox + oy * oy
        if square < best:
            best, first, at_end = square, float(end), end
            face = 0 if ox > 0.0 else (1 if oy > 0.0 else -1)
    core = hx * hx + hy * hy
    for k in range(4):
        kx, ky = (sx if k & 1 else -sx), (sy if k & 2 else -sy)
        t = ((kx - x) * hx + (ky - y) * hy) / core
        t = min(max(t, -1.0), 1.0)
        dx, dy = kx - x - t * hx, ky - y - t * hy
        square = dx * dx + dy * dy
        if square < best - MIN_VALUE:
            best, first, corner = square, t, k
    if corner >= 0:
        return first, _second_from_corner(first, corner, hx, hy, sx, sy)
    if face < 0:
        return first, -4.0
    return first, _second_from_face(x, y, hx, hy, sx, sy, at_end, face)


@inlined
def _second_from_corner(first, corner, hx, hy, sx, sy):
    across = ((hx > 0.0) ^ ((corner & 1) != 0)) + 2 * ((hy > 0.0) ^ ((corner & 2) != 0))
    if across != 1 and across != 2:
        return -4.0  # the core points to or from the corner
    along_x = abs(hx) > abs(hy)
    forward = across == (1 if along_x else 2)
    second = 1.0 - first if forward else 1.0 + first
    limit = 2.0 * sx / abs(hx) if along_x else 2.0 * sy / abs(hy)
    second = min(second, limit)
    return second if forward else -second


@inlined
def _second_from_face(x, y, hx, hy, sx, sy, at_end, face):
    sign = -float(at_end)
    ex, ey = x - sign * hx, y - sign * hy
    second = 2.0
    size, at, half = (sy, ey, hy) if face == 0 else (sx, ex, hx)
    for side in (size, -size):
        reach = (side - at) / half * sign
        if 0.0 < reach < second:
            second = reach
    return second * sign


@inlined
def _touch_box_sphere(table, count, x, y, radius, grown, sx, sy, mx, my):
    kx, ky = min(max(x, -sx), sx), min(max(y, -sy), sy)
    dx, dy = x - kx, y - ky
    gap = np.sqrt(dx * dx + dy * dy)
    depth = gap - radius - grown
    if depth >= 0.0:
        return count
    if gap > MIN_VALUE:
        nx, ny = dx / gap, dy / gap
        middle = grown + 0.5 * depth
        return _put(table, count, mx + kx + middle * nx, my + ky + middle * ny, nx, ny, depth)
    best, nx, ny = sx + x, -1.0, 0.0
    if sx - x < best:
        best, nx, ny = sx - x, 1.0, 0.0
    if sy + y < best:
        best, nx, ny = sy + y, 0.0, -1.0
    if sy - y < best:
        best, nx, ny = sy - y, 0.0, 1.0
    best += grown
    back = -0.5 * (radius - best)
    return _put(table, count, mx + x + back * nx, my + y + back * ny, nx, ny, -best - radius)


@inlined
def _touch_polygon(table, count, px, py, ex, ey, radius, grown, corners, start, stop):
    """Closest points of the core and one convex part; where the core is inside, the shallowest way
    out.
    """
    depth, ax, ay, nx, ny = _separate(px, py, ex, ey, radius + grown, corners, start, stop)
    if depth - radius - grown >= 0.0:
        return count
    if depth > 0.0:
        depth, ax, ay, nx, ny = _closest(px, py, ex, ey, corners, start, stop)
    distance = depth - radius - grown
    if distance >= 0.0:
        return count
    reach = grown + 0.5 * distance
    return _put(table, count, ax + reach * nx, ay + reach * ny, nx, ny, distance)


@inlined
def _separate(px, py, ex, ey, clear, corners, start, stop):
    """Greatest separation along a normal of either shape (negative: penetration), its point on the
    part, the normal.

    The first separation found beyond ``clear`` ends the search: they do not touch.
    """
    best, bx, by, bnx, bny = -np.inf, 0.0, 0.0, 1.0, 0.0
    for k in range(start, stop):
        j = k + 1 if k + 1 < stop else start
        dx, dy = corners[j, 0] - corners[k, 0], corners[j, 1] - corners[k, 1]
        length = np.sqrt(dx * dx + dy * dy)
        nx, ny = dy / length, -dx / length
        near = nx * (px - corners[k, 0]) + ny * (py - corners[k, 1])
        far = near + nx * ex + ny * ey
        gap, t = (near, 0.0) if near < far else (far, 1.0)
        if gap > best:
            best, bnx, bny = gap, nx, ny
            bx, by = px + t * ex - gap * nx, py + t * ey - gap * ny
            if gap > clear:
                return best, bx, by, bnx, bny
    length = np.sqrt(ex * ex + ey * ey)
    for sign in (-1.0, 1.0):
        nx, ny = sign * ey / length, -sign * ex / length
        deepest, at = -np.inf, start
        for k in range(start, stop):
            reach = nx * (corners[k, 0] - px) + ny * (corners[k, 1] - py)
            if reach > deepest:
                deepest, at = reach, k
        if -deepest > best:
            best, bnx, bny = -deepest, nx, ny
            bx, by = corners[at, 0], corners[at, 1]
    return best, bx, by, bnx, bny


@inlined
def _closest(px, py, ex, ey, corners, start, stop):
    """Distance of two separate shapes, the closest point on the part, and the normal towards the
    core.
    """
    best, bx, by, cx, cy = np.inf, 0.0, 0.0, 0.0, 0.0
    for k in range(start, stop):
        j = k + 1 if k + 1 < stop else start
        kx, ky = corners[k, 0], corners[k, 1]
        t = ((kx - px) * ex + (ky - py) * ey) / (ex * ex + ey * ey)
        t = min(max(t, 0.0), 1.0)
        qx, qy = px + t * ex, py + t * ey
        square = (qx - kx) ** 2 + (qy - ky) ** 2
        if square < best:
            best, bx, by, cx, cy = square, kx, ky, qx, qy
        dx, dy = corners[j, 0] - kx, corners[j, 1] - ky
        for end in (0.0, 1.0):
            qx, qy = px + end * ex, py + end * ey
            t = ((qx - kx) * dx + (qy - ky) * dy) / (dx * dx + dy * dy)
            t = min(max(t, 0.0), 1.0)
            fx, fy = kx + t * dx, ky + t * dy
            square = (qx - fx) ** 2 + (qy - fy) ** 2
            if square < best:
                best, bx, by, cx, cy = square, fx, fy, qx, qy
    gap = np.sqrt(best)
    return gap, bx, by, (cx - bx) / gap, (cy - by) / gap
