"""Sweeps of the chain in space: vectors of lanes, the base, outwards, inwards, outwards again."""

from feeler.compiled import inlined, lean, nested
from feeler.physics.chain import fields as f
from feeler.physics.chain.lanes import fma, get, put, sincos, spread

# Vectors of lanes: three numbers each.


@inlined
def _get3(t, k, i, width):
    """A vector."""
    return get(t, k, i, width), get(t, k + 1, i, width), get(t, k + 2, i, width)


@inlined
def _put3(t, k, i, v, width):
    """Write a vector."""
    put(t, k, i, v[0], width)
    put(t, k + 1, i, v[1], width)
    put(t, k + 2, i, v[2], width)


@inlined
def cross(a, b):
    """a × b."""
    return (
        fma(a[1], b[2], -(a[2] * b[1])),
        fma(a[2], b[0], -(a[0] * b[2])),
        fma(a[0], b[1], -(a[1] * b[0])),
    )


@inlined
def dot(a, b):
    """a · b."""
    return fma(a[0], b[0], fma(a[1], b[1], a[2] * b[2]))


@inlined
def join(k, a, b):
    """k a + b."""
    return fma(k, a[0], b[0]), fma(k, a[1], b[1]), fma(k, a[2], b[2])


@inlined
def add(a, b):
    """a + b."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@inlined
def scale(k, a):
    """k a."""
    return k * a[0], k * a[1], k * a[2]


@inlined
def _get_base(base, k, width):
    """A vector of the base."""
    return get(base, 0, k, width), get(base, 0, k + 1, width), get(base, 0, k + 2, width)


@inlined
def _put_base(base, k, v, width):
    """Write a vector of the base."""
    for axis in range(3):
        put(base, 0, k + axis, v[axis], width)


# The base in the sweeps: its reaction, and a follicle, in which hinge 1 slides along the base's
# three axes against springs and dampers.


@inlined
def _push_root(base, soft, width):
    """Turn and acceleration of hinge 1, velocity products left out: the base's, and what a follicle
    gives.
    """
    alpha, push = _get_base(base, f.BASE_ALPHA, width), _get_base(base, f.BASE_A, width)
    if len(soft):
        push = add(push, cross(alpha, _get_base(base, f.GIVE_ALONG, width)))
        for k in range(3):
            turn = dot(_get_base(base, f.GIVE_GAIN + 6 * k, width), alpha)
            shift = dot(_get_base(base, f.GIVE_GAIN + 6 * k + 3, width), push)
            own = get(base, 0, f.GIVE_LEFT + k, width) - (turn + shift)
            put(base, 0, f.GIVE_OWN + k, own, width)
            push = join(own, _get_base(base, f.GIVE_AXIS + 3 * k, width), push)
    return alpha, push


@inlined
def _give_way(base, soft, timestep, width):
    """One Euler step of a follicle, and where hinge 1 then is; the velocity products of its
    acceleration, with that of gravity.
    """
    carried = scale(-1.0, _get_base(base, f.BASE_GRAVITY, width))
    place, rate = _get_base(base, f.BASE_PLACE, width), _get_base(base, f.BASE_V, width)
    if len(soft):
        zero = spread(0.0, width)
        along, slide = (zero, zero, zero), (zero, zero, zero)
        for k in range(3):
            own = get(base, 0, f.GIVE_OWN + k, width)
            speed = fma(timestep, own, get(base, 0, f.GIVE_RATE + k, width))
            given = fma(timestep, speed, get(base, 0, f.GIVE + k, width))
            drag = get(base, 0, f.GIVE_DAMP + k, width) * speed
            force = fma(-get(base, 0, f.GIVE_STIFF + k, width), given, -drag)
            put(base, 0, f.GIVE_RATE + k, speed, width)
            put(base, 0, f.GIVE + k, given, width)
            put(base, 0, f.GIVE_FORCE + k, force, width)
            axis = _get_base(base, f.BASE_AXES + 3 * k, width)
            _put_base(base, f.GIVE_AXIS + 3 * k, axis, width)
            along, slide = join(given, axis, along), join(speed, axis, slide)
        _put_base(base, f.GIVE_ALONG, along, width)
        omega = _get_base(base, f.BASE_OMEGA, width)
        swept = cross(omega, along)
        carried = add(carried, cross(omega, join(2.0, slide, swept)))
        place, rate = add(place, along), add(rate, add(swept, slide))
    _put_base(base, f.ROOT, place, width)
    _put_base(base, f.ROOT_V, rate, width)
    return carried


@inlined
def _fold_base(base, soft, timestep, whole, width):
    """Take a follicle's slides out of the articulated wrench, and read the base's reaction."""
    alpha, push = _get_base(base, f.BASE_ALPHA, width), _get_base(base, f.BASE_A, width)
    if len(soft):
        push = add(push, cross(alpha, _get_base(base, f.GIVE_ALONG, width)))
        for k in (2, 1, 0):
            whole = _fold_slide(base, k, timestep, whole, width)
    _react(base, whole, alpha, push, width)


@inlined
def _fold_slide(base, k, timestep, whole, width):
    h, m, a = whole[1], whole[2], _get_base(base, f.GIVE_AXIS + 3 * k, width)
    ut = (
        dot((h[0], h[1], h[2]), a),
        dot((h[3], h[4], h[5]), a),
        dot((h[6], h[7], h[8]), a),
    )
    uf = (
        dot((m[0], m[1], m[2]), a),
        dot((m[1], m[3], m[4]), a),
        dot((m[2], m[4], m[5]), a),
    )
    held = get(base, 0, f.GIVE_HELD, width)
    drag = fma(timestep, get(base, 0, f.GIVE_DAMP + k, width), held)
    inverse = 1.0 / (dot(a, uf) + drag)
    left = get(base, 0, f.GIVE_FORCE + k, width) - dot(a, whole[4])
    _put_base(base, f.GIVE_GAIN + 6 * k, scale(inverse, ut), width)
    _put_base(base, f.GIVE_GAIN + 6 * k + 3, scale(inverse, uf), width)
    put(base, 0, f.GIVE_LEFT + k, left * inverse, width)
    return _take_out(whole, ut, uf, inverse, left)


@inlined
def _take_out(whole, ut, uf, inverse, left):
    """The articulated wrench without a joint, of which it keeps ``left`` of u uᵀ/…"""
    inertia, mixed, mass, turn, force = whole
    gt, gf = scale(inverse, ut), scale(inverse, uf)
    inertia = (
        fma(-gt[0], ut[0], inertia[0]),
        fma(-gt[0], ut[1], inertia[1]),
        fma(-gt[0], ut[2], inertia[2]),
        fma(-gt[1], ut[1], inertia[3]),
        fma(-gt[1], ut[2], inertia[4]),
        fma(-gt[2], ut[2], inertia[5]),
    )
    mixed = (
        fma(-gt[0], uf[0], mixed[0]),
        fma(-gt[0], uf[1], mixed[1]),
        fma(-gt[0], uf[2], mixed[2]),
        fma(-gt[1], uf[0], mixed[3]),
        fma(-gt[1], uf[1], mixed[4]),
        fma(-gt[1], uf[2], mixed[5]),
        fma(-gt[2], uf[0], mixed[6]),
        fma(-gt[2], uf[1], mixed[7]),
        fma(-gt[2], uf[2], mixed[8]),
    )
    mass = (
        fma(-gf[0], uf[0], mass[0]),
        fma(-gf[0], uf[1], mass[1]),
        fma(-gf[0], uf[2], mass[2]),
        fma(-gf[1], uf[1], mass[3]),
        fma(-gf[1], uf[2], mass[4]),
        fma(-gf[2], uf[2], mass[5]),
    )
    return inertia, mixed, mass, join(left, gt, turn), join(left, gf, force)


@inlined
def _react(base, whole, al, a, width):
    """What the base does to the antenna: moment and force."""
    inertia, mixed, mass, turn, force = whole
    m, h = mass, mixed
    moment = (
        dot((inertia[0], inertia[1], inertia[2]), al) + dot((h[0], h[1], h[2]), a),
        dot((inertia[1], inertia[3], inertia[4]), al) + dot((h[3], h[4], h[5]), a),
        dot((inertia[2], inertia[4], inertia[5]), al) + dot((h[6], h[7], h[8]), a),
    )
    push = (
        dot((h[0], h[3], h[6]), al) + dot((m[0], m[1], m[2]), a),
        dot((h[1], h[4], h[7]), al) + dot((m[1], m[3], m[4]), a),
        dot((h[2], h[5], h[8]), al) + dot((m[2], m[4], m[5]), a),
    )
    for k in range(3):
        put(base, 0, f.BASE_MOMENT + k, turn[k] + moment[k], width)
        put(base, 0, f.BASE_FORCE + k, force[k] + push[k], width)


# The three sweeps of the chain in space: outwards (move), inwards (fold), outwards again
# (unfold).
#
# Featherstone's articulated bodies in the world's axes, each segment about its own hinge: what
# the distal part shows there is a wrench (t, f) = [I H; Hᵀ M] (α, a) + (bias), with I and M
# symmetric. A hinge of axis s takes from it u uᵀ/(sᵀ I s + h c), u = (I s, Hᵀ s). An angle
# turns as :mod:`feeler.antenna.segments` says. All numbers are lanes.


@inlined
def _accelerate(work, i, p, alpha, push, width):
    """A hinge's own acceleration, of those of what carries it."""
    turn, shift = (
        _get3(work, f.GAIN + 6 * p, i, width),
        _get3(work, f.GAIN + 6 * p + 3, i, width),
    )
    return get(work, f.LEFT + p, i, width) - (dot(turn, alpha) + dot(shift, push))


