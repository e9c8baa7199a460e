"""MuJoCo's soft contact as a convex problem in the accelerations, one O(n) sweep per Newton
iterate.

    min over q̈ of ½ (q̈ − a₀)ᵀ M (q̈ − a₀) + Σ_rows ½ D min(0, J q̈ − a_ref)²

Each contact has the rows n ± μt and, from the two edges of MuJoCo's pyramid that leave the plane, n
with twice the weight. A row touches one segment only, w = (lever, direction), J q̈ = w·(α, a), so
JᵀDJ adds D w wᵀ to its inertia.
"""

import numpy as np

from feeler.compiled import inlined
from feeler.physics.chain import fields as f
from feeler.physics.chain.sweep import fold, fold_both, unfold

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
