"""``feeler info``: what a file holds."""

from pathlib import Path
from typing import Annotated, Any

import typer

from feeler.cli.say import Json, say_json

_EXAMPLES = """Examples:

  feeler info set.zarr

  feeler info tensor.nc antenna.toml

  feeler walkDLC.h5                                    a file alone asks the same
"""


def info(
    files: Annotated[
        list[Path],
        typer.Argument(help="a file of touches, an antenna, model, robot, recording or tracks"),
    ],
    max_gib: Annotated[float, typer.Option(help="largest content that is read [GiB]")] = 4.0,
    as_json: Json = False,
) -> None:
    """Print what files hold: sizes, units, labels, configuration, versions, licence. Nothing in
    them is executed.
    """
    from feeler.errors import FeelerError
    from feeler.guard import Limits
    from feeler.tensors.inspect import describe_file

    limits, also = Limits(max_bytes=int(max_gib * 2**30)), list_rooms()
    found, refused = {}, []
    for file in files:
        try:
            found[file] = describe_file(file, limits, also)
        except FeelerError as error:
            refused.append(str(error))
    if as_json:
        say_json([{"file": file, "says": lines} for file, lines in found.items()])
    for lines in [] if as_json else found.values():
        typer.echo("\n".join(lines))
    for words in refused:
        typer.echo(f"feeler: {words}", err=True)
    if refused:
        raise typer.Exit(2)


def list_rooms() -> dict[str, Any]:
    """The formats that stand beside tensors' own: what designs, robots and trackers write."""
    from feeler.design.files import DESIGN_FILES
    from feeler.robot.files import ROBOT_FILES
    from feeler.tracking.files import TRACK_FILES

    return {**DESIGN_FILES, **ROBOT_FILES, **TRACK_FILES}


def register(app: typer.Typer) -> None:
    """Add ``info`` to the command line."""
    app.command("info", epilog=_EXAMPLES)(info)
