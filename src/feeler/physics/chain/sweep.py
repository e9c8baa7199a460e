"""The O(n) sweeps of a planar chain: kinematics and articulated-body dynamics (Featherstone 2008, ch. 7).

World-aligned axes at each hinge. A segment's acceleration is (turn α, hinge a); a point at r from the hinge moves with
a + α·P(r), P(r) = (r_y, −r_x), because positive angles turn from +y towards +x. Velocity-product accelerations become
forces beforehand, so that every sweep solves (M + …)·q̈ = forces with no J̇v left in it.
"""

from feeler.compiled import compiled
from feeler.physics.chain.fields import (
    C_DAMPING,
    C_INERTIA,
    C_LENGTH,
    C_MASS,
    C_RADIUS,
    C_REST,
    C_STIFFNESS,
    O_BASE,
    O_FORWARD_X,
    O_FORWARD_Y,
    O_GRAVITY_X,
    O_GRAVITY_Y,
    O_HIGH_X,
    O_HIGH_Y,
    O_LOW_X,
    O_LOW_Y,
    O_PULL_X,
    O_PULL_Y,
    P_FIRST,
    P_LAST,
    P_X,
    P_Y,
    W_ALPHA,
    W_ANGLE,
    W_AX,
    W_AY,
    W_B0,
    W_B1,
    W_B2,
    W_D,
    W_EX,
    W_EY,
    W_FX,
    W_FY,
    W_K00,
    W_K01,
    W_K02,
    W_K11,
    W_K12,
    W_K22,
    W_OMEGA,
    W_PX,
    W_PY,
    W_RATE,
    W_TORQUE,
    W_U,
    W_UX,
    W_UY,
    W_VX,
    W_VY,
)
from feeler.physics.chain.lanes import choose, fma, get, larger, put, smaller, spread
from feeler.physics.chain.turn import sincos


@compiled
def move(constants, work, obj, place, width):
    """Turn the chain: segment vectors, velocity-product forces and passive torques, base to tip.

    Also the first and last segment whose bounding box meets the object's, in the feature's frame, into ``place``.
    """
    zero = spread(0.0, width)
    heading = get(obj, 0, O_BASE, width)
    cx, cy = get(obj, 0, O_FORWARD_X, width), get(obj, 0, O_FORWARD_Y, width)
    low_x, high_x = get(obj, 0, O_LOW_X, width), get(obj, 0, O_HIGH_X, width)
    low_y, high_y = get(obj, 0, O_LOW_Y, width), get(obj, 0, O_HIGH_Y, width)
    px, py = -get(place, 0, P_X, width), -get(place, 0, P_Y, width)
    at_x, at_y = fma(cx, px, cy * py), fma(cx, py, -(cy * px))
    first, last = spread(1e9, width), spread(-1.0, width)
    omega = zero
    ax, ay = -get(obj, 0, O_GRAVITY_X, width), -get(obj, 0, O_GRAVITY_Y, width)
    for i in range(constants.shape[0]):
        angle, rate = get(work, i, W_ANGLE, width), get(work, i, W_RATE, width)
        heading, omega = heading + angle, omega + rate
        s, c = sincos(heading)
        length, mass = get(constants, i, C_LENGTH, width), get(constants, i, C_MASS, width)
        ex, ey, square = length * s, length * c, omega * omega
        turn_x, turn_y = square * ex, square * ey
        put(work, i, W_EX, ex, width)
        put(work, i, W_EY, ey, width)
        put(work, i, W_FX, mass * fma(turn_x, 0.5, -ax), width)
        put(work, i, W_FY, mass * fma(turn_y, 0.5, -ay), width)
        drag = get(constants, i, C_DAMPING, width) * rate
        stretch = get(constants, i, C_REST, width) - angle
        put(work, i, W_TORQUE, fma(get(constants, i, C_STIFFNESS, width), stretch, -drag), width)
        ax, ay = ax - turn_x, ay - turn_y
        to_x, to_y = at_x + fma(cx, ex, cy * ey), at_y + fma(cx, ey, -(cy * ex))
        radius = get(constants, i, C_RADIUS, width)
        near = (smaller(at_x, to_x) <= high_x + radius) & (larger(at_x, to_x) >= low_x - radius)
        near = near & (smaller(at_y, to_y) <= high_y + radius) & (larger(at_y, to_y) >= low_y - radius)
        number = float(i)
        first, last = choose(near, smaller(first, number), first), choose(near, number, last)
        at_x, at_y = to_x, to_y
    put(place, 0, P_FIRST, first, width)
    put(place, 0, P_LAST, last, width)


