"""How commands join the command line, with their options and help, and what they print."""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from feeler.errors import InvalidInput, MissingDependencyError

# What a verb says with ``--json``: the same numbers, and nothing beside them; what one says
# that was interrupted, and of a file that is there already.

Json = Annotated[bool, typer.Option("--json", help="print JSON in place of words")]


def say_json(value: object) -> None:
    """One line of JSON on standard output; what is not a number becomes null."""
    from feeler.provenance import to_json

    typer.echo(json.dumps(to_json(value)))


def say(as_json: bool, plain: object, lines: Iterable[str]) -> None:
    """Print a result as JSON, or in words: a line each."""
    if as_json:
        say_json(plain)
        return
    for line in lines:
        typer.echo(line)


def try_movie(write: Callable[[Path], Path], path: Path) -> Path | None:
    """The movie that was written, or None where the library for movies is missing, said so."""
    try:
        return write(path)
    except MissingDependencyError as missing:
        typer.echo(f"no movie: {missing}", err=True)
        return None


@contextmanager
def report_interrupt(words: str) -> Iterator[None]:
    """After Ctrl-C: what is kept and how to go on, and the shells' exit code for it."""
    try:
        yield
    except KeyboardInterrupt:
        typer.echo(f"interrupted; {words}, and the same command goes on from there", err=True)
        raise typer.Exit(130) from None


def require_new(file: Path, option: str = "name") -> None:
    """Refuse to write over what is there."""
    if file.exists():
        raise InvalidInput(f"{file} exists already. Choose another {option}.")


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


def as_sentence(words: str) -> str:
    """A line of the terminal as a sentence of a page."""
    line = words.strip()
    return f"{line[0].upper()}{line[1:]}."


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


# How a verb joins the command line, with its options as one record if there are many; what its
# help shows: the options that matter first, then the others; and messages of the library in the
# words of the command line.

_MANY_OPTIONS = 8  # options; a verb with fewer shows them in one list
SHOWN_FIRST = {
    "touch": ("feature", "size", "location", "speed", "antenna"),
    "spikes": ("feature", "location", "speed", "antenna", "out"),
    "tracks": ("frame_rate", "tips", "body", "individual", "out"),
    "calibrate": ("data", "frame_rate", "release", "at", "out"),
    "design": ("new", "out", "evaluations", "starts", "seed"),
    "reproduce": ("scale", "out", "open_", "antenna", "change"),
    "tradeoff": ("out", "antenna", "objects", "speed", "classifier"),
    "active": ("out", "policy", "antenna", "noise", "sets"),
    "export": ("feature", "location", "speed", "antenna", "body"),
    "follow": ("turn", "speed", "target", "friction", "out"),
    "wall": ("angle", "reading", "near", "far", "out"),
    "convert": ("variable", "trial", "session_start", "identifier", "subject"),
    "robot check": ("antenna", "calibration", "unit", "gaps", "out"),
    "robot convert": ("out", "antenna", "calibration", "unit", "gaps"),
    "robot fit": ("antenna", "calibration", "unit", "joints", "out"),
    "robot classify": ("antenna", "objects", "speeds", "calibration", "out"),
    "robot train": ("out", "speeds", "noise", "calibration", "joints"),
    "robot stream": ("antenna", "objects", "speeds", "calibration", "serial"),
}
"""The five options of a verb with many that most people want."""
_ARGUMENT = re.compile(
    r"(?<![\w-])(?P<name>[a-z][a-z0-9_]*)=(?:['\"](?P<word>[^'\"]*)['\"]|(?P<bare>[\w.]*\w)?)"
)
_FIELD = re.compile(r"^(?:[A-Z]\w+\.|[a-z_]+: )(?P<name>[a-z_]+)(?= must )")
# what a verb calls a field that has another name in the library
_CALLED = {
    "radius": "size",
    "half_width": "size",
    "inter_antennal_angle": "angle",
    "classifiers": "classifier",
    "n_hinges": "hinges",
    "unit": "time_unit",
}
_PLAINLY = {  # the words of Typer from 0.29, and of Click, which it showed before
    r"Input should be a valid number.*|.* is not a valid float.*": "give a number",
    r"Input should be a valid integer.*|.* is not a valid int.*": "give a whole number",
    r"(?:Input should be greater than or equal to |.* is not in the range x>=)(.+?)\.?": (
        r"give at least \1"
    ),
    r"(?:Input should be less than or equal to |.* is not in the range x<=)(.+?)\.?": (
        r"give at most \1"
    ),
}
# what the command line has in the place of an argument
_INSTEAD = {
    "n_channels=": "--antenna robot.toml, which feeler robot new --hinges N writes",
    "Use its planar twin, antenna.flatten().": "Name an antenna in the plane.",
    " or accuracy=0.01": "",
}

