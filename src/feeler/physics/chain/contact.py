"""Contact of a planar chain: where capsules meet convex parts, and MuJoCo's soft contact as a
convex problem.
"""

import numpy as np

from feeler.compiled import inlined
from feeler.physics.chain import fields as f
from feeler.physics.chain.sweep import fold, fold_both, unfold

# Contacts of the chain's capsules with an object's convex parts, as MuJoCo finds them, in the
# object's own frame.

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


# MuJoCo's soft contact as a convex problem in the accelerations, one O(n) sweep per Newton
# iterate.
#
#     min over q̈ of ½ (q̈ − a₀)ᵀ M (q̈ − a₀) + Σ_rows ½ D min(0, J q̈ − a_ref)²
#
# Each contact has the rows n ± μt and, from the two edges of MuJoCo's pyramid that leave the
# plane, n with twice the weight. A row touches one segment only, w = (lever, direction), J q̈ =
# w·(α, a), so JᵀDJ adds D w wᵀ to its inertia.

MAX_NEWTON = 50
_MAX_SEARCH = 60
_MIN_IMPEDANCE, _MAX_IMPEDANCE = 1e-4, 0.9999  # MuJoCo's mjMINIMP, mjMAXIMP


@inlined
def compute_impedance(distance, high, width, obj, o, lane):
    """MuJoCo's d(r): from d_min at the surface to d_max = ``high`` at ``width``, a power law on
    either side of the midpoint.
    """
    low = obj[o, f.O_D_MIN, lane]
    middle, power = obj[o, f.O_MIDPOINT, lane], obj[o, f.O_POWER, lane]
    x = abs(distance) / width
    if x >= 1.0:
        return min(max(high, _MIN_IMPEDANCE), _MAX_IMPEDANCE)
    if power == 1.0:
        y = x
    elif power == 2.0:
        y = x * x / middle if x <= middle else 1.0 - (1.0 - x) * (1.0 - x) / (1.0 - middle)
    elif x <= middle:
        y = x**power / middle ** (power - 1.0)
    else:
        y = 1.0 - (1.0 - x) ** power / (1.0 - middle) ** (power - 1.0)
    return min(max(low + y * (high - low), _MIN_IMPEDANCE), _MAX_IMPEDANCE)


@inlined
def make_rows(constants, work, base, obj, table, count, place, rows, lane):
    """The rows of one lane's ``count`` contacts; each contact is told its share of the segment's
    length.
    """
    for k in range(count):
        o, i = int(table[k, f.T_OBJECT]), int(table[k, f.T_SEGMENT])
        distance, nx, ny = table[k, f.T_DISTANCE], table[k, f.T_NX], table[k, f.T_NY]
        rx, ry = (
            table[k, f.T_X] - work[f.W_PX, i, lane],
            table[k, f.T_Y] - work[f.W_PY, i, lane],
        )
        ex, ey = work[f.W_EX, i, lane], work[f.W_EY, i, lane]
        table[k, f.T_SHARE] = (rx * ex + ry * ey) / (ex * ex + ey * ey)
        turn, ox, oy = (
            place[o, f.P_TURN, lane],
            table[k, f.T_X] - place[o, f.P_X, lane],
            table[k, f.T_Y] - place[o, f.P_Y, lane],
        )
        mx, my = (
            place[o, f.P_VX, lane] + turn * oy,
            place[o, f.P_VY, lane] - turn * ox,
        )  # the object's point
        vx, vy = mx - base[0, f.B_VX, lane], my - base[0, f.B_VY, lane]  # seen from the base
        slow = min(obj[o, f.O_SLOW, lane], constants[f.C_SLOW, i, lane])
        fast = min(obj[o, f.O_FAST, lane], constants[f.C_WIDEST, i, lane])
        wide = max(constants[f.C_WIDTH, i, lane], slow, fast)
        impedance = compute_impedance(
            distance, constants[f.C_D_MAX, i, lane], wide, obj, o, lane
        )
        thin = min(constants[f.C_RADIUS, i, lane], obj[o, f.O_RADIUS, lane])
        base[0, f.B_SINK, lane] = max(base[0, f.B_SINK, lane], -distance / thin)
        mu = obj[o, f.O_FRICTION, lane]
        normal, edge = weigh(
            mu, constants[f.C_INVWEIGHT, i, lane] * (1.0 - impedance) / impedance
        )
        pull = -constants[f.C_K, i, lane] * impedance * distance
        omega, wx, wy = (
            work[f.W_OMEGA, i, lane],
            work[f.W_VX, i, lane] - vx,
            work[f.W_VY, i, lane] - vy,
        )
        for side in range(f.ROWS):
            slide = (side - 1) * mu  # −μ, 0, +μ along the tangent (−n_y, n_x)
            dx, dy = nx - slide * ny, ny + slide * nx
            lever = ry * dx - rx * dy
            row = f.ROWS * k + side
            rows[row, f.R_OBJECT], rows[row, f.R_SEGMENT] = o, i
            rows[row, f.R_W0], rows[row, f.R_W1], rows[row, f.R_W2] = lever, dx, dy
            rows[row, f.R_ARM] = dx * mx + dy * my
            rows[row, f.R_WEIGHT] = normal if side == 1 else edge
            rows[row, f.R_AIM] = pull - constants[f.C_B, i, lane] * (
                lever * omega + dx * wx + dy * wy
            )


