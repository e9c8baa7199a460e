"""Implicit steps of an antenna among objects: pressure, friction, and Newton's method with O(n)
sweeps.
"""

import math

import numpy as np

from feeler.compiled import compiled

# Columns of the rod's arrays.

# columns of the antenna's table, one row per segment
R_LENGTH, R_STIFFNESS, R_DAMPING, R_REST, R_RADIUS, R_MASS, R_WEIGHT, R_FIRMNESS = range(8)
# columns of a face: its first point, the unit normal of its free side, its length, and where on its
# part's rim it begins:
# the length of the faces before it [mm] and the turns of the corners before it [rad]
F_X, F_Y, F_NX, F_NY, F_LENGTH, F_START, F_TURN = range(7)
# columns of a convex part: its first face and the one after its last, its object, that one's
# friction and rounding, and
# the length of all faces (infinite for a face without end)
# the last: its radius where it is a ball or a rounded edge, else infinite
P_FIRST, P_STOP, P_OBJECT, P_FRICTION, P_ROUNDING, P_RIM, P_RADIUS = range(7)
# columns of an object: place, first axis, velocity and turn rate
O_X, O_Y, O_FORWARD_X, O_FORWARD_Y, O_VX, O_VY, O_TURN = range(7)
# columns of a contact: depth, normal, place on the rim, force
C_DEPTH, C_NX, C_NY, C_PLACE, C_FX, C_FY = range(6)
N_FACE, N_PART, N_OBJECT, N_CONTACT = 7, 7, 7, 6


# Contact of an antenna's nodes with convex parts: pressure, and friction with a stored place of
# sticking.


@compiled
def _place_faces(model, lane):
    """Put the faces where their objects are."""
    for p in range(model.parts.shape[0]):
        item = lane.objects[int(model.parts[p, P_OBJECT])]
        x, y, c, s = item[O_X], item[O_Y], item[O_FORWARD_X], item[O_FORWARD_Y]
        for k in range(int(model.parts[p, P_FIRST]), int(model.parts[p, P_STOP])):
            own, face = model.faces[k], lane.faces[k]
            face[F_X], face[F_Y] = (
                x + (c * own[F_X] - s * own[F_Y]),
                y + (s * own[F_X] + c * own[F_Y]),
            )
            face[F_NX], face[F_NY] = (
                c * own[F_NX] - s * own[F_NY],
                s * own[F_NX] + c * own[F_NY],
            )


@compiled
def _touch(faces, part, point, reach):
    """(depth, normal x, normal y, place on the rim) of a node at a convex part; depth < 0: no
    contact.

    Of a convex part the face that is farthest, with its sign, is the nearest, or one of the two at
    the nearest corner.
    """
    best, gap, x, y = int(part[P_FIRST]), -np.inf, point[0], point[1]
    for k in range(best, int(part[P_STOP])):
        far = (x - faces[k, F_X]) * faces[k, F_NX] + (y - faces[k, F_Y]) * faces[k, F_NY]
        if far >= reach:
            return -1.0, 0.0, 0.0, 0.0  # most nodes, most of the time
        if far > gap:
            best, gap = k, far
    face = faces[best]
    dx, dy, nx, ny, length = (
        x - face[F_X],
        y - face[F_Y],
        face[F_NX],
        face[F_NY],
        face[F_LENGTH],
    )
    along = dx * ny - dy * nx
    start = (
        face[F_START] + reach * face[F_TURN]
    )  # where on the rim as the node's middle sees it
    if length > 0.0 and (gap <= 0.0 or 0.0 <= along <= length):
        return reach - gap, nx, ny, start + along
    corner = min(max(along, 0.0), length)
    ex, ey = dx - corner * ny, dy + corner * nx
    away = np.sqrt(ex * ex + ey * ey)
    if not 0.0 < away < reach:
        return -1.0, 0.0, 0.0, 0.0
    turned = math.atan2(ex * ny - ey * nx, ex * nx + ey * ny)
    return reach - away, ex / away, ey / away, start + corner + reach * turned


@compiled
def _slip(place, held, rim, reach):
    """How far a node is from where it sticks, the shorter way round."""
    slip = place - held
    if rim < np.inf:
        whole = rim + 2 * np.pi * reach
        slip -= whole * np.round(slip / whole)
    return slip


