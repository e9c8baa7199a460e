"""``@compiled``: numba with a cache on disk that notices a change in whatever the function can
call.

Numba alone looks only at the file of the function itself. But machine code holds whatever it calls,
and the constants it reads: after a change in another file, numba's own cache would go on giving the
old numbers. ``NUMBA_DISABLE_JIT=1`` runs the same functions as plain Python.
"""

import hashlib
import logging
import os
import re
import sys
import tempfile
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path
from typing import Any

from numba import config, njit
from numba.core.runtime.nrt import rtsys


def compiled(function: Callable | None = None, **options: Any) -> Any:
    """``function`` compiled at its first call, without Python's lock, errors as in NumPy;
    ``options`` are numba's.
    """
    if function is None:
        return partial(compiled, **options)
    make = partial(njit, nogil=True, error_model="numpy", **options)
    try:
        dispatcher = make(cache=True)(function)
    except RuntimeError:  # numba finds no folder that it may write to
        dispatcher = make(cache=_move_cache())(function)
    kept: Any = getattr(dispatcher, "_cache", None)
    if hasattr(kept, "_cache_file"):  # absent where nothing is kept or compiled
        file = kept._cache_file
        file._load_index = partial(_load_index, file._load_index)
        file._source_stamp = _stamp_code(function.__module__) or file._source_stamp
        kept.load_overload = partial(_load_code, kept)
        _tell(logging.INFO, f"compiled code is kept in {kept.cache_path}.")
    return dispatcher


lean = partial(compiled, _nrt=False)
"""``@compiled`` for a function that makes no array: numba does not count who holds those that it is
handed. Counting is a locked addition for each, which took a third of a step of eight lanes."""

nested = partial(lean, no_cpython_wrapper=True, no_cfunc_wrapper=True)
"""``@lean`` for a function that only compiled ones call: taking arrays out of Python's objects
would be a quarter of what is compiled.
"""

inlined = partial(nested, forceinline=True)
"""``@nested`` for a small function that is called very often: handing over a dozen arrays costs
more than its work.
"""


def _load_code(kept: Any, signature: Any, context: Any) -> Any:
    """Machine code of this processor, or of one with fewer features, such as wheels bring; without
    numba's own loading of its compiler (0.4 s). None where there is none.
    """
    rtsys.initialize(context)
    if (found := kept._load_overload(signature, context)) is not None or not kept._enabled:
        return found
    _, here, code = kept._index_key(signature, context.codegen())
    for key in reversed(kept._cache_file._load_index()):
        if (key[0], key[2]) == (signature, code) and _runs(key[1], here):
            return kept._impl.rebuild(context, kept._cache_file.load(key))
    return None


def _runs(made: tuple[str, str, str], here: tuple[str, str, str]) -> bool:
    """Whether code made for one (system, processor, features) runs on another."""
    wanted, offered = ({x for x in m[2].split(",") if x[:1] == "+"} for m in (made, here))
    return made[0] == here[0] and wanted <= offered


def _load_index(load: Callable[[], dict]) -> dict:
    """What numba has kept; nothing where it was kept for a class that has gone or has another name
    since.
    """
    try:
        return load()
    except (AttributeError, ImportError):
        return {}


_IMPORT = re.compile(r"^from ([\w.]+) import (?:\(([^)]*)\)|(.*))$", re.MULTILINE)


@cache
def _stamp_code(module: str) -> str:
    """Digest of a module's source and of all that its machine code can hold: other compiled modules
    and the constants (upper case) that it imports; "" where no file holds it (at a prompt).
    """
    found: dict[str, str] = {}
    names = [module]
    while names:
        name = names.pop()
        if name in found or not (source := _read_source(name)):
            continue
        found[name] = source
        for home, *lists in _IMPORT.findall(source):
            for word in re.findall(r"\w+", "".join(lists)):
                if "from feeler.compiled import" in _read_source(home) or word.isupper():
                    names.append(home)
                names += [f"{home}.{word}"] if _read_source(f"{home}.{word}") else []
    text = "\n".join(f"{name}\n{found[name]}" for name in sorted(found))
    return hashlib.sha256(text.encode()).hexdigest() if found else ""


@cache
def _read_source(module: str) -> str:
    """The source of a module, of feeler or loaded already; "" where no such file stands."""
    package, _, rest = module.partition(".")
    file = Path(__file__).parent.joinpath(*rest.split(".")).with_suffix(".py")
    if package != "feeler":
        file = Path(getattr(sys.modules.get(module), "__file__", None) or "")
    return file.read_text(encoding="utf-8") if file.suffix == ".py" and file.is_file() else ""


@cache
def _move_cache() -> bool:
    """Let numba, here and in processes that start from here, keep machine code in a temporary
    folder, if there is one.

    Whoever can write to that folder decides what code runs: it must be this user's own and closed
    to others.
    """
    user = os.getuid() if hasattr(os, "getuid") else "user"
    try:
        folder = Path(tempfile.gettempdir()) / f"feeler-compiled-{user}"
        folder.mkdir(mode=0o700, exist_ok=True)
        found = folder.lstat()
        if found.st_uid != user or found.st_mode & 0o77:
            folder = Path(tempfile.mkdtemp(prefix="feeler-compiled-"))
    except OSError:
        _tell(
            logging.WARNING,
            "no folder can be written to; each process compiles anew, which takes up to a minute.",
        )
        return False
    os.environ["NUMBA_CACHE_DIR"] = str(folder)
    config.reload_config()
    _tell(
        logging.WARNING,
        "neither feeler's folder nor your home can be written to; compiled code is kept in"
        f" {folder}.",
    )
    return True


@cache
def _tell(level: int, words: str) -> None:
    logging.getLogger("feeler").log(level, "%s Set NUMBA_CACHE_DIR to choose a folder.", words)
