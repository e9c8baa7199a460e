"""MATLAB files, version 5: written with SciPy, read by a small reader of our own that only knows numbers and texts.

In MATLAB each variable has its Dataset's name; ``angle`` is (trial, sensor, time), vectors are rows, texts are char
matrices with one row per entry, and ``feeler_description`` is JSON with dims, units, types and all attributes.
"""

import io
import math
import os
import struct
import zlib
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.io import savemat

from feeler.errors import InvalidInput
from feeler.tensors.disk import write_atomic
from feeler.tensors.limits import Limits, find_limits, parse_json, read_bytes
from feeler.tensors.plain import complete, describe, restore

DESCRIPTION = "feeler_description"
MAX_VARIABLE = 2**31 - 1  # bytes; the format's own limit
MAGIC = b"MATLAB 5.0 MAT-file"
_MATRIX, _COMPRESSED = 14, 15
_TYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
_CLASSES = {6: "f8", 7: "f4", 8: "i1", 9: "u1", 10: "i2", 11: "u2", 12: "i4", 13: "u4", 14: "i8", 15: "u8"}
_CHAR, _UTF8, _UTF16 = 4, 16, 17


def save_mat(dataset: xr.Dataset, path: str | os.PathLike) -> None:
    """Write a Dataset as a MATLAB version 5 file."""
    dataset = complete(dataset)
    content: dict[str, object] = {}
    for name, variable in dataset.variables.items():
        if variable.nbytes > MAX_VARIABLE:
            raise InvalidInput(f"{name} takes {variable.nbytes:,} bytes; a version 5 file holds 2 GiB. Use NetCDF.")
        text = variable.dtype.kind in "UOT"
        content[str(name)] = variable.values.astype(str).ravel() if text else variable.values
    content[DESCRIPTION] = describe(dataset)
    buffer = io.BytesIO()
    savemat(buffer, content, format="5", long_field_names=True, oned_as="row")
    write_atomic(Path(path), buffer.getvalue())


def load_mat(path: str | os.PathLike, limits: Limits | None = None) -> xr.Dataset:
    """The Dataset in a file that :func:`save_mat` wrote (MATLAB may have saved it again with -v6 or -v7).

    Raises
    ------
    InvalidInput
        Another kind of file, damaged, over the limits, or without ``feeler_description``.
    """
    limits = find_limits(limits)
    return parse_mat(read_bytes(path, limits.max_bytes), Path(path).name, limits)


def parse_mat(raw: bytes, source: str, limits: Limits) -> xr.Dataset:
    """As :func:`load_mat`, from bytes."""
    arrays = read_variables(raw, source, limits)
    text = arrays.pop(DESCRIPTION, None)
    if not isinstance(text, str):
        raise InvalidInput(
            f"{source} has no {DESCRIPTION}, so what its variables ({', '.join(sorted(arrays)[:8]) or 'none'}) mean is "
            "unknown. Files of recordings are read from CSV."
        )
    numbers = {name: values for name, values in arrays.items() if isinstance(values, np.ndarray)}
    return restore(parse_json(text.encode("utf-8", "replace"), f"{DESCRIPTION} in {source}"), numbers, source)


def read_variables(raw: bytes, source: str, limits: Limits) -> dict[str, np.ndarray | str]:
    """Numeric arrays and char rows by name; cells, structs, objects and sparse matrices are passed over."""
    if not raw.startswith(MAGIC) or len(raw) < 128 or raw[126:128] != b"IM":
        raise InvalidInput(f"{source} is no little-endian MATLAB 5 file. In MATLAB: save(..., '-v7').")
    found: dict[str, np.ndarray | str] = {}
    place, budget = 128, limits.max_bytes
    while place + 8 <= len(raw):
        kind, start, end, place = _element(raw, place, len(raw), source)
        body = raw[start:end]
        if kind == _COMPRESSED:
            body = _inflate(body, budget, source)
            kind, start, end, _ = _element(body, 0, len(body), source)
            body = body[start:end]
        if kind != _MATRIX:
            raise InvalidInput(f"{source} is damaged: a variable has the type {kind}.")
        budget -= len(body)
        limits.check_bytes(limits.max_bytes - budget, source)
        name, value = _matrix(body, source, limits)
        if value is not None:
            found[name] = value
        if len(found) > limits.max_arrays:
            raise InvalidInput(f"{source} holds more than {limits.max_arrays} variables.")
    return found


