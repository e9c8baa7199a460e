"""``feeler design``: which antenna to build for a task.

Examples:

  feeler design task.toml --new                      a commented task file to be edited

  feeler design task.toml --out out/design           searches, judges, and writes a page; Ctrl-C \
and again: goes on

  feeler design task.toml --out out/design --robot   also as widths and sheet thicknesses, and \
what 5 % errors cost
"""

from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.cli.options import Json, report_interrupt, require_new, say
from feeler.files import write_text
from feeler.progress import ProgressBar


def design(
    task: Annotated[
        Path, typer.Argument(help="design file (TOML): task, space, constraints, search")
    ],
    out: Annotated[
        Path, typer.Option(help="folder for page, antenna.toml, journal and numbers")
    ] = Path("out/design"),
    new: Annotated[
        bool, typer.Option("--new", help="write a commented design file and stop")
    ] = False,
    evaluations: Annotated[
        int | None, typer.Option(min=1, help="antennas simulated from each start")
    ] = None,
    starts: Annotated[
        int | None,
        typer.Option(
            min=1, help="searches: the first begins at the file's antenna, others far off"
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(min=0, help="seed of the search; the touches have another")
    ] = None,
    classifier: Annotated[
        str | None,
        typer.Option(
            "--classifier",
            "--reader",  # its name before 0.4
            help="classifier that scores antennas in place of the usual one: lda, svm …, or"
            " mine.py:make, a function that gives one",
        ),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="threads; default one per core")
    ] = None,
    cluster: Annotated[
        str | None, typer.Option(help="address of a Dask scheduler, or its JSON file")
    ] = None,
    robot: Annotated[
        bool, typer.Option(help="also give the hinges as strips of foil, and their tolerance")
    ] = False,
    movie: Annotated[bool, typer.Option(help="write a movie of one touch")] = True,
    as_json: Json = False,
) -> None:
    """Search for the antenna that does a task best.

    The design is evaluated on touches that the search has not seen.
    """
    from feeler.antenna.segments import require_plane
    from feeler.cli.choose import choose_executor, name_classifier
    from feeler.design.plan import JOURNAL, TEMPLATE, load_plan, run_plan

    if new:
        require_new(task)
        write_text(task, TEMPLATE.format(file=task.name))
        typer.echo(f"wrote {task}; edit it, then: feeler design {task} --out {out}")
        return
    plan = load_plan(task)
    if robot:
        require_plane(plan.reference, "--robot")
    given = {"evaluations": evaluations, "starts": starts, "seed": seed}
    plan.search.update({name: value for name, value in given.items() if value is not None})
    kept = report_interrupt(f"every simulated antenna is in {out / JOURNAL}")
    total = plan.search.get("evaluations", 100) * plan.search.get("starts", 1)
    bar = ProgressBar("antennas simulated")
    with choose_executor(workers, cluster) as executor, kept, bar:
        before = last = 0

        def watch(problem: Any) -> None:
            nonlocal before, last
            if problem.evaluations < last:  # another start
                before += last
            last = problem.evaluations
            bar(min(before + last, total - 1), total)

        own = {} if classifier is None else {"classifier": name_classifier(classifier)}
        found = run_plan(plan, out, watch=watch, executor=executor, **own)
        _report(found, out, robot, movie, executor, as_json)


def _report(found, out: Path, robot: bool, movie: bool, executor, as_json: bool) -> None:
    from feeler.design.page import write_design
    from feeler.design.plan import measure_tolerance
    from feeler.provenance import describe_versions

    tolerance = measure_tolerance(found.best, found.task, executor=executor) if robot else None
    fewer, error = found.compare()
    task = found.plan.task
    seeds = ", ".join(f"{name} {seed}" for name, seed in task.seeds)
    conditions = (
        f"{task.n_classes} classes at {', '.join(f'{v:g}' for v in task.speeds)} m/s,"
        f" {task.deadline:g} ms, noise {task.noise}; seeds of the draws:"
        f" {seeds}; timestep {task.timestep:g} ms. {describe_versions()}"
    )
    page = write_design(found, out, conditions=conditions, movie=movie, tolerance=tolerance)
    lines = [
        f"final draws: {100 * found.final.errors:.1f} % wrong, the reference"
        f" {100 * found.reference_final.errors:.1f} %: errors avoided {100 * fewer:.0f} ±"
        f" {100 * error:.0f} %" + ("" if found.looks == 1 else f" (look number {found.looks})"),
        f"antenna: {out / 'antenna.toml'}",
        f"page: {page}",
    ]
    say(as_json, {**found.to_plain(), "antenna": out / "antenna.toml", "page": page}, lines)