@inlined
def _step_hinge(work, i, p, timestep, alpha, push, width):
    """One Euler step of a hinge: its angle and rate, and the acceleration of what it carries."""
    own = _accelerate(work, i, p, alpha, push, width)
    rate = fma(timestep, own, get(work, f.RATE + p, i, width))
    angle = fma(timestep, rate, get(work, f.ANGLE + p, i, width))
    put(work, f.RATE + p, i, rate, width)
    put(work, f.ANGLE + p, i, angle, width)
    return angle, rate, join(own, _get3(work, f.AXIS + 3 * p, i, width), alpha)


@inlined
def _load_hinge(constants, work, i, p, angle, rate, axis, width):
    """Note a hinge's axis and passive torque."""
    _put3(work, f.AXIS + 3 * p, i, axis, width)
    stretch = get(constants, f.C_SLACK + p, i, width) - angle
    drag = get(constants, f.C_DAMP + p, i, width) * rate
    torque = fma(get(constants, f.C_STIFF + p, i, width), stretch, -drag)
    put(work, f.TORQUE + p, i, torque, width)


@lean
def move_in_space(constants, work, base, kind, timestep, width):
    """One Euler step of every hinge, v += h q̈, q += h v, and all that follows from where it then
    is. A ``timestep`` of 0 moves nothing and computes what follows.
    """
    planes, soft, flows = kind
    alpha, push = _push_root(base, soft, width)
    carried = _give_way(base, soft, timestep, width)
    x, y = _get_base(base, f.BASE_AXES, width), _get_base(base, f.BASE_AXES + 3, width)
    z, omega = _get_base(base, f.BASE_AXES + 6, width), _get_base(base, f.BASE_OMEGA, width)
    zero = spread(0.0, width)
    product = zero, zero, zero
    stream = join(-1.0, _get_base(base, f.FLOW_V, width), _get_base(base, f.ROOT_V, width))
    for i in range(work.shape[1]):
        along = _get3(work, f.SEG_ALONG, i, width)
        first, first_rate, alpha = _step_hinge(work, i, 0, timestep, alpha, push, width)
        second, second_rate, alpha = _step_hinge(work, i, 1, timestep, alpha, push, width)
        third, third_rate = zero, zero
        if len(planes) == 3:
            third, third_rate, alpha = _step_hinge(work, i, 2, timestep, alpha, push, width)
        push = add(push, cross(alpha, along))
        sine, cosine = sincos(first)
        axis = scale(-1.0, z)
        _load_hinge(constants, work, i, 0, first, first_rate, axis, width)
        x, y = join(-sine, y, scale(cosine, x)), join(sine, x, scale(cosine, y))
        product, omega = _spin(first_rate, axis, product, omega)
        sine, cosine = sincos(second)
        _load_hinge(constants, work, i, 1, second, second_rate, x, width)
        y, z = join(sine, z, scale(cosine, y)), join(-sine, y, scale(cosine, z))
        product, omega = _spin(second_rate, x, product, omega)
        if len(planes) == 3:
            sine, cosine = sincos(third)
            _load_hinge(constants, work, i, 2, third, third_rate, y, width)
            x, z = join(-sine, z, scale(cosine, x)), join(sine, x, scale(cosine, z))
            product, omega = _spin(third_rate, y, product, omega)
        along = scale(get(constants, f.C_LENGTH, i, width), y)
        _put3(work, f.SEG_ALONG, i, along, width)
        _put3(work, f.OMEGA, i, omega, width)
        ahead = add(cross(product, along), cross(omega, cross(omega, along)))
        share, mass = get(constants, f.C_SHARE, i, width), get(constants, f.C_MASS, i, width)
        force = scale(-mass, join(share, ahead, carried))
        carried = add(carried, ahead)
        across, axial = (
            get(constants, f.C_ACROSS, i, width),
            get(constants, f.C_AXIAL, i, width),
        )
        turning = join(axial * dot(y, product), y, scale(across, product))
        spin = join(axial * dot(y, omega), y, scale(across, omega))
        own = scale(-1.0, add(turning, cross(omega, spin)))
        own = join(share, cross(along, force), own)
        if len(flows):
            swept = cross(omega, along)
            whole = get(constants, f.C_FLOW, i, width)
            more = get(constants, f.C_FLOW + 1, i, width) * dot(y, stream)
            lever = cross(along, join(2.0 / 3.0, swept, stream))
            own = join(-0.5 * whole, lever, own)
            force = join(-more, y, join(-whole, join(0.5, swept, stream), force))
            stream = add(stream, swept)
        _put3(work, f.MOMENT, i, own, width)
        _put3(work, f.FORCE, i, force, width)


