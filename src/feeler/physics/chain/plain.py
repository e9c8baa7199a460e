"""The functions of ``feeler.physics.chain.lanes`` in plain Python, for ``NUMBA_DISABLE_JIT=1``: a
number with lanes is an array with one entry per lane. Slow, and the same bits.
"""

import ctypes
import math
from ctypes.util import find_library

import numpy as np


def _find_fma():
    """a·b + c with one rounding: Python's own from 3.13 on, before that the C library's."""
    if hasattr(math, "fma"):
        return math.fma
    found = ctypes.CDLL(find_library("m") or find_library("ucrtbase") or None).fma
    found.argtypes, found.restype = [ctypes.c_double] * 3, ctypes.c_double
    return found


_fuse = _find_fma()


def _fma(a, b, c):
    """a·b + c with one rounding, lane by lane."""
    triples = zip(*(x.tolist() for x in np.broadcast_arrays(a, b, c)), strict=True)
    return np.array([_fuse(*triple) for triple in triples])


PLAIN = {
    "get": lambda table, i, j, width: table[i, j].copy(),
    "put": lambda table, i, j, value, width: table.__setitem__((i, j), value),
    "spread": lambda value, width: np.full(len(width), value),
    "beside": lambda values: np.array([np.ravel(value)[0] for value in values]),
    "everywhere": lambda mask: bool(np.all(mask)),
    "pick": lambda value, lane: value[lane : lane + 1],
    "choose": np.where,
    "smaller": lambda a, b: np.where(np.less(b, a), b, a),
    "floor": np.floor,
    "fma": _fma,
}
"""What takes the place of each function of ``lanes``."""
