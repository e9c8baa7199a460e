"""One implicit step of an antenna among objects: Newton's method with O(n) sweeps.

The antenna is a chain of segments with headings φ_i (from +y towards +x), p_i = p_(i−1) + ℓ_i (sin
φ_i, cos φ_i), whose nodes carry the forces f_i of contact and gravity. A step of length h solves,
for every segment,

    T_i − T_(i+1) = t_i · Σ_(j ≥ i) f_j,    T_i = k_i (θ_i − rest_i) + c_i (θ_i − θ_i⁻) / h,    t_i
    = ∂p_i/∂φ_i,

backward Euler without inertia: h → ∞ gives an equilibrium, reached along the antenna's own damping.
With inertia, m_i (p_i − p_i⁻ − h v_i⁻) / h² is taken from f_i (mass lumped at the nodes). The
linear system of a Newton iteration is solved like an articulated body: one sweep from the tip that
condenses everything distal into a 3 × 3 response of the segment's near end, one sweep outwards.
Where a pivot is not positive the turning of the levers is left out, so that every step descends.
"""

import math

import numpy as np

from feeler.compiled import compiled
from feeler.physics.rod import fields as f
from feeler.physics.rod.contact import add_forces, move_anchors

_MAX_TURN = 0.3  # rad; largest change of a heading in one Newton iteration
_MAX_ITERATIONS, _MAX_HALVINGS, _BOLD_ITERATIONS = 40, 16, 12


@compiled
def place_nodes(table, base, heading, points):
    """Fill ``points`` (segment + 1, 2) from the base (x, y, heading) and the headings
    (segment,).
    """
    points[0, 0], points[0, 1] = base[0], base[1]
    for i in range(table.shape[0]):
        points[i + 1, 0] = points[i, 0] + table[i, f.R_LENGTH] * math.sin(heading[i])
        points[i + 1, 1] = points[i, 1] + table[i, f.R_LENGTH] * math.cos(heading[i])


@compiled
def _add_inertia(table, points, target, rate, force, stiffness):
    """Add the inertia of the nodes to the forces; returns its part of the potential."""
    energy = 0.0
    for i in range(table.shape[0]):
        share = table[i, f.R_MASS] * rate * rate
        dx, dy = points[i + 1, 0] - target[i, 0], points[i + 1, 1] - target[i, 1]
        energy += 0.5 * share * (dx * dx + dy * dy)
        force[i, 0] -= share * dx
        force[i, 1] -= share * dy
        stiffness[i, 0] += share
        stiffness[i, 2] += share
    return energy


@compiled
def _balance(table, base, heading, points, old_angle, rate, force, out):
    """Out-of-balance torque of every segment; returns (largest size over stiffness [rad], energy of
    the hinges).
    """
    n, worst, energy = table.shape[0], 0.0, 0.0
    fx = fy = torque = 0.0
    for i in range(n - 1, -1, -1):
        fx, fy = fx + force[i, 0], fy + force[i, 1]
        angle = heading[i] - (heading[i - 1] if i else base[2])
        bend, turned = angle - table[i, f.R_REST], angle - old_angle[i]
        drag = rate * table[i, f.R_DAMPING]
        energy += 0.5 * table[i, f.R_STIFFNESS] * bend * bend + 0.5 * drag * turned * turned
        own = table[i, f.R_STIFFNESS] * bend + drag * turned
        turn = (points[i + 1, 1] - points[i, 1]) * fx - (points[i + 1, 0] - points[i, 0]) * fy
        out[i] = own - torque - turn
        worst = max(worst, abs(out[i]) / (table[i, f.R_STIFFNESS] + drag))
        torque = own
    return worst, energy


