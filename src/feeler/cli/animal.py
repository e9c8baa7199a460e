"""``feeler animal``: from films and tables of an animal to a fitted antenna that is tested on films
which the fit has not seen.

Examples:

  feeler animal --new animal.toml                      a commented plan, to be filled in

  feeler animal --example out/cricket                  all files of a synthetic animal

  feeler animal out/cricket/animal.toml --out out/cricket/result
"""

from pathlib import Path
from shlex import quote
from typing import Annotated

import typer

from feeler.cli.options import Json, say
from feeler.errors import InvalidInput
from feeler.progress import ProgressBar


def animal(
    plan: Annotated[
        Path | None, typer.Argument(help="TOML file that names what there is")
    ] = None,
    new: Annotated[
        Path | None, typer.Option(help="write a commented plan with this name, and end")
    ] = None,
    example: Annotated[
        Path | None,
        typer.Option(help="write a synthetic animal's files to this folder, and end"),
    ] = None,
    out: Annotated[
        Path, typer.Option(help="folder for page (HTML), pictures, numbers and antennas")
    ] = Path("out/animal"),
    as_json: Json = False,
) -> None:
    """Fit an antenna to an animal and predict its films.

    One file names films and tables. Computed is what they allow: kinematics, one antenna fitted to
    releases, forces and impulses, predictions of other films, a touch, a wall, spikes.
    """
    from feeler.animal import study_animal, write_animal_page, write_example, write_template

    if sum(one is not None for one in (plan, new, example)) != 1:
        raise InvalidInput(
            "give one of: a plan (animal.toml), --new FILE, or --example FOLDER."
        )
    if new is not None:
        write_template(new)
        typer.echo(f"wrote {new}; fill it in, then: feeler animal {quote(str(new))}")
        return
    if example is not None:
        written = write_example(example)
        typer.echo(f"wrote a synthetic animal; next: feeler animal {quote(str(written))}")
        return
    assert plan is not None
    with ProgressBar("animals") as progress:
        study = study_animal(plan, progress=progress)
    names = write_animal_page(study, out)
    plain = {"problems": study.problems, "missing": study.missing}
    say(as_json, plain | {"page": out / "animal.html"}, study.describe())
    typer.echo(f"wrote {out}/{', '.join(names)}", err=True)
    if study.problems:
        raise typer.Exit(1)
