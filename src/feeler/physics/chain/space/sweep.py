"""The three sweeps of the chain in space: outwards (move), inwards (fold), outwards again (unfold).

Featherstone's articulated bodies in the world's axes, each segment about its own hinge: what the
distal part shows there is a wrench (t, f) = [I H; Hᵀ M] (α, a) + (bias), with I and M symmetric. A
hinge of axis s takes from it u uᵀ/(sᵀ I s + h c), u = (I s, Hᵀ s). An angle turns as
:mod:`feeler.antenna.space` says. All numbers are lanes.
"""

from feeler.compiled import inlined, lean
from feeler.physics.chain import fields as f
from feeler.physics.chain.lanes import fma, get, put, sincos, spread
from feeler.physics.chain.space import fields as s
from feeler.physics.chain.space.base import fold_base, give_way, push_root, take_out
from feeler.physics.chain.space.vectors import (
    add,
    cross,
    dot,
    get3,
    get_base,
    join,
    put3,
    scale,
)


@inlined
def _accelerate(work, i, p, alpha, push, width):
    """A hinge's own acceleration, of those of what carries it."""
    turn, shift = get3(work, s.GAIN + 6 * p, i, width), get3(work, s.GAIN + 6 * p + 3, i, width)
    return get(work, s.LEFT + p, i, width) - (dot(turn, alpha) + dot(shift, push))


@inlined
def _step_hinge(work, i, p, timestep, alpha, push, width):
    """One Euler step of a hinge: its angle and rate, and the acceleration of what it carries."""
    own = _accelerate(work, i, p, alpha, push, width)
    rate = fma(timestep, own, get(work, s.RATE + p, i, width))
    angle = fma(timestep, rate, get(work, s.ANGLE + p, i, width))
    put(work, s.RATE + p, i, rate, width)
    put(work, s.ANGLE + p, i, angle, width)
    return angle, rate, join(own, get3(work, s.AXIS + 3 * p, i, width), alpha)


@inlined
def _load_hinge(constants, work, i, p, angle, rate, axis, width):
    """Note a hinge's axis and passive torque."""
    put3(work, s.AXIS + 3 * p, i, axis, width)
    stretch = get(constants, s.C_SLACK + p, i, width) - angle
    drag = get(constants, s.C_DAMP + p, i, width) * rate
    torque = fma(get(constants, s.C_STIFF + p, i, width), stretch, -drag)
    put(work, s.TORQUE + p, i, torque, width)


@lean
def move_in_space(constants, work, base, kind, timestep, width):
    """One Euler step of every hinge, v += h q̈, q += h v, and all that follows from where it then
    is. A ``timestep`` of 0 moves nothing and computes what follows.
    """
    planes, soft, flows = kind
    alpha, push = push_root(base, soft, width)
    carried = give_way(base, soft, timestep, width)
    x, y = get_base(base, s.BASE_AXES, width), get_base(base, s.BASE_AXES + 3, width)
    z, omega = get_base(base, s.BASE_AXES + 6, width), get_base(base, s.BASE_OMEGA, width)
    zero = spread(0.0, width)
    product = zero, zero, zero
    stream = join(-1.0, get_base(base, s.FLOW_V, width), get_base(base, s.ROOT_V, width))
    for i in range(work.shape[1]):
        along = get3(work, s.SEG_ALONG, i, width)
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
        put3(work, s.SEG_ALONG, i, along, width)
        put3(work, s.OMEGA, i, omega, width)
        ahead = add(cross(product, along), cross(omega, cross(omega, along)))
        share, mass = get(constants, s.C_SHARE, i, width), get(constants, f.C_MASS, i, width)
        force = scale(-mass, join(share, ahead, carried))
        carried = add(carried, ahead)
        across, axial = (
            get(constants, s.C_ACROSS, i, width),
            get(constants, s.C_AXIAL, i, width),
        )
        turning = join(axial * dot(y, product), y, scale(across, product))
        spin = join(axial * dot(y, omega), y, scale(across, omega))
        own = scale(-1.0, add(turning, cross(omega, spin)))
        own = join(share, cross(along, force), own)
        if len(flows):
            swept = cross(omega, along)
            whole = get(constants, s.C_FLOW, i, width)
            more = get(constants, s.C_FLOW + 1, i, width) * dot(y, stream)
            lever = cross(along, join(2.0 / 3.0, swept, stream))
            own = join(-0.5 * whole, lever, own)
            force = join(-more, y, join(-whole, join(0.5, swept, stream), force))
            stream = add(stream, swept)
        put3(work, s.MOMENT, i, own, width)
        put3(work, s.FORCE, i, force, width)


