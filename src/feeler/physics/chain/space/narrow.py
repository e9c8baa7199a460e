"""Contacts of segments with the solids of objects in space, as MuJoCo finds them."""

import numpy as np

from feeler.compiled import inlined
from feeler.physics.chain import fields as f
from feeler.physics.chain.narrow import MIN_VALUE
from feeler.physics.chain.space import fields as s
from feeler.physics.chain.space.box import NONE, find_box_points, leave_box
from feeler.stimulus.hull import dot3, join3, measure

_PARALLEL = 1e-8  # squared sine of the angle from which MuJoCo 4 takes capsules for parallel


@inlined
def find_in_space(constants, work, obj, place, solid, hulls, table, count, lane):
    """Append one lane's contacts with a solid, base to tip; their number, or −1 if the table is too
    short.
    """
    o, kind = int(solid[s.S_OBJECT]), int(solid[s.S_KIND])
    grown = obj[o, f.O_ROUNDING, lane]
    ax, ay, az = _to_world(place, o, solid, s.S_A, lane)
    bx, by, bz = _to_world(place, o, solid, s.S_B, lane)
    hx, hy, hz = 0.5 * (bx - ax), 0.5 * (by - ay), 0.5 * (bz - az)
    mx, my, mz = 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz)
    reach = np.sqrt(hx * hx + hy * hy + hz * hz) + grown
    for i in range(work.shape[1]):
        radius = constants[f.C_RADIUS, i, lane]
        ex, ey, ez = (
            0.5 * work[s.SEG_ALONG, i, lane],
            0.5 * work[s.SEG_ALONG + 1, i, lane],
            0.5 * work[s.SEG_ALONG + 2, i, lane],
        )
        px, py, pz = (
            work[s.SEG_PLACE, i, lane] + ex,
            work[s.SEG_PLACE + 1, i, lane] + ey,
            work[s.SEG_PLACE + 2, i, lane] + ez,
        )
        half = 0.5 * constants[f.C_LENGTH, i, lane]
        dx, dy, dz = px - mx, py - my, pz - mz
        if kind == s.SOLID_WALL:
            nx, ny, nz = (
                place[s.OBJ_AXES, o, lane],
                place[s.OBJ_AXES + 1, o, lane],
                place[s.OBJ_AXES + 2, o, lane],
            )
            if nx * dx + ny * dy + nz * dz > half + radius:
                continue
        elif dx * dx + dy * dy + dz * dz > (half + radius + reach) ** 2:
            continue
        if count + 2 > table.shape[0]:
            return -1
        before = count
        if kind == s.SOLID_WALL:
            for k in range(2):
                side = 1.0 - 2.0 * k
                x, y, z = dx + side * ex, dy + side * ey, dz + side * ez
                gap = nx * x + ny * y + nz * z - radius
                if gap <= 0.0:
                    deep = radius + 0.5 * gap
                    table[count, s.HIT_POINT] = mx + x - nx * deep
                    table[count, s.HIT_POINT + 1] = my + y - ny * deep
                    table[count, s.HIT_POINT + 2] = mz + z - nz * deep
                    table[count, s.HIT_NORMAL] = nx
                    table[count, s.HIT_NORMAL + 1] = ny
                    table[count, s.HIT_NORMAL + 2] = nz
                    table[count, s.HIT_DISTANCE] = gap
                    count += 1
        elif kind == s.SOLID_BALL:
            t = -(dx * ex + dy * ey + dz * ez) / (ex * ex + ey * ey + ez * ez)
            count = _touch(table, count, px, py, pz, ex, ey, ez, t, radius, mx, my, mz, grown)
        elif kind == s.SOLID_BOX or kind == s.SOLID_HULL:
            p = _to_frame(place, o, (px, py, pz), 1.0, lane)
            e = _to_frame(place, o, (ex, ey, ez), 0.0, lane)
            if kind == s.SOLID_BOX:
                count = _touch_box(table, count, p, e, radius, solid, grown)
            else:
                count = _touch_hull(table, count, p, e, radius, solid, hulls, grown)
            for k in range(before, count):
                _turn_contact(place, o, table, k, lane)
        else:
            count = _touch_capsule(
                table,
                count,
                (px, py, pz),
                (ex, ey, ez),
                radius,
                (mx, my, mz),
                (hx, hy, hz),
                grown,
            )
        for k in range(before, count):
            table[k, s.HIT_OBJECT], table[k, s.HIT_SEGMENT] = o, i
            for axis in range(3):  # only walls ask for a tangent, that of the segment
                along = work[s.SEG_ALONG + axis, i, lane] / constants[f.C_LENGTH, i, lane]
                table[k, s.HIT_TANGENT + axis] = along if kind == s.SOLID_WALL else 0.0
    return count


@inlined
def _to_world(place, o, solid, k, lane):
    """A point of an object's frame."""
    x, y, z = solid[k], solid[k + 1], solid[k + 2]
    a = s.OBJ_AXES
    return (
        place[s.OBJ_PLACE, o, lane]
        + x * place[a, o, lane]
        + y * place[a + 3, o, lane]
        + z * place[a + 6, o, lane],
        place[s.OBJ_PLACE + 1, o, lane]
        + x * place[a + 1, o, lane]
        + y * place[a + 4, o, lane]
        + z * place[a + 7, o, lane],
        place[s.OBJ_PLACE + 2, o, lane]
        + x * place[a + 2, o, lane]
        + y * place[a + 5, o, lane]
        + z * place[a + 8, o, lane],
    )