@compiled
def locate(constants, work, last, width):
    """Hinge positions and velocities and turn rates of segments 0…``last``; only contact needs them."""
    px = py = vx = vy = omega = spread(0.0, width)
    for i in range(last + 1):
        ex, ey = get(work, i, W_EX, width), get(work, i, W_EY, width)
        omega = omega + get(work, i, W_RATE, width)
        put(work, i, W_PX, px, width)
        put(work, i, W_PY, py, width)
        put(work, i, W_OMEGA, omega, width)
        put(work, i, W_VX, vx, width)
        put(work, i, W_VY, vy, width)
        px, py, vx, vy = px + ex, py + ey, fma(omega, ey, vx), fma(-omega, ex, vy)


@compiled
def solve_with_contacts(constants, work, obj, loaded, last, width):
    """Accelerations of segments 0…``last`` under (M + JᵀDJ) q̈ = passive + velocity-product forces + JᵀD a_ref.

    ``loaded`` marks the segments whose columns K.. and B.. hold a contact's Σ D w wᵀ and −Σ D a_ref w in some lane.
    """
    zero = spread(0.0, width)
    a = b = c = torque = zero
    fx, fy = -get(obj, 0, O_PULL_X, width), -get(obj, 0, O_PULL_Y, width)
    for i in range(constants.shape[0] - 1, -1, -1):
        ex, ey = get(work, i, W_EX, width), get(work, i, W_EY, width)
        own_x, own_y = get(work, i, W_FX, width), get(work, i, W_FY, width)
        mass = get(constants, i, C_MASS, width)
        half = 0.5 * mass
        wx, wy = fma(a, ey, -(b * ex)), fma(b, ey, -(c * ex))
        d = fma(ey, wx, fma(-ex, wy, get(constants, i, C_INERTIA, width)))
        ux, uy = fma(half, ey, wx), fma(-half, ex, wy)
        bias = fma(ey, fma(-0.5, own_x, fx), fma(-ex, fma(-0.5, own_y, fy), torque))
        a, c, fx, fy = a + mass, c + mass, fx - own_x, fy - own_y
        if loaded[i]:
            d = d + get(work, i, W_K00, width)
            ux, uy = ux + get(work, i, W_K01, width), uy + get(work, i, W_K02, width)
            a, b = a + get(work, i, W_K11, width), b + get(work, i, W_K12, width)
            c, bias = c + get(work, i, W_K22, width), bias + get(work, i, W_B0, width)
            fx, fy = fx + get(work, i, W_B1, width), fy + get(work, i, W_B2, width)
        inverse = 1.0 / d
        torque = get(work, i, W_TORQUE, width)
        gx, gy, u = ux * inverse, uy * inverse, (torque - bias) * inverse
        put(work, i, W_UX, gx, width)
        put(work, i, W_UY, gy, width)
        put(work, i, W_U, u, width)
        a, b, c = fma(-ux, gx, a), fma(-ux, gy, b), fma(-uy, gy, c)
        fx, fy = fma(ux, u, fx), fma(uy, u, fy)
    ax = ay = zero
    for i in range(last + 1):
        alpha = fma(-get(work, i, W_UY, width), ay, fma(-get(work, i, W_UX, width), ax, get(work, i, W_U, width)))
        put(work, i, W_ALPHA, alpha, width)
        put(work, i, W_AX, ax, width)
        put(work, i, W_AY, ay, width)
        ax, ay = fma(alpha, get(work, i, W_EY, width), ax), fma(-alpha, get(work, i, W_EX, width), ay)


