"""What a result depends on, its key, and a journal of what was computed."""

import ast
import atexit
import dataclasses
import errno
import hashlib
import importlib.util
import json
import math
import os
import platform
import re
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from functools import cache
from importlib.metadata import PackageNotFoundError, packages_distributions, version
from pathlib import Path
from typing import Any

import numpy as np

from feeler.errors import InvalidInput, StoreError
from feeler.files import Lock, parse_json, read_bytes

# The code that a module can run: found by following its imports, not listed.
#
# Every import is followed, also in functions, but not those for type checkers alone; so is
# every home of an open set (a text ``"package.module:name"``). ``from feeler.room import name``
# leads to the file that defines the name, past the room's ``__init__``, which only hands names
# on. A module counts as its syntax tree without comments and documentation: a typo corrected in
# a text makes no result worthless. A data file that a module names counts with its bytes.

SOURCE = Path(__file__).parents[1]
_FOUND = ".json"  # results of feeler's own, kept beside the module that shows them
_DATA = (".toml", ".csv", ".npz", ".safetensors", _FOUND)  # files that hold numbers
_HOME = re.compile(r"(\w+(?:\.\w+)+):\w+")

_Wanted = tuple[str, str | None]
"""An import: the module, and the name taken from it (None: the module itself)."""


@dataclass(frozen=True, kw_only=True)
class _Module:
    """What one file of Python says that matters here.

    Attributes
    ----------
    digest : str
        Fingerprint of its syntax tree without documentation.
    imports : tuple[Wanted, ...]
        What it imports when it runs.
    names : dict[str, Wanted]
        Where a room's names come from.
    texts : tuple[str, ...]
        Its texts that may name data; ``*`` stands for what is filled in.
    packages : tuple[str, ...]
        Packages of others that it imports.
    """

    path: str
    digest: str
    imports: tuple[_Wanted, ...]
    names: dict[str, _Wanted]
    texts: tuple[str, ...]
    packages: tuple[str, ...]


_Find = Callable[[str], Path | None]
_Read = Callable[[str, Path], _Module]


def find_modules(*modules: str) -> dict[str, _Module]:
    """The modules themselves and, by their full names, all own modules that they import, directly
    or through others.

    Own are feeler's and those beside a starting module: an engine or a shape from outside brings
    its code with it.
    """
    tops = {"feeler", *(name.partition(".")[0] for name in modules)}
    folders = {
        path.parent for top in tops if (path := _find_file(top)) and path.name != "__init__.py"
    }

    def is_own(module: str) -> bool:
        top = module.partition(".")[0]
        return top in tops or any((folder / f"{top}.py").is_file() for folder in folders)

    find, read = (
        cache(_find_file),
        cache(_read_module),
    )  # a hundred modules import the same dozen
    found: dict[str, _Module] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        if name not in found and (path := find(name)):
            found[name] = module = read(name, path)
            waiting += [
                resolve(*wanted, find, read) for wanted in module.imports if is_own(wanted[0])
            ]
    return dict(sorted(found.items()))


def find_data(modules: dict[str, _Module]) -> set[Path]:
    """Data files that modules name: by the whole name wherever they lie, with something filled in
    if beside them or below. A kept result counts in its own folder alone: many share a name.
    """
    return {
        path
        for module in modules.values()
        for path in (_list_data(SOURCE) if module.texts else ())
        if _is_read(path, Path(module.path).parent, module.texts)
    }


def _is_read(path: Path, home: Path, texts: tuple[str, ...]) -> bool:
    """Whether a module in ``home`` with these texts names the file."""
    beside = home == path.parent if path.suffix == _FOUND else home in path.parents
    if beside:
        return any(fnmatchcase(path.name, text) for text in texts)
    return path.suffix != _FOUND and path.name in texts


def _find_file(module: str) -> Path | None:
    """The Python file of a module, without running it; None for what is built in or typed at a
    prompt.
    """
    first, *rest = module.split(".")
    if first == "feeler":
        base = SOURCE.joinpath(*rest)
        return next(
            (
                path
                for path in (base.with_suffix(".py"), base / "__init__.py")
                if path.is_file()
            ),
            None,
        )
    try:
        spec = importlib.util.find_spec(module)
    except (ImportError, ValueError):
        return None
    return Path(spec.origin) if spec and spec.origin and spec.origin.endswith(".py") else None


