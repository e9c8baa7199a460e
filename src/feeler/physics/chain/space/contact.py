"""Contact in space: the convex problem of the plane with the four edges of MuJoCo's pyramid,
n ± μ t along two tangents, and wrenches of six numbers.
"""

import numpy as np

from feeler.compiled import inlined
from feeler.physics.chain import fields as f
from feeler.physics.chain.contact import MAX_NEWTON, compute_impedance, improve, recall, weigh
from feeler.physics.chain.narrow import MIN_VALUE
from feeler.physics.chain.space import fields as s
from feeler.physics.chain.space.sweep import fold_in_space, unfold_in_space
from feeler.stimulus.hull import cross3, dot3, join3


@inlined
def make_rows_in_space(constants, work, base, obj, table, count, place, rows, lane):
    """The rows of one lane's ``count`` contacts; each contact is told its share of the segment's
    length.
    """
    for k in range(count):
        o, i = int(table[k, s.HIT_OBJECT]), int(table[k, s.HIT_SEGMENT])
        point = (table[k, s.HIT_POINT], table[k, s.HIT_POINT + 1], table[k, s.HIT_POINT + 2])
        normal = (
            table[k, s.HIT_NORMAL],
            table[k, s.HIT_NORMAL + 1],
            table[k, s.HIT_NORMAL + 2],
        )
        distance = table[k, s.HIT_DISTANCE]
        r = join3(-1.0, _read(work, s.SEG_PLACE, i, lane), point)
        along = _read(work, s.SEG_ALONG, i, lane)
        table[k, s.HIT_SHARE] = dot3(r, along) / dot3(along, along)
        arm = join3(-1.0, _read(place, s.OBJ_PLACE, o, lane), point)
        moved = cross3(_read(place, s.OBJ_OMEGA, o, lane), arm)
        moved = join3(1.0, moved, _read(place, s.OBJ_V, o, lane))  # the object's point
        own = cross3(_read(work, s.OMEGA, i, lane), r)
        slip = join3(-1.0, moved, join3(1.0, own, _read(work, s.VELOCITY, i, lane)))
        slow = min(obj[o, f.O_SLOW, lane], constants[f.C_SLOW, i, lane])
        fast = min(obj[o, f.O_FAST, lane], constants[f.C_WIDEST, i, lane])
        wide = max(constants[f.C_WIDTH, i, lane], slow, fast)
        impedance = compute_impedance(
            distance, constants[f.C_D_MAX, i, lane], wide, obj, o, lane
        )
        thin = min(constants[f.C_RADIUS, i, lane], obj[o, f.O_RADIUS, lane])
        base[0, s.BASE_SINK, lane] = max(base[0, s.BASE_SINK, lane], -distance / thin)
        mu = obj[o, f.O_FRICTION, lane]
        ease = constants[f.C_INVWEIGHT, i, lane] * (1.0 - impedance) / impedance
        straight, edge = weigh(mu, ease)
        pull = -constants[f.C_K, i, lane] * impedance * distance
        first, second = _find_tangents(normal, table, k)
        for side in range(s.EDGES):
            slide = mu if side % 2 == 0 else -mu
            across = first if side < 2 else second
            d = (
                normal[0] + slide * across[0],
                normal[1] + slide * across[1],
                normal[2] + slide * across[2],
            )
            turn, row = cross3(r, d), s.EDGES * k + side
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
    t = (table[k, s.HIT_TANGENT], table[k, s.HIT_TANGENT + 1], table[k, s.HIT_TANGENT + 2])
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
            recall(rows[lane], s.EDGES * count[lane], memory[lane], s.EDGES)
            left += 1
    for sweep in range(MAX_NEWTON):
        for lane in range(count.shape[0]):
            if open_[lane]:
                _load(work, rows[lane], s.EDGES * count[lane], loaded, lane)
        fold_in_space(constants, work, base, loaded, kind, timestep, width)
        unfold_in_space(work, base, loaded, last, kind, width)
        for lane in range(count.shape[0]):
            if open_[lane]:
                n_rows = s.EDGES * count[lane]
                same = _evaluate(work, rows[lane], n_rows, lane)
                improve(rows[lane], n_rows, sweep == 0 or same)
                open_[lane] = not same
                left -= 1 if same else 0
        if left == 0:
            break


@inlined
def clear_in_space(work, rows, n_rows, lane):
    """Empty the contact columns of the touched segments."""
    for first in range(0, n_rows, s.EDGES):
        i = int(rows[first, f.R_SEGMENT])
        for column in range(s.ADD, s.N_SPACE_WORK):
            work[column, i, lane] = 0.0


@inlined
def _load(work, rows, n_rows, loaded, lane):
    """Put Σ D w wᵀ and −Σ D a_ref w of the active rows into their segments' columns."""
    clear_in_space(work, rows, n_rows, lane)
    for r in range(n_rows):
        i = int(rows[r, f.R_SEGMENT])
        loaded[i] = True
        if rows[r, f.R_ACTIVE] > 0.0:
            weight, at = rows[r, f.R_WEIGHT], s.ADD
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
                work[s.BIAS + j, i, lane] -= pull * rows[r, f.R_W0 + j]


@inlined
def _evaluate(work, rows, n_rows, lane):
    """J q̈ and λ of the full Newton step; whether its active rows are those it was computed with."""
    same = True
    for r in range(n_rows):
        i, x = int(rows[r, f.R_SEGMENT]), 0.0
        for j in range(6):
            x += rows[r, f.R_W0 + j] * work[s.ALPHA + j, i, lane]
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
                work[s.BIAS + j, i, lane] -= force * rows[r, f.R_W0 + j]
            for j in range(3):
                place[s.OBJ_FORCE + j, o, lane] += force * rows[r, f.R_W0 + 3 + j]
            place[s.OBJ_WORK, o, lane] += timestep * force * rows[r, f.R_ARM]
            share = min(max(table[r // s.EDGES, s.HIT_SHARE], 0.0), 1.0)
            base[0, s.BASE_PRESS, lane] += force
            base[0, s.BASE_SPOT, lane] += force * (
                constants[f.C_START, i, lane] + share * constants[f.C_PORTION, i, lane]
            )
