"""The functions of ``feeler.physics.chain.lanes`` in plain Python, for ``NUMBA_DISABLE_JIT=1``: a
number with lanes is an array with one entry per lane. Slow, and the same bits.
"""

import ctypes
import math
from ctypes.util import find_library

import numpy as np


def _get(table, i, j, width):
    """All lanes of ``table[i, j]``; a table (row, column) holds one number for every lane."""
    return np.full(len(width), table[i, j]) if table.ndim == 2 else table[i, j].copy()


def _put(table, i, j, value, width):
    """Write all lanes of ``table[i, j]``."""
    table[i, j] = value


def _spread(value, width):
    """A plain float in every lane."""
    return np.full(len(width), value)


def _beside(values):
    """A tuple of numbers of one lane as one number with as many lanes."""
    return np.array([np.ravel(value)[0] for value in values])


def _everywhere(mask):
    """Whether ``mask`` holds in all lanes."""
    return bool(np.all(mask))


def _pick(value, lane):
    """One of several lanes, as a number of one lane."""
    return value[lane : lane + 1]


def _choose(mask, yes, no):
    """``yes`` in the lanes where ``mask`` holds, else ``no``."""
    return np.where(mask, yes, no)


def _smaller(a, b):
    """The smaller of two, the first where they cannot be compared."""
    return np.where(np.less(b, a), b, a)


def _floor(value):
    """Largest whole number not above."""
    return np.floor(value)


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
    "get": _get,
    "put": _put,
    "spread": _spread,
    "beside": _beside,
    "everywhere": _everywhere,
    "pick": _pick,
    "choose": _choose,
    "smaller": _smaller,
    "floor": _floor,
    "fma": _fma,
}
"""What takes the place of each function of ``lanes``."""
