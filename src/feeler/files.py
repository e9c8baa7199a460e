"""Small files read safely and written atomically: bytes, text, JSON and TOML."""

import codecs
import contextlib
import errno
import json
import os
import re
import secrets
import shutil
import socket
import stat
import tempfile
import time
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from types import ModuleType
from typing import Any, BinaryIO, TypeVar

from feeler.errors import FeelerError, InvalidInput, StoreError, require_extra
from feeler.records import Record

# What a file is that a reader cannot read, by how it begins: in words, with what to do.

_KINDS = (
    (rb"\x89HDF\r\n\x1a\n", "an HDF5 file; feeler info says what is in it"),
    (rb"\x89MCAP", "a ROS 2 recording (MCAP): feeler robot check and convert read it"),
    (rb"#ROSBAG V2", "a ROS 1 recording (bag): feeler robot check and convert read it"),
    (rb"#ROSBAG", "an old ROS 1 recording: mend it with rosbag fix, then feeler robot check"),
    (rb"SQLite format 3\0", "an SQLite file; as a ROS 2 recording feeler robot check reads it"),
    (
        rb"PK\x03\x04(?s:.*)(?:\[Content_Types\]|xl/|oasis.opendoc)|\xd0\xcf\x11\xe0",
        "a document (Excel, Word, OpenDocument): save a sheet of it as CSV in UTF-8",
    ),
    (
        rb"PK\x03\x04",
        "a ZIP archive (.npz, .zip): unpack it first; pickled content is never read",
    ),
    (rb"\x1f\x8b", "compressed by gzip: unpack it first, with gunzip"),
    (
        rb"BZh|\xfd7zXZ|\x28\xb5\x2f\xfd|7z\xbc\xaf|Rar!|(?s:.{257})ustar",
        "an archive, or compressed: unpack it first",
    ),
    (
        rb"version https://git-lfs",
        "a pointer of Git LFS, not the file: fetch it by git lfs pull",
    ),
    (rb"CDF[\x01\x02\x05]", "NetCDF-3: convert it with nccopy -k nc4, or by xarray"),
    (rb"MATLAB 7\.3", "MATLAB -v7.3: save it with '-v7', or as NetCDF"),
    (rb"MATLAB 5\.0", "a MATLAB file; feeler info says whether feeler wrote it"),
    (rb"\x93NUMPY", "a NumPy array: save it as CSV with a header row, by numpy.savetxt"),
    (rb"ARROW1", "a table for programs (Arrow): write it as CSV, by pandas"),
    (
        rb"(?s:.{4})(?:ftyp|wide|mdat|moov)|RIFF(?s:.{4})AVI |\x1a\x45\xdf\xa3"
        rb"|\0\0\x01\xba|\x30\x26\xb2\x75",
        "a film: track landmarks in it first (DeepLabCut, SLEAP), then feeler tracks",
    ),
    (rb"\x89PNG|\xff\xd8\xff|GIF8|II\*\0|MM\0\*|BM", "a picture, which holds no touches"),
    (rb"%PDF", "a PDF document"),
    (rb"\x80[\x02-\x05]", "a Python pickle, which can run programs when opened: never read"),
    (rb"RIFF(?s:.{4})WAVE", "a sound, which holds no touches"),
    (rb'\s*(?:\{\s*"|\[\s*[\[{"\d])', "JSON: write its tracks or readings as a CSV table"),
    (rb"\s*<(?:!|\?xml|html)", "a web page or XML, no table: export it as CSV"),
)


def sniff_file_type(start: bytes) -> str:
    """What a file is that begins so, with what to do; empty where nobody knows."""
    return next((words for magic, words in _KINDS if re.match(magic, start)), "")


# Small files: the one safe way to read one whole (regular, within a limit, JSON only where it
# is JSON), and to be the only one who writes.

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
"""Errors of the system that say that there is no room left."""
_UTF_16 = (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
TEMPORARY_DAYS = 7.0  # [C] days; no run of ours needs its temporary folders for longer
NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,63}")
"""Names that a variable, an attribute of a file or a parameter of a model may have."""