def _read_module(name: str, path: Path) -> _Module:
    """Read one file, or what was noted of it when it was last read."""
    now, notes = path.stat(), _open_notes(SOURCE)
    stamp = [now.st_mtime_ns, now.st_size]
    if name not in notes or notes[name][:2] != [str(path), stamp]:
        notes[name] = [str(path), stamp, parse_module(name, path)]
        notes[""] = None  # there is something to write down
    return notes[name][2]


def resolve(
    module: str, name: str | None, find: _Find = _find_file, read: _Read = _read_module
) -> str:
    """The module that defines what ``from module import name`` gives."""
    path = find(module)
    if name is None or path is None or path.name != "__init__.py":
        return module
    home, inner = read(module, path).names.get(name), f"{module}.{name}"
    if home and home != (module, name):
        return resolve(*home, find, read)
    return inner if find(inner) else module


def parse_module(name: str, path: Path) -> _Module:
    """Read one file; texts that stand alone are documentation."""
    tree = _parse(path.read_bytes())
    room = path.name == "__init__.py"
    package = name if room else name.rpartition(".")[0]
    texts: set[str] = set()
    names: dict[str, _Wanted] = {}
    imports: list[_Wanted] = []
    idle: set[ast.AST] = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            node.body = [line for line in node.body if not _is_text(line)]
        elif isinstance(node, ast.If) and getattr(node.test, "id", "") == "TYPE_CHECKING":
            idle.update(node.body)
        elif isinstance(node, ast.Import | ast.ImportFrom):
            wanted = list(_read_import(node, package))
            names |= {
                alias.asname or alias.name: found
                for alias, found in zip(node.names, wanted, strict=True)
            }
            imports += wanted if room or node not in idle else []
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            texts.add(node.value)
        elif isinstance(node, ast.JoinedStr):
            texts.add(
                "".join(
                    str(part.value) if isinstance(part, ast.Constant) else "*"
                    for part in node.values
                )
            )
    imports += [(home[1], None) for text in sorted(texts) if (home := _HOME.fullmatch(text))]
    tops = {module.partition(".")[0] for module, _ in imports} - {
        "feeler",
        "",
        name.partition(".")[0],
    }
    return _Module(
        path=str(path),
        digest=compute_hash(ast.dump(tree).encode()),
        imports=tuple(dict.fromkeys(imports)),
        names=names if room else {},
        texts=tuple(sorted(text for text in texts if text.endswith(_DATA))),
        packages=tuple(sorted(tops - sys.stdlib_module_names)),
    )


def _parse(raw: bytes) -> ast.Module:
    try:
        return ast.parse(raw)
    # of Python 3.11, where what was thrown away meanwhile wrote a traceback, and so parsed too
    except SystemError:
        return ast.parse(raw)


def compute_hash(raw: bytes) -> str:
    """A short fingerprint of bytes."""
    return hashlib.sha256(raw).hexdigest()[:16]


def _is_text(line: ast.AST) -> bool:
    return (
        isinstance(line, ast.Expr)
        and isinstance(line.value, ast.Constant)
        and isinstance(line.value.value, str)
    )


def _read_import(node: ast.Import | ast.ImportFrom, package: str) -> Iterator[_Wanted]:
    for alias in node.names:
        if isinstance(node, ast.Import):
            yield alias.name, None
        else:
            base = package.rsplit(".", node.level - 1)[0] if node.level else ""
            yield ".".join(part for part in (base, node.module) if part), alias.name


@cache
def _list_data(source: Path) -> list[Path]:
    return [path for path in source.rglob("*") if path.suffix in _DATA]


