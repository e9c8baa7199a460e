"""Units travel with numbers: whoever takes a quantity out of a Dataset says in which unit."""

import math
import re
from fractions import Fraction
from typing import Any

import xarray as xr

from feeler.errors import InvalidInput
from feeler.records.checked import checked

_NEWTON, _JOULE = (1, 1, -2, 0), (1, 2, -2, 0)
_BASE: dict[str, tuple[tuple[int, ...], Any]] = {
    "1": ((0, 0, 0, 0), 1),
    "g": ((1, 0, 0, 0), Fraction(1, 1000)),
    "m": ((0, 1, 0, 0), 1),
    "s": ((0, 0, 1, 0), 1),
    "Hz": ((0, 0, -1, 0), 1),
    "rad": ((0, 0, 0, 1), 1),
    "deg": ((0, 0, 0, 1), Fraction(math.pi / 180)),
    "N": (_NEWTON, 1),
    "J": (_JOULE, 1),
}
"""Powers of kg, m, s and rad, and how many of that unit one is."""

_PREFIX = {"M": 6, "k": 3, "": 0, "c": -2, "m": -3, "u": -6, "n": -9}
_SPELLING = {"µ": "u", "μ": "u", "·": "*", "²": "^2", "³": "^3", "°": "deg", "**": "^"}


@checked
def in_unit(array: xr.DataArray, unit: str) -> xr.DataArray:
    """The quantity in the unit that is asked for, whatever unit it is kept in.

    Parameters
    ----------
    array
        A quantity whose ``attrs["units"]`` says its unit.
    unit
        Products and quotients of g, m, s, Hz, rad, deg, N, J and 1 with the usual prefixes, such
        as ``"uJ"`` (or ``"µJ"``), ``"mm/ms"``, ``"N*mm"`` or ``"1/mm^2"``.

    Returns
    -------
    xarray.DataArray
        The same array where it is in that unit already; else a converted one whose ``units`` is
        ``unit``.

    Raises
    ------
    InvalidInput
        The array says no unit, one that is not known, or one of another kind.
    """
    name, kept = array.name or "array", array.attrs.get("units")
    if kept is None:
        raise InvalidInput(
            f"{name!r} says no unit; set attrs['units'] to convert it to {unit}."
        )
    if kept == unit:
        return array
    kind, size = _read_unit(str(kept))
    wanted, step = _read_unit(unit)
    if kind != wanted:
        raise InvalidInput(f"{name!r} is in {kept}, which cannot be converted to {unit}.")
    factor = Fraction(size) / Fraction(step)
    # 1/1000 is no float: dividing by 1000 rounds once
    values = array * float(factor) if factor >= 1 else array / float(1 / factor)
    return values.assign_attrs({**array.attrs, "units": unit})


def _read_unit(text: str) -> tuple[tuple[int, ...], Fraction]:
    """Powers of the base units, and how many of them one is."""
    plain = "*" + text
    for spelling, letters in _SPELLING.items():
        plain = plain.replace(spelling, letters)
    factor = r"([*/])([A-Za-z]+|1)(?:\^([1-9]))?"
    if not re.fullmatch(f"(?:{factor})+", plain):
        raise InvalidInput(f"{text!r} is no unit; write products and quotients, such as mm/ms.")
    powers: tuple[int, ...] = (0, 0, 0, 0)
    size = Fraction(1)
    for operator, symbol, power in re.findall(factor, plain):
        own, one = _read_symbol(symbol)
        times = int(power or 1) * (-1 if operator == "/" else 1)
        powers = tuple(a + times * b for a, b in zip(powers, own, strict=True))
        for _ in range(abs(times)):
            size = size * one if times > 0 else size / one
    return powers, size


def _read_symbol(symbol: str) -> tuple[tuple[int, ...], Fraction]:
    if symbol in _BASE:
        return _BASE[symbol][0], Fraction(_BASE[symbol][1])
    prefix, base = symbol[:1], symbol[1:]
    if prefix not in _PREFIX or base not in _BASE or base in ("1", "deg"):
        raise InvalidInput(
            f"unknown unit {symbol!r}; known are {', '.join(_BASE)} with the prefixes"
            f" {', '.join(filter(None, _PREFIX))}."
        )
    powers, size = _BASE[base]
    return powers, size * Fraction(f"1e{_PREFIX[prefix]}")


def need(dataset: xr.Dataset, *names: str) -> None:
    """Raise where a Dataset lacks one of these variables."""
    if missing := [name for name in names if name not in dataset.variables]:
        there = ", ".join(map(str, dataset.variables)) or "none"
        raise InvalidInput(f"the Dataset has no variable {missing[0]!r}; it has: {there}.")
