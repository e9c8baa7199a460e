"""What a verb says with ``--json``: the same numbers, and nothing beside them; what one says that
was interrupted, and of a file that is there already.
"""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any

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


def say_adapted(tensors: Any) -> str:
    """That the default contact is not that of the paper's antennas, where it is not."""
    from feeler.physics.contact import get_contact

    usual = get_contact().solref[0]
    time = tensors.attrs.get("contact_time_constant", usual)
    if time == usual:
        return ""
    return (
        f"contact: time constant {time:.3g} ms in place of {usual:g} ms, since"
        f" this antenna is thin; timestep {tensors.attrs['timestep']:.3g} ms"
    )


def describe_timesteps(antennas: Mapping[str, Any]) -> str:
    """The default timesteps of some antennas, by name where they differ."""
    from feeler.physics.contact import get_contact
    from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep

    steps = {
        name: f"{choose_timestep(None, DEFAULT_ENGINE, get_contact(None, antenna)):.3g} ms"
        for name, antenna in antennas.items()
    }
    if len({*steps.values()}) == 1:
        return f"timestep {next(iter(steps.values()))}"
    return "timestep " + ", ".join(f"{step} ({name})" for name, step in steps.items())
