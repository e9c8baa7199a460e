"""``feeler studio``: an antenna in your browser."""

from typing import Annotated

import typer

EXAMPLES = """Examples:

  feeler studio

  feeler studio --antenna mine.toml --no-open

The address holds a token: who knows it can use this studio, and nobody else. Nothing is loaded from any other host.
"""


def studio(
    antenna: Annotated[str, typer.Option(help="preset or antenna TOML file")] = "exponential",
    port: Annotated[int | None, typer.Option(help="default 8765; 0 takes any free one")] = None,
    open_page: Annotated[bool, typer.Option("--open/--no-open", help="open it in the browser")] = True,
) -> None:
    """Shape an antenna, touch it and watch it feel, in a page of your browser served on this machine."""
    import webbrowser

    from feeler.studio import Studio
    from feeler.studio.wish import choose_wish

    running = Studio(choose_wish(antenna), port=port)
    typer.echo(f"feeler studio: {running.address}")
    if open_page and not webbrowser.open(running.address):
        typer.echo("no browser was found here: open the address in yours")
    typer.echo("Ctrl-C ends it")
    try:
        running.wait()
    except KeyboardInterrupt:
        typer.echo("the studio is closed")


def register(app: typer.Typer) -> None:
    """Add ``studio`` to the command line."""
    app.command("studio", epilog=EXAMPLES)(studio)
