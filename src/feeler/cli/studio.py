"""``feeler studio``: an antenna in your browser.

Examples:

  feeler studio

  feeler studio --antenna mine.toml --no-open

  feeler studio --page drag.html

  feeler studio --antenna robot.toml --board /dev/ttyACM0 --calibration calibration.json

The address holds a token: who knows it can use this studio, and nobody else. Nothing is loaded \
from any other host.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from feeler.cli.options import require_new
from feeler.errors import InvalidInput
from feeler.files import write_text

if TYPE_CHECKING:
    from feeler.studio import AntennaRequest


def studio(
    antenna: Annotated[
        str, typer.Option(help="preset, antenna TOML or robot file")
    ] = "exponential",
    port: Annotated[int | None, typer.Option(help="default 8765; 0 takes any free one")] = None,
    board: Annotated[
        str | None,
        typer.Option(help="serial port that the system does not list (extra: robot)"),
    ] = None,
    baudrate: Annotated[int, typer.Option(help="of boards")] = 115_200,
    calibration: Annotated[
        Path | None, typer.Option(help="sensor calibration (JSON), for capacitance")
    ] = None,
    open_page: Annotated[
        bool, typer.Option("--open/--no-open", help="open it in the browser")
    ] = True,
    page: Annotated[
        Path | None,
        typer.Option(help="write a standalone page to this file (HTML), and end"),
    ] = None,
) -> None:
    """Shape and touch an antenna in your browser.

    The page comes from this machine.
    """
    import webbrowser

    from feeler.cli.robot_options import Robot
    from feeler.presets import PRESETS
    from feeler.renamed import rename_antenna
    from feeler.robot import load_calibration
    from feeler.studio import Boards, Studio
    from feeler.studio.requests import wish_for

    robot = Robot(antenna)
    wish = wish_for(known if (known := rename_antenna(antenna)) in PRESETS else robot.antenna)
    if page is not None:
        _write(page, wish)
        return
    calibration = calibration or robot.calibration
    boards = Boards(
        board, baudrate, None if calibration is None else load_calibration(calibration)
    )
    running = Studio(wish, port=port, boards=boards)
    typer.echo(f"feeler studio: {running.address}")
    if open_page and not webbrowser.open(running.address):
        typer.echo("no browser was found here: open the address in yours")
    typer.echo("Ctrl-C ends it")
    try:
        running.wait()
    except KeyboardInterrupt:
        typer.echo("the studio is closed")


def _write(file: Path, antenna: "AntennaRequest") -> None:
    """Write the standalone page."""
    from feeler.studio import TouchRequest, write_touch_page

    require_new(file)
    if not file.parent.is_dir():
        raise InvalidInput(
            f"{file.parent} is no folder. Make it first, or choose another place."
        )
    text = write_touch_page(TouchRequest(antenna=antenna))
    write_text(file, text)
    size = len(text.encode()) / 1000
    typer.echo(f"{file}: {size:.0f} kB; open it in any browser, no server is needed")