def _element(raw: bytes, place: int, limit: int, source: str) -> tuple[int, int, int, int]:
    """Type, start and end of the data, and where the next element begins."""
    if place + 8 > limit:
        raise InvalidInput(f"{source} is damaged: cut off at byte {place}.")
    kind, size = struct.unpack_from("<II", raw, place)
    if kind >> 16:  # small element: length and type share four bytes
        kind, size, start, after = kind & 0xFFFF, kind >> 16, place + 4, place + 8
        if size > 4:
            raise InvalidInput(f"{source} is damaged: an element of {size} bytes in 4 (byte {place}).")
    else:
        start = place + 8
        after = start + size + (-size % 8 if kind != _COMPRESSED else 0)
    if start + size > limit:
        raise InvalidInput(f"{source} is damaged: cut off at byte {place}.")
    return kind, start, start + size, after


def _inflate(body: bytes, budget: int, source: str) -> bytes:
    stream = zlib.decompressobj()
    try:
        out = stream.decompress(body, max(budget, 0) + 1)
    except zlib.error as error:
        raise InvalidInput(f"{source} is damaged: {error}.") from error
    if len(out) > budget:
        raise InvalidInput(f"{source} unpacks to more than the limit (Limits.max_bytes, FEELER_MAX_GIB).")
    return out


def _matrix(body: bytes, source: str, limits: Limits) -> tuple[str, np.ndarray | str | None]:
    """Name and value of one variable; None where it is of a class that is not read."""
    kind, start, end, place = _element(body, 0, len(body), source)
    if kind != 6 or end - start != 8:
        raise InvalidInput(f"{source} is damaged: a variable without its flags.")
    flags = struct.unpack_from("<I", body, start)[0]
    group = flags & 0xFF
    kind, start, end, place = _element(body, place, len(body), source)
    if kind != 5 or (end - start) % 4 or not 8 <= end - start <= 32:
        raise InvalidInput(f"{source} is damaged: a variable without 2 to 8 dimensions.")
    shape = tuple(int(n) for n in np.frombuffer(body[start:end], "<i4"))
    kind, start, end, place = _element(body, place, len(body), source)
    name = body[start:end].decode("ascii", "replace")
    if kind not in (1, 2) or not 1 <= len(name) <= 63:
        raise InvalidInput(f"{source} is damaged: a variable's name is {name[:40]!r}.")
    if (group not in _CLASSES and group != _CHAR) or flags & 0x800:
        return name, None
    limits.check_shape(shape, 1, f"{source}: variable {name!r}")
    kind, start, end, _ = _element(body, place, len(body), source)
    if group == _CHAR:
        return name, _text(body[start:end], kind, shape, name, source)
    return name, _numbers(body[start:end], kind, shape, _CLASSES[group], bool(flags & 0x200), name, source)


def _numbers(
    data: bytes, kind: int, shape: tuple[int, ...], item: str, logical: bool, name: str, source: str
) -> np.ndarray:
    stored = np.dtype("<" + _TYPES[kind]) if kind in _TYPES else None
    if stored is None or len(data) != math.prod(shape) * stored.itemsize:
        raise InvalidInput(f"{source} is damaged: variable {name!r} of shape {shape} has {len(data):,} bytes.")
    with np.errstate(invalid="ignore"):
        return np.frombuffer(data, stored).reshape(shape, order="F").astype("?" if logical else item)


def _text(data: bytes, kind: int, shape: tuple[int, ...], name: str, source: str) -> str:
    coding = {_UTF8: "utf-8", _UTF16: "utf-16-le", 4: "utf-16-le", 1: "latin-1", 2: "latin-1"}.get(kind)
    if coding is None:
        raise InvalidInput(f"{source} is damaged: the text {name!r} has the type {kind}.")
    return data.decode(coding, "replace")