@cache
def _open_notes(source: Path) -> dict[str, Any]:
    """What was read of each module, kept beside Python's own compiled files: to parse them all
    takes a second.
    """
    reader = compute_hash(Path(__file__).read_bytes())[:8]  # another reader, other notes
    file = source / "__pycache__" / f"sources-{sys.implementation.cache_tag}-{reader}.json"
    notes: dict[str, Any] = {}
    with suppress(Exception):  # whatever is wrong with notes, they are made anew
        for name, (path, stamp, said) in json.loads(file.read_text()).items():
            pairs = tuple((module, wanted) for module, wanted in said.pop("imports"))
            names = {
                key: (module, wanted) for key, (module, wanted) in said.pop("names").items()
            }
            texts, packages = tuple(said.pop("texts")), tuple(said.pop("packages"))
            notes[name] = [
                path,
                stamp,
                _Module(imports=pairs, names=names, texts=texts, packages=packages, **said),
            ]
    atexit.register(_write_notes, file, notes)
    return notes


def _write_notes(file: Path, notes: dict[str, Any]) -> None:
    if "" in notes:
        with suppress(OSError):
            fresh = file.with_suffix(f".{os.getpid()}")
            kept = {
                name: [*entry[:2], asdict(entry[2])]
                for name, entry in notes.items()
                if name.startswith("feeler")
            }
            file.parent.mkdir(
                exist_ok=True
            )  # absent where Python is told to keep no compiled files
            fresh.write_text(json.dumps(kept))
            fresh.replace(file)


# What a result depends on: plain data that describe it, the versions of packages, and the code
# that made it.

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
_list_distributions = cache(packages_distributions)  # looks through all that is installed


def tick() -> float:
    """Seconds of a clock that nobody sets."""
    boot = getattr(time, "CLOCK_BOOTTIME", None)
    return time.monotonic() if boot is None else time.clock_gettime(boot)


_LOADED = tick()  # s; a file changed later is not the code that runs


@cache
def list_versions() -> dict[str, str]:
    """Versions of Python and of the packages that can change a number."""
    return {
        "python": platform.python_version(),
        **{name: find_version(name) for name in _PACKAGES},
    }


def describe_versions() -> str:
    """The same in words, for the foot of a page."""
    return ", ".join(f"{name} {version}" for name, version in list_versions().items())


@cache
def find_version(package: str) -> str:
    """Version of a package by the name that it is installed or imported under; "" if it is not
    installed.
    """
    try:
        return version(package)
    except PackageNotFoundError:
        return ",".join(
            sorted({version(name) for name in _list_distributions().get(package, ())})
        )


def make_plain(value: Any) -> Any:
    """``value`` in JSON's types: arrays become lists, dataclasses dictionaries (or what their
    ``to_plain`` says), infinities and NaN words.
    """
    if isinstance(value, np.ndarray | list | tuple):
        items = value.tolist() if isinstance(value, np.ndarray) else value
        return [
            item if type(item) is float and math.isfinite(item) else make_plain(item)
            for item in items
        ]
    if isinstance(value, np.generic):
        return make_plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if value is None or isinstance(value, str | int | bool):
        return value
    if isinstance(value, dict):
        return {str(key): make_plain(item) for key, item in value.items()}
    if hasattr(value, "to_plain"):
        return make_plain(value.to_plain())
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {
            field.name: make_plain(getattr(value, field.name))
            for field in dataclasses.fields(value)
        }
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise InvalidInput(
        f"a configuration holds numbers, texts, lists and dictionaries; got {type(value).__name__}."
    )


def write_canonical(configuration: Any) -> str:
    """The configuration as JSON with sorted keys: equal configurations give equal texts."""
    return write_plain(make_plain(configuration))


def write_plain(plain: Any) -> str:
    """The canonical text of what is in JSON's types already."""
    return json.dumps(plain, sort_keys=True, ensure_ascii=False, separators=(",", ":"))


def compute_digest(configuration: Any) -> str:
    """SHA-256 of the canonical text, in hexadecimal."""
    return hashlib.sha256(write_canonical(configuration).encode()).hexdigest()


def make_key(configuration: Any, *modules: str) -> str:
    """A short name for a result: another one where the configuration, a version or the code of
    ``modules`` differs.

    Parameters
    ----------
    configuration
        What the result is made with; numbers, texts, lists, dictionaries, arrays and dataclasses.
    modules
        Full names of the modules that make it, e.g. ``"feeler.experiments.tactile"``.
    """
    made_by = {"versions": list_versions(), "code": describe_code(*modules)}
    return compute_digest({"configuration": configuration, **made_by})[:16]


