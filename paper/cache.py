"""What a run keeps: results that take seconds, such as one fit, for all runs of this user, each
found again by what it is made of; and stages, named steps of the run, each by a key of everything
that its numbers depend on.
"""

import json
import os
import shutil
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import Any, cast

import joblib
import pandas as pd
from filelock import FileLock

from feeler.errors import FeelerError
from feeler.execute.workers import hold_blas
from feeler.provenance import PHYSICS, compute_digest, make_key, name_release
from feeler.report import MARKER, Section
from feeler.robot.decoder import find_cache
from paper.context import KEYED, Context, View

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


@dataclass(frozen=True, kw_only=True)
class Stage:
    """One step: its figures in turn.

    A figure is two functions of a module, ``compute(context)`` and ``show(data, section)``: what
    the first returns holds ``rows``, the values of the table of results by name, and all that the
    second draws and says; or it is None, and nothing is shown. Modules are imported where the stage
    runs, so that who only hands out stages starts in no time.

    Attributes
    ----------
    figures : tuple[str, ...]
        What makes the section: of ``module:part`` in this package ``compute_part`` and
        ``show_part``; of a module's full name its ``show(context, section)``.
    reads : tuple[str, ...]
        Which parameters its numbers depend on; it cannot read the others.
    make : Callable[[Context, Section], None] | None
        A maker in place of the figures.
    """

    name: str
    title: str
    figures: tuple[str, ...] = ()
    reads: tuple[str, ...] = KEYED
    make: Callable[[Context, Section], None] | None = None

    @property
    def modules(self) -> tuple[str, ...]:
        """The modules that make the section."""
        if self.make:
            return (self.make.__module__,)
        names = dict.fromkeys(name.partition(":")[0] for name in self.figures)
        return tuple(name if "." in name else f"paper.{name}" for name in names)

    def key(self, context: Context) -> str:
        """Name of the section's numbers: parameters, defaults of the physics, and versions."""
        return make_key({"context": context.describe(self.reads), "vector": context.vector})

    def show(self, context: Context, section: Section) -> None:
        """Compute, draw and say everything."""
        if self.make:
            self.make(context, section)
        for figure in () if self.make else self.figures:
            module, _, part = figure.partition(":")
            if "." in module:
                import_module(module).show(context, section)
                continue
            home, end = import_module(f"paper.{module}"), part and f"_{part}"
            if data := getattr(home, f"compute{end}")(context):
                section.values |= data.rows
                getattr(home, f"show{end}")(data, section)


def is_kept(path: Path, context: Context) -> bool:
    """Whether a finished result stands there that this run may use: with ``fresh`` only what this
    run made itself.
    """
    return path.exists() and (not context.fresh or path.stat().st_mtime >= context.started)


def find_kept(stage: Stage, context: Context) -> Section | None:
    """The stage's section if the cache holds it whole."""
    folder = _find_folder(stage, context)
    return Section.load(folder) if is_kept(folder / MARKER, context) else None


def _find_folder(stage: Stage, context: Context) -> Path:
    """Where a section is cached; a figure whose own file has changed is made again."""
    texts = [
        Path(str(import_module(name).__file__)).read_text(encoding="utf-8")
        for name in stage.modules
    ]
    key = compute_digest({"key": stage.key(context), "figures": texts})[:16]
    return context.out / "cache" / stage.name / key


def run_stage(stage: Stage, context: Context) -> Section:
    """The stage's section: from the cache where its key stands there whole, else made now.

    The section is made in a folder of another name and renamed when it is whole, so that a killed
    run leaves either all of it or nothing. A FeelerError becomes the section's text; the other
    sections go on.
    """
    if kept := find_kept(stage, context):
        return kept
    final = _find_folder(stage, context)
    partial = final.with_name(f".{final.name}.{os.getpid()}")
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    section = Section(name=stage.name, title=stage.title, folder=partial, vector=context.vector)
    start = time.perf_counter()
    used = begin(context.started if context.fresh else 0.0)
    try:
        with hold_blas():
            stage.show(cast(Context, View(context, stage.reads)), section)
    except FeelerError as error:
        shutil.rmtree(partial)
        failed = Section(
            name=stage.name,
            title=stage.title,
            folder=final,
            seconds=time.perf_counter() - start,
            failed=str(error),
        )
        failed.text(f"This section could not be made: {error}")
        return failed
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise
    section.seconds = time.perf_counter() - start
    section.numbers(USED, results=used)
    section.save()
    shutil.rmtree(final, ignore_errors=True)
    partial.replace(final)
    return replace(section, folder=final)
