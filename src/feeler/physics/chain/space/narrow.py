"""Contacts of segments with balls, capsules and walls in space, as MuJoCo finds them."""

import numpy as np

from feeler.compiled import inlined
from feeler.physics.chain import fields as f
from feeler.physics.chain.narrow import MIN_VALUE
from feeler.physics.chain.space import fields as s

PARALLEL = 1e-8  # squared sine of the angle from which MuJoCo 4 takes capsules for parallel


@inlined
def find_in_space(constants, work, obj, place, solid, table, count, lane):
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
    if det >= PARALLEL * a * c:
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