@inlined
def weigh(mu, ease):
    """Weights of the normal row and of each edge row; without friction only the normal row acts
    (``condim`` 1).
    """
    if mu == 0.0:
        return 1.0 / max(ease, 1e-15), 0.0
    weight = 1.0 / max(2.0 * mu * mu * (1.0 + mu * mu) * ease, 1e-15)
    return 2.0 * weight, weight


@inlined
def solve_contacts(
    segments,
    work,
    base,
    rows,
    count,
    loaded,
    memory,
    open_,
    timestep,
    damped,
    last,
    pair,
    width,
):
    """Forces of each lane's rows in ``f.R_FORCE`` at its minimum, and its hinges as ``fold`` leaves
    them.

    ``memory`` holds what :func:`keep` noted; it leads to the first guess. One lane (which has a
    ``pair``) that is not ``damped`` is left ready for ``refold``.
    A lane that has its minimum is left alone while the others go on: its columns stay, and so does
    what they give.
    """
    both = pair is not None and not damped
    left = 0
    for lane in range(count.shape[0]):
        open_[lane] = count[lane] > 0
        if open_[lane]:
            recall(rows[lane], f.ROWS * count[lane], memory[lane], f.ROWS)
            left += 1
    for sweep in range(MAX_NEWTON):
        for lane in range(count.shape[0]):
            if open_[lane]:
                _load(work, rows[lane], f.ROWS * count[lane], loaded, lane)
        if both and sweep == 0:
            _fold_both(segments, work, base, loaded, last, timestep, pair, width)
        else:
            fold(segments, work, base, loaded, timestep if damped else 0.0, width)
        unfold(work, base, loaded, last, width)
        for lane in range(count.shape[0]):
            if open_[lane]:
                n_rows = f.ROWS * count[lane]
                same = _evaluate(work, rows[lane], n_rows, lane)
                improve(rows[lane], n_rows, sweep == 0 or same)
                open_[lane] = not same
                left -= 1 if same else 0
        if left == 0:
            break


@inlined
def _fold_both(segments, work, base, loaded, last, timestep, pair, width):
    """``fold_both`` for one lane; more lanes could not even compile it."""
    if pair is not None:
        fold_both(segments, work, base, loaded, last, timestep, pair, width)