@inlined
def _spin(rate, axis, product, omega):
    """Velocity-product acceleration and turn rate beyond a hinge."""
    return join(rate, cross(omega, axis), product), join(rate, axis, omega)


@inlined
def _fold_hinge(work, i, p, drag, whole, width):
    """Take one hinge out of the articulated wrench (I: xx xy xz yy yz zz, H by rows, M, bias)."""
    inertia, mixed = whole[0], whole[1]
    a = _get3(work, f.AXIS + 3 * p, i, width)
    ut = (
        fma(inertia[0], a[0], fma(inertia[1], a[1], inertia[2] * a[2])),
        fma(inertia[1], a[0], fma(inertia[3], a[1], inertia[4] * a[2])),
        fma(inertia[2], a[0], fma(inertia[4], a[1], inertia[5] * a[2])),
    )
    uf = (
        fma(mixed[0], a[0], fma(mixed[3], a[1], mixed[6] * a[2])),
        fma(mixed[1], a[0], fma(mixed[4], a[1], mixed[7] * a[2])),
        fma(mixed[2], a[0], fma(mixed[5], a[1], mixed[8] * a[2])),
    )
    inverse = 1.0 / (dot(a, ut) + drag)
    left = get(work, f.TORQUE + p, i, width) - dot(a, whole[3])
    _put3(work, f.GAIN + 6 * p, i, scale(inverse, ut), width)
    _put3(work, f.GAIN + 6 * p + 3, i, scale(inverse, uf), width)
    put(work, f.LEFT + p, i, left * inverse, width)
    return _take_out(whole, ut, uf, inverse, left)


