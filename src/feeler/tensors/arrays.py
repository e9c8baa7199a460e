"""Named arrays in one file, in the safetensors format: a length, a JSON header, raw numbers. Nothing to execute."""

import json
import math
import os
import struct
from pathlib import Path

import numpy as np

from feeler.errors import InvalidInput
from feeler.tensors.disk import write_atomic
from feeler.tensors.limits import Limits, find_limits, parse_json, read_bytes

TYPES = {
    "F64": "<f8",
    "F32": "<f4",
    "F16": "<f2",
    "I64": "<i8",
    "I32": "<i4",
    "I16": "<i2",
    "I8": "|i1",
    "U64": "<u8",
    "U32": "<u4",
    "U16": "<u2",
    "U8": "|u1",
    "BOOL": "|b1",
}
_NAMES = {np.dtype(kind): name for name, kind in TYPES.items()}
_METADATA = "__metadata__"


def pack_arrays(arrays: dict[str, np.ndarray], notes: dict[str, str]) -> bytes:
    """The bytes of a safetensors file with these arrays and notes."""
    header: dict[str, object] = {_METADATA: notes}
    parts, place = [], 0
    for name, values in arrays.items():
        values = np.ascontiguousarray(values)
        kind = _NAMES.get(values.dtype.newbyteorder("<"))
        if kind is None or name == _METADATA:
            raise InvalidInput(f"array {name!r} has the type {values.dtype}; storable: {', '.join(TYPES.values())}.")
        part = values.astype(TYPES[kind], copy=False).tobytes()
        shape = list(np.shape(arrays[name]))
        header[name] = {"dtype": kind, "shape": shape, "data_offsets": [place, place + len(part)]}
        parts.append(part)
        place += len(part)
    text = json.dumps(header, ensure_ascii=False).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + b"".join(parts)


def unpack_arrays(raw: bytes, what: str, limits: Limits) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Arrays and notes from a safetensors file's bytes; InvalidInput where anything does not add up."""
    length = struct.unpack("<Q", raw[:8])[0] if len(raw) >= 8 else -1
    if not 2 <= length <= min(limits.max_text, len(raw) - 8):
        raise InvalidInput(f"{what} is no safetensors file, or is cut off.")
    header = parse_json(raw[8 : 8 + length], f"the header of {what}")
    notes = header.pop(_METADATA, {})
    if not isinstance(notes, dict) or not all(isinstance(text, str) for text in notes.values()):
        raise InvalidInput(f"{what} is damaged: its notes must be texts.")
    if len(header) > limits.max_arrays:
        raise InvalidInput(f"{what} holds {len(header)} arrays; the limit is {limits.max_arrays}.")
    data = memoryview(raw)[8 + length :]
    arrays, place = {}, 0
    for name, entry in header.items():
        arrays[name], place = _take(name, entry, data, place, what, limits)
    if place != len(data):
        raise InvalidInput(f"{what} is damaged: {len(data) - place:,} bytes belong to no array.")
    return arrays, notes


def _take(name: str, entry: object, data: memoryview, place: int, what: str, limits: Limits) -> tuple[np.ndarray, int]:
    entry = entry if isinstance(entry, dict) else {}
    kind, shape, offsets = entry.get("dtype"), entry.get("shape"), entry.get("data_offsets")
    if not isinstance(kind, str) or kind not in TYPES or not isinstance(shape, list):
        raise InvalidInput(
            f"{what}: array {name[:40]!r} has the type {str(kind)[:20]!r}; readable: {', '.join(TYPES)}."
        )
    item = np.dtype(TYPES[kind]).itemsize
    limits.check_shape(tuple(shape), item, f"{what}: array {name[:40]!r}")
    end = place + math.prod(shape) * item
    if offsets != [place, end] or end > len(data):
        raise InvalidInput(f"{what} is damaged: array {name[:40]!r} does not lie where its shape says.")
    return np.frombuffer(data[place:end], dtype=TYPES[kind]).reshape(shape).copy(), end


def save_arrays(path: str | os.PathLike, arrays: dict[str, np.ndarray], notes: dict[str, str]) -> None:
    """Write arrays and notes as a safetensors file, whole or not at all."""
    try:
        write_atomic(Path(path), pack_arrays(arrays, notes))
    except OSError as error:
        raise InvalidInput(f"cannot write {path}: {error.strerror}. Check the folder and the room left.") from error


def load_arrays(path: str | os.PathLike, limits: Limits | None = None) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Arrays and notes of a safetensors file."""
    limits = find_limits(limits)
    return unpack_arrays(read_bytes(path, limits.max_bytes + limits.max_text), Path(path).name, limits)