@inlined
def _spin(rate, axis, product, omega):
    """Velocity-product acceleration and turn rate beyond a hinge."""
    return join(rate, cross(omega, axis), product), join(rate, axis, omega)


@inlined
def _fold_hinge(work, i, p, drag, whole, width):
    """Take one hinge out of the articulated wrench (I: xx xy xz yy yz zz, H by rows, M, bias)."""
    inertia, mixed = whole[0], whole[1]
    a = get3(work, s.AXIS + 3 * p, i, width)
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
    left = get(work, s.TORQUE + p, i, width) - dot(a, whole[3])
    put3(work, s.GAIN + 6 * p, i, scale(inverse, ut), width)
    put3(work, s.GAIN + 6 * p + 3, i, scale(inverse, uf), width)
    put(work, s.LEFT + p, i, left * inverse, width)
    return take_out(whole, ut, uf, inverse, left)


@inlined
def _carry(constants, work, i, flows, timestep, whole, width):
    """The articulated wrench at the hinge before, with the segment's own inertia."""
    inertia, mixed, mass, turn, force = whole
    r = get3(work, s.SEG_ALONG, i, width)
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
    own, excess = get(constants, s.C_HINGE, i, width), get(constants, s.C_EXCESS, i, width)
    lever, own_mass = get(constants, s.C_LEVER, i, width), get(constants, f.C_MASS, i, width)
    if len(flows):  # implicit drag is as a mass spread evenly, timestep times the drag
        length, drag = get(constants, f.C_LENGTH, i, width), get(constants, s.C_FLOW, i, width)
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
            get(constants, s.C_FLOW + 1, i, width),
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
    turn = join(-1.0, get3(work, s.MOMENT, i, width), add(turn, cross(r, force)))
    return inertia, mixed, mass, turn, join(-1.0, get3(work, s.FORCE, i, width), force)


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
    a, c = _get6(work, s.ADD, i, width), _get6(work, s.ADD + 15, i, width)
    b, r = _get6(work, s.ADD + 6, i, width), get3(work, s.ADD + 12, i, width)
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
    turn = add(turn, get3(work, s.BIAS, i, width))
    return inertia, mixed, mass, turn, add(force, get3(work, s.BIAS + 3, i, width))


@lean
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
            drag = timestep * get(constants, s.C_DAMP + 2, i, width)
            whole = _fold_hinge(work, i, 2, drag, whole, width)
        drag = timestep * get(constants, s.C_DAMP + 1, i, width)
        whole = _fold_hinge(work, i, 1, drag, whole, width)
        drag = timestep * get(constants, s.C_DAMP, i, width)
        whole = _fold_hinge(work, i, 0, drag, whole, width)
    fold_base(base, soft, timestep, whole, width)


@lean
def unfold_in_space(work, base, loaded, last, kind, width):
    """The outward sweep: segments 0…``last`` that are ``loaded`` are told their accelerations."""
    planes, soft, _ = kind
    alpha, push = push_root(base, soft, width)
    for i in range(last + 1):
        for p in range(len(planes)):
            own = _accelerate(work, i, p, alpha, push, width)
            alpha = join(own, get3(work, s.AXIS + 3 * p, i, width), alpha)
        if loaded[i]:
            put3(work, s.ALPHA, i, alpha, width)
            put3(work, s.PUSH, i, push, width)
        push = add(push, cross(alpha, get3(work, s.SEG_ALONG, i, width)))


@lean
def locate_in_space(work, base, last, width):
    """Places and velocities of hinges 0…``last`` in the world; only contact needs them."""
    place, velocity = get_base(base, s.ROOT, width), get_base(base, s.ROOT_V, width)
    for i in range(last + 1):
        put3(work, s.SEG_PLACE, i, place, width)
        put3(work, s.VELOCITY, i, velocity, width)
        along = get3(work, s.SEG_ALONG, i, width)
        place = add(place, along)
        velocity = add(velocity, cross(get3(work, s.OMEGA, i, width), along))