@inlined
def _carry(constants, work, i, flows, timestep, whole, width):
    """The articulated wrench at the hinge before, with the segment's own inertia."""
    inertia, mixed, mass, turn, force = whole
    r = _get3(work, f.SEG_ALONG, i, width)
    c0 = cross(r, (mass[0], mass[1], mass[2]))
    c1 = cross(r, (mass[1], mass[3], mass[4]))
    c2 = cross(r, (mass[2], mass[4], mass[5]))
    k0, k1, k2 = (
        (mixed[0] + c0[0], mixed[1] + c1[0], mixed[2] + c2[0]),
        (mixed[3] + c0[1], mixed[4] + c1[1], mixed[5] + c2[1]),
        (mixed[6] + c0[2], mixed[7] + c1[2], mixed[8] + c2[2]),
    )
    a0, a1, a2 = cross(r, k0), cross(r, k1), cross(r, k2)
    h0 = cross(r, (mixed[0], mixed[1], mixed[2]))
    h1 = cross(r, (mixed[3], mixed[4], mixed[5]))
    h2 = cross(r, (mixed[6], mixed[7], mixed[8]))
    own, excess = get(constants, f.C_HINGE, i, width), get(constants, f.C_EXCESS, i, width)
    lever, own_mass = get(constants, f.C_LEVER, i, width), get(constants, f.C_MASS, i, width)
    if len(flows):  # implicit drag is as a mass spread evenly, timestep times the drag
        length, drag = get(constants, f.C_LENGTH, i, width), get(constants, f.C_FLOW, i, width)
        drag = timestep * drag
        own, excess = own + drag * length * length / 3.0, excess - drag / 3.0
        lever, own_mass = lever + 0.5 * drag, own_mass + drag
    e = scale(excess, r)
    inertia = (
        inertia[0] + a0[0] + h0[0] + fma(e[0], r[0], own),
        inertia[1] + a0[1] + h1[0] + e[0] * r[1],
        inertia[2] + a0[2] + h2[0] + e[0] * r[2],
        inertia[3] + a1[1] + h1[1] + fma(e[1], r[1], own),
        inertia[4] + a1[2] + h2[1] + e[1] * r[2],
        inertia[5] + a2[2] + h2[2] + fma(e[2], r[2], own),
    )
    mixed = (
        k0[0],
        fma(-lever, r[2], k0[1]),
        fma(lever, r[1], k0[2]),
        fma(lever, r[2], k1[0]),
        k1[1],
        fma(-lever, r[0], k1[2]),
        fma(-lever, r[1], k2[0]),
        fma(lever, r[0], k2[1]),
        k2[2],
    )
    mass = (
        mass[0] + own_mass,
        mass[1],
        mass[2],
        mass[3] + own_mass,
        mass[4],
        mass[5] + own_mass,
    )
    if len(flows):
        length, more = (
            get(constants, f.C_LENGTH, i, width),
            get(constants, f.C_FLOW + 1, i, width),
        )
        e = scale(timestep * more / (length * length), r)
        mass = (
            fma(e[0], r[0], mass[0]),
            fma(e[0], r[1], mass[1]),
            fma(e[0], r[2], mass[2]),
            fma(e[1], r[1], mass[3]),
            fma(e[1], r[2], mass[4]),
            fma(e[2], r[2], mass[5]),
        )
    turn = join(-1.0, _get3(work, f.MOMENT, i, width), add(turn, cross(r, force)))
    return inertia, mixed, mass, turn, join(-1.0, _get3(work, f.FORCE, i, width), force)