@inlined
def improve(rows, n_rows, whole):
    """Move one lane's iterate along the Newton step, ``whole`` or as far as is best."""
    step = 1.0 if whole else _search(rows, n_rows)
    for r in range(n_rows):
        if step == 1.0:
            rows[r, f.R_X], rows[r, f.R_FORCE] = rows[r, f.R_NEW_X], rows[r, f.R_NEW_FORCE]
        else:
            rows[r, f.R_X] += step * (rows[r, f.R_NEW_X] - rows[r, f.R_X])
            rows[r, f.R_FORCE] += step * (rows[r, f.R_NEW_FORCE] - rows[r, f.R_FORCE])
        rows[r, f.R_ACTIVE] = 1.0 if rows[r, f.R_X] < rows[r, f.R_AIM] else 0.0


@inlined
def keep(rows, count, memory, each):
    """Note J q̈ of the ``count`` contacts of the step before, of ``each`` so many rows, which are
    about to be overwritten.
    """
    for k in range(count):
        memory[k, f.M_OBJECT], memory[k, f.M_SEGMENT] = (
            rows[each * k, f.R_OBJECT],
            rows[each * k, f.R_SEGMENT],
        )
        for side in range(each):
            memory[k, f.M_X + side] = rows[each * k + side, f.R_X]
    memory[count, f.M_OBJECT] = np.inf


@inlined
def recall(rows, n_rows, memory, each):
    """The first guess: a row is active if the J q̈ of the step before falls short of what this step
    aims at, or is not known.

    Both lists run from the first object to the last, and from the base to the tip.
    """
    at = 0
    for first in range(0, n_rows, each):
        o, i = rows[first, f.R_OBJECT], rows[first, f.R_SEGMENT]
        while memory[at, f.M_OBJECT] < o or (
            memory[at, f.M_OBJECT] == o and memory[at, f.M_SEGMENT] < i
        ):
            at += 1
        known = memory[at, f.M_OBJECT] == o and memory[at, f.M_SEGMENT] == i
        for side in range(each):
            short = not known or memory[at, f.M_X + side] < rows[first + side, f.R_AIM]
            rows[first + side, f.R_ACTIVE] = 1.0 if short else 0.0
        if known:
            at += 1


@inlined
def _load(work, rows, n_rows, loaded, lane):
    """Put Σ D w wᵀ and −Σ D a_ref w of the active rows into their segments' columns."""
    clear(work, rows, n_rows, lane)
    for first in range(0, n_rows, f.ROWS):  # a contact's rows touch one segment
        i = int(rows[first, f.R_SEGMENT])
        loaded[i] = True
        k00, k01, k02 = work[f.W_K00, i, lane], work[f.W_K01, i, lane], work[f.W_K02, i, lane]
        k11, k12, k22 = work[f.W_K11, i, lane], work[f.W_K12, i, lane], work[f.W_K22, i, lane]
        b0, b1, b2 = work[f.W_B0, i, lane], work[f.W_B1, i, lane], work[f.W_B2, i, lane]
        for r in range(first, first + f.ROWS):
            if rows[r, f.R_ACTIVE] > 0.0:
                w0, w1, w2, weight = (
                    rows[r, f.R_W0],
                    rows[r, f.R_W1],
                    rows[r, f.R_W2],
                    rows[r, f.R_WEIGHT],
                )
                k00, k01, k02 = (
                    k00 + weight * w0 * w0,
                    k01 + weight * w0 * w1,
                    k02 + weight * w0 * w2,
                )
                k11, k12, k22 = (
                    k11 + weight * w1 * w1,
                    k12 + weight * w1 * w2,
                    k22 + weight * w2 * w2,
                )
                pull = weight * rows[r, f.R_AIM]
                b0, b1, b2 = b0 - pull * w0, b1 - pull * w1, b2 - pull * w2
        work[f.W_K00, i, lane], work[f.W_K01, i, lane], work[f.W_K02, i, lane] = k00, k01, k02
        work[f.W_K11, i, lane], work[f.W_K12, i, lane], work[f.W_K22, i, lane] = k11, k12, k22
        work[f.W_B0, i, lane], work[f.W_B1, i, lane], work[f.W_B2, i, lane] = b0, b1, b2


