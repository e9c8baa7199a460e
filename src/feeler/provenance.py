"""What a result depends on, its key, and a journal of what was computed.

The identity of a result is feeler's version, a version of its physics and the configuration.
"""

import dataclasses
import errno
import hashlib
import json
import math
import os
import platform
import re
from collections.abc import Callable
from contextlib import AbstractContextManager
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from feeler.errors import InvalidInput, StoreError
from feeler.files import Lock, parse_json, read_bytes

LICENCE = (  # of data made by simulation; change it in the file's attributes if yours is another
    "CC0-1.0"
)
_PACKAGES = (
    "feeler",
    "mujoco",
    "numpy",
    "scipy",
    "numba",
    "xarray",
    "scikit-learn",
)  # said in each file feeler writes
PHYSICS = 1
"""Version of the simulated mechanics: raised by hand when a change moves any bit that a parity test
holds. Results of another version are not mixed and are computed again."""


@cache
def list_versions() -> dict[str, str]:
    """Versions of Python and of the packages that can change a number."""
    return {
        "python": platform.python_version(),
        **{name: find_version(name) for name in _PACKAGES},
    }


def describe_versions() -> str:
    """The same in words, for the foot of a page."""
    return ", ".join(f"{name} {have}" for name, have in list_versions().items() if have)


@cache
def find_version(package: str) -> str:
    """Version of a package by the name that it is installed under; "" if it is not installed."""
    try:
        return version(package)
    except PackageNotFoundError:
        return ""


def name_release() -> str:
    """feeler's version without its patch number, under which results stay the same."""
    return ".".join(find_version("feeler").split(".")[:2])


_PLAIN = {str, int, bool, type(None)}


def to_jsonable(value: Any, *, loose: bool = False) -> Any:
    """``value`` in JSON's types: arrays become lists, dataclasses dictionaries (or what their
    ``to_plain`` says), infinities and NaN words. ``loose`` is as :func:`to_json` says.
    """
    if hasattr(value, "to_plain"):
        value = value.to_plain()
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        value = {f.name: getattr(value, f.name) for f in dataclasses.fields(value)}
    elif isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    named = isinstance(value, dict)
    if named or isinstance(value, list | tuple):
        items = [
            item
            if type(item) in _PLAIN or (type(item) is float and math.isfinite(item))
            else to_jsonable(item, loose=loose)
            for item in (value.values() if named else value)
        ]
        return dict(zip(map(str, value), items, strict=True)) if named else items
    if isinstance(value, float):
        return value if math.isfinite(value) else None if loose else str(value)
    if value is None or isinstance(value, str | int | bool):
        return value
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if loose:
        return to_json(value.values) if hasattr(value, "values") else str(value)
    raise InvalidInput(
        f"a configuration holds numbers, texts, lists and dictionaries; got {type(value).__name__}."
    )


def to_json(value: Any) -> Any:
    """The same for files that others read: what is not a number becomes null, labelled arrays their
    values, and what has no type of JSON its text.
    """
    return to_jsonable(value, loose=True)


def write_canonical(configuration: Any) -> str:
    """The configuration as JSON with sorted keys: equal configurations give equal texts."""
    return write_plain(to_jsonable(configuration))


def write_plain(plain: Any) -> str:
    """The canonical text of what is in JSON's types already."""
    return json.dumps(plain, sort_keys=True, ensure_ascii=False, separators=(",", ":"))


def compute_digest(configuration: Any) -> str:
    """SHA-256 of the canonical text, in hexadecimal."""
    return hashlib.sha256(write_canonical(configuration).encode()).hexdigest()


def make_key(configuration: Any) -> str:
    """A short name for a result: another one where the configuration, feeler's version (less its
    patch number) or the version of its physics differs.

    Parameters
    ----------
    configuration
        What the result is made with; numbers, texts, lists, dictionaries, arrays and dataclasses.
    """
    made_by = {"feeler": name_release(), "physics": PHYSICS}
    return compute_digest({"configuration": configuration, **made_by})[:16]


# Journal: what was computed, on disk as soon as it is known, so that whoever was interrupted
# goes on from there.

_MAX_BYTES = 256 * 2**20  # [C] a million antennas
_REMEDY = "Free some space and run the same command again; it goes on from what is kept."
_FIRST_LINE = re.compile(rb'\{"key": "([0-9a-f]{1,16})"\}')


