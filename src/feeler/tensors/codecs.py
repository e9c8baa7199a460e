"""Codecs of chunks, each bounded: what would unpack to more than its chunk holds is refused before it does."""

import struct
import zlib
from typing import Any

import google_crc32c
from numcodecs import zstd

from feeler.errors import InvalidInput


def check_sum(raw: bytes, what: str) -> bytes:
    """``raw`` without its trailing CRC-32C; InvalidInput where that does not fit."""
    if len(raw) < 4 or struct.unpack("<I", raw[-4:])[0] != google_crc32c.value(raw[:-4]):
        raise InvalidInput(f"{what} is damaged: its checksum does not fit its content.")
    return raw[:-4]


def split_texts(raw: bytes, count: int, what: str) -> list[str]:
    """The ``count`` texts of a ``vlen-utf8`` chunk."""
    if len(raw) < 4 or struct.unpack("<I", raw[:4])[0] != count or 4 + 4 * count > len(raw):
        raise InvalidInput(f"{what} is damaged: it does not hold {count} texts.")
    texts, place = [], 4
    for _ in range(count):
        length = int.from_bytes(raw[place : place + 4], "little")
        place += 4 + length
        if place > len(raw):
            raise InvalidInput(f"{what} is damaged: a text runs over its end.")
        texts.append(raw[place - length : place].decode("utf-8", errors="replace"))
    return texts


def _read_zstd(raw: bytes, most: int, what: str) -> bytes:
    _refuse_bomb(_zstd_size(raw), most, what)
    return _decompress(zstd.decompress, raw, what)


def _zstd_size(raw: bytes) -> int:
    """Decompressed size that a zstd frame states (RFC 8878, 3.1.1.1), or −1 where it states none."""
    if len(raw) < 6 or raw[:4] != b"\x28\xb5\x2f\xfd":
        return -1
    flag, single, dictionary = raw[4] >> 6, raw[4] >> 5 & 1, raw[4] & 3
    width = {0: single, 1: 2, 2: 4, 3: 8}[flag]
    start = 5 + (not single) + (0, 1, 2, 4)[dictionary]
    stated = raw[start : start + width]
    return int.from_bytes(stated, "little") + (256 if flag == 1 else 0) if width and len(stated) == width else -1


def _read_gzip(raw: bytes, most: int, what: str) -> bytes:
    stream = zlib.decompressobj(wbits=31)
    try:
        out = stream.decompress(raw, most + 1)
    except zlib.error as error:
        raise InvalidInput(f"{what} is damaged: {error}.") from error
    _refuse_bomb(len(out), most, what)
    return out


def _refuse_bomb(size: int, most: int, what: str) -> None:
    if not 0 <= size <= most:
        raise InvalidInput(f"{what} is damaged or hostile: it unpacks to other than the {most:,} bytes of its chunk.")


def _decompress(function: Any, raw: bytes, what: str) -> bytes:
    try:
        return bytes(function(raw))
    except (RuntimeError, ValueError, MemoryError) as error:
        raise InvalidInput(f"{what} is damaged: {error}.") from error


DECOMPRESS = {"zstd": _read_zstd, "gzip": _read_gzip}
"""Compressors that can be read, each as ``function(raw, most, what)`` giving at most ``most`` bytes."""