@compiled
def _add_forces(model, lane, points, force, stiffness):
    """Gravity and contact at every node: force (segment, 2) and stiffness (segment, 3: xx, xy, yy);
    contacts are noted in ``lane.push``. Returns (energy, touching nodes).

    Friction is limited by ``lane.pressed``, the normal force at the end of the step before, so that
    a step has a potential energy.
    """
    energy, count = 0.0, 0
    for i in range(model.table.shape[0]):
        firm, weight = model.table[i, R_FIRMNESS], model.table[i, R_WEIGHT]
        force[i, 0], force[i, 1] = weight * model.gravity[0], weight * model.gravity[1]
        energy -= force[i, 0] * points[i + 1, 0] + force[i, 1] * points[i + 1, 1]
        stiffness[i, 0] = stiffness[i, 1] = stiffness[i, 2] = 0.0
        for p in range(model.parts.shape[0]):
            part, push = model.parts[p], lane.push[i, p]
            reach = model.table[i, R_RADIUS] + part[P_ROUNDING]
            depth, nx, ny, place = _touch(lane.faces, part, points[i + 1], reach)
            push[C_DEPTH] = depth
            if depth <= 0.0:
                continue
            count += 1
            energy += 0.5 * firm * depth * depth
            fx, fy = firm * depth * nx, firm * depth * ny
            stiffness[i, 0] += firm * nx * nx
            stiffness[i, 1] += firm * nx * ny
            stiffness[i, 2] += firm * ny * ny
            held, limit = lane.anchor[i, p], part[P_FRICTION] * lane.pressed[i, p]
            if limit > 0.0 and not np.isnan(held):
                tx, ty, slip = ny, -nx, _slip(place, held, part[P_RIM], reach)
                if abs(slip) * firm <= limit:
                    energy += 0.5 * firm * slip * slip
                    drag = -firm * slip
                    stiffness[i, 0] += firm * tx * tx
                    stiffness[i, 1] += firm * tx * ty
                    stiffness[i, 2] += firm * ty * ty
                else:
                    energy += limit * (abs(slip) - 0.5 * limit / firm)
                    drag = -limit if slip > 0.0 else limit
                fx += drag * tx
                fy += drag * ty
            force[i, 0] += fx
            force[i, 1] += fy
            push[C_NX], push[C_NY], push[C_PLACE], push[C_FX], push[C_FY] = (
                nx,
                ny,
                place,
                fx,
                fy,
            )
    return energy, count


@compiled
def _move_anchors(model, lane):
    """After a step: note the normal forces; nodes that slid drag their anchor along, nodes that
    left forget it.
    """
    for i in range(model.table.shape[0]):
        firm = model.table[i, R_FIRMNESS]
        for p in range(model.parts.shape[0]):
            part, depth, place = (
                model.parts[p],
                lane.push[i, p, C_DEPTH],
                lane.push[i, p, C_PLACE],
            )
            if depth <= 0.0:
                lane.anchor[i, p], lane.pressed[i, p] = np.nan, 0.0
                continue
            held, most = lane.anchor[i, p], part[P_FRICTION] * lane.pressed[i, p] / firm
            slip = _slip(place, held, part[P_RIM], model.table[i, R_RADIUS] + part[P_ROUNDING])
            if np.isnan(held):
                lane.anchor[i, p] = place
            elif abs(slip) > most:
                lane.anchor[i, p] = place - most if slip > 0.0 else place + most
            lane.pressed[i, p] = firm * depth


# One implicit step of an antenna among objects: Newton's method with O(n) sweeps.
#
# The antenna is a chain of segments with headings φ_i (from +y towards +x), p_i = p_(i−1) + ℓ_i
# (sin φ_i, cos φ_i), whose nodes carry the forces f_i of contact and gravity. A step of length
# h solves, for every segment,
#
#     T_i − T_(i+1) = t_i · Σ_(j ≥ i) f_j,    T_i = k_i (θ_i − rest_i) + c_i (θ_i − θ_i⁻) / h,
#     t_i = ∂p_i/∂φ_i,
#
# backward Euler without inertia: h → ∞ gives an equilibrium, reached along the antenna's own
# damping. With inertia, m_i (p_i − p_i⁻ − h v_i⁻) / h² is taken from f_i (mass lumped at the
# nodes). The linear system of a Newton iteration is solved like an articulated body: one sweep
# from the tip that condenses everything distal into a 3 × 3 response of the segment's near end,
# one sweep outwards. Where a pivot is not positive the turning of the levers is left out, so
# that every step descends.

_MAX_TURN = 0.3  # rad; largest change of a heading in one Newton iteration
_MAX_ITERATIONS, _MAX_HALVINGS, _BOLD_ITERATIONS = 40, 16, 12


