"""Lanes: several simulations in one SIMD register, as a number type that compiled code can
calculate with.

A table of the engine is an array (row, column, lane). ``get(table, i, j, width)`` reads all lanes
of one entry as one number and ``put`` writes them back; ``width`` is a tuple with as many entries
as there are lanes, because the number of lanes must be part of a type. Arithmetic is lane by lane
and strictly IEEE: a lane's result does not depend on its neighbours nor on their number, and with
one lane the type is a plain double, which goes with any number of lanes.
"""

import ctypes
import math
import operator
from ctypes.util import find_library

import numpy as np
from llvmlite import ir
from numba import config, types
from numba.core import cgutils
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

from feeler.compiled import lean

_DOUBLE, _BIT = ir.DoubleType(), ir.IntType(1)


class _Lanes(types.Type):
    """One double per lane."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Lanes({width})")


class _Mask(types.Type):
    """One truth value per lane."""

    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Mask({width})")


def _wide(scalar: ir.Type, width: int) -> ir.Type:
    return scalar if width == 1 else ir.VectorType(scalar, width)


@register_model(_Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager, kind) -> None:
        super().__init__(manager, kind, _wide(_DOUBLE, kind.width))


@register_model(_Mask)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager, kind) -> None:
        super().__init__(manager, kind, _wide(_BIT, kind.width))


def _spread(builder, value: ir.Value, width: int) -> ir.Value:
    """The same scalar in every lane."""
    if width == 1 or isinstance(value.type, ir.VectorType):
        return value
    whole = _wide(_DOUBLE, width)
    first = builder.insert_element(
        ir.Constant(whole, ir.Undefined), value, ir.Constant(ir.IntType(32), 0)
    )
    zeros = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(first, ir.Constant(whole, ir.Undefined), zeros)


def _widest(args) -> int | None:
    if len(args) == 2 and all(isinstance(a, _Lanes | types.Float) for a in args):
        return max((a.width for a in args if isinstance(a, _Lanes)), default=None)
    return None


def _register(operation, result, emit) -> None:
    @infer_global(operation)
    class _Typing(AbstractTemplate):
        def generic(self, args, kws):
            width = _widest(args)
            return None if width is None or kws else signature(result(width), *args)

    def lower(context, builder, sig, args):
        width = _widest(sig.args)
        return emit(builder, *(_spread(builder, a, width) for a in args))

    for pair in ((_Lanes, _Lanes), (_Lanes, types.Float), (types.Float, _Lanes)):
        lower_builtin(operation, *pair)(lower)


_register(operator.add, _Lanes, lambda b, x, y: b.fadd(x, y))
_register(operator.sub, _Lanes, lambda b, x, y: b.fsub(x, y))
_register(operator.mul, _Lanes, lambda b, x, y: b.fmul(x, y))
_register(operator.truediv, _Lanes, lambda b, x, y: b.fdiv(x, y))
_register(operator.lt, _Mask, lambda b, x, y: b.fcmp_ordered("<", x, y))
_register(operator.gt, _Mask, lambda b, x, y: b.fcmp_ordered(">", x, y))
_register(operator.ge, _Mask, lambda b, x, y: b.fcmp_ordered(">=", x, y))
_register(operator.le, _Mask, lambda b, x, y: b.fcmp_ordered("<=", x, y))


@infer_global(operator.neg)
class _Negate(AbstractTemplate):
    def generic(self, args, kws):
        return (
            signature(args[0], args[0])
            if len(args) == 1 and isinstance(args[0], _Lanes)
            else None
        )


@lower_builtin(operator.neg, _Lanes)
def _lower_negate(context, builder, sig, args):
    return builder.fneg(args[0])


def _combine(operation, emit) -> None:
    @infer_global(operation)
    class _Typing(AbstractTemplate):
        def generic(self, args, kws):
            if len(args) == 2 and isinstance(args[0], _Mask) and args[0] == args[1]:
                return signature(args[0], *args)
            return None

    lower_builtin(operation, _Mask, _Mask)(
        lambda context, builder, sig, args: emit(builder, *args)
    )


_combine(operator.and_, lambda b, x, y: b.and_(x, y))
_combine(operator.or_, lambda b, x, y: b.or_(x, y))


def _call_llvm(builder, name: str, args) -> ir.Value:
    """LLVM's intrinsic of that name on doubles or vectors of doubles."""
    kind = args[0].type
    suffix = f"v{kind.count}f64" if isinstance(kind, ir.VectorType) else "f64"
    shape = ir.FunctionType(kind, [kind] * len(args))
    return builder.call(
        cgutils.get_or_insert_function(builder.module, shape, f"llvm.{name}.{suffix}"), args
    )