@inlined
def _touch(table, count, px, py, pz, ex, ey, ez, t, radius, bx, by, bz, grown):
    """Contact of a ball with the point ``t`` of a segment (middle p, half e) of a radius."""
    t = min(max(t, -1.0), 1.0)
    x, y, z = px + t * ex - bx, py + t * ey - by, pz + t * ez - bz
    apart = np.sqrt(x * x + y * y + z * z)
    gap = apart - grown - radius
    if gap > 0.0:
        return count
    if apart < MIN_VALUE:
        x, y, z, apart = 1.0, 0.0, 0.0, 1.0  # as MuJoCo has it
    nx, ny, nz = x / apart, y / apart, z / apart
    deep = grown + 0.5 * gap
    table[count, s.HIT_POINT] = bx + nx * deep
    table[count, s.HIT_POINT + 1] = by + ny * deep
    table[count, s.HIT_POINT + 2] = bz + nz * deep
    table[count, s.HIT_NORMAL], table[count, s.HIT_NORMAL + 1] = nx, ny
    table[count, s.HIT_NORMAL + 2], table[count, s.HIT_DISTANCE] = nz, gap
    return count + 1


@inlined
def _touch_capsule(table, count, p, e, radius, m, h, grown):
    """Contacts of two capsules, of middles p and m and half axes e and h: one, or up to two where
    they are parallel.
    """
    (px, py, pz), (ex, ey, ez), (mx, my, mz), (hx, hy, hz) = p, e, m, h
    dx, dy, dz = px - mx, py - my, pz - mz
    a, c = ex * ex + ey * ey + ez * ez, hx * hx + hy * hy + hz * hz
    b = -(ex * hx + ey * hy + ez * hz)
    u, v = -(ex * dx + ey * dy + ez * dz), hx * dx + hy * dy + hz * dz
    det = a * c - b * b
    if det >= _PARALLEL * a * c:
        t, r = (c * u - b * v) / det, (a * v - b * u) / det
        if t > 1.0 or t < -1.0:
            t = 1.0 if t > 1.0 else -1.0
            r = (v - b * t) / c
        if r > 1.0 or r < -1.0:
            r = 1.0 if r > 1.0 else -1.0
            t = (u - b * r) / a
        x, y, z = mx + r * hx, my + r * hy, mz + r * hz
        return _touch(table, count, px, py, pz, ex, ey, ez, t, radius, x, y, z, grown)
    start = count
    for k in range(4):  # each end of the one, then of the other
        side = 1.0 - 2.0 * (k % 2)
        t, r = side, side
        if k < 2:
            r = min(max((v - b * side) / c, -1.0), 1.0)
        else:
            t = (u - b * side) / a
        if count < start + 2:
            x, y, z = mx + r * hx, my + r * hy, mz + r * hz
            count = _touch(table, count, px, py, pz, ex, ey, ez, t, radius, x, y, z, grown)
    return count


@inlined
def _to_frame(place, o, v, shift, lane):
    """A place (``shift`` 1) or direction (0) in an object's frame."""
    v = join3(-shift, _read(place, s.OBJ_PLACE, o, lane), v)
    return (
        dot3(_read(place, s.OBJ_AXES, o, lane), v),
        dot3(_read(place, s.OBJ_AXES + 3, o, lane), v),
        dot3(_read(place, s.OBJ_AXES + 6, o, lane), v),
    )


@inlined
def _read(table, k, o, lane):
    return table[k, o, lane], table[k + 1, o, lane], table[k + 2, o, lane]


@inlined
def _turn_contact(place, o, table, k, lane):
    """A contact of an object's frame in the world."""
    for at, shift in ((s.HIT_POINT, 1.0), (s.HIT_NORMAL, 0.0)):
        v = (0.0, 0.0, 0.0)
        for axis in range(3):
            v = join3(table[k, at + axis], _read(place, s.OBJ_AXES + 3 * axis, o, lane), v)
        v = join3(shift, _read(place, s.OBJ_PLACE, o, lane), v)
        table[k, at], table[k, at + 1], table[k, at + 2] = v


@inlined
def _put(table, count, near, out, gap, radius, grown):
    """A contact at a solid's point, if the grown surfaces meet there."""
    distance = gap - radius - grown
    if distance > 0.0:
        return count
    point = join3(grown + 0.5 * distance, out, near)
    for axis in range(3):
        table[count, s.HIT_POINT + axis], table[count, s.HIT_NORMAL + axis] = (
            point[axis],
            out[axis],
        )
    table[count, s.HIT_DISTANCE] = distance
    return count + 1


@inlined
def _touch_box(table, count, p, e, radius, solid, grown):
    """Contacts of a segment (middle p, half e towards its far end) with a box: none, one or two."""
    low = (solid[s.S_A], solid[s.S_A + 1], solid[s.S_A + 2])
    high = (solid[s.S_B], solid[s.S_B + 1], solid[s.S_B + 2])
    size = join3(-0.5, low, (0.5 * high[0], 0.5 * high[1], 0.5 * high[2]))
    middle = join3(1.0, low, size)
    x, h = join3(-1.0, middle, p), (-e[0], -e[1], -e[2])
    at, more = find_box_points(x, h, size)
    for k in range(2):
        if k == 0 or more > NONE + 1.0:
            near, out, gap = leave_box(join3(at + k * more, h, x), size)
            near = join3(1.0, middle, near)
            count = _put(table, count, near, out, gap, radius, grown)
    return count


@inlined
def _touch_hull(table, count, p, e, radius, solid, hulls, grown):
    """Contact of a segment with a polyhedron, where they are nearest or least deep."""
    first, middle, stop = int(solid[s.S_FIRST]), int(solid[s.S_MIDDLE]), int(solid[s.S_STOP])
    along = (2.0 * e[0], 2.0 * e[1], 2.0 * e[2])
    start = join3(-1.0, e, p)
    gap, near, out = measure(hulls, first, middle, stop, start, along, radius + grown)
    return _put(table, count, near, out, gap, radius, grown)
