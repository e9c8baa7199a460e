r"""The chain run backwards: what a scalar of the angles gains from each hinge's stiffness and
damping and each segment's mass.

A step solves R(a, q, v) = M a + bias(q, v) + h C a + C v − K (q₀ − q) + Σ_active Jᵀ D (J a − a_ref)
= 0, then v += h a, q += h v. With λ_q, λ_v the derivatives with respect to what the step leaves,

    λ_v += h λ_q,   (M + h C + Jᵀ D J) μ = h λ_v,   S = μ · R,   λ_q −= ∂S/∂q,   λ_v −= ∂S/∂v,
    dL/dp −= ∂S/∂p.

The matrix is symmetric, so μ costs one more of the forward sweeps. In S the chain's part is Σ m δp
· p̈ + I δφ φ̈ with virtual velocities δ of μ, whose derivatives are two sweeps. A contact depends
on three numbers of its segment, hinge place and heading: these few derivatives are central
differences of the engine's own contact, so that every shape has them. The set of active rows is
held: with the smooth contact a row's force is zero where it comes or goes. Symbols as in ``sweep``:
P(e) = (e_y, −e_x).
"""

import numpy as np

from feeler.compiled import compiled
from feeler.physics.chain import fields as f
from feeler.physics.chain.contact import clear, make_rows
from feeler.physics.chain.lanes import fma, get, put, spread
from feeler.physics.chain.narrow import find_contacts
from feeler.physics.chain.step import _find
from feeler.physics.chain.sweep import fold, move, unfold

NUDGE = 1e-6  # mm, rad; of the contact's central differences, whose error is then some 1e-9

(
    L_ANGLE,  # λ_q, λ_v
    L_RATE,
    L_QDD,  # a
    L_ALPHA,  # acceleration of segment and hinge, velocity products left out
    L_AX,
    L_AY,
    L_TURN,  # virtual velocity of segment and hinge
    L_MX,
    L_MY,
    L_PX,  # acceleration and virtual velocity of the centre
    L_PY,
    L_DX,
    L_DY,
    # ∂S of contact: hinge's place, acceleration, virtual velocity, velocity; heading, turn rate
    L_G_PX,
    L_G_PY,
    L_G_AX,
    L_G_AY,
    L_G_MX,
    L_G_MY,
    L_G_VX,
    L_G_VY,
    L_G_HEADING,
    L_G_OMEGA,
    L_STIFFNESS,  # what has been gathered
    L_DAMPING,
    L_MASS,
    L_INVWEIGHT,
) = range(27)
N_ADJOINT = 27


@compiled
def go_back(handle, adj, tape, place, weights, first, every, timestep, scratch, rows):
    """Take the steps of ``tape`` (lane, step + 1, column) back, the last first; ``adj`` (row,
    segment, lane) is carried on.

    ``tape`` begins at step number ``first``, where the objects were at ``place``. ``weights`` are
    dL/d angle (lane, sample, segment).
    """
    t = handle.tables
    n = t.work.shape[1]
    for step in range(tape.shape[1] - 2, -1, -1):
        now = first + step + 1
        _set_state(
            t, adj, tape, place, weights, step, now // every if now % every == 0 else -1, timestep
        )
        move(t.segments, t.work, t.wides, t.base, 0.0, t.width)
        touched = _find(t)
        _accelerate(adj, t.work, t.width)
        if touched:
            _load(t, adj)
        _ask(t.work, adj, timestep, t.width)
        fold(t.segments, t.work, t.base, t.loaded, timestep, t.width)
        unfold(t.work, t.base, t.loaded, n - 1, t.width)
        if touched:
            t.loaded[:] = False
            for lane in range(t.number.shape[0]):
                clear(t.work, t.rows[lane], f.ROWS * t.number[lane], lane)
        _turn(t.segments, t.work, t.base, adj, t.width)
        if touched:
            for lane in range(t.number.shape[0]):
                _pull_contacts(t, adj, scratch, rows, lane)
        _gather(t.segments, t.work, adj, timestep, t.width)
        if touched:
            _forget(t, adj)


