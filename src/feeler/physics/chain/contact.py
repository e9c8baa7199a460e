"""MuJoCo's soft contact as a convex problem in the accelerations, one O(n) sweep per Newton iterate.

    min over q̈ of ½ (q̈ − a₀)ᵀ M (q̈ − a₀) + Σ_rows ½ D min(0, J q̈ − a_ref)²

Each contact has the rows n ± μt and, from the two edges of MuJoCo's pyramid that leave the plane, n with twice the
weight. A row touches one segment only, w = (lever, direction), J q̈ = w·(α, a), so JᵀDJ adds D w wᵀ to its inertia.
"""

import numpy as np

from feeler.compiled import compiled
from feeler.physics.chain.fields import (
    C_INVWEIGHT,
    O_B,
    O_FRICTION,
    O_K,
    O_MAX_IMPEDANCE,
    O_MIDPOINT,
    O_MIN_IMPEDANCE,
    O_POWER,
    O_WIDTH,
    P_VX,
    P_VY,
    W_ALPHA,
    W_AX,
    W_AY,
    W_B0,
    W_B1,
    W_B2,
    W_K00,
    W_K01,
    W_K02,
    W_K11,
    W_K12,
    W_K22,
    W_OMEGA,
    W_PX,
    W_PY,
    W_VX,
    W_VY,
)
from feeler.physics.chain.narrow import T_DISTANCE, T_NX, T_NY, T_SEGMENT, T_X, T_Y
from feeler.physics.chain.sweep import solve

(
    R_SEGMENT,
    R_W0,
    R_W1,
    R_W2,
    R_WEIGHT,
    R_AIM,  # reference acceleration
    R_X,  # J q̈ of the iterate
    R_FORCE,  # λ with M (q̈ − a₀) = Jᵀλ at the iterate
    R_NEW_X,
    R_NEW_FORCE,
    R_ACTIVE,
) = range(11)
N_ROW = 11
ROWS = 3  # per contact
MAX_NEWTON = 50
MAX_SEARCH = 60
MIN_IMPEDANCE, MAX_IMPEDANCE = 1e-4, 0.9999  # MuJoCo's mjMINIMP, mjMAXIMP


@compiled
def compute_impedance(distance, obj, lane):
    """MuJoCo's d(r): from d_min at the surface to d_max at ``width``, a power law on either side of the midpoint."""
    low, high, width = obj[0, O_MIN_IMPEDANCE, lane], obj[0, O_MAX_IMPEDANCE, lane], obj[0, O_WIDTH, lane]
    middle, power = obj[0, O_MIDPOINT, lane], obj[0, O_POWER, lane]
    x = abs(distance) / width
    if x >= 1.0:
        return min(max(high, MIN_IMPEDANCE), MAX_IMPEDANCE)
    if power == 1.0:
        y = x
    elif power == 2.0:
        y = x * x / middle if x <= middle else 1.0 - (1.0 - x) * (1.0 - x) / (1.0 - middle)
    elif x <= middle:
        y = x**power / middle ** (power - 1.0)
    else:
        y = 1.0 - (1.0 - x) ** power / (1.0 - middle) ** (power - 1.0)
    return min(max(low + y * (high - low), MIN_IMPEDANCE), MAX_IMPEDANCE)


@compiled
def make_rows(constants, work, obj, table, count, place, rows, lane):
    """The rows of one lane's ``count`` contacts."""
    vx, vy = place[0, P_VX, lane], place[0, P_VY, lane]
    mu = obj[0, O_FRICTION, lane]
    for k in range(count):
        i = int(table[k, T_SEGMENT])
        distance, nx, ny = table[k, T_DISTANCE], table[k, T_NX], table[k, T_NY]
        rx, ry = table[k, T_X] - work[W_PX, i, lane], table[k, T_Y] - work[W_PY, i, lane]
        impedance = compute_impedance(distance, obj, lane)
        ease = 2.0 * mu * mu * (1.0 + mu * mu) * constants[C_INVWEIGHT, i, lane] * (1.0 - impedance) / impedance
        weight = 1.0 / max(ease, 1e-15)
        pull = -obj[0, O_K, lane] * impedance * distance
        omega, wx, wy = work[W_OMEGA, i, lane], work[W_VX, i, lane] - vx, work[W_VY, i, lane] - vy
        for side in range(ROWS):
            slide = (side - 1) * mu  # −μ, 0, +μ along the tangent (−n_y, n_x)
            dx, dy = nx - slide * ny, ny + slide * nx
            lever = ry * dx - rx * dy
            row = ROWS * k + side
            rows[row, R_SEGMENT] = i
            rows[row, R_W0], rows[row, R_W1], rows[row, R_W2] = lever, dx, dy
            rows[row, R_WEIGHT] = 2.0 * weight if side == 1 else weight
            rows[row, R_AIM] = pull - obj[0, O_B, lane] * (lever * omega + dx * wx + dy * wy)


@compiled
def solve_contacts(constants, work, obj, rows, count, loaded, memory, open_, timestep, last, width):
    """Forces of each lane's rows in ``R_FORCE`` at its minimum and accelerations as ``solve`` leaves them.

    ``memory`` (lane, segment) holds each segment's active rows as bits, from the step before; it is the first guess.
    A lane that has its minimum is left alone while the others go on: its columns stay, and so does what they give.
    """
    left = 0
    for lane in range(count.shape[0]):
        open_[lane] = count[lane] > 0
        if open_[lane]:
            _recall(rows[lane], ROWS * count[lane], memory[lane])
            left += 1
    for sweep in range(MAX_NEWTON):
        for lane in range(count.shape[0]):
            if open_[lane]:
                _load(work, rows[lane], ROWS * count[lane], loaded, lane)
        solve(constants, work, obj, loaded, timestep, last, width)
        for lane in range(count.shape[0]):
            if open_[lane] and _improve(work, rows[lane], ROWS * count[lane], sweep == 0, lane):
                open_[lane] = False
                _remember(rows[lane], ROWS * count[lane], memory[lane])
                left -= 1
        if left == 0:
            break