def _address(context, builder, kind, array, i, j, width: int):
    """Pointer to lane 0 of row i, column j. A table that is not contiguous holds many lanes column
    after column, or one lane row after row."""
    table = context.make_array(kind)(context, builder, array)
    strides = cgutils.unpack_tuple(builder, table.strides, 3)
    size = ir.Constant(i.type, 8 * width)
    row, column = (strides[0], size) if kind.layout == "C" or width == 1 else (size, strides[1])
    offset = builder.add(builder.mul(i, row), builder.mul(j, column))
    start = builder.ptrtoint(table.data, i.type)
    return builder.inttoptr(builder.add(start, offset), _wide(_DOUBLE, width).as_pointer())


@intrinsic
def get(typing, table, i, j, width):
    """All lanes of ``table[i, j]`` as one number."""
    kind = _Lanes(len(width))

    def emit(context, builder, sig, args):
        i, j = (context.cast(builder, args[k], sig.args[k], types.intp) for k in (1, 2))
        return builder.load(
            _address(context, builder, sig.args[0], args[0], i, j, kind.width), align=8
        )

    return kind(table, i, j, width), emit


@intrinsic
def put(typing, table, i, j, value, width):
    """Write all lanes of ``table[i, j]``; a plain float goes to every lane."""
    lanes = len(width)

    def emit(context, builder, sig, args):
        i, j = (context.cast(builder, args[k], sig.args[k], types.intp) for k in (1, 2))
        where = _address(context, builder, sig.args[0], args[0], i, j, lanes)
        builder.store(_spread(builder, args[3], lanes), where, align=8)
        return context.get_dummy_value()

    return types.void(table, i, j, value, width), emit


@intrinsic
def spread(typing, value, width):
    """A plain float in every lane."""
    kind = _Lanes(len(width))
    return kind(types.float64, width), lambda context, builder, sig, args: _spread(
        builder, args[0], kind.width
    )


@intrinsic
def beside(typing, values):
    """A tuple of plain floats, or of numbers of one lane, as one number with as many lanes."""
    width = len(values)

    def emit(context, builder, sig, args):
        whole = ir.Constant(_wide(_DOUBLE, width), ir.Undefined)
        for lane in range(width):
            value = builder.extract_value(args[0], lane)
            whole = builder.insert_element(whole, value, ir.Constant(ir.IntType(32), lane))
        return whole

    return _Lanes(width)(values), emit


@intrinsic
def everywhere(typing, mask):
    """Whether ``mask`` holds in all lanes."""

    def emit(context, builder, sig, args):
        bits = ir.IntType(mask.width)
        return builder.icmp_unsigned(
            "==", builder.bitcast(args[0], bits), ir.Constant(bits, 2**mask.width - 1)
        )

    return types.boolean(mask), emit


@intrinsic
def pick(typing, value, lane):
    """One of several lanes, as a number of one lane."""
    return _Lanes(1)(value, lane), lambda context, builder, sig, args: builder.extract_element(
        *args
    )


@intrinsic
def choose(typing, mask, yes, no):
    """``yes`` in the lanes where ``mask`` holds, else ``no``."""
    kind = _Lanes(mask.width)

    def emit(context, builder, sig, args):
        yes, no = (_spread(builder, a, kind.width) for a in args[1:])
        return builder.select(args[0], yes, no)

    return kind(mask, yes, no), emit


