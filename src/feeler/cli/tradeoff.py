"""``feeler tradeoff``: how fast to touch, given how much time there is.

Examples:

  feeler tradeoff --out out/tradeoff

  feeler tradeoff --antenna mine.toml --antenna exponential --objects ball:radius=1 --objects \
box:half_width=2,half_height=1
"""

from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.options import Json, describe_timesteps, say
from feeler.progress import ProgressBar


def tradeoff(
    out: Annotated[Path, typer.Option(help="folder for page, figure, CSV and JSON")],
    antenna: Annotated[
        list[str] | None, typer.Option(help="preset or antenna file (TOML); more than once")
    ] = None,
    objects: Annotated[
        list[str] | None,
        typer.Option(help="kind:field=value,… (at least one; default: the paper's six)"),
    ] = None,
    speed: Annotated[
        list[float] | None,
        typer.Option(help="speed [m/s], more than once; default: six from 0.03 to 1.2"),
    ] = None,
    sets: Annotated[
        int | None,
        typer.Option(
            min=1, help="how often all touches are drawn; default 80 (4 minutes on two cores)"
        ),
    ] = None,
    classifier: Annotated[
        list[str] | None,
        typer.Option(
            "--classifier",
            "--reader",  # its name before 0.4
            help="classifier that names the touches, more than once: ideal (knows every touch;"
            " default), lda, svm, templates …, or mine.py:make, a function that gives one; all but"
            " ideal learn from touches of their own, which takes minutes for each draw",
        ),
    ] = None,
    journal: Annotated[
        Path | None, typer.Option(help="file that keeps each set; an interrupted study goes on")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="threads; default one per core")
    ] = None,
    as_json: Json = False,
) -> None:
    """Compare slow and fast touch: accuracy, bits, work.

    Compare slow and fast touch: accuracy, bits, work and force at six speeds, by time, distance
    and samples since contact.
    """
    from feeler.cli.choose import name_antennas, name_classifier
    from feeler.physics.engine import DEFAULT_ENGINE
    from feeler.provenance import describe_versions
    from feeler.tradeoff import load_declared, split_measured, write_tradeoff

    classifier = [name_classifier(text) for text in classifier or ()]
    given = {"sets": sets, "speeds": speed, "objects": objects, "classifiers": classifier}
    study = load_declared(
        **{
            name: tuple(value) if isinstance(value, list) else value
            for name, value in given.items()
            if value
        }
    )
    chosen = name_antennas(antenna or ["exponential"])
    out.mkdir(parents=True, exist_ok=True)
    with ProgressBar(f"touching with {', '.join(chosen)}") as progress:
        measured = split_measured(
            study.run(chosen, journal=journal, workers=workers, progress=progress)
        )
    conditions = (
        f"Engine {DEFAULT_ENGINE}, {describe_timesteps(chosen)},"
        f" {study.sets} sets, seed {study.seed}. {describe_versions()}"
    )
    page = write_tradeoff(measured, study, out, conditions)
    plain = {"antennas": {name: found.to_dict() for name, found in measured.items()}}
    say(as_json, plain | {"classifiers": classifier, "page": page}, [f"page: {page}"])