def _open_regular(path: str | os.PathLike, max_bytes: int | None = None) -> BinaryIO:
    """A regular file of at most ``max_bytes``, open for reading."""
    name = os.fspath(path)
    try:
        file = os.fdopen(os.open(path, os.O_RDONLY | os.O_NONBLOCK), "rb")
    except (OSError, ValueError) as error:
        known: dict[type, str] = {FileNotFoundError: "no such file"}
        known[IsADirectoryError] = "not a regular file"
        reason = known.get(type(error)) or getattr(error, "strerror", None) or error
        raise InvalidInput(f"cannot read {name!s}: {reason}. Check the path.") from error
    info = os.fstat(file.fileno())
    wrong = ""
    if not stat.S_ISREG(info.st_mode):
        wrong = "is not a regular file"
    elif max_bytes is not None and info.st_size > max_bytes:
        wrong = f"has {info.st_size:,} bytes, over the limit of {max_bytes:,}. Split it"
    if wrong:
        file.close()
        raise InvalidInput(f"{name!s} {wrong}.")
    return file


def read_bytes(path: str | os.PathLike, max_bytes: int) -> bytes:
    """The bytes of a regular file of at most ``max_bytes``; pipes and devices are refused."""
    with _open_regular(path, max_bytes) as file:
        # not max_bytes: Python takes the memory for all that it is asked for
        return file.read(os.fstat(file.fileno()).st_size)


def read_start(path: str | os.PathLike, n_bytes: int) -> bytes:
    """The first bytes of a regular file, by which it is recognised; text as UTF-8."""
    with _open_regular(path) as file:
        start = file.read(n_bytes)
    return start.decode("utf-16", "ignore").encode() if start[:2] in _UTF_16 else start


def find_file(path: str | os.PathLike, kinds: Iterable[str], max_bytes: int) -> Path:
    """The path of a regular file of at most ``max_bytes`` whose name ends in one of ``kinds``."""
    path = Path(path)
    if path.suffix.lower() not in kinds:
        raise InvalidInput(
            f"{path.name!r} is none of {', '.join(kinds)}; save it as one of these."
        )
    _open_regular(path, max_bytes).close()
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
    if os.path.exists(path) and not path.is_file():
        raise InvalidInput(f"cannot write {path}: it is no file. Name a file in a folder.")
    part = (
        path.parent / f".{secrets.token_hex(4)}.part{path.suffix}"
    )  # others may write it, too
    try:
        yield part
        part.replace(path)
    except FeelerError:
        raise
    except OSError as error:
        # HDF5 hides the system's number in lines about its own inside
        hidden = re.search(r"errno = (\d+)", str(error))
        number = error.errno or (int(hidden[1]) if hidden else 0)
        if number in FULL:
            size = part.stat().st_size if part.exists() else 0
            raise StoreError(
                f"no room left for {path}, of which {size:,} bytes were written. Free some space"
                " and do it again; what was there before is as it was."
            ) from error
        reason = os.strerror(number) if number else str(error).split("\n")[0][:100]
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


