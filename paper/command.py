"""What ``feeler reproduce`` does and says."""

import json
import sys
import time
import webbrowser
from pathlib import Path

import typer

from feeler.cli.choose import change_antenna, choose_antenna
from feeler.cli.options import report_interrupt
from feeler.errors import FeelerError
from feeler.physics.contact import get_contact
from feeler.physics.engine import ENGINES, choose_timestep
from feeler.progress import ProgressBar
from paper.cache import SOURCES, list_sources
from paper.context import Context
from paper.inputs import read_inputs
from paper.reproduce import STAGES, reproduce
from paper.statements import count_verdicts, judge_statements, summarise_counts
from paper.table import RESULTS


def run(
    *,
    scale: str,
    out: Path,
    antenna: str,
    change: list[str],
    engine: str,
    timestep: float | None,
    seed: int,
    workers: int | None,
    log_json: bool,
    show: bool,
    fresh: bool,
    inputs: Path | None = None,
) -> None:
    """Run the paper as the options of the command line ask, and say what is going on."""
    ENGINES[engine]  # refuses an unknown one
    chosen = change_antenna(choose_antenna(antenna), change)
    is_cockroach = antenna in ("cockroach", "exponential") and not change
    if inputs:
        read_inputs(inputs)  # refuses what it cannot use before anything is computed
    out.mkdir(parents=True, exist_ok=True)
    context = Context(
        scale=scale,
        seed=seed,
        engine=engine,
        timestep=choose_timestep(timestep, engine, get_contact(None, chosen)),
        workers=workers,
        antenna=chosen,
        is_cockroach=is_cockroach,
        out=out,
        fresh=fresh,
        inputs=inputs,
        progress=_make_bars(log_json),
    )
    if not log_json:
        typer.echo(
            f"scale {scale}: about {context.effort.minutes:g} min on two cores, less for what is"
            f" in the cache; {out / 'report.html'} is written anew with each section"
        )
    start = time.perf_counter()
    with report_interrupt(f"finished stages are in {out / 'cache'}"):
        made = reproduce(context, _make_reporter(log_json, len(STAGES), start))
    _summarise(context, made, time.perf_counter() - start, log_json)
    if show:
        webbrowser.open((out / "report.html").resolve().as_uri())
    if failed := [f"{one.title}: {one.failed}" for one in made if one.failed]:
        raise FeelerError(
            f"{len(failed)} of {len(made)} sections could not be made. {' '.join(failed)}"
        )


def _make_reporter(log_json: bool, total: int, start: float):
    """A line when a stage starts and another when it ends; with ``log_json`` as JSON on stderr."""
    done = 0

    def report(title: str, section) -> None:
        nonlocal done
        done += section is not None
        seconds = None if section is None else round(section.seconds, 1)
        if log_json:
            event = {
                "event": "stage",
                "title": title,
                "done": done,
                "total": total,
                "seconds": seconds,
            }
            print(json.dumps(event), file=sys.stderr, flush=True)
            return
        word = "..." if section is None else _say_whence(section)
        typer.echo(f"[{done}/{total}] {time.perf_counter() - start:6.1f} s  {title}  {word}")

    return report


def _say_whence(section) -> str:
    if section.kept:
        return "kept, see the report"
    return "from the cache" if section.cached else f"{section.seconds:.1f} s"


def _make_bars(log_json: bool):
    """A progress bar for each set of trials in turn."""
    bar: list[ProgressBar] = []

    def progress(done: int, total: int) -> None:
        if not bar:
            bar.append(ProgressBar("touches", log_json=log_json))
        bar[0](done, total)
        if done >= total:
            bar.pop().close()

    return progress


def _summarise(context, made, seconds: float, log_json: bool) -> None:
    judged = judge_statements(made, context) if context.is_cockroach else []
    report, figures = context.out / "report.html", context.out / "figures"
    if log_json:
        counts = {whose: count_verdicts(judged, whose) for whose in ("paper", "ours")}
        event = {
            "event": "report",
            "path": str(report),
            "verdicts": counts,
            "seconds": round(seconds, 1),
        }
        print(json.dumps(event), file=sys.stderr, flush=True)
        return
    if judged:
        typer.echo(summarise_counts(judged))
    counts = list_sources(made).groupby(["source", "result"]).size()
    said = "; ".join(
        f"{source}: " + ", ".join(f"{n} × {result}" for result, n in one.droplevel(0).items())
        for source, one in counts.groupby(level=0)
    )
    typer.echo(f"{said} ({context.out / SOURCES})")
    pdf = f", {context.out / 'figures.pdf'}" if context.vector else ""
    results = context.out / RESULTS
    typer.echo(
        f"report: {report}   results: {results}   figures: {figures}{pdf}   ({seconds:.1f} s)"
    )
