"""The O(n) sweeps of a planar chain: kinematics and articulated-body dynamics (Featherstone 2008, ch. 7).

World-aligned axes at each hinge; a segment's acceleration is (turn α, hinge a) and a point at r from the hinge moves with
a + α·P(r), P(r) = (r_y, −r_x), because positive angles turn from +y towards +x. Velocity-product accelerations are turned
into forces beforehand, so that every sweep solves (M + …)·q̈ = forces with no J̇v left in it.
"""

from numba import njit

from feeler.physics.chain.fields import (
    C_DAMPING,
    C_LENGTH,
    C_MASS,
    C_REST,
    C_STIFFNESS,
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
    W_INVERSE,
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
from feeler.physics.chain.turn import sincos

COMPILE = {"cache": True, "nogil": True, "error_model": "numpy"}


@njit(**COMPILE)
def move(constants, work, base):
    """Kinematics, velocity-product forces and passive torques of every segment, base to tip."""
    n = constants.shape[0]
    heading = base
    for i in range(n):
        heading = heading + work[i, W_ANGLE]
        work[i, W_OMEGA] = heading
    for i in range(n):
        s, c = sincos(work[i, W_OMEGA])
        work[i, W_EX] = constants[i, C_LENGTH] * s
        work[i, W_EY] = constants[i, C_LENGTH] * c
    px = py = vx = vy = ax = ay = omega = 0.0
    for i in range(n):
        rate = work[i, W_RATE]
        omega = omega + rate
        ex, ey = work[i, W_EX], work[i, W_EY]
        work[i, W_PX], work[i, W_PY], work[i, W_OMEGA], work[i, W_VX], work[i, W_VY] = px, py, omega, vx, vy
        square = omega * omega
        mass = constants[i, C_MASS]
        work[i, W_FX] = -mass * (ax - 0.5 * square * ex)
        work[i, W_FY] = -mass * (ay - 0.5 * square * ey)
        work[i, W_TORQUE] = (
            -constants[i, C_STIFFNESS] * (work[i, W_ANGLE] - constants[i, C_REST]) - constants[i, C_DAMPING] * rate
        )
        px, py = px + ex, py + ey
        vx, vy = vx + omega * ey, vy - omega * ex
        ax, ay = ax - square * ex, ay - square * ey


@njit(**COMPILE)
def solve_with_contacts(constants, work, loaded, last):
    """Accelerations of segments 0…``last`` under (M + JᵀDJ) q̈ = passive + velocity-product forces + JᵀD a_ref.

    ``loaded`` marks the segments whose columns K.. and B.. hold a contact's Σ D w wᵀ and −Σ D a_ref w.
    """
    n = constants.shape[0]
    a = b = c = fx = fy = torque = 0.0
    for i in range(n - 1, -1, -1):
        ex, ey, mass = work[i, W_EX], work[i, W_EY], constants[i, C_MASS]
        half = 0.5 * mass
        wx, wy = a * ey - b * ex, b * ey - c * ex
        fpx, fpy = fx - work[i, W_FX], fy - work[i, W_FY]
        d = mass * constants[i, C_LENGTH] * constants[i, C_LENGTH] / 3.0 + (ey * wx - ex * wy)
        ux, uy = half * ey + wx, wy - half * ex
        bias = torque + (ey * fx - ex * fy) - 0.5 * (ey * work[i, W_FX] - ex * work[i, W_FY])
        a, c = a + mass, c + mass
        if loaded[i]:
            d, ux, uy = d + work[i, W_K00], ux + work[i, W_K01], uy + work[i, W_K02]
            a, b, c = a + work[i, W_K11], b + work[i, W_K12], c + work[i, W_K22]
            bias, fpx, fpy = bias + work[i, W_B0], fpx + work[i, W_B1], fpy + work[i, W_B2]
        inverse = 1.0 / d
        torque = work[i, W_TORQUE]
        u = (torque - bias) * inverse
        work[i, W_U], work[i, W_INVERSE] = u, inverse
        work[i, W_UX], work[i, W_UY] = ux, uy
        gx, gy = ux * inverse, uy * inverse
        a, b, c = a - ux * gx, b - ux * gy, c - uy * gy
        fx, fy = fpx + ux * u, fpy + uy * u
    ax = ay = 0.0
    for i in range(last + 1):
        alpha = work[i, W_U] - work[i, W_INVERSE] * (work[i, W_UX] * ax + work[i, W_UY] * ay)
        work[i, W_ALPHA], work[i, W_AX], work[i, W_AY] = alpha, ax, ay
        ax, ay = ax + alpha * work[i, W_EY], ay - alpha * work[i, W_EX]


@njit(**COMPILE)
def advance(constants, work, loaded, timestep):
    """One Euler step, implicit in the joint damping C: v += h (M + hC)⁻¹ (forces), q += h v.

    ``loaded`` marks the segments whose columns B.. hold minus the contact's wrench about the hinge.
    """
    n = constants.shape[0]
    d = ux = uy = a = b = c = torque = fx = fy = 0.0  # what the distal part shows at its own hinge
    for i in range(n - 1, -1, -1):
        ex, ey, mass = work[i, W_EX], work[i, W_EY], constants[i, C_MASS]
        half = 0.5 * mass
        wx, wy = ux + (a * ey - b * ex), uy + (b * ey - c * ex)
        d = mass * constants[i, C_LENGTH] * constants[i, C_LENGTH] / 3.0 + (d + ey * (ux + wx) - ex * (uy + wy))
        ux, uy = half * ey + wx, wy - half * ex
        bias = torque + (ey * fx - ex * fy) - 0.5 * (ey * work[i, W_FX] - ex * work[i, W_FY])
        fx, fy = fx - work[i, W_FX], fy - work[i, W_FY]
        a, c = a + mass, c + mass
        if loaded[i]:
            bias, fx, fy = bias + work[i, W_B0], fx + work[i, W_B1], fy + work[i, W_B2]
        drag = timestep * constants[i, C_DAMPING]
        inverse = 1.0 / (d + drag)
        u = work[i, W_TORQUE] - bias
        work[i, W_D], work[i, W_UX], work[i, W_UY] = d, ux, uy
        work[i, W_U], work[i, W_INVERSE] = u, inverse
        qdd = u * inverse
        share = drag * inverse
        gx, gy = ux * inverse, uy * inverse
        torque = bias + d * qdd
        fx, fy = fx + ux * qdd, fy + uy * qdd
        a, b, c = a - ux * gx, b - ux * gy, c - uy * gy
        d, ux, uy = d * share, ux * share, uy * share
    alpha = ax = ay = 0.0
    for i in range(n):
        qdd = work[i, W_INVERSE] * (work[i, W_U] - work[i, W_D] * alpha - work[i, W_UX] * ax - work[i, W_UY] * ay)
        alpha = alpha + qdd
        rate = work[i, W_RATE] + timestep * qdd
        work[i, W_RATE] = rate
        work[i, W_ANGLE] = work[i, W_ANGLE] + timestep * rate
        ax, ay = ax + alpha * work[i, W_EY], ay - alpha * work[i, W_EX]