_CONTACT = re.compile(
    r"(?:contact='(?P<word>[^']+)'|a Contact of solref \S+) \(its time constant[^)]*\)"
    r"(?: and leave timestep= out)?(?P<cost>, which takes [^.]*to compute)?"
    r"(?:, or a slower object)?"
)
"""The advice of a harder contact."""


class _Page(TyperCommand):
    """A verb whose help has the options that matter first in a list of their own."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """A value that an option cannot take is refused in plain words."""
        words = list(args)
        try:
            return super().parse_args(ctx, args)
        except typer.BadParameter as error:
            error.message = _say_plainly(error.message, getattr(error.param, "opts", []), words)
            raise

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Two lists where a verb has many options."""
        shown: dict[str, list[Any]] = {"argument": [], "option": []}
        for param in self.get_params(ctx):
            if row := param.get_help_record(ctx):
                shown[param.param_type_name].append((param.name, row))
        options = dict(shown["option"])
        path = " ".join(ctx.command_path.split()[-2:])
        first = SHOWN_FIRST.get(path) or SHOWN_FIRST.get(self.name or "")
        if len(options) <= _MANY_OPTIONS or not first:
            super().format_options(ctx, formatter)
            return
        lists = {
            "Arguments": [row for _, row in shown["argument"]],
            "Options that matter first": [options.pop(name) for name in first],
            "More options": list(options.values()),
        }
        for title, rows in lists.items():
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


class Commands(typer.Typer):
    """A Typer whose commands have such pages."""

    def command(self, name: str | None = None, **how: Any) -> Any:
        """As Typer's own."""
        return super().command(name, **{"cls": _Page, **how})


def list_options(group: Any, words: list[str]) -> dict[str, str]:
    """Options of the verb that words on the command line name: Python's name, and the shell's."""
    for word in words:
        if isinstance(group, TyperGroup) and word in group.commands:
            group = group.commands[word]
    longest = {p.name: max(p.opts, key=len) for p in group.params if p.opts}
    return {name: option for name, option in longest.items() if option.startswith("--")}


def say_in_shell(message: str, options: dict[str, str]) -> str:
    """A message of the library in the words of the command line.

    ``frame_rate=`` becomes ``--frame-rate``, ``gaps='bridge'`` ``--gaps bridge`` and ``Trial.speed
    must`` ``--speed must``, where the verb has the option. Advice of a harder contact or a smaller
    timestep names ``feeler touch``, which has both, where the verb has neither.
    """
    slower = f"a lower {options['speed']}" if "speed" in options else "slower objects"

    def turn_contact(found: re.Match) -> str:
        alone = f"`feeler touch --contact {found['word'] or 'smooth:TIME'}` for one touch alone"
        return f"{slower}, or {alone}{found['cost'] or ''}"

    def turn(found: re.Match) -> str:
        option = options.get(found["name"])
        if option is None:
            return found[0]
        value = found["word"] or found["bare"]
        return f"{option} {value}" if value and value != "True" else option

    if "contact" not in options:
        message = _CONTACT.sub(turn_contact, message)
    if "timestep" not in options:
        alone = "`feeler touch --timestep` for one touch alone"
        message = message.replace(" and leave timestep= out", "")
        message = message.replace("a smaller timestep=", f"{slower}, or {alone}")
    for argument, words in _INSTEAD.items():
        message = message.replace(argument, words)
    if found := _FIELD.match(message):
        name = found["name"]
        said = options.get(name) or options.get(_CALLED.get(name, ""), found[0])
        message = said + message.removeprefix(found[0])
    return _ARGUMENT.sub(turn, message)


def _say_plainly(message: str, opts: Sequence[str], words: Sequence[str]) -> str:
    """What is wrong with an option's value, with what was got, found among the words."""
    for pattern, plain in _PLAINLY.items():
        if re.fullmatch(pattern, message):
            given = [b for a, b in pairwise(words) if a in opts]
            given += [
                b for a, _, b in (word.partition("=") for word in words) if b and a in opts
            ]
            return re.sub(pattern, plain, message) + "".join(
                f", got {one!r}" for one in given[-1:]
            )
    return message


EngineName = Annotated[
    str,
    typer.Option(
        help="simulator: chain-consistent (most accurate at its timestep), chain (computes MuJoCo's"
        " equations) or mujoco (MuJoCo itself)"
    ),
]


def add_verb(app: typer.Typer, name: str) -> None:
    """Add the command ``name``: the function of this name in ``feeler/cli/NAME.py``, or all
    commands of the ``app`` there, with the examples that the file begins with.
    """
    module = import_module(f"feeler.cli.{name}")
    if hasattr(module, "app"):
        app.add_typer(module.app, name=name)
        return
    app.command(name, epilog=list_examples(module))(getattr(module, name))


def list_examples(module: ModuleType) -> str:
    """The examples that a module's docstring ends with."""
    _, head, examples = (module.__doc__ or "").partition("Examples:\n")
    return head + examples
