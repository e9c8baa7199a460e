"""``feeler antenna``: write a preset as a TOML file to start from."""

from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """Examples:

  feeler antenna mine.toml

  feeler antenna soft.toml --profile constant --sensors all

  feeler info mine.toml
"""
SOURCES = {
    "segment_length": ("D", "length and its sigmoid share; the form is [P]"),
    "segment_mass": ("D", "constant density [P], radius falling exponentially"),
    "radius": ("D", "collision radius; constant [P]"),
    "stiffness": ("P", "exponential fit; its unit is [D]"),
    "damping": ("P", "exponential fit; its unit is [D]"),
    "sensors": ("C", "56 sensors are [P], their places are not published"),
}


def antenna(
    file: Annotated[Path, typer.Argument(help="TOML file to write")],
    profile: Annotated[str, typer.Option(help="exponential, linear, constant or matched")] = "exponential",
    sensors: Annotated[str, typer.Option(help="even, distal or all")] = "even",
) -> None:
    """Write the cockroach antenna as a TOML file, with units and sources, to be edited and given to --antenna."""
    from feeler.antenna.cockroach import cockroach
    from feeler.antenna.fact import PAPER
    from feeler.antenna.file import save_antenna
    from feeler.antenna.parse import Source
    from feeler.errors import InvalidInput

    if file.exists():
        raise InvalidInput(f"{file} exists already. Choose another name.")
    sources = {name: Source(tag=tag, reference=PAPER, note=note) for name, (tag, note) in SOURCES.items()}
    if profile != "exponential":
        control = Source(tag="C", note=f"control profile {profile!r}, matched to the exponential antenna")
        sources |= {"stiffness": control, "damping": control}
    save_antenna(cockroach(profile, sensors=sensors), file, sources)
    typer.echo(f"wrote {file}")


def register(app: typer.Typer) -> None:
    """Add ``antenna`` to the command line."""
    app.command("antenna", epilog=EXAMPLES)(antenna)
