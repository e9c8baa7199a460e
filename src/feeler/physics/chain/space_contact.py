"""Contact in space: where segments meet solids, and the convex problem with MuJoCo's pyramid."""

import numpy as np

from feeler.compiled import inlined
from feeler.objects.distance import cross3, dot3, join3, measure
from feeler.physics.chain import fields as f
from feeler.physics.chain.contact import (
    MAX_NEWTON,
    MIN_VALUE,
    compute_impedance,
    improve,
    recall,
    weigh,
)
from feeler.physics.chain.space_sweep import fold_in_space, unfold_in_space

# Contacts of a segment with a box in space, as MuJoCo finds them: at the point of the segment
# that is nearest to the box, and at a second one where it lies along a face or an edge.
#
# Places on the segment run from −1 at its far end to +1 at its hinge, as MuJoCo's capsule does;
# it decides ties. A corner is a number whose bits say on which side it lies.

NONE = -4.0  # no second point


@inlined
def _find_box_points(x, h, size):
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
def _leave_box(at, size):
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


# Contacts of segments with the solids of objects in space, as MuJoCo finds them.

_PARALLEL = 1e-8  # squared sine of the angle from which MuJoCo 4 takes capsules for parallel


@inlined
def find_in_space(constants, work, obj, place, solid, hulls, table, count, lane):
    """Append one lane's contacts with a solid, base to tip; their number, or −1 if the table is too
    short.
    """
    o, kind = int(solid[f.S_OBJECT]), int(solid[f.S_KIND])
    grown = obj[o, f.O_ROUNDING, lane]
    ax, ay, az = _to_world(place, o, solid, f.S_A, lane)
    bx, by, bz = _to_world(place, o, solid, f.S_B, lane)
    hx, hy, hz = 0.5 * (bx - ax), 0.5 * (by - ay), 0.5 * (bz - az)
    mx, my, mz = 0.5 * (ax + bx), 0.5 * (ay + by), 0.5 * (az + bz)
    reach = np.sqrt(hx * hx + hy * hy + hz * hz) + grown
    for i in range(work.shape[1]):
        radius = constants[f.C_RADIUS, i, lane]
        ex, ey, ez = (
            0.5 * work[f.SEG_ALONG, i, lane],
            0.5 * work[f.SEG_ALONG + 1, i, lane],
            0.5 * work[f.SEG_ALONG + 2, i, lane],
        )
        px, py, pz = (
            work[f.SEG_PLACE, i, lane] + ex,
            work[f.SEG_PLACE + 1, i, lane] + ey,
            work[f.SEG_PLACE + 2, i, lane] + ez,
        )
        half = 0.5 * constants[f.C_LENGTH, i, lane]
        dx, dy, dz = px - mx, py - my, pz - mz
        if kind == f.SOLID_WALL:
            nx, ny, nz = (
                place[f.OBJ_AXES, o, lane],
                place[f.OBJ_AXES + 1, o, lane],
                place[f.OBJ_AXES + 2, o, lane],
            )
            if nx * dx + ny * dy + nz * dz > half + radius:
                continue
        elif dx * dx + dy * dy + dz * dz > (half + radius + reach) ** 2:
            continue
        if count + 2 > table.shape[0]:
            return -1
        before = count
        if kind == f.SOLID_WALL:
            for k in range(2):
                side = 1.0 - 2.0 * k
                x, y, z = dx + side * ex, dy + side * ey, dz + side * ez
                gap = nx * x + ny * y + nz * z - radius
                if gap <= 0.0:
                    deep = radius + 0.5 * gap
                    table[count, f.HIT_POINT] = mx + x - nx * deep
                    table[count, f.HIT_POINT + 1] = my + y - ny * deep
                    table[count, f.HIT_POINT + 2] = mz + z - nz * deep
                    table[count, f.HIT_NORMAL] = nx
                    table[count, f.HIT_NORMAL + 1] = ny
                    table[count, f.HIT_NORMAL + 2] = nz
                    table[count, f.HIT_DISTANCE] = gap
                    count += 1
        elif kind == f.SOLID_BALL:
            t = -(dx * ex + dy * ey + dz * ez) / (ex * ex + ey * ey + ez * ez)
            count = _touch(table, count, px, py, pz, ex, ey, ez, t, radius, mx, my, mz, grown)
        elif kind == f.SOLID_BOX or kind == f.SOLID_HULL:
            p = _to_frame(place, o, (px, py, pz), 1.0, lane)
            e = _to_frame(place, o, (ex, ey, ez), 0.0, lane)
            if kind == f.SOLID_BOX:
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
            table[k, f.HIT_OBJECT], table[k, f.HIT_SEGMENT] = o, i
            for axis in range(3):  # only walls ask for a tangent, that of the segment
                along = work[f.SEG_ALONG + axis, i, lane] / constants[f.C_LENGTH, i, lane]
                table[k, f.HIT_TANGENT + axis] = along if kind == f.SOLID_WALL else 0.0
    return count


