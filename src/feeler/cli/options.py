"""A verb's options as one record: Typer reads its fields, and the verb gets the record."""

from collections.abc import Callable
from dataclasses import MISSING, fields
from inspect import Parameter, Signature
from typing import Annotated, Any, TypeVar, get_type_hints

import typer

R = TypeVar("R")
EngineName = Annotated[
    str,
    typer.Option(
        help="simulator: chain-consistent (most accurate at its timestep), chain (computes MuJoCo's"
        " equations), mujoco (MuJoCo itself) or rod (for walls)"
    ),
]


def add_verb(
    app: typer.Typer, name: str, options: type[R], run: Callable[[R], None], epilog: str = ""
) -> None:
    """Add the command ``name``: one option for each field of the dataclass ``options``.

    Each field is ``Annotated[type, typer.Option(help=...)]``; the command's help is the docstring
    of ``run``, which is called with the record.
    """

    def verb(**said: Any) -> None:
        run(options(**said))

    hints = get_type_hints(options, include_extras=True)
    given = [_make_parameter(field, hints[field.name]) for field in fields(options)]  # type: ignore[arg-type]
    verb.__signature__ = Signature(given)  # type: ignore[attr-defined]
    verb.__annotations__ = hints
    verb.__doc__ = run.__doc__
    verb.__name__ = name
    app.command(name, epilog=epilog or None)(verb)


def _make_parameter(field: Any, hint: Any) -> Parameter:
    default = field.default if field.default is not MISSING else Parameter.empty
    if field.default_factory is not MISSING:
        default = field.default_factory()
    return Parameter(field.name, Parameter.KEYWORD_ONLY, default=default, annotation=hint)