@compiled
def _improve(work, rows, n_rows, first, lane):
    """Move one lane's iterate along the Newton step; whether it is the minimum."""
    same = _evaluate(work, rows, n_rows, lane)
    step = 1.0 if first or same else _search(rows, n_rows)
    for r in range(n_rows):
        if step == 1.0:
            rows[r, R_X], rows[r, R_FORCE] = rows[r, R_NEW_X], rows[r, R_NEW_FORCE]
        else:
            rows[r, R_X] += step * (rows[r, R_NEW_X] - rows[r, R_X])
            rows[r, R_FORCE] += step * (rows[r, R_NEW_FORCE] - rows[r, R_FORCE])
        rows[r, R_ACTIVE] = 1.0 if rows[r, R_X] < rows[r, R_AIM] else 0.0
    return same


@compiled
def _recall(rows, n_rows, memory):
    for r in range(n_rows):
        bits = memory[int(rows[r, R_SEGMENT])]
        rows[r, R_ACTIVE] = 1.0 if bits == 0 or (bits >> (r % ROWS)) & 1 else 0.0


@compiled
def _remember(rows, n_rows, memory):
    memory[:] = 0
    for r in range(n_rows):
        if rows[r, R_ACTIVE] > 0.0:
            memory[int(rows[r, R_SEGMENT])] |= 1 << (r % ROWS)


@compiled
def _load(work, rows, n_rows, loaded, lane):
    """Put Σ D w wᵀ and −Σ D a_ref w of the active rows into their segments' columns."""
    clear(work, rows, n_rows, lane)
    for r in range(n_rows):
        i = int(rows[r, R_SEGMENT])
        loaded[i] = True
        if rows[r, R_ACTIVE] > 0.0:
            w0, w1, w2, weight = rows[r, R_W0], rows[r, R_W1], rows[r, R_W2], rows[r, R_WEIGHT]
            work[W_K00, i, lane] += weight * w0 * w0
            work[W_K01, i, lane] += weight * w0 * w1
            work[W_K02, i, lane] += weight * w0 * w2
            work[W_K11, i, lane] += weight * w1 * w1
            work[W_K12, i, lane] += weight * w1 * w2
            work[W_K22, i, lane] += weight * w2 * w2
            pull = weight * rows[r, R_AIM]
            work[W_B0, i, lane] -= pull * w0
            work[W_B1, i, lane] -= pull * w1
            work[W_B2, i, lane] -= pull * w2


@compiled
def clear(work, rows, n_rows, lane):
    """Empty the contact columns of the touched segments."""
    for r in range(n_rows):
        i = int(rows[r, R_SEGMENT])
        for column in range(W_K00, W_B2 + 1):
            work[column, i, lane] = 0.0


@compiled
def _evaluate(work, rows, n_rows, lane):
    """J q̈ and λ of the full Newton step; whether its active rows are those it was computed with."""
    same = True
    for r in range(n_rows):
        i = int(rows[r, R_SEGMENT])
        x = (
            rows[r, R_W0] * work[W_ALPHA, i, lane]
            + rows[r, R_W1] * work[W_AX, i, lane]
            + rows[r, R_W2] * work[W_AY, i, lane]
        )
        rows[r, R_NEW_X] = x
        short = rows[r, R_AIM] - x
        active = rows[r, R_ACTIVE] > 0.0
        rows[r, R_NEW_FORCE] = rows[r, R_WEIGHT] * short if active else 0.0
        same = same and active == (short > 0.0)
    return same


@compiled
def _search(rows, n_rows):
    """Exact minimiser along the Newton direction: root of a rising, piecewise linear slope, by safeguarded Newton."""
    low, high, t = 0.0, np.inf, 1.0
    for _ in range(MAX_SEARCH):
        slope, bend = 0.0, 0.0
        for r in range(n_rows):
            change, force = rows[r, R_NEW_X] - rows[r, R_X], rows[r, R_NEW_FORCE] - rows[r, R_FORCE]
            slope += change * (rows[r, R_FORCE] + t * force)
            bend += change * force
            over = rows[r, R_X] + t * change - rows[r, R_AIM]
            if over < 0.0:
                slope += rows[r, R_WEIGHT] * over * change
                bend += rows[r, R_WEIGHT] * change * change
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


@compiled
def press(work, rows, n_rows, loaded, lane):
    """Put minus the rows' wrenches into the bias columns; the total force on the chain."""
    clear(work, rows, n_rows, lane)
    fx = fy = 0.0
    for r in range(n_rows):
        force = rows[r, R_FORCE]
        if force > 0.0:
            i = int(rows[r, R_SEGMENT])
            loaded[i] = True
            work[W_B0, i, lane] -= force * rows[r, R_W0]
            work[W_B1, i, lane] -= force * rows[r, R_W1]
            work[W_B2, i, lane] -= force * rows[r, R_W2]
            fx, fy = fx + force * rows[r, R_W1], fy + force * rows[r, R_W2]
    return fx, fy
