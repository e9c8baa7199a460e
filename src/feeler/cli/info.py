"""``feeler info``: what a file holds."""

from pathlib import Path
from typing import Annotated

import typer

EXAMPLES = """Examples:

  feeler info set.zarr

  feeler info tensor.nc antenna.toml
"""


def info(
    files: Annotated[list[Path], typer.Argument(help="store, Zarr, NetCDF, NWB, MATLAB, CSV, antenna or model file")],
    max_gib: Annotated[float, typer.Option(help="largest content that is read [GiB]")] = 4.0,
) -> None:
    """Print what files hold: sizes, units, labels, configuration, versions, licence. Nothing in them is executed."""
    from feeler.limits import Limits
    from feeler.tensors.inspect import describe_file

    for file in files:
        typer.echo("\n".join(describe_file(file, Limits(max_bytes=int(max_gib * 2**30)))))


def register(app: typer.Typer) -> None:
    """Add ``info`` to the command line."""
    app.command("info", epilog=EXAMPLES)(info)
