"""A Dataset as plain arrays and one JSON text: what every format stores, so that each restores the
same Dataset.
"""

import json
import math
import re
from typing import Any

import numpy as np
import xarray as xr

from feeler.disk.files import NAME
from feeler.disk.provenance import make_plain
from feeler.errors import InvalidInput

_TYPE = re.compile(r"[<>|=]?(b1|[iu][1248]|f[48])")
_OLD_UNIT = "fraction of length"  # of files of feeler 0.1, in which a share had this unit
REQUIRED = {
    "configuration": "{}",
    "versions": "{}",
    "units": "g, mm, ms, rad",
    "licence": "not stated",
}
"""Attributes that every file carries, with what stands where the producer said nothing."""


def complete(dataset: xr.Dataset) -> xr.Dataset:
    """The Dataset with every required attribute present."""
    return dataset.assign_attrs({**REQUIRED, **dataset.attrs})


def describe(dataset: xr.Dataset) -> str:
    """JSON: dims, type, attributes and role of each variable, texts themselves, and the Dataset's
    attributes.
    """
    variables = {}
    for name, variable in dataset.variables.items():
        check_variable(name, variable)
        entry = {
            "dims": list(variable.dims),
            "shape": list(variable.shape),
            "type": variable.dtype.str,
        }
        entry |= {
            "attributes": make_plain(dict(variable.attrs)),
            "coordinate": name in dataset.coords,
        }
        if variable.dtype.kind in "UOT":
            entry |= {"type": "str", "texts": [str(text) for text in variable.values.ravel()]}
        variables[name] = entry
    content = {
        "format": 1,
        "variables": variables,
        "attributes": make_plain(dict(dataset.attrs)),
    }
    return json.dumps(content, ensure_ascii=True)


def describe_whole(dataset: xr.Dataset) -> dict[str, Any]:
    """A small Dataset with all its numbers, as plain data; :func:`restore_whole` reads it."""
    numbers = {
        str(name): make_plain(item.values.ravel())
        for name, item in dataset.variables.items()
        if item.dtype.kind not in "UOT"
    }
    return {"rest": json.loads(describe(dataset)), "numbers": numbers}


def restore_whole(content: dict[str, Any], source: str) -> xr.Dataset:
    """The Dataset that :func:`describe_whole` described, to the last digit."""
    arrays = {}
    for name, values in content["numbers"].items():
        flat = np.array(values, dtype=object).ravel().tolist()
        # above 2^53 no float is exact: whole numbers stay whole
        whole = all(isinstance(value, int) for value in flat)
        arrays[name] = np.array(flat if whole else [float(value) for value in flat])
    return restore(content["rest"], arrays, source)


def check_variable(name: Any, variable: xr.Variable) -> None:
    """Raise where a variable cannot be written to every format."""
    if not (isinstance(name, str) and NAME.fullmatch(name)):
        raise InvalidInput(
            f"a variable's name is letters, digits and _, from a letter, at most 64; got {name!r}."
        )
    if variable.dtype.kind not in "biufUOT" or (
        variable.dtype.kind == "f" and variable.dtype.itemsize not in (4, 8)
    ):
        raise InvalidInput(
            f"variable {name!r} has the type {variable.dtype}; files hold numbers and texts."
        )


def restore(content: dict[str, Any], arrays: dict[str, np.ndarray], source: str) -> xr.Dataset:
    """The Dataset that :func:`describe` described, with its numbers from ``arrays`` (any shape of
    the right size).
    """
    try:
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for name, entry in content["variables"].items():
            values = _values(name, entry, arrays, source)
            attributes = dict(entry.get("attributes") or {})
            attributes |= {"units": "1"} if attributes.get("units") == _OLD_UNIT else {}
            variable = xr.Variable(_read_dims(name, entry["dims"]), values, attributes)
            (coordinates if entry.get("coordinate") else variables)[name] = variable
        return xr.Dataset(
            variables, coords=coordinates, attrs=dict(content.get("attributes") or {})
        )
    except InvalidInput:
        raise
    except (KeyError, TypeError, ValueError, AttributeError, OverflowError) as error:
        raise InvalidInput(
            f"{source} is damaged: its description does not fit ({str(error)[:150]})."
        ) from error


def _read_dims(name: str, dims: Any) -> tuple[str, ...]:
    good = (
        isinstance(dims, list | tuple)
        and all(isinstance(dim, str) for dim in dims)
        and len(set(dims)) == len(dims)
    )
    if not good:
        raise InvalidInput(
            f"variable {name!r} has the dims {str(dims)[:80]}; dims are names, each given once."
        )
    return tuple(dims)


def _values(
    name: str, entry: dict[str, Any], arrays: dict[str, np.ndarray], source: str
) -> np.ndarray:
    shape = tuple(entry["shape"])
    if entry["type"] == "str":
        return np.array([str(text) for text in entry["texts"]], dtype=str).reshape(shape)
    if not (
        isinstance(entry["type"], str) and _TYPE.fullmatch(entry["type"])
    ):  # np.dtype parses all kinds of texts
        raise InvalidInput(
            f"{source}: variable {name!r} has the type {str(entry['type'])[:40]!r}."
        )
    kind = np.dtype(entry["type"])
    if name not in arrays:
        raise InvalidInput(f"{source} is damaged: variable {name!r} is missing.")
    values = arrays[name]
    if values.size != math.prod(shape):
        raise InvalidInput(
            f"{source} is damaged: variable {name!r} has {values.size} values for the shape"
            f" {shape}."
        )
    with np.errstate(
        invalid="ignore"
    ):  # a damaged file may hold a NaN where whole numbers belong; validation says so
        return values.reshape(shape).astype(kind)