class Journal(AbstractContextManager):
    """Results by name, one line of JSON each; without a path they are only kept in memory.

    ::

        with Journal(path, key=make_key(task, __name__), of="search") as journal:
            bits = journal.get_or(lambda: simulate(antenna), antenna.name, speed)

    A name is any numbers, texts, lists and arrays, and so is a result; it comes back in JSON's
    types, floats to the last bit, arrays as lists, NaN and inf as words (``np.array(found, float)``
    reads them). A last line that was cut while it was written is dropped.
    A file that holds anything else, were it one letter, is left as it is.

    Parameters
    ----------
    key
        What :func:`feeler.provenance.make_key` makes of all that the results follow from.
    of
        What is kept, for messages: "search".

    Raises
    ------
    InvalidInput
        The file is something else, or belongs to another key; it is left as it is.
    StoreError
        Another process writes to it, or it cannot be written.
    """

    def __init__(self, path: str | Path | None = None, key: str = "0", of: str = "fit") -> None:
        self._file: Any = None
        self._entries: dict[str, Any] = {}
        if path is None:
            return
        self._path, self._size = Path(path), 0
        first = json.dumps({"key": key}).encode()
        if not _FIRST_LINE.fullmatch(first):
            raise InvalidInput(
                f"a journal's key must be 1 to 16 hexadecimal digits, got {key!r}."
            )
        lock = self._path.with_name(f".{self._path.name}.lock")
        self._lock = Lock(lock, f"the journal {path}")
        try:
            if self._path.exists():
                self._entries, self._size = _read_journal(self._path, key, of)
            self._file = self._path.open("ab", buffering=0)
            self._file.truncate(self._size)
            if not self._size:
                self._write(first + b"\n")
        except BaseException as error:
            self.close()
            if isinstance(error, OSError) and not isinstance(error, StoreError):
                raise StoreError(f"cannot write {self._path}: {error.strerror}.") from error
            raise

    def __len__(self) -> int:
        return len(self._entries)

    def find(self, *name: Any) -> Any:
        """The result of this name; None where it is not known."""
        return self._entries.get(_write_name(name))

    def add(self, result: Any, *name: Any) -> Any:
        """Remember a result, here and on disk; gives it as ``find`` will."""
        plain = to_jsonable(result)
        if self._file is not None:
            line = json.dumps({"name": to_jsonable(name), "result": plain}, ensure_ascii=False)
            self._write(line.encode() + b"\n")
        self._entries[_write_name(name)] = plain
        return plain

    def get_or(self, make: Callable[[], Any], *name: Any) -> Any:
        """The result of this name; where it is not known, ``make`` makes it."""
        known = self.find(*name)
        return self.add(make(), *name) if known is None else known

    def _write(self, line: bytes) -> None:
        try:
            if self._file.write(line) != len(line):
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        except OSError as error:
            self._file.truncate(
                self._size
            )  # the next line must not be glued to a part of this one
            self._file.seek(self._size)
            raise StoreError(
                f"cannot write {len(line):,} bytes to {self._path}, which holds {self._size:,}:"
                f" {error.strerror}. {_REMEDY}"
            ) from error
        self._size += len(line)

    def close(self) -> None:
        """Let go of the file."""
        if self._file is not None:
            self._file.close()
        if hasattr(self, "_lock"):
            self._lock.release()

    def __exit__(self, *_: object) -> None:
        self.close()


def _read_journal(path: Path, key: str, of: str = "fit") -> tuple[dict[str, Any], int]:
    """Results of a journal by name, and how many bytes of the file are whole lines.

    Raises
    ------
    InvalidInput
        The file is something else, or belongs to another key.
    """
    raw = read_bytes(path, _MAX_BYTES)
    whole = raw.rfind(b"\n") + 1
    if not raw:
        return {}, 0
    try:
        first, *lines = raw[:whole].splitlines()
        found = _FIRST_LINE.fullmatch(first)[1].decode()  # type: ignore[index]
        kept = [parse_json(line, "a line") for line in lines]
        entries = {_write_name(line["name"]): line["result"] for line in kept}
    except (InvalidInput, KeyError, ValueError, TypeError) as error:
        raise InvalidInput(
            f"{path} is no journal of a {of} ({error}). Name another; it is left as it is."
        ) from error
    if found != key:
        raise InvalidInput(
            f"{path} belongs to another {of}: settings or versions differ. Remove it, or name"
            " another."
        )
    return entries, whole


def _write_name(name: Any) -> str:
    return write_plain(to_jsonable(name))