@compiled
def solve_damped(constants, work, obj, loaded, timestep, width):
    """Accelerations of every segment under (M + hC + JᵀDJ) q̈ = forces + JᵀD a_ref, columns as in solve_with_contacts.

    Each hinge's own acceleration is left in column D.
    """
    zero = spread(0.0, width)
    d = ux = uy = a = b = c = torque = zero  # what the distal part shows at its own hinge
    fx, fy = -get(obj, 0, O_PULL_X, width), -get(obj, 0, O_PULL_Y, width)
    for i in range(constants.shape[0] - 1, -1, -1):
        ex, ey = get(work, i, W_EX, width), get(work, i, W_EY, width)
        own_x, own_y = get(work, i, W_FX, width), get(work, i, W_FY, width)
        mass = get(constants, i, C_MASS, width)
        half = 0.5 * mass
        wx, wy = fma(a, ey, fma(-b, ex, ux)), fma(b, ey, fma(-c, ex, uy))
        d = fma(ey, ux + wx, fma(-ex, uy + wy, d + get(constants, i, C_INERTIA, width)))
        ux, uy = fma(half, ey, wx), fma(-half, ex, wy)
        bias = fma(ey, fma(-0.5, own_x, fx), fma(-ex, fma(-0.5, own_y, fy), torque))
        a, c, fx, fy = a + mass, c + mass, fx - own_x, fy - own_y
        if loaded[i]:
            d = d + get(work, i, W_K00, width)
            ux, uy = ux + get(work, i, W_K01, width), uy + get(work, i, W_K02, width)
            a, b = a + get(work, i, W_K11, width), b + get(work, i, W_K12, width)
            c, bias = c + get(work, i, W_K22, width), bias + get(work, i, W_B0, width)
            fx, fy = fx + get(work, i, W_B1, width), fy + get(work, i, W_B2, width)
        drag = timestep * get(constants, i, C_DAMPING, width)
        inverse = 1.0 / (d + drag)
        share = drag * inverse
        qdd = (get(work, i, W_TORQUE, width) - bias) * inverse
        turn, gx, gy = d * inverse, ux * inverse, uy * inverse
        put(work, i, W_D, turn, width)
        put(work, i, W_UX, gx, width)
        put(work, i, W_UY, gy, width)
        put(work, i, W_U, qdd, width)
        torque = fma(d, qdd, bias)
        fx, fy = fma(ux, qdd, fx), fma(uy, qdd, fy)
        a, b, c = fma(-ux, gx, a), fma(-ux, gy, b), fma(-uy, gy, c)
        d, ux, uy = d * share, ux * share, uy * share
    alpha = ax = ay = zero
    for i in range(constants.shape[0]):
        free = fma(-get(work, i, W_UY, width), ay, fma(-get(work, i, W_UX, width), ax, get(work, i, W_U, width)))
        qdd = fma(-get(work, i, W_D, width), alpha, free)
        alpha = alpha + qdd
        put(work, i, W_D, qdd, width)
        put(work, i, W_ALPHA, alpha, width)
        put(work, i, W_AX, ax, width)
        put(work, i, W_AY, ay, width)
        ax, ay = fma(alpha, get(work, i, W_EY, width), ax), fma(-alpha, get(work, i, W_EX, width), ay)


@compiled
def advance(constants, work, obj, loaded, timestep, width):
    """One Euler step, implicit in the joint damping C: v += h (M + hC)⁻¹ (forces), q += h v.

    ``loaded`` marks the segments whose columns B.. hold minus the contact's wrench about the hinge in some lane.
    """
    zero = spread(0.0, width)
    d = ux = uy = a = b = c = torque = zero  # what the distal part shows at its own hinge
    fx, fy = -get(obj, 0, O_PULL_X, width), -get(obj, 0, O_PULL_Y, width)
    for i in range(constants.shape[0] - 1, -1, -1):
        ex, ey = get(work, i, W_EX, width), get(work, i, W_EY, width)
        own_x, own_y = get(work, i, W_FX, width), get(work, i, W_FY, width)
        mass = get(constants, i, C_MASS, width)
        half = 0.5 * mass
        wx, wy = fma(a, ey, fma(-b, ex, ux)), fma(b, ey, fma(-c, ex, uy))
        d = fma(ey, ux + wx, fma(-ex, uy + wy, d + get(constants, i, C_INERTIA, width)))
        ux, uy = fma(half, ey, wx), fma(-half, ex, wy)
        bias = fma(ey, fma(-0.5, own_x, fx), fma(-ex, fma(-0.5, own_y, fy), torque))
        a, c, fx, fy = a + mass, c + mass, fx - own_x, fy - own_y
        if loaded[i]:
            bias = bias + get(work, i, W_B0, width)
            fx, fy = fx + get(work, i, W_B1, width), fy + get(work, i, W_B2, width)
        drag = timestep * get(constants, i, C_DAMPING, width)
        inverse = 1.0 / (d + drag)
        share = drag * inverse
        qdd = (get(work, i, W_TORQUE, width) - bias) * inverse
        turn, gx, gy = d * inverse, ux * inverse, uy * inverse
        put(work, i, W_D, turn, width)
        put(work, i, W_UX, gx, width)
        put(work, i, W_UY, gy, width)
        put(work, i, W_U, qdd, width)
        torque = fma(d, qdd, bias)
        fx, fy = fma(ux, qdd, fx), fma(uy, qdd, fy)
        a, b, c = fma(-ux, gx, a), fma(-ux, gy, b), fma(-uy, gy, c)
        d, ux, uy = d * share, ux * share, uy * share
    alpha = ax = ay = zero
    for i in range(constants.shape[0]):
        free = fma(-get(work, i, W_UY, width), ay, fma(-get(work, i, W_UX, width), ax, get(work, i, W_U, width)))
        qdd = fma(-get(work, i, W_D, width), alpha, free)
        alpha = alpha + qdd
        rate = fma(timestep, qdd, get(work, i, W_RATE, width))
        put(work, i, W_RATE, rate, width)
        put(work, i, W_ANGLE, fma(timestep, rate, get(work, i, W_ANGLE, width)), width)
        ax, ay = fma(alpha, get(work, i, W_EY, width), ax), fma(-alpha, get(work, i, W_EX, width), ay)
