"""The code that a module can run: found by following its imports, not listed.

Every import is followed, also in functions, but not those for type checkers alone; so is every home
of an open set (a text ``"package.module:name"``). ``from feeler.room import name`` leads to the
file that defines the name, past the room's ``__init__``, which only hands names on. A module counts
as its syntax tree without comments and documentation: a typo corrected in a text makes no result
worthless. A data file that a module names counts with its bytes.
"""

import ast
import atexit
import hashlib
import importlib.util
import json
import os
import re
import sys
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from fnmatch import fnmatchcase
from functools import cache
from pathlib import Path
from typing import Any

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