@compiled
def _newton(table, points, rate, force, stiffness, residual, full, work, change):
    """Fill ``change`` (segment,) with the Newton step; False where a pivot is not positive.

    Without ``full`` the turning of the forces' levers is left out, and the matrix is positive
    whatever the state.
    """
    n = table.shape[0]
    p00 = p01 = p11 = u0 = u1 = e0 = e1 = z = h = fx = fy = 0.0
    for i in range(n - 1, -1, -1):
        fx, fy = fx + force[i, 0], fy + force[i, 1]
        p00, p01, p11 = p00 - stiffness[i, 0], p01 - stiffness[i, 1], p11 - stiffness[i, 2]
        t0, t1 = points[i + 1, 1] - points[i, 1], points[i, 0] - points[i + 1, 0]
        q0, q1 = p00 * t0 + p01 * t1 + u0, p01 * t0 + p11 * t1 + u1
        kappa = table[i, f.R_STIFFNESS] + rate * table[i, f.R_DAMPING]
        pivot = kappa - (u0 * t0 + u1 * t1 + z) - (t0 * q0 + t1 * q1)
        if full:
            pivot += t0 * fy - t1 * fx
        if not pivot > 1e-9 * kappa:
            return False
        rho = h + t0 * e0 + t1 * e1 - residual[i]
        a, v0, v1, b = kappa / pivot, q0 / pivot, q1 / pivot, rho / pivot
        work[i, 0], work[i, 1], work[i, 2], work[i, 3] = a, v0, v1, b
        z, h = kappa * (a - 1.0), kappa * b
        p00, p01, p11 = p00 + q0 * v0, p01 + q0 * v1, p11 + q1 * v1
        e0, e1 = e0 + q0 * b, e1 + q1 * b
        u0, u1 = q0 * a, q1 * a
    return _sweep_out(points, work, change)


@compiled
def _sweep_out(points, work, change):
    x = y = phi = 0.0
    for i in range(work.shape[0]):
        phi = work[i, 0] * phi + work[i, 1] * x + work[i, 2] * y + work[i, 3]
        change[i] = phi
        x = x + (points[i + 1, 1] - points[i, 1]) * phi
        y = y - (points[i + 1, 0] - points[i, 0]) * phi
    return np.isfinite(phi)


@compiled
def _potential(model, lane, heading, points, past, rate, inertia, force, stiffness, residual):
    """(largest imbalance [rad], potential, touching nodes) at ``heading``; fills points, force,
    stiffness, residual.
    """
    place_nodes(model.table, lane.base, heading, points)
    energy, count = add_forces(model, lane, points, force, stiffness)
    if inertia:
        energy += _add_inertia(model.table, points, past[1], rate, force, stiffness)
    worst, own = _balance(
        model.table, lane.base, heading, points, past[0], rate, force, residual
    )
    return worst, energy + own, count


@compiled
def _minimise(model, lane, now, place, past, rate, inertia, bold, tolerance):
    """Newton's method from ``now``, in place; (largest imbalance [rad], touching nodes).

    ``bold`` takes full steps, so that nodes find all their contacts at once; otherwise each step is
    halved until the potential falls, which is slow where many nodes come into contact but cannot
    get lost.
    """
    n = now.shape[0]
    trial = now.copy()
    force, stiffness, residual = np.empty((n, 2)), np.empty((n, 3)), np.empty(n)
    work, change = np.empty((n, 4)), np.empty(n)
    worst, energy, count = _potential(
        model, lane, now, place, past, rate, inertia, force, stiffness, residual
    )
    for _ in range(_BOLD_ITERATIONS if bold else _MAX_ITERATIONS):
        if worst < tolerance:
            break
        if not _newton(
            model.table, place, rate, force, stiffness, residual, True, work, change
        ):
            _newton(model.table, place, rate, force, stiffness, residual, False, work, change)
        largest, slope = 0.0, 0.0
        for i in range(n):
            largest, slope = max(largest, abs(change[i])), slope + change[i] * residual[i]
        scale = min(1.0, _MAX_TURN / largest) if largest > 0.0 else 1.0
        better = False
        for _ in range(_MAX_HALVINGS):
            for i in range(n):
                trial[i] = now[i] + scale * change[i]
            new_worst, new_energy, count = _potential(
                model, lane, trial, place, past, rate, inertia, force, stiffness, residual
            )
            falls = new_energy <= energy + 1e-4 * scale * slope
            if bold or falls or (new_worst < worst and new_worst < 1e-4):
                better = True
                break
            scale *= 0.5
        if not better:
            break
        now[:] = trial
        worst, energy = new_worst, new_energy
    return worst, count


