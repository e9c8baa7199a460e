"""Stages: named steps of the run, each kept by a key of everything that its numbers depend on."""

import os
import shutil
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import cast

from feeler.errors import FeelerError
from feeler.execute.threads import hold_blas
from feeler.provenance import compute_digest, make_key
from feeler.report import MARKER, Section
from paper import cache
from paper.context import KEYED, Context, View


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
    used = cache.begin(context.started if context.fresh else 0.0)
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
        )
        failed.text(f"This section could not be made: {error}")
        return failed
    except BaseException:
        shutil.rmtree(partial, ignore_errors=True)
        raise
    section.seconds = time.perf_counter() - start
    section.numbers(cache.USED, results=used)
    section.save()
    shutil.rmtree(final, ignore_errors=True)
    partial.replace(final)
    return replace(section, folder=final)
