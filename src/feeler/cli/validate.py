"""``feeler validate``: what is wrong with a file.

Examples:

  feeler validate set.zarr

  feeler validate *.nc
"""

from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.options import Json, say
from feeler.errors import escape
from feeler.sandbox import Limits


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
    from feeler.cli.info import list_rooms
    from feeler.tensors.formats import find_problems

    limits, rooms = Limits(max_bytes=int(max_gib * 2**30)), list_rooms()
    found = {file: find_problems(file, limits, rooms) for file in files}
    plain = [{"file": f, "valid": not p, "problems": p} for f, p in found.items()]
    lines = [
        line
        for file, problems in found.items()
        for line in (
            f"{file}: {f'{len(problems)} problem(s)' if problems else 'valid'}",
            *(f"  - {escape(problem)}" for problem in problems),
        )
    ]
    say(as_json, plain, lines)
    if any(found.values()):
        raise typer.Exit(1)
