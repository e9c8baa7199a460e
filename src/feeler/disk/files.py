"""Small files: the one safe way to read one whole (regular, within a limit, JSON only where it is
JSON), and to be the only one who writes.
"""

import contextlib
import errno
import json
import os
import re
import shutil
import socket
import stat
import tempfile
import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from filelock import FileLock, Timeout

from feeler.disk.foreign import name_start
from feeler.errors import FeelerError, InvalidInput, StoreError

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of the system that say that there is no room left."""
TEMPORARY_DAYS = 7.0  # [C] days; no run of ours needs its temporary folders for longer
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
        raise InvalidInput(
            f"cannot read {os.fspath(path)!s}: {reason}. Check the path."
        ) from error
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


def find_file(path: str | os.PathLike, kinds: Iterable[str], max_bytes: int) -> Path:
    """The path of a regular file of at most ``max_bytes`` whose name ends in one of ``kinds``."""
    try:
        path = Path(path)
        there, size = path.is_file(), path.stat().st_size if path.exists() else 0
    except (TypeError, ValueError, OSError) as error:
        raise InvalidInput(f"path must name a file, got {str(path)[:80]!r}.") from error
    if path.suffix.lower() not in kinds:
        raise InvalidInput(
            f"{path.name!r} is none of {', '.join(kinds)}; save it as one of these."
        )
    if not there:
        raise InvalidInput(f"cannot read {path}: no such file. Check the path.")
    if size > max_bytes:
        raise InvalidInput(f"{path} has {size:,} bytes, over the limit of {max_bytes:,}.")
    return path


@contextlib.contextmanager
def writing(path: str | os.PathLike) -> Iterator[Path]:
    """A file beside ``path`` to be written, which takes that name once it is whole.

    Raises
    ------
    InvalidInput
        ``path`` cannot be a file, a folder for instance.
    StoreError
        The disk is full; what was there before stays.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        raise InvalidInput(f"cannot write {path}: it is no file. Name a file in a folder.")
    part = path.parent / f".part.{path.name}"
    try:
        yield part
        part.replace(path)
    except FeelerError:
        raise
    except OSError as error:
        if error.errno in FULL:
            size = part.stat().st_size if part.exists() else 0
            raise StoreError(
                f"no room left for {path}, of which {size:,} bytes were written. Free some space"
                " and do it again; what was there before is as it was."
            ) from error
        reason = error.strerror or error
        raise InvalidInput(
            f"cannot write {path}: {reason}. Name a file in a folder that is there."
        ) from error
    finally:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)


def write_text(path: str | os.PathLike, text: str) -> None:
    """Write a text in UTF-8; the file is whole or stays as it was, see :func:`writing`."""
    with writing(path) as part:
        part.write_text(text, encoding="utf-8")


def ensure_folder(path: str | os.PathLike) -> Path:
    """The folder of this path, made where it is not there yet."""
    try:
        Path(path).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        words = f"cannot make the folder {os.fspath(path)!s}: {error.strerror}. Name another."
        raise InvalidInput(words) from error
    return Path(path)


def read_start(path: str | os.PathLike, n_bytes: int) -> bytes:
    """The first bytes of a regular file, by which it is recognised."""
    try:
        if not os.path.isfile(
            path
        ):  # also false for pipes and devices, which could keep us waiting
            reason = "not a regular file" if os.path.exists(path) else "no such file"
            raise InvalidInput(f"cannot read {path!s}: {reason}. Check the path.")
        with open(path, "rb") as file:
            return file.read(n_bytes)
    except (OSError, ValueError) as error:
        if isinstance(error, InvalidInput):
            raise
        words = getattr(error, "strerror", None) or error
        raise InvalidInput(f"cannot read {path!s}: {words}.") from error


def read_text(path: str | os.PathLike, max_bytes: int) -> str:
    """The text of a regular UTF-8 file of at most ``max_bytes``, lines ended by newlines."""
    raw, source = read_bytes(path, max_bytes), os.fspath(path)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(_name_binary(source, raw, error.start)) from error
    if "\0" in text:
        raise InvalidInput(_name_binary(source, raw, text.index("\0")))
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _name_binary(source: str, raw: bytes, place: int) -> str:
    """What is said of a file that is no text."""
    if words := name_start(raw[:512]):
        return f"{source} is {words}."
    if 0 in raw[:512]:
        return (
            f"{source} is a binary file of a kind that feeler does not know, no table of text."
        )
    return f"{source} is not UTF-8 text (byte {place}). Save it again as CSV in UTF-8."


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


@contextlib.contextmanager
def temporary_folder() -> Iterator[Path]:
    """A folder that goes at the end; those of processes that were killed go after a week."""
    sweep_old(Path(tempfile.gettempdir()), "feeler-once-*", days=TEMPORARY_DAYS)
    with tempfile.TemporaryDirectory(
        prefix="feeler-once-", ignore_cleanup_errors=True
    ) as folder:
        yield Path(folder)


def sweep_old(folder: Path, pattern: str, *, keep: int = 0, days: float = 0.0) -> None:
    """Remove what matches in a folder, but the ``keep`` newest and what is younger than ``days``;
    what cannot be removed stays.
    """
    latest = time.time() - days * 24 * 3600
    for path in sorted(folder.glob(pattern), key=_find_time, reverse=True)[keep:]:
        if _find_time(path) <= latest:
            with contextlib.suppress(OSError):
                shutil.rmtree(path) if path.is_dir() else path.unlink()


def _find_time(path: Path) -> float:
    try:
        return path.lstat().st_mtime
    except OSError:  # somebody else removed it
        return 0.0


class Lock:
    """Holds a file locked until ``release``; it vanishes with its holder, however that ends.

    Raises
    ------
    StoreError
        Another writer holds it (the message names it), or there are no locks to be had.
    """

    def __init__(self, path: Path, what: str) -> None:
        self._lock = FileLock(path, thread_local=False)
        self._holder = holder = path.with_name(f"{path.name}.holder")
        try:
            self._lock.acquire(blocking=False)
        except Timeout:
            name = (
                holder.read_text(errors="replace")[:200].strip()
                if holder.is_file()
                else "another process"
            )
            if name.startswith(f"process {os.getpid()} "):
                raise StoreError(
                    f"{what} is already open for writing in this process. Close it first."
                ) from None
            raise StoreError(
                f"{what} is being written by {name}. Wait until it has finished, or use another"
                " one."
            ) from None
        except (NotImplementedError, OSError) as error:
            reason = getattr(error, "strerror", None) or "this file system has none"
            raise StoreError(
                f"{what} cannot be locked against other writers ({reason}). Use a folder that you"
                " may write to, on another disk if need be."
            ) from error
        # A full disk must not lock anyone out: the name is only for the message.
        with contextlib.suppress(OSError):
            holder.write_text(f"process {os.getpid()} on {socket.gethostname()}\n")

    def release(self) -> None:
        """Let go; a second call does nothing."""
        if self._lock.is_locked:
            with contextlib.suppress(OSError):
                self._holder.unlink()
        self._lock.release()
