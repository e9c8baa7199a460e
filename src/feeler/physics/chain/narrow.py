"""Contacts of the chain's capsules with the object, as MuJoCo finds them, in the feature's own frame.

A row of the contact table: segment, point x, y, normal x, y (world, from the object to the segment), distance.
"""

import numpy as np

from feeler.compiled import compiled
from feeler.physics.chain.fields import (
    C_RADIUS,
    KIND_BALL,
    KIND_BOX,
    O_FORWARD_X,
    O_FORWARD_Y,
    O_HIGH_X,
    O_HIGH_Y,
    O_LOW_X,
    O_LOW_Y,
    O_RADIUS,
    P_FIRST,
    P_LAST,
    P_X,
    P_Y,
    W_EX,
    W_EY,
    W_PX,
    W_PY,
)

T_SEGMENT, T_X, T_Y, T_NX, T_NY, T_DISTANCE = range(6)
N_CONTACT = 6
MIN_VALUE = 1e-15  # MuJoCo's mjMINVAL


@compiled
def find_contacts(constants, work, obj, kind, corners, part, place, table, lane):
    """Fill ``table`` with one lane's contacts, base to tip; their number, or −1 if the table is too short."""
    count, x, y = np.int64(0), place[0, P_X, lane], place[0, P_Y, lane]  # a plain 0 is a type of its own to numba
    cx, cy = obj[0, O_FORWARD_X, lane], obj[0, O_FORWARD_Y, lane]
    low_x, low_y, high_x, high_y = (
        obj[0, O_LOW_X, lane],
        obj[0, O_LOW_Y, lane],
        obj[0, O_HIGH_X, lane],
        obj[0, O_HIGH_Y, lane],
    )
    for i in range(int(place[0, P_FIRST, lane]), int(place[0, P_LAST, lane]) + 1):
        dx, dy, radius = work[W_PX, i, lane] - x, work[W_PY, i, lane] - y, constants[C_RADIUS, i, lane]
        px, py = cx * dx + cy * dy, cx * dy - cy * dx
        ex, ey = (
            cx * work[W_EX, i, lane] + cy * work[W_EY, i, lane],
            cx * work[W_EY, i, lane] - cy * work[W_EX, i, lane],
        )
        if (
            min(px, px + ex) > high_x + radius
            or max(px, px + ex) < low_x - radius
            or min(py, py + ey) > high_y + radius
            or max(py, py + ey) < low_y - radius
        ):
            continue
        before = count
        if kind == KIND_BALL:
            count = _touch_ball(
                table, count, px, py, ex, ey, radius, corners[0, 0], corners[0, 1], obj[0, O_RADIUS, lane]
            )
        elif kind == KIND_BOX:
            count = _touch_box(table, count, px, py, ex, ey, radius, corners)
        else:
            for k in range(part.shape[0] - 1):
                count = _touch_polygon(table, count, px, py, ex, ey, radius, corners, part[k], part[k + 1])
        for k in range(before, count):
            _to_world(table, k, i, cx, cy, x, y)
        if count + 2 * part.shape[0] > table.shape[0]:
            return -1
    return count


@compiled
def _to_world(table, k, i, cx, cy, x, y):
    table[k, T_SEGMENT] = i
    px, py, nx, ny = table[k, T_X], table[k, T_Y], table[k, T_NX], table[k, T_NY]
    table[k, T_X], table[k, T_Y] = x + cx * px - cy * py, y + cy * px + cx * py
    table[k, T_NX], table[k, T_NY] = cx * nx - cy * ny, cy * nx + cx * ny


@compiled
def _put(table, count, x, y, nx, ny, distance):
    table[count, T_X], table[count, T_Y] = x, y
    table[count, T_NX], table[count, T_NY] = nx, ny
    table[count, T_DISTANCE] = distance
    return count + 1


@compiled
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


@compiled
def _touch_box(table, count, px, py, ex, ey, radius, corners):
    """MuJoCo's capsule–box test in the plane: the closest point of the capsule's core, and a sensible second one.

    Positions on the core run from −1 at the far end to +1 at the hinge, as MuJoCo's capsule does; it decides ties.
    """
    sx, sy = 0.5 * (corners[1, 0] - corners[2, 0]), 0.5 * (corners[1, 1] - corners[0, 1])
    mx, my = 0.5 * (corners[1, 0] + corners[2, 0]), 0.5 * (corners[1, 1] + corners[0, 1])
    hx, hy = -0.5 * ex, -0.5 * ey
    x, y = px - hx - mx, py - hy - my
    first, second = _box_points(x, y, hx, hy, sx, sy)
    count = _touch_box_sphere(table, count, x + first * hx, y + first * hy, radius, sx, sy, mx, my)
    if second > -3.0:
        at = first + second
        count = _touch_box_sphere(table, count, x + at * hx, y + at * hy, radius, sx, sy, mx, my)
    return count


@compiled
def _box_points(x, y, hx, hy, sx, sy):
    """Position of the closest point of the core, and how much further along the core the second lies (−4: none)."""
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


@compiled
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


@compiled
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


@compiled
def _touch_box_sphere(table, count, x, y, radius, sx, sy, mx, my):
    kx, ky = min(max(x, -sx), sx), min(max(y, -sy), sy)
    dx, dy = x - kx, y - ky
    gap = np.sqrt(dx * dx + dy * dy)
    if gap >= radius:
        return count
    if gap > MIN_VALUE:
        nx, ny = dx / gap, dy / gap
        middle = 0.5 * (gap - radius)
        return _put(table, count, mx + kx + middle * nx, my + ky + middle * ny, nx, ny, gap - radius)
    best, nx, ny = sx + x, -1.0, 0.0
    if sx - x < best:
        best, nx, ny = sx - x, 1.0, 0.0
    if sy + y < best:
        best, nx, ny = sy + y, 0.0, -1.0
    if sy - y < best:
        best, nx, ny = sy - y, 0.0, 1.0
    back = -0.5 * (radius - best)
    return _put(table, count, mx + x + back * nx, my + y + back * ny, nx, ny, -best - radius)


@compiled
def _touch_polygon(table, count, px, py, ex, ey, radius, corners, start, stop):
    """Closest points of the core and one convex part; where the core is inside, the shallowest way out."""
    depth, ax, ay, nx, ny = _separate(px, py, ex, ey, corners, start, stop)
    if depth >= radius:
        return count
    if depth > 0.0:
        depth, ax, ay, nx, ny = _closest(px, py, ex, ey, corners, start, stop)
        if depth >= radius:
            return count
    distance = depth - radius
    reach = 0.5 * distance
    return _put(table, count, ax + reach * nx, ay + reach * ny, nx, ny, distance)


@compiled
def _separate(px, py, ex, ey, corners, start, stop):
    """Greatest separation along a normal of either shape (negative: penetration), its point on the part, the normal."""
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


@compiled
def _closest(px, py, ex, ey, corners, start, stop):
    """Distance of two separate shapes, the closest point on the part, and the normal towards the core."""
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
