"""Limits: what a file may ask for before any memory is taken, and the one safe way to open a file."""

import json
import math
import os
import re
import stat
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from feeler.errors import InvalidInput

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
"""Names that a variable, an attribute of a file or a parameter of a model may have."""


@dataclass(frozen=True, kw_only=True)
class Limits:
    """What is read at most from one file or store; all [C], adjustable here or with FEELER_MAX_GIB."""

    max_bytes: int = 4 * 2**30
    """Bytes of numbers once decompressed (default 4 GiB; 90 trials of 56 sensors take 50 MiB)."""
    max_arrays: int = 256
    """Variables in one file."""
    max_chunks: int = 1_000_000
    """Chunks of one array."""
    max_text: int = 64 * 2**20
    """Bytes of JSON, TOML or CSV text in one file."""
    max_seconds: float = 120.0
    """Time that the reader of an HDF5 file is given."""

    def __post_init__(self) -> None:
        for name, value in vars(self).items():
            if not value > 0:
                raise InvalidInput(f"Limits.{name} must be > 0, got {value!r}.")

    def check_bytes(self, n_bytes: int, what: str) -> None:
        """Raise where ``n_bytes`` exceeds ``max_bytes``."""
        if n_bytes > self.max_bytes:
            raise InvalidInput(
                f"{what} asks for {_size(n_bytes)}, over the limit of {_size(self.max_bytes)}. If you trust the file, "
                "raise the limit: Limits(max_bytes=…), or FEELER_MAX_GIB in the environment."
            )

    def check_shape(self, shape: tuple[int, ...], item_size: int, what: str) -> int:
        """Bytes of an array of this shape; raises on anything but a few whole numbers ≥ 0 within the limits."""
        if len(shape) > 8 or not all(isinstance(n, int) and not isinstance(n, bool) and n >= 0 for n in shape):
            raise InvalidInput(f"{what} has the shape {str(shape)[:80]}; a shape is up to 8 whole numbers ≥ 0.")
        n_bytes = math.prod(shape) * max(int(item_size), 1)
        self.check_bytes(n_bytes, what)
        return n_bytes


def find_limits(limits: Limits | None = None) -> Limits:
    """The limits given, or the defaults with FEELER_MAX_GIB from the environment."""
    if limits is not None:
        return limits
    text = os.environ.get("FEELER_MAX_GIB")
    if not text:
        return Limits()
    try:
        return Limits(max_bytes=int(float(text) * 2**30))
    except (ValueError, OverflowError):
        raise InvalidInput(f"FEELER_MAX_GIB must be a number > 0 of GiB, got {text[:40]!r}.") from None


def read_bytes(path: str | os.PathLike, max_bytes: int, *, follow: bool = True) -> bytes:
    """The bytes of a regular file of at most ``max_bytes``; pipes, devices and (``follow=False``) links are refused."""
    flags = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC | (0 if follow else os.O_NOFOLLOW)
    try:
        descriptor = os.open(path, flags)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InvalidInput(f"cannot read {os.fspath(path)!s}: {reason}. Check the path.") from error
    info = os.fstat(descriptor)
    if not stat.S_ISREG(info.st_mode) or info.st_size > max_bytes:
        os.close(descriptor)
        if not stat.S_ISREG(info.st_mode):
            raise InvalidInput(f"{os.fspath(path)} is not a regular file.")
        raise InvalidInput(f"{os.fspath(path)} has {_size(info.st_size)}, over the limit of {_size(max_bytes)}.")
    with os.fdopen(descriptor, "rb") as file:
        return file.read(info.st_size)  # not max_bytes: Python takes the memory for all that it is asked for


def parse_json(raw: bytes, what: str) -> dict[str, Any]:
    """The JSON object in ``raw``; anything else is an InvalidInput that names ``what``."""

    def refuse(constant: str) -> None:
        raise ValueError(f"{constant} is not JSON")

    try:
        value = json.loads(raw.decode("utf-8"), parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise InvalidInput(f"{what} is not valid JSON: {str(error)[:200]}.") from error
    if not isinstance(value, dict):
        raise InvalidInput(f"{what} must be a JSON object, got {type(value).__name__}.")
    return value


def list_folder(folder: Path) -> list[os.DirEntry]:
    """Entries of a folder, by name; a symbolic link among them is refused, since it may lead anywhere."""
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError as error:
        raise InvalidInput(f"cannot read the folder {folder}: {error.strerror}.") from error
    for entry in entries:
        if entry.is_symlink():
            raise InvalidInput(f"{entry.path} is a symbolic link; inside a store they are refused. Copy the data in.")
    return entries


def _size(n_bytes: int) -> str:
    for unit, factor in (("GiB", 2**30), ("MiB", 2**20), ("KiB", 2**10)):
        if n_bytes >= factor:
            return f"{n_bytes / factor:.4g} {unit}" if n_bytes < 2**80 else f"over 2^80 bytes ({unit})"
    return f"{n_bytes} bytes"
