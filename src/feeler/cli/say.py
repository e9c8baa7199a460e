"""What a verb says with ``--json``: the same numbers, and nothing beside them."""

import json
from typing import Annotated

import typer

Json = Annotated[bool, typer.Option("--json", help="print JSON in place of words")]


def say_json(value: object) -> None:
    """One line of JSON on standard output; what is not a number becomes null."""
    from feeler.report.section import to_json

    typer.echo(json.dumps(to_json(value)))
