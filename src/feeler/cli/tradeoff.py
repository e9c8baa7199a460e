"""``feeler tradeoff``: how fast to touch, given how much time there is."""

from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.say import Json, say_json

_EXAMPLES = """Examples:

  feeler tradeoff --out out/tradeoff

  feeler tradeoff --antenna mine.toml --antenna exponential --objects ball:radius=1 --objects \
box:half_width=2,half_height=1
"""


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
        list[float] | None, typer.Option(help="m/s, more than once; default: six from 0.03 to 1.2")
    ] = None,
    sets: Annotated[
        int | None,
        typer.Option(min=1, help="draws of all touches; default 80, some 4 minutes on two cores"),
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="threads; default one per core")
    ] = None,
    as_json: Json = False,
) -> None:
    """Accuracy, bits, work and force of touches at six speeds, by time, distance and samples since
    contact.
    """
    from feeler.cli.choose import choose_antenna
    from feeler.cli.progress import ProgressBar
    from feeler.physics.engine import DEFAULT_ENGINE, get_engine
    from feeler.provenance import describe_versions
    from feeler.stimulus.feature import parse_feature
    from feeler.studies.tradeoff import load_declared, measure_tradeoff, write_tradeoff

    given = {"sets": sets, "speeds": tuple(speed) if speed else None}
    declared = load_declared(**{name: value for name, value in given.items() if value is not None})
    chosen = {Path(name).stem: choose_antenna(name) for name in antenna or ["exponential"]}
    features = [parse_feature(text) for text in objects] if objects else None
    out.mkdir(parents=True, exist_ok=True)
    measured = {}
    for name, one in chosen.items():
        with ProgressBar(f"touching with {name}") as progress:
            found = measure_tradeoff(one, declared, features, workers=workers, progress=progress)
        measured[name] = found.assign_attrs(antenna=name)
    conditions = (
        f"Engine {DEFAULT_ENGINE}, timestep {get_engine(DEFAULT_ENGINE).timestep:g} ms,"
        f" {declared.sets} sets, seed {declared.seed}. {describe_versions()}"
    )
    page = write_tradeoff(measured, declared, out, conditions)
    if as_json:
        say_json(
            {"antennas": {name: found.to_dict() for name, found in measured.items()}, "page": page}
        )
    else:
        typer.echo(f"page: {page}")


def register(app: typer.Typer) -> None:
    """Add ``tradeoff`` to the command line."""
    app.command("tradeoff", epilog=_EXAMPLES)(tradeoff)
