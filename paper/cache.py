"""Results that take seconds, such as one fit, kept on disk for all runs of this user: each is found
again by what it is made of.
"""

import json
import os
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any

import joblib
import pandas as pd
from filelock import FileLock

from feeler.provenance import PHYSICS, name_release
from feeler.report import Section
from feeler.robot.decoder import find_cache

USED = "used"
"""Name of a section's file that lists which results it used."""
SOURCES = "sources.csv"
RESULTS = 3
"""Raised by hand when a cached function gives other numbers and the physics stays."""
_NEVER_MATTER = ("workers", "known")  # arguments that change no number
_used: list[dict[str, Any]] = []  # of the section that this process makes
_since = 0.0  # results from before are not used


@contextmanager
def hold(path: Path) -> Iterator[None]:
    """Let one process at a time make ``path``; who comes second waits and then finds it made. Where
    nothing can be written, nobody waits.
    """
    with ExitStack() as held:
        with suppress(OSError):
            path.parent.mkdir(parents=True, exist_ok=True)
            held.enter_context(FileLock(path.with_name(f".{path.name}.lock")))
        yield


def begin(fresh_since: float = 0.0) -> list[dict[str, Any]]:
    """The list, empty yet, of what the section that now begins will use; earlier results than
    ``fresh_since`` [s since 1970] are computed anew.
    """
    global _used, _since
    _used, _since = [], fresh_since
    return _used


def keep(what: str, function: Callable[..., Any], *args: Any, **options: Any) -> Any:
    """``function(*args, **options)``, computed or from the cache.

    Parameters
    ----------
    what
        What it gives, in a word: "fit".
    """
    matter = {key: value for key, value in options.items() if key not in _NEVER_MATTER}
    name = joblib.hash((what, function.__qualname__, args, matter))
    path = find_cache() / "paper" / what / f"{name}.joblib"
    with hold(path):
        start, found = time.perf_counter(), _read(path, what)
        source = "cache" if found else "computed"
        if not found:
            found = (function(*args, **options),)
            _write(path, found, what)
    _used.append(
        {
            "result": what,
            "source": source,
            "seconds": round(time.perf_counter() - start, 2),
            "name": name,
        }
    )
    return found[0]


def _read(path: Path, what: str) -> tuple[Any] | None:
    if not path.exists() or path.stat().st_mtime < _since:
        return None
    try:
        made_by, *found = joblib.load(path)
    except Exception:  # whatever a damaged pickle raises
        made_by = None
    if made_by == _describe_maker():
        return tuple(found)
    said = "made by another version of feeler" if made_by else "damaged"
    warnings.warn(f"a {what} in the cache is computed anew: {said}", stacklevel=3)
    return None


def _write(path: Path, found: tuple[Any], what: str) -> None:
    """Write it whole or not at all."""
    partial = path.with_name(f"{path.name}.{os.getpid()}")
    try:
        joblib.dump((_describe_maker(), *found), partial, compress=1)
        partial.replace(path)
    except OSError as error:
        with suppress(OSError):
            partial.unlink()
        warnings.warn(f"a {what} could not be cached: {error.strerror}", stacklevel=3)


def _describe_maker() -> dict[str, Any]:
    return {"feeler": name_release(), "physics": PHYSICS, "results": RESULTS}


def list_sources(sections: Sequence[Section]) -> pd.DataFrame:
    """Where every section and every result in it comes from: ``computed``, the ``cache``, or the
    ``repository``; of a section that is not computed now its results are not listed.
    """
    rows: list[dict[str, Any]] = []
    for section in sections:
        source = "repository" if section.kept else "cache" if section.cached else "computed"
        rows.append({"result": "section", "source": source, "seconds": section.seconds})
        path = section.folder / f"{USED}.json"
        if source == "computed" and path.exists():
            rows += json.loads(path.read_text(encoding="utf-8"))["results"]
        for row in rows:
            row.setdefault("section", section.name)
    return pd.DataFrame(rows, columns=["section", "result", "source", "seconds", "name"])