@inlined
def _get6(work, k, i, width):
    return (
        get(work, k, i, width),
        get(work, k + 1, i, width),
        get(work, k + 2, i, width),
        get(work, k + 3, i, width),
        get(work, k + 4, i, width),
        get(work, k + 5, i, width),
    )


@inlined
def _touch(work, i, whole, width):
    """Add what contacts put into the segment's columns."""
    inertia, mixed, mass, turn, force = whole
    a, c = _get6(work, f.ADD, i, width), _get6(work, f.ADD + 15, i, width)
    b, r = _get6(work, f.ADD + 6, i, width), _get3(work, f.ADD + 12, i, width)
    inertia = (
        inertia[0] + a[0],
        inertia[1] + a[1],
        inertia[2] + a[2],
        inertia[3] + a[3],
        inertia[4] + a[4],
        inertia[5] + a[5],
    )
    mixed = (
        mixed[0] + b[0],
        mixed[1] + b[1],
        mixed[2] + b[2],
        mixed[3] + b[3],
        mixed[4] + b[4],
        mixed[5] + b[5],
        mixed[6] + r[0],
        mixed[7] + r[1],
        mixed[8] + r[2],
    )
    mass = (
        mass[0] + c[0],
        mass[1] + c[1],
        mass[2] + c[2],
        mass[3] + c[3],
        mass[4] + c[4],
        mass[5] + c[5],
    )
    turn = add(turn, _get3(work, f.BIAS, i, width))
    return inertia, mixed, mass, turn, add(force, _get3(work, f.BIAS + 3, i, width))


