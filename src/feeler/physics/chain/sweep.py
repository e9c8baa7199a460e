"""The O(n) sweeps of a planar chain: kinematics and articulated-body dynamics (Featherstone 2008,
ch. 7).

World-aligned axes at each hinge. A segment's acceleration is (turn α, hinge a); a point at r from
the hinge moves with a + α·P(r), P(r) = (r_y, −r_x), because positive angles turn from +y towards
+x. Velocity-product accelerations become forces beforehand, so that every sweep solves (M + …)·q̈ =
forces with no J̇v left in it. Places and velocities are seen from the base, which may move: its
acceleration is where the outward sweep begins.

A sweep's time is the latency of its recurrences, so sums are grouped such that as little as
possible waits for the segment before; what waits for none (sines, torques) runs at full SIMD width
even for a single simulation.
"""

from feeler.compiled import inlined, lean, nested
from feeler.physics.chain import fields as f
from feeler.physics.chain.lanes import (
    beside,
    choose,
    everywhere,
    fma,
    get,
    pick,
    put,
    sincos,
    smaller,
    spread,
)


@lean
def move(segments, work, wides, base, timestep, width):
    """The outward sweep and one Euler step of every hinge, v += h q̈, q += h v, and all that
    follows from where it then is.

    Headings, turn rates, segment vectors, passive torques, velocity-product forces. Block by block:
    what no segment needs another for is done on eight numbers at once, while the recurrences of the
    next block wait for each other. A ``timestep`` of 0 moves nothing and computes what follows.
    """
    n = work.shape[1]
    wide_segments, wide_work, wide = wides
    heading, omega = get(base, 0, f.B_HEADING, width), get(base, 0, f.B_TURN, width)
    alpha, push_x, push_y = (
        get(base, 0, f.B_ALPHA, width),
        get(base, 0, f.B_AX, width),
        get(base, 0, f.B_AY, width),
    )
    ax, ay = -get(base, 0, f.B_GRAVITY_X, width), -get(base, 0, f.B_GRAVITY_Y, width)
    size = len(wide) // len(width)
    # the first part runs a block ahead: what was just written one by one cannot be read eight at a
    # time without a wait
    for k in range(-1, (n + size - 1) // size):
        for i in range((k + 1) * size, min((k + 2) * size, n)):
            before, alpha = alpha, _turn(work, i, alpha, push_x, push_y, width)
            push_x = fma(alpha, get(work, f.W_EY, i, width), push_x)
            push_y = fma(-alpha, get(work, f.W_EX, i, width), push_y)
            rate = fma(timestep, alpha - before, get(work, f.W_RATE, i, width))
            angle = fma(timestep, rate, get(work, f.W_ANGLE, i, width))
            heading, omega = heading + angle, omega + rate
            put(work, f.W_RATE, i, rate, width)
            put(work, f.W_ANGLE, i, angle, width)
            put(work, f.W_HEADING, i, heading, width)
            put(work, f.W_OMEGA, i, omega, width)
        if k < 0:
            continue
        s, c = sincos(get(wide_work, f.W_HEADING, k, wide))
        length = get(wide_segments, f.C_LENGTH, k, wide)
        put(wide_work, f.W_EX, k, length * s, wide)
        put(wide_work, f.W_EY, k, length * c, wide)
        drag = get(wide_segments, f.C_DAMPING, k, wide) * get(wide_work, f.W_RATE, k, wide)
        stretch = get(wide_segments, f.C_REST, k, wide) - get(wide_work, f.W_ANGLE, k, wide)
        put(
            wide_work,
            f.W_TORQUE,
            k,
            fma(get(wide_segments, f.C_STIFFNESS, k, wide), stretch, -drag),
            wide,
        )
        for i in range(k * size, min(k * size + size, n)):
            ex, ey, turning = (
                get(work, f.W_EX, i, width),
                get(work, f.W_EY, i, width),
                get(work, f.W_OMEGA, i, width),
            )
            square, mass = turning * turning, get(segments, f.C_MASS, i, width)
            turn_x, turn_y = square * ex, square * ey
            put(work, f.W_FX, i, mass * fma(turn_x, 0.5, -ax), width)
            put(work, f.W_FY, i, mass * fma(turn_y, 0.5, -ay), width)
            ax, ay = ax - turn_x, ay - turn_y


@nested
def seek(segments, work, obj, place, o, pair, width):
    """Note the first and the last segment that none of object ``o``'s half planes keeps clear of
    it.
    """
    ax, ay, a = _face(obj, place, o, 0, width)
    bx, by, b = _face(obj, place, o, 1, width)
    cx, cy, c = _face(obj, place, o, 2, width)
    dx, dy, d = _face(obj, place, o, 3, width)
    first, last = spread(1e9, width), spread(-1.0, width)
    if pair is None:
        for i in range(work.shape[1]):
            ex, ey = get(work, f.W_EX, i, width), get(work, f.W_EY, i, width)
            radius, number = get(segments, f.C_RADIUS, i, width), float(i)
            at_a, at_b, at_c, at_d = (
                a,
                b,
                c,
                d,
            )  # how far its hinge is outside each plane, and then the next one's
            a, b, c, d = (
                a + fma(ax, ex, ay * ey),
                b + fma(bx, ex, by * ey),
                c + fma(cx, ex, cy * ey),
                d + fma(dx, ex, dy * ey),
            )
            near = (smaller(at_a, a) <= radius) & (smaller(at_b, b) <= radius)
            near = near & (smaller(at_c, c) <= radius) & (smaller(at_d, d) <= radius)
            first, last = smaller(first, choose(near, number, 1e9)), choose(near, number, last)
    else:  # one lane: its four planes side by side
        nx, ny, outside = (
            beside((ax, bx, cx, dx)),
            beside((ay, by, cy, dy)),
            beside((a, b, c, d)),
        )
        for i in range(work.shape[1]):
            at = outside
            outside = at + fma(
                nx, get(work, f.W_EX, i, width), ny * get(work, f.W_EY, i, width)
            )
            if everywhere(smaller(at, outside) <= get(segments, f.C_RADIUS, i, width)):
                first, last = smaller(first, float(i)), spread(float(i), width)
    put(place, o, f.P_FIRST, first, width)
    put(place, o, f.P_LAST, last, width)


@nested
def _face(obj, place, o, k, width):
    """Outward normal of half plane ``k`` as it now lies, and how far outside it the base is."""
    x, y = get(obj, o, f.O_PLANES + 3 * k, width), get(obj, o, f.O_PLANES + 3 * k + 1, width)
    forward_x, forward_y = (
        get(place, o, f.P_FORWARD_X, width),
        get(place, o, f.P_FORWARD_Y, width),
    )
    nx, ny = fma(forward_x, x, -(forward_y * y)), fma(forward_y, x, forward_x * y)
    outside = -fma(nx, get(place, o, f.P_X, width), ny * get(place, o, f.P_Y, width))
    return nx, ny, outside - get(obj, o, f.O_PLANES + 3 * k + 2, width)


@nested
def locate(work, last, width):
    """Hinge positions and velocities of segments 0…``last``, seen from the base; only contact needs
    them.
    """
    px = py = vx = vy = spread(0.0, width)
    for i in range(last + 1):
        ex, ey, omega = (
            get(work, f.W_EX, i, width),
            get(work, f.W_EY, i, width),
            get(work, f.W_OMEGA, i, width),
        )
        put(work, f.W_PX, i, px, width)
        put(work, f.W_PY, i, py, width)
        put(work, f.W_VX, i, vx, width)
        put(work, f.W_VY, i, vy, width)
        px, py, vx, vy = px + ex, py + ey, fma(omega, ey, vx), fma(-omega, ex, vy)


@nested
def fold(segments, work, base, loaded, timestep, width):
    """The inward sweep of (M + hC + JᵀDJ) q̈ = passive + velocity-product forces + JᵀD a_ref: what
    is left for each hinge.

    ``loaded`` marks the segments that are touched in some lane: their rows K.. and B.. hold Σ D w
    wᵀ and −Σ D a_ref w of their active contacts, or nothing and minus the contacts' wrench. A
    ``timestep`` of 0 leaves the implicit damping hC out. What the antenna then shows at its base
    gives the reaction.
    """
    zero = spread(0.0, width)
    fx, fy = -get(base, 0, f.B_PULL_X, width), -get(base, 0, f.B_PULL_Y, width)
    inertia, bias = (zero, zero, zero, zero, zero, zero), (zero, fx, fy)
    for i in range(work.shape[1] - 1, -1, -1):
        inertia, bias, found, _ = _fold_one(
            segments, work, i, loaded[i], timestep, 1.0, inertia, bias, width
        )
        _put_four(work, f.W_UX, i, found, width)
    react_x, react_y, react_moment = _react(base, inertia, width)
    put(base, 0, f.B_FX, bias[1] + react_x, width)
    put(base, 0, f.B_FY, bias[2] + react_y, width)
    put(base, 0, f.B_MOMENT, bias[0] + react_moment, width)


@nested
def fold_both(segments, work, base, loaded, last, timestep, pair, width):
    """``fold`` without damping, and at once, in a lane beside it, with damping but without contact.

    One lane's sweep waits for itself, so two cost what one does. ``refold`` lets contact act on the
    damped one as far as segment ``last``; beyond, nothing is touched.
    """
    zero, fx, fy = (
        spread(0.0, pair),
        spread(-base[0, f.B_PULL_X, 0], pair),
        spread(-base[0, f.B_PULL_Y, 0], pair),
    )
    inertia, bias = (zero, zero, zero, zero, zero, zero), (zero, fx, fy)
    timesteps, only = beside((0.0, timestep)), beside((1.0, 0.0))
    for i in range(work.shape[1] - 1, -1, -1):
        if i == last:
            put(base, 0, f.B_LEFT_TORQUE, pick(bias[0], 1), width)
            put(base, 0, f.B_LEFT_FX, pick(bias[1], 1), width)
            put(base, 0, f.B_LEFT_FY, pick(bias[2], 1), width)
        inertia, bias, found, kept = _fold_one(
            segments, work, i, loaded[i], timesteps, only, inertia, bias, width
        )
        _put_four(work, f.W_UX, i, _pick_four(found, 0), width)
        _put_four(work, f.W_NEXT_UX, i, _pick_four(found, 1), width)
        _put_four(work, f.W_D, i, _pick_four(kept, 1), width)
    a, b = pick(inertia[4], 1), pick(inertia[5], 1)
    react_x, react_y, react_moment = _react(base, (*_pick_four(inertia, 1), a, b), width)
    put(base, 0, f.B_REACT_FX, react_x, width)
    put(base, 0, f.B_REACT_FY, react_y, width)
    put(base, 0, f.B_REACT_MOMENT, react_moment, width)


@nested
def refold(work, wides, base, loaded, last, width):
    """The rest of ``fold`` with damping after ``fold_both``, now that the contacts' wrenches are in
    rows B...
    """
    _, wide_work, wide = wides
    for k in range(wide_work.shape[1]):
        for row in range(4):
            put(wide_work, f.W_UX + row, k, get(wide_work, f.W_NEXT_UX + row, k, wide), wide)
    torque = get(base, 0, f.B_LEFT_TORQUE, width)
    fx, fy = get(base, 0, f.B_LEFT_FX, width), get(base, 0, f.B_LEFT_FY, width)
    for i in range(last, -1, -1):
        ex, ey = get(work, f.W_EX, i, width), get(work, f.W_EY, i, width)
        own_x, own_y = get(work, f.W_FX, i, width), get(work, f.W_FY, i, width)
        bias = fma(ey, fma(-0.5, own_x, fx), fma(-ex, fma(-0.5, own_y, fy), torque))
        fx, fy = fx - own_x, fy - own_y
        if loaded[i]:
            bias = bias + get(work, f.W_B0, i, width)
            fx, fy = fx + get(work, f.W_B1, i, width), fy + get(work, f.W_B2, i, width)
        u = (get(work, f.W_TORQUE, i, width) - bias) * get(work, f.W_INVERSE, i, width)
        put(work, f.W_U, i, u, width)
        torque = fma(get(work, f.W_D, i, width), u, bias)
        fx, fy = (
            fma(get(work, f.W_DX, i, width), u, fx),
            fma(get(work, f.W_DY, i, width), u, fy),
        )
    put(base, 0, f.B_FX, fx + get(base, 0, f.B_REACT_FX, width), width)
    put(base, 0, f.B_FY, fy + get(base, 0, f.B_REACT_FY, width), width)
    put(base, 0, f.B_MOMENT, torque + get(base, 0, f.B_REACT_MOMENT, width), width)


@inlined
def _fold_one(segments, work, i, touched, timestep, only, inertia, bias, width):
    """Segment ``i`` of ``fold``: inertia and bias that the next one is shown, what is left for the
    hinge, and for ``refold``.

    ``inertia`` and ``bias`` are what the distal part shows at its own hinge. Contact acts in the
    lanes where ``only`` is 1.
    """
    (d, ux, uy, a, b, c), (torque, fx, fy) = inertia, bias
    ex, ey = get(work, f.W_EX, i, width), get(work, f.W_EY, i, width)
    own_x, own_y = get(work, f.W_FX, i, width), get(work, f.W_FY, i, width)
    mass = get(segments, f.C_MASS, i, width)
    half, twice_x, twice_y = 0.5 * mass, ex + ex, ey + ey
    wx, wy = fma(a, ey, fma(-b, ex, ux)), fma(b, ey, fma(-c, ex, uy))
    far = fma(c, ex * ex, ux * twice_y) - fma(b, twice_x * ey, uy * twice_x)
    drag, own = (
        timestep * get(segments, f.C_DAMPING, i, width),
        get(segments, f.C_INERTIA, i, width),
    )
    near, damped = fma(a, ey * ey, own + d), fma(a, ey * ey, (own + drag) + d)
    ux, uy = fma(half, ey, wx), fma(-half, ex, wy)
    rest = fma(ey, fma(-0.5, own_x, fx), fma(-ex, fma(-0.5, own_y, fy), torque))
    a, c, fx, fy = a + mass, c + mass, fx - own_x, fy - own_y
    if touched:
        near, damped = (
            near + only * get(work, f.W_K00, i, width),
            damped + only * get(work, f.W_K00, i, width),
        )
        ux, uy = (
            ux + only * get(work, f.W_K01, i, width),
            uy + only * get(work, f.W_K02, i, width),
        )
        a, b = a + only * get(work, f.W_K11, i, width), b + only * get(work, f.W_K12, i, width)
        c, rest = (
            c + only * get(work, f.W_K22, i, width),
            rest + only * get(work, f.W_B0, i, width),
        )
        fx, fy = (
            fx + only * get(work, f.W_B1, i, width),
            fy + only * get(work, f.W_B2, i, width),
        )
    d, inverse = near + far, 1.0 / (damped + far)
    u = (get(work, f.W_TORQUE, i, width) - rest) * inverse
    found, kept = (ux * inverse, uy * inverse, drag * inverse, u), (d, ux, uy, inverse)
    bias = (fma(d, u, rest), fma(ux, u, fx), fma(uy, u, fy))
    a, b, c = (
        fma(-(ux * ux), inverse, a),
        fma(-(ux * uy), inverse, b),
        fma(-(uy * uy), inverse, c),
    )
    return (
        ((d * drag) * inverse, (ux * drag) * inverse, (uy * drag) * inverse, a, b, c),
        bias,
        found,
        kept,
    )


@inlined
def _react(base, inertia, width):
    """What the base's acceleration adds to its reaction: force and moment."""
    d, ux, uy, a, b, c = inertia
    alpha, ax, ay = (
        get(base, 0, f.B_ALPHA, width),
        get(base, 0, f.B_AX, width),
        get(base, 0, f.B_AY, width),
    )
    fx, fy = fma(a, ax, fma(b, ay, ux * alpha)), fma(b, ax, fma(c, ay, uy * alpha))
    return fx, fy, fma(d, alpha, fma(ux, ax, uy * ay))


@inlined
def _put_four(work, at, i, values, width):
    """Write rows ``at`` to ``at`` + 3 of segment ``i``."""
    put(work, at, i, values[0], width)
    put(work, at + 1, i, values[1], width)
    put(work, at + 2, i, values[2], width)
    put(work, at + 3, i, values[3], width)


@inlined
def _pick_four(values, lane):
    """One lane of the first four."""
    return (
        pick(values[0], lane),
        pick(values[1], lane),
        pick(values[2], lane),
        pick(values[3], lane),
    )


@nested
def unfold(work, base, loaded, last, width):
    """The outward sweep: accelerations of hinges 0…``last``; the segments that are ``loaded`` are
    told theirs.
    """
    alpha, ax, ay = (
        get(base, 0, f.B_ALPHA, width),
        get(base, 0, f.B_AX, width),
        get(base, 0, f.B_AY, width),
    )
    for i in range(last + 1):
        before, alpha = alpha, _turn(work, i, alpha, ax, ay, width)
        put(work, f.W_QDD, i, alpha - before, width)
        if loaded[i]:
            put(work, f.W_ALPHA, i, alpha, width)
            put(work, f.W_AX, i, ax, width)
            put(work, f.W_AY, i, ay, width)
        ax, ay = (
            fma(alpha, get(work, f.W_EY, i, width), ax),
            fma(-alpha, get(work, f.W_EX, i, width), ay),
        )


@nested
def _turn(work, i, alpha, ax, ay, width):
    """A segment's turning acceleration, of that of the segment before and its hinge's
    acceleration.
    """
    gx, gy, share = (
        get(work, f.W_UX, i, width),
        get(work, f.W_UY, i, width),
        get(work, f.W_SHARE, i, width),
    )
    return fma(-gy, ay, fma(-gx, ax, fma(share, alpha, get(work, f.W_U, i, width))))
