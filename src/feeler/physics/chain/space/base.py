"""The base in the sweeps: its reaction, and a follicle, in which hinge 1 slides along the base's
three axes against springs and dampers.
"""

from feeler.compiled import inlined
from feeler.physics.chain.lanes import fma, get, put, spread
from feeler.physics.chain.space import fields as s
from feeler.physics.chain.space.vectors import add, cross, dot, get_base, join, put_base, scale


@inlined
def push_root(base, soft, width):
    """Turn and acceleration of hinge 1, velocity products left out: the base's, and what a follicle
    gives.
    """
    alpha, push = get_base(base, s.BASE_ALPHA, width), get_base(base, s.BASE_A, width)
    if len(soft):
        push = add(push, cross(alpha, get_base(base, s.GIVE_ALONG, width)))
        for k in range(3):
            turn = dot(get_base(base, s.GIVE_GAIN + 6 * k, width), alpha)
            shift = dot(get_base(base, s.GIVE_GAIN + 6 * k + 3, width), push)
            own = get(base, 0, s.GIVE_LEFT + k, width) - (turn + shift)
            put(base, 0, s.GIVE_OWN + k, own, width)
            push = join(own, get_base(base, s.GIVE_AXIS + 3 * k, width), push)
    return alpha, push


@inlined
def give_way(base, soft, timestep, width):
    """One Euler step of a follicle, and where hinge 1 then is; the velocity products of its
    acceleration, with that of gravity.
    """
    carried = scale(-1.0, get_base(base, s.BASE_GRAVITY, width))
    place, rate = get_base(base, s.BASE_PLACE, width), get_base(base, s.BASE_V, width)
    if len(soft):
        zero = spread(0.0, width)
        along, slide = (zero, zero, zero), (zero, zero, zero)
        for k in range(3):
            own = get(base, 0, s.GIVE_OWN + k, width)
            speed = fma(timestep, own, get(base, 0, s.GIVE_RATE + k, width))
            given = fma(timestep, speed, get(base, 0, s.GIVE + k, width))
            drag = get(base, 0, s.GIVE_DAMP + k, width) * speed
            force = fma(-get(base, 0, s.GIVE_STIFF + k, width), given, -drag)
            put(base, 0, s.GIVE_RATE + k, speed, width)
            put(base, 0, s.GIVE + k, given, width)
            put(base, 0, s.GIVE_FORCE + k, force, width)
            axis = get_base(base, s.BASE_AXES + 3 * k, width)
            put_base(base, s.GIVE_AXIS + 3 * k, axis, width)
            along, slide = join(given, axis, along), join(speed, axis, slide)
        put_base(base, s.GIVE_ALONG, along, width)
        omega = get_base(base, s.BASE_OMEGA, width)
        swept = cross(omega, along)
        carried = add(carried, cross(omega, join(2.0, slide, swept)))
        place, rate = add(place, along), add(rate, add(swept, slide))
    put_base(base, s.ROOT, place, width)
    put_base(base, s.ROOT_V, rate, width)
    return carried


@inlined
def fold_base(base, soft, timestep, whole, width):
    """Take a follicle's slides out of the articulated wrench, and read the base's reaction."""
    alpha, push = get_base(base, s.BASE_ALPHA, width), get_base(base, s.BASE_A, width)
    if len(soft):
        push = add(push, cross(alpha, get_base(base, s.GIVE_ALONG, width)))
        for k in (2, 1, 0):
            whole = _fold_slide(base, k, timestep, whole, width)
    _react(base, whole, alpha, push, width)


@inlined
def _fold_slide(base, k, timestep, whole, width):
    h, m, a = whole[1], whole[2], get_base(base, s.GIVE_AXIS + 3 * k, width)
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
    held = get(base, 0, s.GIVE_HELD, width)
    drag = fma(timestep, get(base, 0, s.GIVE_DAMP + k, width), held)
    inverse = 1.0 / (dot(a, uf) + drag)
    left = get(base, 0, s.GIVE_FORCE + k, width) - dot(a, whole[4])
    put_base(base, s.GIVE_GAIN + 6 * k, scale(inverse, ut), width)
    put_base(base, s.GIVE_GAIN + 6 * k + 3, scale(inverse, uf), width)
    put(base, 0, s.GIVE_LEFT + k, left * inverse, width)
    return take_out(whole, ut, uf, inverse, left)


@inlined
def take_out(whole, ut, uf, inverse, left):
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
        put(base, 0, s.BASE_MOMENT + k, turn[k] + moment[k], width)
        put(base, 0, s.BASE_FORCE + k, force[k] + push[k], width)
