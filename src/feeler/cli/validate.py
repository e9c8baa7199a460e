"""``feeler validate``: what is wrong with a file."""

from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.say import Json, say_json

_EXAMPLES = """Examples:

  feeler validate set.zarr

  feeler validate *.nc
"""


def validate(
    files: Annotated[
        list[Path],
        typer.Argument(help="store, Zarr, NetCDF, NWB, MATLAB, CSV, antenna or model file"),
    ],
    max_gib: Annotated[float, typer.Option(help="largest content that is read [GiB]")] = 4.0,
    as_json: Json = False,
) -> None:
    """Check files and checksums against the data contract; exit code 1 if anything is wrong."""
    from feeler.guard import Limits
    from feeler.tensors.inspect import find_problems

    found = {file: find_problems(file, Limits(max_bytes=int(max_gib * 2**30))) for file in files}
    if as_json:
        say_json(
            [
                {"file": f, "valid": not problems, "problems": problems}
                for f, problems in found.items()
            ]
        )
    for file, problems in [] if as_json else found.items():
        typer.echo(f"{file}: {'valid' if not problems else f'{len(problems)} problem(s)'}")
        for problem in problems:
            typer.echo(f"  - {problem}")
    if any(found.values()):
        raise typer.Exit(1)


def register(app: typer.Typer) -> None:
    """Add ``validate`` to the command line."""
    app.command("validate", epilog=_EXAMPLES)(validate)