@inlined
def _to_world(place, o, solid, k, lane):
    """A point of an object's frame."""
    x, y, z = solid[k], solid[k + 1], solid[k + 2]
    a = f.OBJ_AXES
    return (
        place[f.OBJ_PLACE, o, lane]
        + x * place[a, o, lane]
        + y * place[a + 3, o, lane]
        + z * place[a + 6, o, lane],
        place[f.OBJ_PLACE + 1, o, lane]
        + x * place[a + 1, o, lane]
        + y * place[a + 4, o, lane]
        + z * place[a + 7, o, lane],
        place[f.OBJ_PLACE + 2, o, lane]
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
    table[count, f.HIT_POINT] = bx + nx * deep
    table[count, f.HIT_POINT + 1] = by + ny * deep
    table[count, f.HIT_POINT + 2] = bz + nz * deep
    table[count, f.HIT_NORMAL], table[count, f.HIT_NORMAL + 1] = nx, ny
    table[count, f.HIT_NORMAL + 2], table[count, f.HIT_DISTANCE] = nz, gap
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
    v = join3(-shift, _read_narrow(place, f.OBJ_PLACE, o, lane), v)
    return (
        dot3(_read_narrow(place, f.OBJ_AXES, o, lane), v),
        dot3(_read_narrow(place, f.OBJ_AXES + 3, o, lane), v),
        dot3(_read_narrow(place, f.OBJ_AXES + 6, o, lane), v),
    )


@inlined
def _read_narrow(table, k, o, lane):
    return table[k, o, lane], table[k + 1, o, lane], table[k + 2, o, lane]


@inlined
def _turn_contact(place, o, table, k, lane):
    """A contact of an object's frame in the world."""
    for at, shift in ((f.HIT_POINT, 1.0), (f.HIT_NORMAL, 0.0)):
        v = (0.0, 0.0, 0.0)
        for axis in range(3):
            v = join3(
                table[k, at + axis], _read_narrow(place, f.OBJ_AXES + 3 * axis, o, lane), v
            )
        v = join3(shift, _read_narrow(place, f.OBJ_PLACE, o, lane), v)
        table[k, at], table[k, at + 1], table[k, at + 2] = v


@inlined
def _put(table, count, near, out, gap, radius, grown):
    """A contact at a solid's point, if the grown surfaces meet there."""
    distance = gap - radius - grown
    if distance > 0.0:
        return count
    point = join3(grown + 0.5 * distance, out, near)
    for axis in range(3):
        table[count, f.HIT_POINT + axis], table[count, f.HIT_NORMAL + axis] = (
            point[axis],
            out[axis],
        )
    table[count, f.HIT_DISTANCE] = distance
    return count + 1


@inlined
def _touch_box(table, count, p, e, radius, solid, grown):
    """Contacts of a segment (middle p, half e towards its far end) with a box: none, one or two."""
    low = (solid[f.S_A], solid[f.S_A + 1], solid[f.S_A + 2])
    high = (solid[f.S_B], solid[f.S_B + 1], solid[f.S_B + 2])
    size = join3(-0.5, low, (0.5 * high[0], 0.5 * high[1], 0.5 * high[2]))
    middle = join3(1.0, low, size)
    x, h = join3(-1.0, middle, p), (-e[0], -e[1], -e[2])
    at, more = _find_box_points(x, h, size)
    for k in range(2):
        if k == 0 or more > NONE + 1.0:
            near, out, gap = _leave_box(join3(at + k * more, h, x), size)
            near = join3(1.0, middle, near)
            count = _put(table, count, near, out, gap, radius, grown)
    return count


@inlined
def _touch_hull(table, count, p, e, radius, solid, hulls, grown):
    """Contact of a segment with a polyhedron, where they are nearest or least deep."""
    first, middle, stop = int(solid[f.S_FIRST]), int(solid[f.S_MIDDLE]), int(solid[f.S_STOP])
    along = (2.0 * e[0], 2.0 * e[1], 2.0 * e[2])
    start = join3(-1.0, e, p)
    gap, near, out = measure(hulls, first, middle, stop, start, along, radius + grown)
    return _put(table, count, near, out, gap, radius, grown)


# Contact in space: the convex problem of the plane with the four edges of MuJoCo's pyramid, n ±
# μ t along two tangents, and wrenches of six numbers.


@inlined
def make_rows_in_space(constants, work, base, obj, table, count, place, rows, lane):
    """The rows of one lane's ``count`` contacts; each contact is told its share of the segment's
    length.
    """
    for k in range(count):
        o, i = int(table[k, f.HIT_OBJECT]), int(table[k, f.HIT_SEGMENT])
        point = (table[k, f.HIT_POINT], table[k, f.HIT_POINT + 1], table[k, f.HIT_POINT + 2])
        normal = (
            table[k, f.HIT_NORMAL],
            table[k, f.HIT_NORMAL + 1],
            table[k, f.HIT_NORMAL + 2],
        )
        distance = table[k, f.HIT_DISTANCE]
        r = join3(-1.0, _read(work, f.SEG_PLACE, i, lane), point)
        along = _read(work, f.SEG_ALONG, i, lane)
        table[k, f.HIT_SHARE] = dot3(r, along) / dot3(along, along)
        arm = join3(-1.0, _read(place, f.OBJ_PLACE, o, lane), point)
        moved = cross3(_read(place, f.OBJ_OMEGA, o, lane), arm)
        moved = join3(1.0, moved, _read(place, f.OBJ_V, o, lane))  # the object's point
        own = cross3(_read(work, f.OMEGA, i, lane), r)
        slip = join3(-1.0, moved, join3(1.0, own, _read(work, f.VELOCITY, i, lane)))
        slow = min(obj[o, f.O_SLOW, lane], constants[f.C_SLOW, i, lane])
        fast = min(obj[o, f.O_FAST, lane], constants[f.C_WIDEST, i, lane])
        wide = max(constants[f.C_WIDTH, i, lane], slow, fast)
        impedance = compute_impedance(
            distance, constants[f.C_D_MAX, i, lane], wide, obj, o, lane
        )
        thin = min(constants[f.C_RADIUS, i, lane], obj[o, f.O_RADIUS, lane])
        base[0, f.BASE_SINK, lane] = max(base[0, f.BASE_SINK, lane], -distance / thin)
        mu = obj[o, f.O_FRICTION, lane]
        ease = constants[f.C_INVWEIGHT, i, lane] * (1.0 - impedance) / impedance
        straight, edge = weigh(mu, ease)
        pull = -constants[f.C_K, i, lane] * impedance * distance
        first, second = _find_tangents(normal, table, k)
        for side in range(f.EDGES):
            slide = mu if side % 2 == 0 else -mu
            across = first if side < 2 else second
            d = (
                normal[0] + slide * across[0],
                normal[1] + slide * across[1],
                normal[2] + slide * across[2],
            )
            turn, row = cross3(r, d), f.EDGES * k + side
            rows[row, f.R_OBJECT], rows[row, f.R_SEGMENT] = o, i
            for axis in range(3):
                rows[row, f.R_W0 + axis] = turn[axis]
                rows[row, f.R_W0 + 3 + axis] = d[axis]
            rows[row, f.R_ARM] = dot3(d, moved)
            rows[row, f.R_WEIGHT] = edge
            if mu == 0.0:
                rows[row, f.R_WEIGHT] = straight if side == 0 else 0.0
            rows[row, f.R_AIM] = pull - constants[f.C_B, i, lane] * dot3(d, slip)


@inlined
def _find_tangents(n, table, k):
    """Two unit vectors at right angles to the normal: MuJoCo's ``mju_makeFrame``, of the tangent
    that the contact asks for, or of y or z.
    """
    t = (table[k, f.HIT_TANGENT], table[k, f.HIT_TANGENT + 1], table[k, f.HIT_TANGENT + 2])
    if dot3(t, t) < 0.25:  # none: MuJoCo takes a long one to be meant
        t = (0.0, 1.0, 0.0) if -0.5 < n[1] < 0.5 else (0.0, 0.0, 1.0)
    lean = dot3(t, n)
    t = (t[0] - lean * n[0], t[1] - lean * n[1], t[2] - lean * n[2])
    size = np.sqrt(dot3(t, t))
    t = (t[0] / size, t[1] / size, t[2] / size) if size > MIN_VALUE else (1.0, 0.0, 0.0)
    return t, cross3(n, t)


@inlined
def _read(table, k, i, lane):
    return table[k, i, lane], table[k + 1, i, lane], table[k + 2, i, lane]


@inlined
def solve_in_space(
    constants, work, base, rows, count, loaded, memory, open_, timestep, last, kind, width
):
    """Forces of each lane's rows in ``f.R_FORCE`` at its minimum, and its hinges as ``fold`` leaves
    them; as in the plane.
    """
    left = 0
    for lane in range(count.shape[0]):
        open_[lane] = count[lane] > 0
        if open_[lane]:
            recall(rows[lane], f.EDGES * count[lane], memory[lane], f.EDGES)
            left += 1
    for sweep in range(MAX_NEWTON):
        for lane in range(count.shape[0]):
            if open_[lane]:
                _load(work, rows[lane], f.EDGES * count[lane], loaded, lane)
        fold_in_space(constants, work, base, loaded, kind, timestep, width)
        unfold_in_space(work, base, loaded, last, kind, width)
        for lane in range(count.shape[0]):
            if open_[lane]:
                n_rows = f.EDGES * count[lane]
                same = _evaluate(work, rows[lane], n_rows, lane)
                improve(rows[lane], n_rows, sweep == 0 or same)
                open_[lane] = not same
                left -= 1 if same else 0
        if left == 0:
            break


@inlined
def clear_in_space(work, rows, n_rows, lane):
    """Empty the contact columns of the touched segments."""
    for first in range(0, n_rows, f.EDGES):
        i = int(rows[first, f.R_SEGMENT])
        for column in range(f.ADD, f.N_SPACE_WORK):
            work[column, i, lane] = 0.0


@inlined
def _load(work, rows, n_rows, loaded, lane):
    """Put Σ D w wᵀ and −Σ D a_ref w of the active rows into their segments' columns."""
    clear_in_space(work, rows, n_rows, lane)
    for r in range(n_rows):
        i = int(rows[r, f.R_SEGMENT])
        loaded[i] = True
        if rows[r, f.R_ACTIVE] > 0.0:
            weight, at = rows[r, f.R_WEIGHT], f.ADD
            for j in range(3):  # I: xx xy xz yy yz zz
                for k in range(j, 3):
                    work[at, i, lane] += weight * rows[r, f.R_W0 + j] * rows[r, f.R_W0 + k]
                    at += 1
            for j in range(3):  # H, by rows
                for k in range(3):
                    work[at, i, lane] += weight * rows[r, f.R_W0 + j] * rows[r, f.R_W0 + 3 + k]
                    at += 1
            for j in range(3, 6):  # M
                for k in range(j, 6):
                    work[at, i, lane] += weight * rows[r, f.R_W0 + j] * rows[r, f.R_W0 + k]
                    at += 1
            pull = weight * rows[r, f.R_AIM]
            for j in range(6):
                work[f.BIAS + j, i, lane] -= pull * rows[r, f.R_W0 + j]


@inlined
def _evaluate(work, rows, n_rows, lane):
    """J q̈ and λ of the full Newton step; whether its active rows are those it was computed with."""
    same = True
    for r in range(n_rows):
        i, x = int(rows[r, f.R_SEGMENT]), 0.0
        for j in range(6):
            x += rows[r, f.R_W0 + j] * work[f.ALPHA + j, i, lane]
        rows[r, f.R_NEW_X] = x
        short = rows[r, f.R_AIM] - x
        active = rows[r, f.R_ACTIVE] > 0.0
        rows[r, f.R_NEW_FORCE] = rows[r, f.R_WEIGHT] * short if active else 0.0
        same = same and active == (short > 0.0)
    return same


@inlined
def press_in_space(constants, work, base, place, table, rows, n_rows, loaded, timestep, lane):
    """Put minus the rows' wrenches into the bias columns; each object's force, the work it does in
    the step, and where along the antenna all press.
    """
    clear_in_space(work, rows, n_rows, lane)
    for r in range(n_rows):
        force = rows[r, f.R_FORCE]
        if force > 0.0:
            o, i = int(rows[r, f.R_OBJECT]), int(rows[r, f.R_SEGMENT])
            loaded[i] = True
            for j in range(6):
                work[f.BIAS + j, i, lane] -= force * rows[r, f.R_W0 + j]
            for j in range(3):
                place[f.OBJ_FORCE + j, o, lane] += force * rows[r, f.R_W0 + 3 + j]
            place[f.OBJ_WORK, o, lane] += timestep * force * rows[r, f.R_ARM]
            share = min(max(table[r // f.EDGES, f.HIT_SHARE], 0.0), 1.0)
            base[0, f.BASE_PRESS, lane] += force
            base[0, f.BASE_SPOT, lane] += force * (
                constants[f.C_START, i, lane] + share * constants[f.C_PORTION, i, lane]
            )
