"""The one safe way to read a whole small file: regular, within a limit, and JSON only where it is
JSON.
"""

import json
import os
import re
import stat
from pathlib import Path
from typing import Any

from feeler.errors import InvalidInput

NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
"""Names that a variable, an attribute of a file or a parameter of a model may have."""


def read_bytes(path: str | os.PathLike, max_bytes: int, *, follow: bool = True) -> bytes:
    """The bytes of a regular file of at most ``max_bytes``; pipes, devices and (``follow=False``)
    links are refused.
    """
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
        raise InvalidInput(
            f"{os.fspath(path)} has {info.st_size:,} bytes, over the limit of {max_bytes:,}."
            " Split it."
        )
    with os.fdopen(descriptor, "rb") as file:
        # not max_bytes: Python takes the memory for all that it is asked for
        return file.read(info.st_size)


def read_text(path: str | os.PathLike, max_bytes: int) -> str:
    """The text of a regular UTF-8 file of at most ``max_bytes``, lines ended by newlines."""
    raw, source = read_bytes(path, max_bytes), os.fspath(path)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(
            f"{source} is not UTF-8 text (byte {error.start}). Export it as CSV in UTF-8."
        ) from error
    if "\0" in text:
        raise InvalidInput(f"{source} holds NUL bytes: a binary file. Export it as CSV in UTF-8.")
    return text.replace("\r\n", "\n").replace("\r", "\n")


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
    """Entries of a folder, by name; a symbolic link among them is refused, since it may lead
    anywhere.
    """
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError as error:
        raise InvalidInput(f"cannot read the folder {folder}: {error.strerror}.") from error
    for entry in entries:
        if entry.is_symlink():
            raise InvalidInput(
                f"{entry.path} is a symbolic link; inside a store they are refused. Copy the"
                " data in."
            )
    return entries
