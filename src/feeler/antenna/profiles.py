"""Quantities along an antenna: profiles, formulas, and slender beams of one material."""

import ast
import operator
import warnings
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol, runtime_checkable

import numpy as np

from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.records import Record
from feeler.validation import Count, checked, show

# Profiles: one quantity along the antenna as a function of segment number, described by a few
# numbers.


@runtime_checkable
class Profile(Protocol):
    """Anything that gives one value per segment, base to tip."""

    def sample(self, n_segments: int) -> np.ndarray:
        """Values (segment,) for segments 1..n_segments."""
        ...


class Exponential(Record):
    """``base * exp(rate * (n - 1))`` for segment n = 1, 2, … (Methods, antenna model).

    base: value at segment 1. rate: change of the logarithm per segment; negative falls towards the
    tip.
    """

    base: float
    rate: float

    @checked
    def sample(self, n_segments: Count) -> np.ndarray:
        """Values (segment,)."""
        return self.base * np.exp(self.rate * np.arange(n_segments))


class Linear(Record):
    """A straight line in segment number from ``base`` (segment 1) to ``tip`` (last segment)."""

    base: float
    tip: float

    @checked
    def sample(self, n_segments: Count) -> np.ndarray:
        """Values (segment,)."""
        return np.linspace(self.base, self.tip, n_segments)


class Constant(Record):
    """The same ``value`` in every segment."""

    value: float

    @checked
    def sample(self, n_segments: Count) -> np.ndarray:
        """Values (segment,)."""
        return np.full(n_segments, float(self.value))


class Sigmoid(Record):
    """``low + rise / (1 + exp(-slope * (x - centre)))`` at the segment's relative number x = (n -
    0.5) / N.
    """

    low: float
    rise: float
    slope: float
    centre: float

    @checked
    def sample(self, n_segments: Count) -> np.ndarray:
        """Values (segment,)."""
        return self.at((np.arange(n_segments) + 0.5) / n_segments)

    def at(self, x: np.ndarray) -> np.ndarray:
        """Values at relative segment numbers ``x`` between 0 and 1."""
        return self.low + self.rise / (
            1.0 + np.exp(-self.slope * (np.asarray(x, dtype=float) - self.centre))
        )


PROFILES = {cls.__name__.lower(): cls for cls in (Exponential, Linear, Constant, Sigmoid)}


def sample_quantity(
    value: Any, n_segments: int, segment_length: np.ndarray | None = None
) -> np.ndarray:
    """Values (segment,) of a number, an array, a profile or a formula."""
    if isinstance(value, Profile):
        return value.sample(n_segments)
    found = (
        evaluate(value, _list_names(n_segments, segment_length))
        if isinstance(value, str)
        else np.asarray(value, float)
    )
    return np.full(n_segments, found) if found.ndim == 0 else found


# Formulas: one line of arithmetic that stands for a number in every segment; read, never run as
# Python.

MAX_LENGTH = 1000  # [C] characters
OPERATORS: dict[type, Callable] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.USub: operator.neg,
    ast.UAdd: operator.pos,
}
FUNCTIONS: dict[str, Callable] = {
    "exp": np.exp,
    "log": np.log,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tanh": np.tanh,
    "abs": np.abs,
    "min": np.minimum,
    "max": np.maximum,
    "spread": lambda total, shares: total * shares / np.sum(shares),
}