@compiled
def _set_state(t, adj, tape, place, weights, step, sample, timestep):
    n = t.work.shape[1]
    for lane in range(t.number.shape[0]):
        for i in range(n):
            rate = tape[lane, step, n + i]
            t.work[f.W_ANGLE, i, lane], t.work[f.W_RATE, i, lane] = tape[lane, step, i], rate
            adj[L_QDD, i, lane] = (tape[lane, step + 1, n + i] - rate) / timestep
            if sample >= 0:
                adj[L_ANGLE, i, lane] += weights[lane, sample, i]
            adj[L_RATE, i, lane] += timestep * adj[L_ANGLE, i, lane]
        for o in range(place.shape[0]):
            t.place[o, f.P_X, lane] = (
                place[o, f.P_X, lane] + step * timestep * place[o, f.P_VX, lane]
            )
            t.place[o, f.P_Y, lane] = (
                place[o, f.P_Y, lane] + step * timestep * place[o, f.P_VY, lane]
            )


@compiled
def _accelerate(adj, work, width):
    """Accelerations of segments and hinges that the step's a means."""
    alpha = ax = ay = spread(0.0, width)
    for i in range(work.shape[1]):
        alpha = alpha + get(adj, L_QDD, i, width)
        put(adj, L_ALPHA, i, alpha, width)
        put(adj, L_AX, i, ax, width)
        put(adj, L_AY, i, ay, width)
        ax = fma(alpha, get(work, f.W_EY, i, width), ax)
        ay = fma(-alpha, get(work, f.W_EX, i, width), ay)


@compiled
def _load(t, adj):
    """Rows of all contacts, which of them were active, and what those add to the inertia."""
    for lane in range(t.number.shape[0]):
        count = t.number[lane]
        if count <= 0:
            continue
        rows = t.rows[lane]
        make_rows(t.constants, t.work, t.base, t.obj, t.contacts[lane], count, t.place, rows, lane)
        clear(t.work, rows, f.ROWS * count, lane)
        for r in range(f.ROWS * count):
            i = int(rows[r, f.R_SEGMENT])
            t.loaded[i] = True
            w0, w1, w2 = rows[r, f.R_W0], rows[r, f.R_W1], rows[r, f.R_W2]
            x = w0 * adj[L_ALPHA, i, lane] + w1 * adj[L_AX, i, lane] + w2 * adj[L_AY, i, lane]
            rows[r, f.R_X] = x
            active = x < rows[r, f.R_AIM]
            rows[r, f.R_ACTIVE] = 1.0 if active else 0.0
            if active:
                weight = rows[r, f.R_WEIGHT]
                t.work[f.W_K00, i, lane] += weight * w0 * w0
                t.work[f.W_K01, i, lane] += weight * w0 * w1
                t.work[f.W_K02, i, lane] += weight * w0 * w2
                t.work[f.W_K11, i, lane] += weight * w1 * w1
                t.work[f.W_K12, i, lane] += weight * w1 * w2
                t.work[f.W_K22, i, lane] += weight * w2 * w2


@compiled
def _ask(work, adj, timestep, width):
    """Put h λ_v where the sweep looks for torques, and nothing else on its right-hand side."""
    zero = spread(0.0, width)
    for i in range(work.shape[1]):
        put(work, f.W_TORQUE, i, timestep * get(adj, L_RATE, i, width), width)
        put(work, f.W_FX, i, zero, width)
        put(work, f.W_FY, i, zero, width)


@compiled
def _turn(constants, work, base, adj, width):
    """Virtual velocities of μ (in ``W_QDD``), accelerations of the centres, and what the masses
    gain.
    """
    zero = spread(0.0, width)
    turn = mx = my = px = py = zero
    px, py = px - get(base, 0, f.B_GRAVITY_X, width), py - get(base, 0, f.B_GRAVITY_Y, width)
    for i in range(work.shape[1]):
        ex, ey, omega = (
            get(work, f.W_EX, i, width),
            get(work, f.W_EY, i, width),
            get(work, f.W_OMEGA, i, width),
        )
        turn, alpha, square = (
            turn + get(work, f.W_QDD, i, width),
            get(adj, L_ALPHA, i, width),
            omega * omega,
        )
        put(adj, L_TURN, i, turn, width)
        put(adj, L_MX, i, mx, width)
        put(adj, L_MY, i, my, width)
        own_x, own_y = fma(alpha, ey, -(square * ex)), -fma(alpha, ex, square * ey)
        centre_x, centre_y = fma(0.5, own_x, px), fma(0.5, own_y, py)
        virtual_x, virtual_y = fma(0.5 * turn, ey, mx), fma(-0.5 * turn, ex, my)
        put(adj, L_PX, i, centre_x, width)
        put(adj, L_PY, i, centre_y, width)
        put(adj, L_DX, i, virtual_x, width)
        put(adj, L_DY, i, virtual_y, width)
        length = get(constants, f.C_LENGTH, i, width)
        gain = fma(
            virtual_x,
            centre_x,
            fma(virtual_y, centre_y, length * length * (1.0 / 12.0) * (turn * alpha)),
        )
        put(adj, L_MASS, i, get(adj, L_MASS, i, width) - gain, width)
        px, py, mx, my = px + own_x, py + own_y, fma(turn, ey, mx), fma(-turn, ex, my)


