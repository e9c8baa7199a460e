"""What a verb says that was interrupted."""

from collections.abc import Iterator
from contextlib import contextmanager

import typer


@contextmanager
def say_what_stays(words: str) -> Iterator[None]:
    """After Ctrl-C: what is kept and how to go on, and the shells' exit code for it."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"interrupted; {words}, and the same command goes on from there", err=True)
        raise typer.Exit(130) from None