def describe_code(*modules: str) -> dict[str, str]:
    """Fingerprints of all that ``modules`` can run: modules and data files by name, others'
    packages by version.

    Raises
    ------
    StoreError
        A file was changed after Python had loaded it, so that the code on disk is not the code that
        runs.
    """
    found = find_modules(*modules)
    data = {path.relative_to(SOURCE).as_posix(): path for path in sorted(find_data(found))}
    now = time.time()
    loaded = now - (tick() - _LOADED)  # as the clock would have said it that now goes
    for path in (*(Path(module.path) for module in found.values()), *data.values()):
        if loaded < path.stat().st_mtime <= now:
            raise StoreError(
                f"feeler's own code changed while it was running ({_shorten(path)}): results would"
                " be stored as those of code that did not make them. Start Python again and repeat"
                " the command."
            )
    packages = {
        package
        for module in found.values()
        for package in module.packages
        if package not in found
    }
    return {
        **{name: module.digest for name, module in found.items()},
        **{name: compute_hash(path.read_bytes()) for name, path in data.items()},
        **{package: find_version(package) for package in sorted(packages)},
    }


def _shorten(path: Path) -> str:
    return path.relative_to(SOURCE).as_posix() if path.is_relative_to(SOURCE) else path.name


# Journal: what was computed, on disk as soon as it is known, so that whoever was interrupted
# goes on from there.

_MAX_BYTES = 256 * 2**20  # [C] a million antennas
_REMEDY = "Free some space and run the same command again; it goes on from what is kept."
_FIRST_LINE = re.compile(rb'\{"key": "([0-9a-f]{1,16})"\}')


class Journal:
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
        self._path, self._key = Path(path), key
        self._first = _make_first_line(key)
        lock = self._path.with_name(f".{self._path.name}.lock")
        self._lock = Lock(lock, f"the journal {path}")
        try:
            self._open(of)
        except BaseException:
            self.close()
            raise

    def _open(self, of: str) -> None:
        known, self._size = self._path.exists(), 0
        if known:
            self._entries, self._size = read_journal(self._path, self._key, of)
        try:
            # one that came into being meanwhile is somebody else's
            self._file = self._path.open("ab" if known else "xb", buffering=0)
        except OSError as error:
            raise StoreError(f"cannot write {self._path}: {error.strerror}.") from error
        if self._size:
            self._file.truncate(self._size)
            return
        try:
            self._write(self._first)
        except StoreError:
            if not known:  # a full disk: an empty file would say nothing
                self._path.unlink(missing_ok=True)
            raise

    def __len__(self) -> int:
        return len(self._entries)

    def find(self, *name: Any) -> Any:
        """The result of this name; None where it is not known."""
        return self._entries.get(_write_name(name))

    def add(self, result: Any, *name: Any) -> Any:
        """Remember a result, here and on disk; gives it as ``find`` will."""
        plain = make_plain(result)
        if self._file is not None:
            line = json.dumps({"name": make_plain(name), "result": plain}, ensure_ascii=False)
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

    def __enter__(self) -> "Journal":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def read_journal(path: Path, key: str, of: str = "fit") -> tuple[dict[str, Any], int]:
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
    first, *lines = raw[:whole].splitlines() or [b""]
    found = _FIRST_LINE.fullmatch(first)
    if found is None:
        raise InvalidInput(
            f"{path} is no journal of a {of}. Name another; it is left as it is."
        )
    if found[1].decode() != key:
        raise InvalidInput(
            f"{path} belongs to another {of}: settings, versions or code differ. Remove it, or name"
            " another."
        )
    entries = {}
    try:
        for line in lines:
            entry = parse_json(line, "a line")
            entries[_write_name(entry["name"])] = entry["result"]
    except (InvalidInput, KeyError) as error:
        raise InvalidInput(
            f"{path} is no journal of a {of} ({error}). Remove it, or name another."
        ) from error
    return entries, whole


def _make_first_line(key: str) -> bytes:
    line = json.dumps({"key": key}).encode()
    if not _FIRST_LINE.fullmatch(line):
        raise InvalidInput(f"a journal's key must be 1 to 16 hexadecimal digits, got {key!r}.")
    return line + b"\n"


def _write_name(name: Any) -> str:
    return write_plain(make_plain(name))