@compiled
def _pull_contacts(t, adj, scratch, rows, lane):
    """∂S of one lane's contacts: by the rows where S is linear, by central differences in their
    segments' geometry.
    """
    count, own, work = t.number[lane], t.rows[lane], t.work
    k = 0
    while k < count:
        o, i = int(t.contacts[lane, k, f.T_OBJECT]), int(t.contacts[lane, k, f.T_SEGMENT])
        stop = k + 1
        while (
            stop < count
            and int(t.contacts[lane, stop, f.T_OBJECT]) == o
            and int(t.contacts[lane, stop, f.T_SEGMENT]) == i
        ):
            stop += 1
        total = 0.0
        for r in range(f.ROWS * k, f.ROWS * stop):
            if own[r, f.R_ACTIVE] > 0.0:
                w0, w1, w2 = own[r, f.R_W0], own[r, f.R_W1], own[r, f.R_W2]
                virtual = (
                    w0 * adj[L_TURN, i, lane] + w1 * adj[L_MX, i, lane] + w2 * adj[L_MY, i, lane]
                )
                pressed, short = (
                    own[r, f.R_WEIGHT] * virtual,
                    own[r, f.R_WEIGHT] * (own[r, f.R_X] - own[r, f.R_AIM]),
                )
                total += short * virtual
                adj[L_G_AX, i, lane] += pressed * w1
                adj[L_G_AY, i, lane] += pressed * w2
                adj[L_G_MX, i, lane] += short * w1
                adj[L_G_MY, i, lane] += short * w2
                brake = t.obj[o, f.O_B, lane] * pressed
                adj[L_G_VX, i, lane] += brake * w1
                adj[L_G_VY, i, lane] += brake * w2
                adj[L_G_OMEGA, i, lane] += brake * w0
        adj[L_INVWEIGHT, i, lane] += total / t.constants[f.C_INVWEIGHT, i, lane]
        px, py, ex, ey = (
            work[f.W_PX, i, lane],
            work[f.W_PY, i, lane],
            work[f.W_EX, i, lane],
            work[f.W_EY, i, lane],
        )
        first, last = t.place[o, f.P_FIRST, lane], t.place[o, f.P_LAST, lane]
        t.place[o, f.P_FIRST, lane] = t.place[o, f.P_LAST, lane] = float(i)
        for which in range(3):
            change = 0.0
            for sign in (1.0, -1.0):
                nudge = sign * NUDGE
                if which == 0:
                    work[f.W_PX, i, lane] = px + nudge
                elif which == 1:
                    work[f.W_PY, i, lane] = py + nudge
                else:
                    c, s = np.cos(nudge), np.sin(nudge)
                    work[f.W_EX, i, lane], work[f.W_EY, i, lane] = c * ex + s * ey, c * ey - s * ex
                change += sign * _measure(t, adj, scratch, rows, own, k, stop - k, o, i, lane)
                work[f.W_PX, i, lane], work[f.W_PY, i, lane] = px, py
                work[f.W_EX, i, lane], work[f.W_EY, i, lane] = ex, ey
            slope = change / (2.0 * NUDGE)
            if which == 0:
                adj[L_G_PX, i, lane] += slope
            elif which == 1:
                adj[L_G_PY, i, lane] += slope
            else:
                adj[L_G_HEADING, i, lane] += slope
        t.place[o, f.P_FIRST, lane], t.place[o, f.P_LAST, lane] = first, last
        k = stop