@intrinsic
def smaller(typing, a, b):
    """The smaller of two, the first where they cannot be compared."""
    width = _widest((a, b))

    def emit(context, builder, sig, args):
        a, b = (_spread(builder, x, width) for x in args)
        return builder.select(builder.fcmp_ordered("<", b, a), b, a)

    return _Lanes(width)(a, b), emit


@intrinsic
def floor(typing, value):
    """Largest whole number not above."""

    def emit(context, builder, sig, args):
        return _call_llvm(builder, "floor", args)

    return value(value), emit


@intrinsic
def fma(typing, a, b, c):
    """a·b + c with one rounding."""
    width = max(getattr(kind, "width", 0) for kind in (a, b, c))
    kind = _Lanes(width)

    def emit(context, builder, sig, args):
        values = [_spread(builder, x, width) for x in args]
        return _call_llvm(builder, "fma", values)

    return kind(a, b, c), emit


# The same functions in plain Python, for ``NUMBA_DISABLE_JIT=1``: a number with lanes is an array
# with one entry per lane. Slow, and the same bits.


def _find_fma():
    """a·b + c with one rounding: Python's own from 3.13 on, before that the C library's."""
    if hasattr(math, "fma"):
        return math.fma
    found = ctypes.CDLL(find_library("m") or find_library("ucrtbase") or None).fma
    found.argtypes, found.restype = [ctypes.c_double] * 3, ctypes.c_double
    return found


def _fma(a, b, c):
    """a·b + c with one rounding, lane by lane."""
    triples = zip(*(x.tolist() for x in np.broadcast_arrays(a, b, c)), strict=True)
    return np.array([_fuse(*triple) for triple in triples])


_PLAIN = {
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

if config.DISABLE_JIT:
    _fuse = _find_fma()  # asks the system, which takes a while
    globals().update(_PLAIN)

# π/2 in three parts of 33 bits, so that subtracting small multiples is exact (Cody & Waite 1980)
_HALF_PI_1, _HALF_PI_2, _HALF_PI_3 = (
    1.57079632673412561417e00,
    6.07710050630396597660e-11,
    2.02226624879595063154e-21,
)
_TWO_OVER_PI = 2 / np.pi
# fdlibm's polynomials on ±π/4, highest power first
_S6, _S5, _S4 = (
    1.58969099521155010221e-10,
    -2.50507602534068634195e-08,
    2.75573137070700676789e-06,
)
_S3, _S2, _S1 = (
    -1.98412698298579493134e-04,
    8.33333333332248946124e-03,
    -1.66666666666666324348e-01,
)
_C6, _C5, _C4 = (
    -1.13596475577881948265e-11,
    2.08757232129817482790e-09,
    -2.75573143513906633035e-07,
)
_C3, _C2, _C1 = (
    2.48015872894767294178e-05,
    -1.38888888888741095749e-03,
    4.16666666666666019037e-02,
)


@lean
def sincos(x):
    """(sin x, cos x) to one unit in the last place for |x| below 1e5."""
    quadrant = floor(x * _TWO_OVER_PI + 0.5)
    r = ((x - quadrant * _HALF_PI_1) - quadrant * _HALF_PI_2) - quadrant * _HALF_PI_3
    z = r * r
    s = fma(fma(fma(fma(fma(_S6, z, _S5), z, _S4), z, _S3), z, _S2), z, _S1)
    s = fma(r * z, s, r)
    c = fma(fma(fma(fma(fma(_C6, z, _C5), z, _C4), z, _C3), z, _C2), z, _C1)
    c = 1.0 - (0.5 * z - z * z * c)
    half = quadrant * 0.5
    odd = half - floor(half) > 0.25
    sine, cosine = choose(odd, c, s), choose(odd, s, c)
    quarter = quadrant * 0.25
    turn = quarter - floor(quarter)  # quadrant / 4 within a full turn
    flip_cosine = (turn > 0.125) & (turn < 0.625)
    return choose(turn > 0.375, -sine, sine), choose(flip_cosine, -cosine, cosine)