@compiled
def place_nodes(table, base, heading, points):
    """Fill ``points`` (segment + 1, 2) from the base (x, y, heading) and the headings
    (segment,).
    """
    points[0, 0], points[0, 1] = base[0], base[1]
    for i in range(table.shape[0]):
        points[i + 1, 0] = points[i, 0] + table[i, R_LENGTH] * math.sin(heading[i])
        points[i + 1, 1] = points[i, 1] + table[i, R_LENGTH] * math.cos(heading[i])


@compiled
def _add_inertia(table, points, target, rate, force, stiffness):
    """Add the inertia of the nodes to the forces; returns its part of the potential."""
    energy = 0.0
    for i in range(table.shape[0]):
        share = table[i, R_MASS] * rate * rate
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
        bend, turned = angle - table[i, R_REST], angle - old_angle[i]
        drag = rate * table[i, R_DAMPING]
        energy += 0.5 * table[i, R_STIFFNESS] * bend * bend + 0.5 * drag * turned * turned
        own = table[i, R_STIFFNESS] * bend + drag * turned
        turn = (points[i + 1, 1] - points[i, 1]) * fx - (points[i + 1, 0] - points[i, 0]) * fy
        out[i] = own - torque - turn
        worst = max(worst, abs(out[i]) / (table[i, R_STIFFNESS] + drag))
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
        kappa = table[i, R_STIFFNESS] + rate * table[i, R_DAMPING]
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
    energy, count = _add_forces(model, lane, points, force, stiffness)
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
        turn = (ex * dy - ey * dx) / table[i, R_LENGTH] ** 2
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
    own = model.table[0, R_STIFFNESS] * (
        old_angle[0] + lane.rate[0] / rate - model.table[0, R_REST]
    )
    for axis in range(2):  # half the first segment's weight hangs on the base itself
        lane.wrench[axis] = 0.0
        for i in range(n):
            lane.wrench[axis] -= force[i, axis]
        lane.wrench[axis] -= 0.5 * model.table[0, R_MASS] * model.gravity[axis]
    lane.wrench[2] = -own - model.table[0, R_DAMPING] * lane.rate[0]
    static, _ = _balance(model.table, lane.base, now, place, old_angle, 0.0, force, residual)
    heading[:], points[:, :] = now, place
    _move_anchors(model, lane)
    return True, static, count, moved


# Many implicit steps, with base and objects carried along, and the way to an equilibrium.

_TOLERANCE = 1e-6  # rad; greatest out-of-balance torque over stiffness in a step
_MAX_SPLITS = 9  # [C] how often a step or a part of it that fails is quartered
_MAX_JUMPS = 5  # [C] so many for a part in which an object comes to the antenna's other side
_CAREFUL = 1  # [C] from so many quarterings on each iteration must lower the potential
_FIRST_STEP, _LONGEST_STEP = 0.5, 1e7  # ms; of a relaxation
_CALM = 0.05  # rad per step
# rad; an antenna that moves less per step, nearly balanced, is as balanced as rounding lets it be
_ROUNDING = 1e-9


@compiled
def march(model, lane, n_steps, timestep, drive, inertia):
    """Take steps in place, the base with ``drive`` (step or 1, 3) at each one's end; False where
    one has no end.
    """
    for k in range(n_steps):
        lane.drive[:] = drive[min(k, drive.shape[0] - 1)]
        if not _divide(model, lane, timestep, inertia):
            return False
    return True


@compiled
def _divide(model, lane, timestep, inertia):
    """One step in as few parts as it takes: a part that fails, or in which the antenna jumps over
    something, is quartered; after one that succeeds the next may be longer. Whether it came to its
    end.
    """
    level, left = 0, 4**_MAX_SPLITS  # of the shortest parts
    sides = np.zeros(model.parts.shape[0])
    while left:
        part = 4 ** (_MAX_SPLITS - level)
        kept = (
            lane.heading.copy(),
            lane.points.copy(),
            lane.velocity.copy(),
            lane.anchor.copy(),
        )
        rest = (lane.pressed.copy(), lane.base.copy(), lane.objects.copy(), lane.work.copy())
        _place_faces(model, lane)
        for p in range(len(sides)):
            sides[p] = _find_side(model, lane, p)
        span = timestep * part / 4**_MAX_SPLITS
        done = _advance(model, lane, span, inertia, level < _CAREFUL)
        if done and level < _MAX_JUMPS:
            for p in range(len(sides)):
                done = done and sides[p] * _find_side(model, lane, p) >= 0.0
        if done:
            left -= part
            if level and left % (4 * part) == 0:
                level -= 1
            continue
        lane.heading[:], lane.points[:], lane.velocity[:], lane.anchor[:] = kept
        lane.pressed[:], lane.base[:], lane.objects[:], lane.work[:] = rest
        level += 1
        if level > _MAX_SPLITS:
            return False
    return True


