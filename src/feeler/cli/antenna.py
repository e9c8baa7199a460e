"""``feeler antenna``: write a preset as a TOML file to start from.

Examples:

  feeler antenna mine.toml

  feeler antenna cricket.toml --preset cricket

  feeler antenna soft.toml --preset constant --sensors all

  feeler info mine.toml
"""

from pathlib import Path
from typing import Annotated

import typer

from feeler.cli.options import require_new
from feeler.errors import InvalidInput


def antenna(
    file: Annotated[Path, typer.Argument(help="TOML file to write")],
    preset: Annotated[
        str, typer.Option("--preset", "--profile", help="which antenna to start from")
    ] = "exponential",
    sensors: Annotated[
        str, typer.Option(help="of the cockroach: even, distal or all")
    ] = "even",
) -> None:
    """Write an antenna as an editable TOML file.

    With formulas, units and sources; give it to --antenna.
    """
    from dataclasses import replace

    from feeler.antenna.animals import PROFILE_NAMES, cockroach
    from feeler.antenna.files import save_antenna
    from feeler.presets import read_preset

    require_new(file)
    found = read_preset(preset)
    if found.antenna.name in PROFILE_NAMES:
        found = replace(found, antenna=cockroach(found.antenna.name, sensors=sensors))
    elif sensors != "even":
        raise InvalidInput(
            f"--sensors is for the cockroach's profiles; {preset} has its own sensors."
        )
    save_antenna(found.antenna, file, found.sources)
    typer.echo(f"wrote {file}")
