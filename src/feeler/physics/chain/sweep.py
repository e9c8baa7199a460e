"""The O(n) sweeps of a planar chain: kinematics and articulated-body dynamics (Featherstone 2008, ch. 7).

World-aligned axes at each hinge. A segment's acceleration is (turn α, hinge a); a point at r from the hinge moves with
a + α·P(r), P(r) = (r_y, −r_x), because positive angles turn from +y towards +x. Velocity-product accelerations become
forces beforehand, so that every sweep solves (M + …)·q̈ = forces with no J̇v left in it.

A sweep's time is the latency of its recurrences, so sums are grouped such that as little as possible waits for the
segment before; what waits for none (sines, torques) runs at full SIMD width even for a single simulation.
"""

from feeler.compiled import compiled
from feeler.physics.chain.fields import (
    C_DAMPING,
    C_INERTIA,
    C_LENGTH,
    C_MASS,
    C_REACH,
    C_REST,
    C_STIFFNESS,
    O_BASE,
    O_FORWARD_X,
    O_FORWARD_Y,
    O_GRAVITY_X,
    O_GRAVITY_Y,
    O_HALF_X,
    O_HALF_Y,
    O_MIDDLE_X,
    O_MIDDLE_Y,
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
    W_EX,
    W_EY,
    W_FX,
    W_FY,
    W_HEADING,
    W_K00,
    W_K01,
    W_K02,
    W_K11,
    W_K12,
    W_K22,
    W_OMEGA,
    W_PX,
    W_PY,
    W_QDD,
    W_RATE,
    W_SHARE,
    W_TORQUE,
    W_U,
    W_UX,
    W_UY,
    W_VX,
    W_VY,
)
from feeler.physics.chain.lanes import choose, distance, fma, get, put, smaller, spread
from feeler.physics.chain.turn import sincos


