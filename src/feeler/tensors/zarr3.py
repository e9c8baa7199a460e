"""Zarr v3 arrays as plain files: written so that a chunk lasts, read so that a hostile one does no harm.

Only the part of the format that a tensor needs: regular chunks; codecs ``bytes``, ``vlen-utf8``, ``crc32c`` and, for
reading, one of ``zstd``, ``gzip``. Any Zarr library reads what this module writes. Zarr's own reader is not
used on files of unknown origin, because it takes memory as the metadata ask.
"""

import itertools
import json
import math
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import google_crc32c
import numpy as np

from feeler.errors import InvalidInput
from feeler.tensors.codecs import DECOMPRESS, check_sum, split_texts
from feeler.tensors.limits import NAME, Limits, list_folder, parse_json, read_bytes

MAX_METADATA = 2**20
NUMBERS = ("bool", *(f"{kind}{bits}" for kind in ("int", "uint") for bits in (8, 16, 32, 64)), "float32", "float64")
_CHECKSUM = {"name": "crc32c"}
_BYTES = {"name": "bytes", "configuration": {"endian": "little"}}


@dataclass(frozen=True, kw_only=True)
class ArrayInfo:
    """What an array's metadata say, checked."""

    name: str
    shape: tuple[int, ...]
    chunk: tuple[int, ...]
    kind: str
    """A number type's name, ``string`` or ``fixed_length_utf32``."""
    dims: tuple[str, ...]
    codecs: tuple[dict[str, Any], ...]
    item_size: int
    separator: str = "."
    prefix: str = "c"
    fill: Any = 0
    attributes: dict[str, Any] = field(default_factory=dict)

    @property
    def grid(self) -> tuple[int, ...]:
        """Number of chunks along each dimension."""
        return tuple(-(-n // c) for n, c in zip(self.shape, self.chunk, strict=True))

    @property
    def n_bytes(self) -> int:
        """Bytes of the whole array in memory."""
        return math.prod(self.shape) * self.item_size

    @property
    def dtype(self) -> np.dtype:
        """Type of the array in memory."""
        if self.kind == "string":
            return np.dtype(object)
        return np.dtype(f"<U{self.item_size // 4}" if self.kind == "fixed_length_utf32" else self.kind)

    def key(self, index: tuple[int, ...]) -> str:
        """Path of a chunk's file inside the array's folder."""
        parts = ([self.prefix] if self.prefix else []) + [str(n) for n in index]
        return self.separator.join(parts) or "0"


def write_array_metadata(info: ArrayInfo) -> bytes:
    """The text of an array's ``zarr.json``."""
    fill = {"f": "NaN", "b": False}.get(np.dtype(info.kind).kind, 0) if info.kind in NUMBERS else ""
    metadata = {
        "zarr_format": 3,
        "node_type": "array",
        "shape": info.shape,
        "data_type": info.kind,
        "chunk_grid": {"name": "regular", "configuration": {"chunk_shape": info.chunk}},
        "chunk_key_encoding": {"name": "default", "configuration": {"separator": info.separator}},
        "fill_value": fill,
        "codecs": info.codecs,
        "attributes": info.attributes,
        "dimension_names": info.dims,
    }
    return json.dumps(metadata, indent=1).encode()


def write_group_metadata(attributes: dict[str, Any]) -> bytes:
    """The text of a group's ``zarr.json``."""
    return json.dumps({"zarr_format": 3, "node_type": "group", "attributes": attributes}, indent=1).encode()


def describe_array(name: str, values: np.ndarray, dims: tuple[str, ...], **fields: Any) -> ArrayInfo:
    """The info of an array to be written from ``values``, in one chunk unless ``shape`` and ``chunk`` say otherwise."""
    text = values.dtype.kind in "UOT"
    kind = "string" if text else values.dtype.name
    if not text and kind not in NUMBERS:
        raise InvalidInput(f"variable {name!r} has the type {values.dtype}; storable: {', '.join(NUMBERS)}, text.")
    defaults = {"shape": values.shape, "chunk": tuple(max(n, 1) for n in values.shape)}
    codecs = ({"name": "vlen-utf8"} if text else _BYTES, _CHECKSUM)
    item = 8 if text else values.dtype.itemsize
    return ArrayInfo(name=name, kind=kind, dims=dims, codecs=codecs, item_size=item, **{**defaults, **fields})


def encode_chunk(values: np.ndarray) -> bytes:
    """A chunk's bytes: the numbers little-endian (or UTF-8 texts with their lengths), then their CRC-32C."""
    if values.dtype.kind in "UOT":
        texts = [str(text).encode() for text in values.ravel()]
        raw = struct.pack("<I", len(texts)) + b"".join(struct.pack("<I", len(text)) + text for text in texts)
    else:
        raw = np.ascontiguousarray(values, dtype=values.dtype.newbyteorder("<")).tobytes()
    return raw + struct.pack("<I", google_crc32c.value(raw))


def list_arrays(
    folder: Path, limits: Limits, names: list[str] | None = None
) -> tuple[dict[str, ArrayInfo], dict[str, Any]]:
    """Infos of a group's arrays (or of those named) and the group's attributes; refuses what exceeds the limits."""
    root = parse_json(read_bytes(folder / "zarr.json", limits.max_text, follow=False), f"{folder}/zarr.json")
    if (
        root.get("zarr_format") != 3
        or root.get("node_type") != "group"
        or not isinstance(root.get("attributes", {}), dict)
    ):
        raise InvalidInput(f"{folder} is not a Zarr v3 group. A store of tensors is one.")
    infos: dict[str, ArrayInfo] = {}
    for entry in list_folder(folder):
        metadata = Path(entry.path) / "zarr.json"
        if not (entry.is_dir() and metadata.is_file()) or (names is not None and entry.name not in names):
            continue
        content = parse_json(read_bytes(metadata, MAX_METADATA, follow=False), str(metadata))
        if content.get("node_type") == "array":
            infos[entry.name] = parse_array_metadata(entry.name, content, limits)
        if len(infos) > limits.max_arrays:
            raise InvalidInput(f"{folder} holds more than {limits.max_arrays} arrays (Limits.max_arrays).")
    limits.check_bytes(sum(info.n_bytes for info in infos.values()), str(folder))
    return infos, root.get("attributes", {})


def parse_array_metadata(name: str, content: dict[str, Any], limits: Limits) -> ArrayInfo:
    """The checked info of an array; InvalidInput names what cannot be read."""
    if not NAME.fullmatch(name):
        raise InvalidInput(f"array name {name[:40]!r} is not allowed; names are letters, digits and _, from a letter.")
    try:
        return _parse(name, content, limits)
    except (KeyError, TypeError, IndexError, AttributeError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        raise InvalidInput(f"the metadata of array {name!r} lack or garble {str(error)[:80]}.") from error


def _parse(name: str, content: dict[str, Any], limits: Limits) -> ArrayInfo:
    if content.get("zarr_format") != 3 or content.get("storage_transformers"):
        raise InvalidInput(f"array {name!r} is not plain Zarr v3.")
    kind, item = _parse_type(name, content["data_type"])
    shape = tuple(content["shape"])
    limits.check_shape(shape, item, f"array {name!r}")
    if content["chunk_grid"]["name"] != "regular":
        raise InvalidInput(f"array {name!r} has a chunk grid other than 'regular'.")
    chunk = tuple(content["chunk_grid"]["configuration"]["chunk_shape"])
    limits.check_shape(chunk, item, f"a chunk of array {name!r}")
    if len(chunk) != len(shape) or 0 in chunk:
        raise InvalidInput(f"array {name!r} of shape {shape} has chunks of shape {chunk}.")
    dims = tuple(content.get("dimension_names") or [f"dim_{n}" for n in range(len(shape))])
    if len(dims) != len(shape) or not all(isinstance(dim, str) and NAME.fullmatch(dim) for dim in dims):
        raise InvalidInput(f"array {name!r} must name its {len(shape)} dimensions, got {str(dims)[:80]}.")
    prefix, separator = _parse_keys(name, content["chunk_key_encoding"])
    fill = content.get("fill_value")
    info = ArrayInfo(
        name=name,
        shape=shape,
        chunk=chunk,
        kind=kind,
        dims=dims,
        codecs=_parse_codecs(name, kind, content["codecs"]),
        item_size=item,
        separator=separator,
        prefix=prefix,
        fill=_parse_fill(name, kind, fill),
        attributes=dict(content.get("attributes") or {}),
    )
    if math.prod(info.grid) > limits.max_chunks:
        raise InvalidInput(f"array {name!r} has {math.prod(info.grid):,} chunks; the limit is {limits.max_chunks:,}.")
    return info


def _parse_type(name: str, kind: Any) -> tuple[str, int]:
    if kind == "string":
        return kind, 8
    if isinstance(kind, dict) and kind.get("name") == "fixed_length_utf32":
        length = kind["configuration"]["length_bytes"]
        if not (isinstance(length, int) and 0 < length <= 2**16 and length % 4 == 0):
            raise InvalidInput(f"array {name!r} has texts of {length!r} bytes.")
        return kind["name"], length
    if kind not in NUMBERS:
        raise InvalidInput(f"array {name!r} has the type {str(kind)[:60]!r}; readable: {', '.join(NUMBERS)}, string.")
    return kind, np.dtype(kind).itemsize


def _parse_keys(name: str, encoding: dict[str, Any]) -> tuple[str, str]:
    default = {"default": "/", "v2": "."}
    separator = encoding.get("configuration", {}).get("separator", default.get(encoding["name"]))
    if encoding["name"] not in default or separator not in ("/", "."):
        raise InvalidInput(f"array {name!r} has an unknown chunk key encoding.")
    return ("c" if encoding["name"] == "default" else ""), separator


def _parse_codecs(name: str, kind: str, codecs: list[dict[str, Any]]) -> tuple[dict[str, Any], ...]:
    names = [codec["name"] for codec in codecs]
    if not all(isinstance(codec.get("configuration") or {}, dict) for codec in codecs):
        raise InvalidInput(f"array {name!r} has codecs whose configuration is no object.")
    first = "vlen-utf8" if kind == "string" else "bytes"
    compressors = [codec for codec in names[1:] if codec != "crc32c"]
    if names[:1] != [first] or len(names) > 4 or len(compressors) > 1 or not set(compressors) <= DECOMPRESS.keys():
        raise InvalidInput(
            f"array {name!r} has the codecs {', '.join(map(str, names))[:80]}; readable: {first}, then "
            f"crc32c and at most one of {', '.join(DECOMPRESS)}."
        )
    return tuple(codecs)


def _parse_fill(name: str, kind: str, fill: Any) -> Any:
    if kind in ("string", "fixed_length_utf32"):
        return "" if fill in (None, 0) else str(fill)
    special = {"NaN": math.nan, "Infinity": math.inf, "-Infinity": -math.inf, None: 0}
    if not isinstance(fill, str | int | float | bool | None) or (isinstance(fill, str) and fill not in special):
        raise InvalidInput(f"array {name!r} has the fill value {str(fill)[:40]!r}.")
    try:
        return np.dtype(kind).type(special.get(fill, fill))
    except (OverflowError, ValueError) as error:
        raise InvalidInput(f"array {name!r} of {kind} has the fill value {fill!r}.") from error


def read_array(folder: Path, info: ArrayInfo) -> np.ndarray:
    """All values of an array; a missing chunk is the fill value, a damaged one an InvalidInput that names it."""
    values = np.full(info.shape, info.fill, dtype=info.dtype)
    for index in itertools.product(*(range(n) for n in info.grid)):
        path = folder / info.name / info.key(index)
        if path.is_symlink() or path.exists():
            part = decode_chunk(read_chunk(path, info), info, str(path))
            place = tuple(slice(i * c, (i + 1) * c) for i, c in zip(index, info.chunk, strict=True))
            kept = tuple(slice(0, min(c, n - i * c)) for i, c, n in zip(index, info.chunk, info.shape, strict=True))
            values[place] = part[kept]
    return values


def read_chunk(path: Path, info: ArrayInfo) -> bytes:
    """A chunk's raw bytes, refused where they are more than the chunk could need."""
    most = 2 * math.prod(info.chunk) * info.item_size + 2**16 if info.kind != "string" else 2**26
    return read_bytes(path, most, follow=False)


def decode_chunk(raw: bytes, info: ArrayInfo, what: str) -> np.ndarray:
    """The values of one chunk from its bytes; InvalidInput names ``what`` where they are damaged."""
    count = math.prod(info.chunk)
    most = count * info.item_size if info.kind != "string" else 2**26
    for codec in reversed(info.codecs[1:]):
        raw = check_sum(raw, what) if codec["name"] == "crc32c" else DECOMPRESS[codec["name"]](raw, most, what)
    if info.kind == "string":
        return np.array(split_texts(raw, count, what), dtype=object).reshape(info.chunk)
    if len(raw) != most:
        raise InvalidInput(f"{what} is damaged: {len(raw):,} bytes where {most:,} were expected.")
    order = ">" if (info.codecs[0].get("configuration") or {}).get("endian") == "big" else "<"
    try:
        return np.frombuffer(raw, dtype=info.dtype.newbyteorder(order)).reshape(info.chunk).astype(info.dtype)
    except ValueError as error:
        raise InvalidInput(f"{what} is damaged: {error}.") from error