@nested
def fold_in_space(constants, work, base, loaded, kind, timestep, width):
    """The inward sweep of (M + hC + JᵀDJ) q̈ = …, as in the plane; the base's reaction."""
    planes, soft, flows = kind
    o = spread(0.0, width)
    six, nine, three = (o, o, o, o, o, o), (o, o, o, o, o, o, o, o, o), (o, o, o)
    whole = six, nine, six, three, three
    for i in range(work.shape[1] - 1, -1, -1):
        whole = _carry(constants, work, i, flows, timestep, whole, width)
        if loaded[i]:
            whole = _touch(work, i, whole, width)
        if len(planes) == 3:
            drag = timestep * get(constants, f.C_DAMP + 2, i, width)
            whole = _fold_hinge(work, i, 2, drag, whole, width)
        drag = timestep * get(constants, f.C_DAMP + 1, i, width)
        whole = _fold_hinge(work, i, 1, drag, whole, width)
        drag = timestep * get(constants, f.C_DAMP, i, width)
        whole = _fold_hinge(work, i, 0, drag, whole, width)
    _fold_base(base, soft, timestep, whole, width)


@nested
def unfold_in_space(work, base, loaded, last, kind, width):
    """The outward sweep: segments 0…``last`` that are ``loaded`` are told their accelerations."""
    planes, soft, _ = kind
    alpha, push = _push_root(base, soft, width)
    for i in range(last + 1):
        for p in range(len(planes)):
            own = _accelerate(work, i, p, alpha, push, width)
            alpha = join(own, _get3(work, f.AXIS + 3 * p, i, width), alpha)
        if loaded[i]:
            _put3(work, f.ALPHA, i, alpha, width)
            _put3(work, f.PUSH, i, push, width)
        push = add(push, cross(alpha, _get3(work, f.SEG_ALONG, i, width)))


@nested
def locate_in_space(work, base, last, width):
    """Places and velocities of hinges 0…``last`` in the world; only contact needs them."""
    place, velocity = _get_base(base, f.ROOT, width), _get_base(base, f.ROOT_V, width)
    for i in range(last + 1):
        _put3(work, f.SEG_PLACE, i, place, width)
        _put3(work, f.VELOCITY, i, velocity, width)
        along = _get3(work, f.SEG_ALONG, i, width)
        place = add(place, along)
        velocity = add(velocity, cross(_get3(work, f.OMEGA, i, width), along))
