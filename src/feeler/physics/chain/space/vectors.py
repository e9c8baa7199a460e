"""Vectors of lanes: three numbers each."""

from feeler.compiled import inlined
from feeler.physics.chain.lanes import fma, get, put


@inlined
def get3(t, k, i, width):
    """A vector."""
    return get(t, k, i, width), get(t, k + 1, i, width), get(t, k + 2, i, width)


@inlined
def put3(t, k, i, v, width):
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
def get_base(base, k, width):
    """A vector of the base."""
    return get(base, 0, k, width), get(base, 0, k + 1, width), get(base, 0, k + 2, width)


@inlined
def put_base(base, k, v, width):
    """Write a vector of the base."""
    for axis in range(3):
        put(base, 0, k + axis, v[axis], width)