def _list_names(
    n_segments: int, segment_length: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """What a formula may use: ``n`` (1 … N), ``N``, ``x`` = (n − ½) / N; with lengths also ``l``
    and ``s``.

    ``l`` is the segment's length [mm], ``s`` its middle as a fraction of the antenna's length.
    """
    number = np.arange(1.0, n_segments + 1)
    names = {"n": number, "N": np.array(float(n_segments)), "x": (number - 0.5) / n_segments}
    if segment_length is not None:
        length = np.broadcast_to(segment_length, number.shape)
        names |= {"l": length, "s": (np.cumsum(length) - length / 2) / length.sum()}
    return names


def evaluate(formula: str, names: Mapping[str, np.ndarray]) -> np.ndarray:
    """The value of a formula; + − * / **, brackets, pi, and the functions of ``FUNCTIONS``.

    ``spread(total, shares)`` gives shares that add up to the total.

    Raises
    ------
    InvalidInput
        Not such a formula; the message says which part is not understood and what is.
    """
    if len(formula) > MAX_LENGTH:
        raise InvalidInput(
            f"a formula has at most {MAX_LENGTH} characters, got {len(formula)}."
        )
    known = {"pi": np.array(np.pi), **names}

    def value(node: Any) -> Any:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return np.float64(number)  # a float, so that no power grows without bounds
            case ast.Name(id=name) if name in known:
                return known[name]
            case ast.BinOp() if type(node.op) in OPERATORS:
                return OPERATORS[type(node.op)](value(node.left), value(node.right))
            case ast.UnaryOp() if type(node.op) in OPERATORS:
                return OPERATORS[type(node.op)](value(node.operand))
            case ast.Call(func=ast.Name(id=name), keywords=[]) if name in FUNCTIONS:
                return FUNCTIONS[name](*map(value, node.args))
        raise InvalidInput(
            f"{ast.unparse(node)[:40]!r} is not understood in a formula; valid: numbers, + - * / **"
            f" ( ), {', '.join(known)}, {', '.join(f'{name}()' for name in FUNCTIONS)}."
        )

    try:
        with np.errstate(
            all="ignore"
        ):  # what is not finite is refused where the quantity is known
            return np.asarray(value(ast.parse(formula.strip(), mode="eval").body), dtype=float)
    except InvalidInput:
        raise
    except (
        SyntaxError,
        ValueError,
        TypeError,
        OverflowError,
        RecursionError,
        MemoryError,
    ) as error:
        raise InvalidInput(
            f"{formula[:60]!r} is no formula ({str(error)[:60]}); as in 37.78 * exp(-0.0827 * (n -"
            " 1))."
        ) from error


# Antennas by their making: a slender beam of one material, as segments and hinges.

_DENSITIES = (1e-4, 2e-2)  # [C] g/mm3; beams outside are warned of
_MODULI = (1e-1, 1e6)  # [C] MPa; from resilin to diamond
# [C] a fifth of the smallest and five times the largest antenna and whisker that is known
_LENGTHS = (0.05, 2e3)  # mm
_RADII = (5e-4, 10.0)  # mm

Along = float | str | Sequence[float] | np.ndarray | Callable[[np.ndarray], Any]
"""One number, a formula or function of the place x along the length (0 base, 1 tip), or a row of
each segment's.
"""


@np.errstate(all="ignore")  # the antenna refuses what is no finite number
def compute_beam(
    length: float | Sequence[float] | np.ndarray,
    n_segments: int | None,
    radius: Along | None,
    width: Along | None,
    thickness: Along | None,
    modulus: Along,
    density: Along,
    damping_time: Along,
    planes: int = 1,
    shear_modulus: Along | None = None,
) -> dict[str, np.ndarray]:
    """Fields of an antenna for a beam; see :meth:`feeler.Antenna.from_beam`."""
    if (radius is None) == (width is None or thickness is None) or (width is None) != (
        thickness is None
    ):
        raise InvalidInput("a beam needs either radius [mm], or width and thickness [mm].")
    size, ends = _divide(length, n_segments)
    even, hinge = np.ndim(length) == 0, ends[:-1]
    middle = hinge + (0.5 / size.size if even else 0.5 * size / size.sum())
    given = (radius, width, thickness, modulus, density, damping_time, shear_modulus)
    radius, width, thickness, modulus, density, damping_time, shear_modulus = (
        _interpolate(value, middle) for value in given
    )
    if radius is not None:
        half = _at("radius", radius, middle)
        area = np.pi * half**2
        moment = np.pi / 4 * _at("radius", radius, hinge) ** 4
    else:
        area = _at("width", width, middle) * _at("thickness", thickness, middle)
        moment = _at("width", width, hinge) * _at("thickness", thickness, hinge) ** 3 / 12
        half = _at("thickness", thickness, middle) / 2
    firm, heavy = _at("modulus", modulus, hinge), _at("density", density, middle)
    _doubt("density", heavy, _DENSITIES, "g/mm3 (water: 1e-3)")
    _doubt("modulus", firm, _MODULI, "MPa (cuticle: some 1e3)")
    _doubt("length", np.array([size.sum()]), _LENGTHS, "mm, not µm or m (a cockroach: 42)")
    _doubt("radius", half, _RADII, "mm, not µm or m (a cockroach: 0.2)")
    # a hinge bends for the halves of the segments beside it, hinge 1 for one half
    reach = 0.5 * np.concatenate([size[:1], size[:-1] + size[1:]])
    stiffness = firm * moment / reach
    found = {
        "segment_length": size,
        "segment_mass": heavy * area * size,
        "radius": half,
        "stiffness": stiffness,
        "damping": _at("damping_time", damping_time, hinge, least=0.0) * stiffness,
    }
    if planes == 1:
        return found
    section = radius, width, thickness
    if even:
        middle = (np.arange(size.size) + 0.5) / size.size
    places = ends, middle, reach
    return found | _bend_in_space(
        found, section, modulus, density, planes, shear_modulus, places
    )


def _divide(
    length: float | Sequence[float] | np.ndarray, n_segments: int | None
) -> tuple[np.ndarray, np.ndarray]:
    """Lengths (segment,) [mm], and the places of hinges and tip (segment + 1,), 0 to 1."""
    if isinstance(length, float | int | np.number):
        n = 60 if n_segments is None else n_segments
        for name, value in (("length", length), ("n_segments", n)):
            if not (np.isfinite(value) and value > 0):
                raise InvalidInput(f"{name} must be finite and > 0, got {value}.")
        return np.full(n, length / n), np.arange(n + 1) / n
    size = np.asarray(length, dtype=float)
    if size.ndim != 1 or not size.size or not np.all(np.isfinite(size) & (size > 0)):
        raise InvalidInput(
            "length must be one number, or the lengths of all segments, finite and > 0, got"
            f" {show(length)}."
        )
    if n_segments not in (None, size.size):
        raise InvalidInput(
            f"length holds the lengths of {size.size} segments, but n_segments is {n_segments}."
            " Leave n_segments out."
        )
    ends = np.concatenate([[0.0], np.cumsum(size)]) / size.sum()
    ends[-1] = 1.0
    return size, ends


def _interpolate(value: Any, middle: np.ndarray) -> Any:
    """Numbers for each segment, as a function of the place: they hold at the segments' middles,
    are linear between them and go on so to both ends, but not below half of the last.
    """
    if value is None or isinstance(value, str) or callable(value) or np.ndim(value) != 1:
        return value
    values = np.asarray(value)
    if values.shape != middle.shape or values.dtype.kind not in "fiu" or values.size < 2:
        return value  # refused where the quantity is known
    slope = (values[[1, -1]] - values[[0, -2]]) / (middle[[1, -1]] - middle[[0, -2]])
    ends = values[[0, -1]] + slope * ([0.0, 1.0] - middle[[0, -1]])
    first, last = np.maximum(ends, 0.5 * values[[0, -1]])
    knots, heights = np.array([0.0, *middle, 1.0]), np.array([first, *values, last])
    return lambda x: np.interp(x, knots, heights)


def _measure_section(
    x: np.ndarray, radius: Along | None, width: Along | None, thickness: Along | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Of a full circle or a strip, at places x: area [mm²], its moments across the second plane and
    of torsion [mm⁴], and half the thickness [mm].
    """
    if radius is not None:
        r = _at("radius", radius, x, least=0.0)
        return np.pi * r**2, np.pi / 4 * r**4, np.pi / 2 * r**4, r
    w, t = _at("width", width, x, least=0.0), _at("thickness", thickness, x, least=0.0)
    long, short = np.maximum(w, t), np.minimum(w, t)
    flat = short / long
    twist = long * short**3 * (1 / 3 - 0.21 * flat * (1 - flat**4 / 12))  # Young & Budynas
    return w * t, t * w**3 / 12, twist, t / 2


def _bend_in_space(
    plane: dict[str, np.ndarray],
    section: tuple[Along | None, ...],
    modulus: Along,
    density: Along,
    planes: int,
    shear_modulus: Along | None,
    places: tuple[np.ndarray, np.ndarray, np.ndarray],
) -> dict[str, np.ndarray]:
    """What is different in space: hinges of each plane, and segments that are frusta."""
    if planes not in (2, 3):
        raise InvalidInput(f"planes must be 1, 2, or 3 with torsion, got {planes!r}.")
    if (planes == 3) != (shear_modulus is not None):
        raise InvalidInput(
            "torsion needs its stiffness: give shear_modulus [MPa] with planes=3, and only then."
        )
    (ends, middle, reach), size = places, plane["segment_length"]
    hinge = ends[:-1]
    area, _, _, thick = _measure_section(ends, *section)
    _, moment, twist, _ = _measure_section(hinge, *section)
    whole = (area[:-1] + 4 * _measure_section(middle, *section)[0] + area[1:]) / 6
    moduli = [_at("modulus", modulus, hinge) * moment]
    if shear_modulus is not None:
        moduli.append(_at("shear_modulus", shear_modulus, hinge) * twist)
    others = np.array(moduli) / reach
    stiffness = np.concatenate([plane["stiffness"][None], others])
    return {
        "segment_mass": _at("density", density, middle) * whole * size,
        "stiffness": stiffness,
        "damping": plane["damping"] / plane["stiffness"] * stiffness,
        "taper": thick[1:] / thick[:-1],
    }


def _doubt(name: str, values: np.ndarray, usual: tuple[float, float], unit: str) -> None:
    """Warn of numbers that look like another unit's, by the largest: a tip may be as thin as it
    likes.
    """
    low, high = usual
    if not low <= values.max() <= high:
        ends = dict.fromkeys((f"{values.min():.4g}", f"{values.max():.4g}"))
        warnings.warn(
            ModelValidityWarning(
                f"{name} is outside its usual range: is it in {unit}?",
                f"It is {' to '.join(ends)}, outside {low:g} to {high:g}.",
            ),
            stacklevel=5,
        )


def _at(
    name: str, value: Along | None, x: np.ndarray, least: float = np.nextafter(0, 1)
) -> np.ndarray:
    """A quantity at places along the beam."""
    found = (
        evaluate(value, {"x": x})
        if isinstance(value, str)
        else value(x)
        if callable(value)
        else value
    )
    try:
        values = np.broadcast_to(np.asarray(found, dtype=float), x.shape).copy()
    except (TypeError, ValueError, OverflowError) as error:
        raise InvalidInput(
            f"{name} must be a number, a formula of x, or a number for each of {x.size} places,"
            f" got {show(found)}."
        ) from error
    if not np.all(np.isfinite(values) & (values >= least)):
        raise InvalidInput(
            f"{name} must be finite and {'>' if least else '≥'} 0 all along the beam, got"
            f" {values.min():.4g} to {values.max():.4g}."
        )
    return values