@compiled
def _measure(t, adj, scratch, rows, own, k, count, o, i, lane):
    """S of the contacts of segment i with object o as it is now placed, rows active as they were."""
    kinds, corners, starts, boxes, blocks, owner = t.shapes
    shapes = (kinds[lane], corners[lane], starts[lane], boxes[lane], blocks[lane])
    found = find_contacts(
        t.constants,
        t.work,
        t.obj,
        o,
        shapes,
        owner[lane, o],
        owner[lane, o + 1],
        t.place,
        scratch,
        np.int64(0),
        lane,
    )
    make_rows(t.constants, t.work, t.base, t.obj, scratch, found, t.place, rows, lane)
    total = 0.0
    for r in range(f.ROWS * min(found, count)):
        if own[f.ROWS * k + r, f.R_ACTIVE] > 0.0:
            w0, w1, w2 = rows[r, f.R_W0], rows[r, f.R_W1], rows[r, f.R_W2]
            virtual = w0 * adj[L_TURN, i, lane] + w1 * adj[L_MX, i, lane] + w2 * adj[L_MY, i, lane]
            x = w0 * adj[L_ALPHA, i, lane] + w1 * adj[L_AX, i, lane] + w2 * adj[L_AY, i, lane]
            total += rows[r, f.R_WEIGHT] * virtual * (x - rows[r, f.R_AIM])
    return total


@compiled
def _gather(constants, work, adj, timestep, width):
    """From the tip to the base: λ before the step, and what stiffness and damping gain."""
    zero = spread(0.0, width)
    ux = uy = vx = vy = px = py = ax = ay = mx = my = wx = wy = heading = rate = zero
    for i in range(work.shape[1] - 1, -1, -1):
        ex, ey, omega = (
            get(work, f.W_EX, i, width),
            get(work, f.W_EY, i, width),
            get(work, f.W_OMEGA, i, width),
        )
        mass, alpha, turn = (
            get(constants, f.C_MASS, i, width),
            get(adj, L_ALPHA, i, width),
            get(adj, L_TURN, i, width),
        )
        dx, dy = mass * get(adj, L_DX, i, width), mass * get(adj, L_DY, i, width)
        cx, cy = mass * get(adj, L_PX, i, width), mass * get(adj, L_PY, i, width)
        half_ux, half_uy, half_vx, half_vy = (
            fma(0.5, dx, ux),
            fma(0.5, dy, uy),
            fma(0.5, cx, vx),
            fma(0.5, cy, vy),
        )
        along_u, across_u = fma(half_ux, ex, half_uy * ey), fma(half_ux, ey, -(half_uy * ex))
        own = fma(px, ey, -(py * ex)) - omega * omega * across_u + get(adj, L_G_HEADING, i, width)
        own = own - alpha * (along_u + fma(ax, ex, ay * ey))
        own = own - turn * (fma(half_vx, ex, half_vy * ey) + fma(mx, ex, my * ey))
        own = own - omega * fma(wx, ex, wy * ey)
        heading = heading + own
        rate = (
            rate
            + fma(-2.0 * omega, along_u, fma(wx, ey, -(wy * ex)))
            + get(adj, L_G_OMEGA, i, width)
        )
        mu = get(work, f.W_QDD, i, width)
        stiffness, damping = (
            get(constants, f.C_STIFFNESS, i, width),
            get(constants, f.C_DAMPING, i, width),
        )
        put(adj, L_ANGLE, i, get(adj, L_ANGLE, i, width) - fma(mu, stiffness, heading), width)
        put(adj, L_RATE, i, get(adj, L_RATE, i, width) - fma(mu, damping, rate), width)
        stretch = get(constants, f.C_REST, i, width) - get(work, f.W_ANGLE, i, width)
        put(adj, L_STIFFNESS, i, fma(mu, stretch, get(adj, L_STIFFNESS, i, width)), width)
        drag = fma(timestep, get(adj, L_QDD, i, width), get(work, f.W_RATE, i, width))
        put(adj, L_DAMPING, i, fma(-mu, drag, get(adj, L_DAMPING, i, width)), width)
        ux, uy, vx, vy = ux + dx, uy + dy, vx + cx, vy + cy
        px, py = px + get(adj, L_G_PX, i, width), py + get(adj, L_G_PY, i, width)
        ax, ay = ax + get(adj, L_G_AX, i, width), ay + get(adj, L_G_AY, i, width)
        mx, my = mx + get(adj, L_G_MX, i, width), my + get(adj, L_G_MY, i, width)
        wx, wy = wx + get(adj, L_G_VX, i, width), wy + get(adj, L_G_VY, i, width)


@compiled
def _forget(t, adj):
    for lane in range(t.number.shape[0]):
        for k in range(max(t.number[lane], 0)):
            i = int(t.contacts[lane, k, f.T_SEGMENT])
            for row in range(L_G_PX, L_G_OMEGA + 1):
                adj[row, i, lane] = 0.0
