"""``feeler validate``: what is wrong with a file.

Examples:

  feeler validate set.zarr

  feeler validate *.nc
"""

from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.options import Json, say_json
from feeler.terminal import escape


def validate(
    files: Annotated[
        list[Path],
        typer.Argument(
            help="any file that some verb reads: touches, antennas, robots, recordings, tracks"
        ),
    ],
    max_gib: Annotated[float, typer.Option(help="largest content that is read [GiB]")] = 4.0,
    as_json: Json = False,
) -> None:
    """Check files against the data contract.

    Checks touches and checksums, and whether other files can be read; exit code 1 if anything
    is wrong.
    """
    from feeler.cli.info import _list_rooms
    from feeler.sandbox import Limits
    from feeler.tensors.formats import find_problems

    limits, rooms = Limits(max_bytes=int(max_gib * 2**30)), _list_rooms()
    found = {file: find_problems(file, limits, rooms) for file in files}
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
            typer.echo(f"  - {escape(problem)}")
    if any(found.values()):
        raise typer.Exit(1)