@inlined
def clear(work, rows, n_rows, lane):
    """Empty the contact columns of the touched segments."""
    for first in range(0, n_rows, f.ROWS):
        i = int(rows[first, f.R_SEGMENT])
        for column in range(f.W_K00, f.W_B2 + 1):
            work[column, i, lane] = 0.0


@inlined
def _evaluate(work, rows, n_rows, lane):
    """J q̈ and λ of the full Newton step; whether its active rows are those it was computed with."""
    same = True
    for r in range(n_rows):
        i = int(rows[r, f.R_SEGMENT])
        x = (
            rows[r, f.R_W0] * work[f.W_ALPHA, i, lane]
            + rows[r, f.R_W1] * work[f.W_AX, i, lane]
            + rows[r, f.R_W2] * work[f.W_AY, i, lane]
        )
        rows[r, f.R_NEW_X] = x
        short = rows[r, f.R_AIM] - x
        active = rows[r, f.R_ACTIVE] > 0.0
        rows[r, f.R_NEW_FORCE] = rows[r, f.R_WEIGHT] * short if active else 0.0
        same = same and active == (short > 0.0)
    return same


@inlined
def _search(rows, n_rows):
    """Exact minimiser along the Newton direction: root of a rising, piecewise linear slope, by
    safeguarded Newton.
    """
    low, high, t = 0.0, np.inf, 1.0
    for _ in range(_MAX_SEARCH):
        slope, bend = 0.0, 0.0
        for r in range(n_rows):
            change, force = (
                rows[r, f.R_NEW_X] - rows[r, f.R_X],
                rows[r, f.R_NEW_FORCE] - rows[r, f.R_FORCE],
            )
            slope += change * (rows[r, f.R_FORCE] + t * force)
            bend += change * force
            over = rows[r, f.R_X] + t * change - rows[r, f.R_AIM]
            if over < 0.0:
                slope += rows[r, f.R_WEIGHT] * over * change
                bend += rows[r, f.R_WEIGHT] * change * change
        if slope < 0.0:
            low = t
        else:
            high = t
        if bend <= 0.0 or slope == 0.0:
            break
        following = t - slope / bend
        if not low < following < high:
            following = 0.5 * (low + high) if high < np.inf else 2.0 * t
        if abs(following - t) <= 1e-15 * abs(t):
            break
        t = following
    return t


@inlined
def press(constants, work, base, place, table, rows, n_rows, loaded, timestep, lane):
    """Put minus the rows' wrenches into the bias columns; each object's force, the work it does in
    the step, and where along the antenna all press."""
    clear(work, rows, n_rows, lane)
    for r in range(n_rows):
        force = rows[r, f.R_FORCE]
        if force > 0.0:
            o, i = int(rows[r, f.R_OBJECT]), int(rows[r, f.R_SEGMENT])
            loaded[i] = True
            work[f.W_B0, i, lane] -= force * rows[r, f.R_W0]
            work[f.W_B1, i, lane] -= force * rows[r, f.R_W1]
            work[f.W_B2, i, lane] -= force * rows[r, f.R_W2]
            place[o, f.P_FX, lane] += force * rows[r, f.R_W1]
            place[o, f.P_FY, lane] += force * rows[r, f.R_W2]
            place[o, f.P_WORK, lane] += timestep * force * rows[r, f.R_ARM]
            share = min(max(table[r // f.ROWS, f.T_SHARE], 0.0), 1.0)
            base[0, f.B_PRESS, lane] += force
            base[0, f.B_PLACE, lane] += force * (
                constants[f.C_START, i, lane] + share * constants[f.C_PORTION, i, lane]
            )