@compiled
def _find_side(model, lane, p):
    """On which side of the antenna the middle of a part is: −1 or 1, or 0 beyond its ends."""
    first, stop = int(model.parts[p, P_FIRST]), int(model.parts[p, P_STOP])
    if model.parts[p, P_RIM] == np.inf:
        return 0.0  # nothing jumps over a face without end
    x, y, nearest, side = 0.0, 0.0, np.inf, 0.0
    for k in range(first, stop):
        x += lane.faces[k, F_X] / (stop - first)
        y += lane.faces[k, F_Y] / (stop - first)
    for i in range(model.table.shape[0]):
        ex = lane.points[i + 1, 0] - lane.points[i, 0]
        ey = lane.points[i + 1, 1] - lane.points[i, 1]
        dx, dy = x - lane.points[i, 0], y - lane.points[i, 1]
        share = (dx * ex + dy * ey) / (ex * ex + ey * ey)
        within = min(max(share, 0.0), 1.0)
        away = (dx - within * ex) ** 2 + (dy - within * ey) ** 2
        if away < nearest:
            beyond = (i == 0 and share < 0.0) or (i == model.table.shape[0] - 1 and share > 1.0)
            nearest, side = away, 0.0 if beyond else np.sign(ex * dy - ey * dx)
    return side


@compiled
def _advance(model, lane, timestep, inertia, bold):
    """Carry base and objects on, and take one step; whether it converged."""
    before = lane.base[2]
    for axis in range(3):
        lane.base[axis] += timestep * lane.drive[axis]
    for o in range(lane.objects.shape[0]):
        item = lane.objects[o]
        item[O_X] += timestep * item[O_VX]
        item[O_Y] += timestep * item[O_VY]
        turned = timestep * item[O_TURN]
        if turned != 0.0:
            c, s, x, y = (
                math.cos(turned),
                math.sin(turned),
                item[O_FORWARD_X],
                item[O_FORWARD_Y],
            )
            item[O_FORWARD_X], item[O_FORWARD_Y] = c * x + s * y, c * y - s * x
    _place_faces(model, lane)
    done, _, _, _ = take(model, lane, before, timestep, inertia, bold, _TOLERANCE)
    if done:
        _add_work(model, lane, timestep)
    return done


@compiled
def _add_work(model, lane, timestep):
    """What base and objects did in this step, by the forces at its end, as the step has them."""
    for axis in range(3):
        lane.work[0] += timestep * lane.wrench[axis] * lane.drive[axis]
    for i in range(lane.push.shape[0]):
        for p in range(lane.push.shape[1]):
            push, o = lane.push[i, p], int(model.parts[p, P_OBJECT])
            if push[C_DEPTH] > 0.0:
                thin = min(model.table[i, R_RADIUS], model.parts[p, P_RADIUS])
                lane.sink[0] = max(lane.sink[0], push[C_DEPTH] / thin)
                item, near = lane.objects[o], model.table[i, R_RADIUS]
                x = lane.points[i + 1, 0] - near * push[C_NX] - item[O_X]
                y = lane.points[i + 1, 1] - near * push[C_NY] - item[O_Y]
                vx, vy = item[O_VX] + item[O_TURN] * y, item[O_VY] - item[O_TURN] * x
                lane.work[1 + o] += timestep * (push[C_FX] * vx + push[C_FY] * vy)


@compiled
def relax(model, lane, before, tolerance, max_steps):
    """Go to an equilibrium in place; returns (imbalance [rad], touching nodes).

    The time step grows while little happens, so that the last steps are plain Newton steps to the
    equilibrium; where much happens it stays short, and the antenna moves off along its own damping.
    """
    timestep, static, count = _FIRST_STEP, np.inf, 0
    _place_faces(model, lane)
    for _ in range(max_steps):
        done, trial, touching, moved = take(
            model, lane, before, timestep, False, False, 0.1 * tolerance
        )
        if not done:
            timestep *= 0.25
            if timestep < 1e-6:
                return np.inf, count
            continue
        before = lane.base[2]  # the base has arrived
        static, count = trial, touching
        if static < tolerance or (static < 10 * tolerance and moved < _ROUNDING):
            break
        if moved < _CALM:
            timestep = min(timestep * 4.0, _LONGEST_STEP)
        elif moved > 3 * _CALM:
            timestep *= 0.5
    return static, count