@compiled
def _coast(table, base, heading, points, target, now):
    """First guess of a moving antenna's headings: nodes go on with their velocities."""
    x, y = base[0], base[1]
    for i in range(table.shape[0]):
        dx, dy = points[i + 1, 0] - points[i, 0], points[i + 1, 1] - points[i, 1]
        ex, ey = target[i, 0] - x, target[i, 1] - y
        turn = (ex * dy - ey * dx) / table[i, f.R_LENGTH] ** 2
        now[i] = heading[i] + min(max(turn, -_MAX_TURN), _MAX_TURN)
        x, y = target[i, 0], target[i, 1]


@compiled
def take(model, lane, before, timestep, inertia, bold, tolerance):
    """Take one implicit step with base and objects where they are at its end, ``before`` being the
    base's heading at its beginning; changes ``lane`` in place.

    The step is the minimum of elastic energy + energy of contact and weight + dissipation / h (+
    inertia), searched boldly or not. Returns (converged, imbalance without damping [rad], touching
    nodes, largest change of a heading [rad]); where it did not converge to ``tolerance`` [rad], the
    antenna is left as it was.
    """
    n, rate = model.table.shape[0], 1.0 / timestep
    heading, points, velocity = lane.heading, lane.points, lane.velocity
    old_angle, target = np.empty(n), np.empty((n, 2))
    for i in range(n):
        old_angle[i] = heading[i] - (heading[i - 1] if i else before)
        target[i, 0] = points[i + 1, 0] + timestep * velocity[i, 0]
        target[i, 1] = points[i + 1, 1] + timestep * velocity[i, 1]
    past = (old_angle, target)
    now, place = (
        heading + (lane.base[2] - before),
        points.copy(),
    )  # first guess: all turns with the base
    if inertia:
        _coast(model.table, lane.base, heading, points, target, now)
    worst, count = _minimise(model, lane, now, place, past, rate, inertia, bold, tolerance)
    if not worst < tolerance:
        return False, np.inf, count, 0.0
    moved = 0.0
    for i in range(n):
        moved = max(moved, abs(now[i] - heading[i]))
        lane.rate[i] = rate * (now[i] - (now[i - 1] if i else lane.base[2]) - old_angle[i])
        if inertia:
            velocity[i, 0] = (place[i + 1, 0] - points[i + 1, 0]) * rate
            velocity[i, 1] = (place[i + 1, 1] - points[i + 1, 1]) * rate
    force, stiffness, residual = np.empty((n, 2)), np.empty((n, 3)), np.empty(n)
    _potential(model, lane, now, place, past, rate, inertia, force, stiffness, residual)
    own = model.table[0, f.R_STIFFNESS] * (
        old_angle[0] + lane.rate[0] / rate - model.table[0, f.R_REST]
    )
    for axis in range(2):  # half the first segment's weight hangs on the base itself
        lane.wrench[axis] = 0.0
        for i in range(n):
            lane.wrench[axis] -= force[i, axis]
        lane.wrench[axis] -= 0.5 * model.table[0, f.R_MASS] * model.gravity[axis]
    lane.wrench[2] = -own - model.table[0, f.R_DAMPING] * lane.rate[0]
    static, _ = _balance(model.table, lane.base, now, place, old_angle, 0.0, force, residual)
    heading[:], points[:, :] = now, place
    move_anchors(model, lane)
    return True, static, count, moved