def read_text(path: str | os.PathLike, max_bytes: int) -> str:
    """The text of a regular file of at most ``max_bytes``, lines ended by newlines: UTF-8, or
    UTF-16 that begins with its mark, as Excel writes "Unicode text".
    """
    raw, source = read_bytes(path, max_bytes), os.fspath(path)
    try:
        text = raw.decode("utf-16" if raw[:2] in _UTF_16 else "utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput(_name_binary(source, raw, error.start)) from error
    if "\0" in text:
        raise InvalidInput(_name_binary(source, raw, text.index("\0")))
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _name_binary(source: str, raw: bytes, place: int) -> str:
    """What is said of a file that is no text."""
    if words := sniff_file_type(raw[:512]):
        return f"{source} is {words}."
    if 0 in raw[:512]:
        return (
            f"{source} is a binary file of a kind that feeler does not know, no table of text."
        )
    return f"{source} is not UTF-8 text (byte {place}). Save it again in UTF-8."


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


def read_shipped(package: str, name: str) -> dict[str, Any]:
    """What a TOML or JSON file in the folder of a package holds."""
    text = resources.files(package).joinpath(name).read_text(encoding="utf-8")
    return json.loads(text) if name.endswith(".json") else parse_toml(text, name)


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
    with contextlib.suppress(OSError):
        for path in sorted(folder.glob(pattern), key=os.path.getmtime, reverse=True)[keep:]:
            if path.stat().st_mtime <= latest and path.is_dir():
                shutil.rmtree(path, ignore_errors=True)
            elif path.stat().st_mtime <= latest:
                path.unlink()


class Lock:
    """Holds a file locked until ``release``; it vanishes with its holder, however that ends.

    Raises
    ------
    StoreError
        Another writer holds it (the message names it), or there are no locks to be had.
    """

    def __init__(self, path: Path, what: str) -> None:
        require_extra("filelock", "store", f"writing {what}")
        from filelock import FileLock, Timeout

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


# The one door for TOML, in and out: what a file holds becomes a dictionary or a record.
#
# ::
#
#     plan = make_record(Plan, read_toml("plan.toml", schema="feeler.plan/1"), "plan.toml")
#     save_toml(plan.to_plain(), "plan.toml")
#
# ``[task]`` fills the field ``task`` of the plan, which is a record itself. What does not fit
# is named: ``plan.toml: [task] speed must be > 0 m/s, got -1.``

MAX_TOML = 4 * 2**20  # [C] 1000 segments with 17 digits take 150 KB
# characters; tomllib needs a second for the worst text of this length, and for longer ones hours
_SMALL = 16_000
_IN_A_ROW = 5  # numbers of a long list in a line
_R = TypeVar("_R", bound=Record)


def read_toml(path: str | os.PathLike, *, schema: str = "") -> dict[str, Any]:
    """What a TOML file holds.

    Parameters
    ----------
    schema
        What the file's first key ``schema`` must say; it is left out of what is returned.

    Raises
    ------
    InvalidInput
        No small file, not TOML, or another schema; the message names the file.
    """
    name = Path(path).name
    content = parse_toml(read_text(path, MAX_TOML), name)
    if schema and (found := content.pop("schema", None)) != schema:
        raise InvalidInput(f"{name}: schema must be {schema!r}, got {str(found)[:40]!r}.")
    return content


def make_record(kind: type[_R], content: Mapping[str, Any], source: str) -> _R:
    """A record from the content of a file called ``source``.

    Raises
    ------
    InvalidInput
        Unknown or missing keys, or values that do not fit; the message names file and table.
    """
    try:
        return kind.from_plain(content)
    except InvalidInput as error:
        words = str(error).removeprefix(error.subject).removeprefix(".").strip()
        where = f": [{'.'.join(map(str, error.tables))}]" if error.tables else ""
        about_a_field = not words.startswith(("has no ", "needs "))
        colon = ":" if about_a_field and not where else ""
        raise InvalidInput(f"{source}{where}{colon} {words}") from error


def parse_toml(text: str, source: str = "text") -> dict[str, Any]:
    """The content of a TOML text of unknown origin; a long one is parsed by the guard.

    Raises
    ------
    InvalidInput
        Not TOML; ``source`` is named.
    """
    try:
        if len(text) <= _SMALL:
            return tomllib.loads(text)
        from feeler.sandbox import open_guarded

        with temporary_folder() as folder:
            path = folder / "TOML"
            path.write_text(text, encoding="utf-8")
            return open_guarded("feeler.files:_parse_file", path)[0]
    except (ValueError, RecursionError) as error:
        words = str(error)[:300].rstrip(".")
        raise InvalidInput(f"{source} is not valid TOML: {words}.") from error


def _parse_file(path: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What the guard's process does for :func:`parse_toml`."""
    return tomllib.loads(Path(path).read_text(encoding="utf-8")), {}


def save_toml(content: Mapping[str, Any], path: str | os.PathLike) -> None:
    """Write plain data as TOML; the file is whole or stays as it was.

    Raises
    ------
    InvalidInput
        The file cannot be written.
    """
    write_text(path, write_toml(content))


def write_toml(content: Mapping[str, Any]) -> str:
    """Plain data as a TOML text: values first, then a table for each dictionary; None is left
    out.
    """
    return "\n".join(_write_table(content, "")) + "\n"


def _write_table(content: Mapping[str, Any], name: str) -> list[str]:
    given = {key: value for key, value in content.items() if value is not None}
    tables = {key: value for key, value in given.items() if isinstance(value, Mapping)}
    lines = [f"{key} = {_write_value(given[key])}" for key in given if key not in tables]
    for key, table in tables.items():
        inner = f"{name}.{key}".removeprefix(".")
        rows = _write_table(table, inner)
        has_values = not rows or not all(isinstance(value, Mapping) for value in table.values())
        lines += ["", f"[{inner}]", *rows] if has_values else rows
    return lines


def _write_value(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, str):
        # A TOML basic string; JSON's escapes are a part of TOML's.
        try:
            value.encode("utf-8")
        except UnicodeEncodeError as error:
            raise InvalidInput(f"{value[:40]!r} is no valid Unicode text.") from error
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        given = (f"{key} = {_write_value(v)}" for key, v in value.items() if v is not None)
        return f"{{{', '.join(given)}}}"
    if isinstance(value, list | tuple):
        texts = [_write_value(item) for item in value]
        if len(texts) <= _IN_A_ROW or all(isinstance(item, int) for item in value):
            return f"[{', '.join(texts)}]"
        starts = range(0, len(texts), _IN_A_ROW)
        rows = [f"  {', '.join(texts[start : start + _IN_A_ROW])}," for start in starts]
        return "\n".join(["[", *rows, "]"])
    return repr(value)


# Writing so that it lasts: a file is complete under its name or absent, and a finished one
# survives a power cut.

TEMPORARY = ".tmp"
_LEAST_SHARE = (
    0.7  # [C] of their size in memory that tensors take at least when they are compressed
)


def write_atomic(path: Path, data: bytes) -> None:
    """Write ``data`` under another name, wait for the disk, rename, wait again: whole or absent at
    any moment.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}{TEMPORARY}")
    try:
        with open(temporary, "wb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(temporary, path)
    except BaseException:
        temporary.unlink(missing_ok=True)
        raise
    # Wait until the disk has the folder's list of names.
    descriptor = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


def check_room(path: Path, n_bytes: int, what: str) -> None:
    """Refuse what will not find room on the disk; numbers of touches shrink by a tenth or more when
    they are compressed.

    Raises
    ------
    StoreError
        With the estimate, and what is free.
    """
    free = shutil.disk_usage(path if path.exists() else path.absolute().parent).free
    if _LEAST_SHARE * n_bytes > free:
        raise StoreError(
            f"{what} need about {n_bytes / 2**30:.3g} GiB at {path}, where {free / 2**30:.3g} GiB"
            ' are free. Free some space, or ask for fewer trials, for save=("angle",) or for'
            ' dtype="float32".'
        )


def measure_folder(folder: Path) -> int:
    """Bytes of all files in a folder and in those within it."""
    return sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())


@contextlib.contextmanager
def explain(path: Path, state: str = "nothing is lost") -> Iterator[None]:
    """Turn the system's errors into a StoreError that says what is safe and what to do."""
    try:
        yield
    except FeelerError:
        raise
    except OSError as error:
        if error.errno in FULL:
            room = shutil.disk_usage(path if path.exists() else path.absolute().parent).free
            raise StoreError(
                f"no room left for the store {path} ({room / 2**20:.1f} MiB free): {state}. "
                "Free some space and run the same command again; it goes on where it stopped."
            ) from error
        raise StoreError(
            f"cannot write the store {path}: {error.strerror or error}; {state}."
        ) from error


# A function of the user's own, from a file that is named on the command line.

_MAX_SOURCE = 2**20  # [C] bytes


def load_function(path: Path, name: str, what: str) -> Any:
    """The function ``name`` of a Python file, which is run: never of a path that stood in a file.

    Raises
    ------
    InvalidInput
        No such file, or no such function in it.
    """
    if not path.is_file():
        raise InvalidInput(f"there is no file {path}; {what} of your own is file.py:function.")
    module = ModuleType(path.stem)
    module.__file__ = str(path)
    # from its text: what Python keeps of a file would hide a change within the same second
    exec(compile(read_bytes(path, _MAX_SOURCE), path, "exec"), vars(module))
    found = getattr(module, name, None)
    if not callable(found):
        raise InvalidInput(f"{path} has no function {name!r}; name it as in {path}:function.")
    return found
