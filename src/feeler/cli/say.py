"""What a verb says with ``--json``: the same numbers, and nothing beside them; what one says that
was interrupted, and of a file that is there already.
"""

import json
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import typer

from feeler.errors import InvalidInput

Json = Annotated[bool, typer.Option("--json", help="print JSON in place of words")]


def say_json(value: object) -> None:
    """One line of JSON on standard output; what is not a number becomes null."""
    from feeler.report.section import to_json

    typer.echo(json.dumps(to_json(value)))


@contextmanager
def say_what_stays(words: str) -> Iterator[None]:
    """After Ctrl-C: what is kept and how to go on, and the shells' exit code for it."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"interrupted; {words}, and the same command goes on from there", err=True)
        raise typer.Exit(130) from None


def require_new(file: Path) -> None:
    """Refuse to write over what is there."""
    if file.exists():
        raise InvalidInput(f"{file} exists already. Choose another name.")