@compiled
def move(constants, work, wides, obj, place, timestep, width):
    """One Euler step of every hinge, v += h q̈, q += h v, and all that follows from where the chain then is.

    Headings, turn rates, segment vectors, passive torques, velocity-product forces; into ``place`` the first and last
    segment whose hinge is within reach of the object's bounding box, in the feature's frame. Block by block: what no
    segment needs another for is done on eight numbers at once.
    """
    n = work.shape[1]
    wide_constants, wide_work, wide = wides
    heading, omega = get(obj, 0, O_BASE, width), spread(0.0, width)
    cx, cy = get(obj, 0, O_FORWARD_X, width), get(obj, 0, O_FORWARD_Y, width)
    half_x, half_y = get(obj, 0, O_HALF_X, width), get(obj, 0, O_HALF_Y, width)
    px, py = get(place, 0, P_X, width), get(place, 0, P_Y, width)
    at_x = -fma(cx, px, fma(cy, py, get(obj, 0, O_MIDDLE_X, width)))
    at_y = -fma(cx, py, fma(-cy, px, get(obj, 0, O_MIDDLE_Y, width)))
    first, last = spread(1e9, width), spread(-1.0, width)
    ax, ay = -get(obj, 0, O_GRAVITY_X, width), -get(obj, 0, O_GRAVITY_Y, width)
    size = len(wide) // len(width)
    # the first part runs a block ahead: what was just written one by one cannot be read eight at a time without a wait
    for k in range(-1, (n + size - 1) // size):
        for i in range((k + 1) * size, min((k + 2) * size, n)):
            rate = fma(timestep, get(work, W_QDD, i, width), get(work, W_RATE, i, width))
            angle = fma(timestep, rate, get(work, W_ANGLE, i, width))
            heading, omega = heading + angle, omega + rate
            put(work, W_RATE, i, rate, width)
            put(work, W_ANGLE, i, angle, width)
            put(work, W_HEADING, i, heading, width)
            put(work, W_OMEGA, i, omega, width)
        if k < 0:
            continue
        s, c = sincos(get(wide_work, W_HEADING, k, wide))
        length = get(wide_constants, C_LENGTH, k, wide)
        put(wide_work, W_EX, k, length * s, wide)
        put(wide_work, W_EY, k, length * c, wide)
        drag = get(wide_constants, C_DAMPING, k, wide) * get(wide_work, W_RATE, k, wide)
        stretch = get(wide_constants, C_REST, k, wide) - get(wide_work, W_ANGLE, k, wide)
        put(wide_work, W_TORQUE, k, fma(get(wide_constants, C_STIFFNESS, k, wide), stretch, -drag), wide)
        for i in range(k * size, min(k * size + size, n)):
            ex, ey, turning = get(work, W_EX, i, width), get(work, W_EY, i, width), get(work, W_OMEGA, i, width)
            square, mass = turning * turning, get(constants, C_MASS, i, width)
            turn_x, turn_y = square * ex, square * ey
            put(work, W_FX, i, mass * fma(turn_x, 0.5, -ax), width)
            put(work, W_FY, i, mass * fma(turn_y, 0.5, -ay), width)
            ax, ay = ax - turn_x, ay - turn_y
            reach, number = get(constants, C_REACH, i, width), float(i)
            near = (distance(at_x) <= half_x + reach) & (distance(at_y) <= half_y + reach)
            first, last = smaller(first, choose(near, number, 1e9)), choose(near, number, last)
            at_x, at_y = at_x + fma(cx, ex, cy * ey), at_y + fma(cx, ey, -(cy * ex))
    put(place, 0, P_FIRST, first, width)
    put(place, 0, P_LAST, last, width)


@compiled
def locate(work, last, width):
    """Hinge positions and velocities of segments 0…``last``; only contact needs them."""
    px = py = vx = vy = spread(0.0, width)
    for i in range(last + 1):
        ex, ey, omega = get(work, W_EX, i, width), get(work, W_EY, i, width), get(work, W_OMEGA, i, width)
        put(work, W_PX, i, px, width)
        put(work, W_PY, i, py, width)
        put(work, W_VX, i, vx, width)
        put(work, W_VY, i, vy, width)
        px, py, vx, vy = px + ex, py + ey, fma(omega, ey, vx), fma(-omega, ex, vy)


@compiled
def solve(constants, work, obj, loaded, timestep, last, width):
    """Accelerations of segments 0…``last`` under (M + hC + JᵀDJ) q̈ = passive + velocity-product forces + JᵀD a_ref.

    ``loaded`` marks the segments that are touched in some lane: their rows K.. and B.. hold Σ D w wᵀ and −Σ D a_ref w
    of their active contacts, or nothing and minus the contacts' wrench; they are told their accelerations. A
    ``timestep`` of 0 leaves the implicit damping hC out.
    """
    zero = spread(0.0, width)
    d = ux = uy = a = b = c = torque = zero  # what the distal part shows at its own hinge
    fx, fy = -get(obj, 0, O_PULL_X, width), -get(obj, 0, O_PULL_Y, width)
    for i in range(work.shape[1] - 1, -1, -1):
        ex, ey = get(work, W_EX, i, width), get(work, W_EY, i, width)
        own_x, own_y = get(work, W_FX, i, width), get(work, W_FY, i, width)
        mass = get(constants, C_MASS, i, width)
        half, twice_x, twice_y = 0.5 * mass, ex + ex, ey + ey
        wx, wy = fma(a, ey, fma(-b, ex, ux)), fma(b, ey, fma(-c, ex, uy))
        far = fma(c, ex * ex, ux * twice_y) - fma(b, twice_x * ey, uy * twice_x)
        drag, own = timestep * get(constants, C_DAMPING, i, width), get(constants, C_INERTIA, i, width)
        near, damped = fma(a, ey * ey, own + d), fma(a, ey * ey, (own + drag) + d)
        ux, uy = fma(half, ey, wx), fma(-half, ex, wy)
        bias = fma(ey, fma(-0.5, own_x, fx), fma(-ex, fma(-0.5, own_y, fy), torque))
        a, c, fx, fy = a + mass, c + mass, fx - own_x, fy - own_y
        if loaded[i]:
            near, damped = near + get(work, W_K00, i, width), damped + get(work, W_K00, i, width)
            ux, uy = ux + get(work, W_K01, i, width), uy + get(work, W_K02, i, width)
            a, b = a + get(work, W_K11, i, width), b + get(work, W_K12, i, width)
            c, bias = c + get(work, W_K22, i, width), bias + get(work, W_B0, i, width)
            fx, fy = fx + get(work, W_B1, i, width), fy + get(work, W_B2, i, width)
        d, inverse = near + far, 1.0 / (damped + far)
        u = (get(work, W_TORQUE, i, width) - bias) * inverse
        put(work, W_SHARE, i, drag * inverse, width)
        put(work, W_UX, i, ux * inverse, width)
        put(work, W_UY, i, uy * inverse, width)
        put(work, W_U, i, u, width)
        torque = fma(d, u, bias)
        fx, fy = fma(ux, u, fx), fma(uy, u, fy)
        a, b, c = fma(-(ux * ux), inverse, a), fma(-(ux * uy), inverse, b), fma(-(uy * uy), inverse, c)
        d, ux, uy = (d * drag) * inverse, (ux * drag) * inverse, (uy * drag) * inverse
    alpha = ax = ay = zero
    for i in range(last + 1):
        gx, gy, u = get(work, W_UX, i, width), get(work, W_UY, i, width), get(work, W_U, i, width)
        before = alpha
        alpha = fma(-gy, ay, fma(-gx, ax, fma(get(work, W_SHARE, i, width), before, u)))
        put(work, W_QDD, i, alpha - before, width)
        if loaded[i]:
            put(work, W_ALPHA, i, alpha, width)
            put(work, W_AX, i, ax, width)
            put(work, W_AY, i, ay, width)
        ax, ay = fma(alpha, get(work, W_EY, i, width), ax), fma(-alpha, get(work, W_EX, i, width), ay)
