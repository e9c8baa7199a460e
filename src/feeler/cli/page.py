"""What the help of a verb shows: the options that matter first, then the others; and messages
of the library in the words of the command line.
"""

import re
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

MANY_OPTIONS = 8  # options; a verb with fewer shows them in one list
SHOWN_FIRST = {
    "touch": ("feature", "size", "location", "speed", "antenna"),
    "spikes": ("feature", "location", "speed", "antenna", "out"),
    "tracks": ("frame_rate", "tips", "body", "individual", "out"),
    "calibrate": ("data", "frame_rate", "release", "profile", "out"),
    "design": ("new", "out", "evaluations", "starts", "seed"),
    "reproduce": ("scale", "out", "open_", "antenna", "change"),
    "tradeoff": ("out", "antenna", "objects", "speed", "reader"),
    "active": ("out", "policy", "antenna", "noise", "sets"),
    "wall": ("angle", "reading", "near", "far", "out"),
    "convert": ("variable", "trial", "session_start", "identifier", "subject"),
    "robot check": ("antenna", "calibration", "unit", "gaps", "out"),
    "robot convert": ("out", "antenna", "calibration", "unit", "gaps"),
    "robot fit": ("antenna", "calibration", "unit", "method", "out"),
    "robot classify": ("antenna", "objects", "speeds", "calibration", "out"),
    "robot stream": ("antenna", "objects", "speeds", "calibration", "serial"),
}
"""The five options of a verb with many that most people want."""
_ARGUMENT = re.compile(
    r"(?<![\w-])(?P<name>[a-z][a-z0-9_]*)=(?:['\"](?P<word>[^'\"]*)['\"]|(?P<bare>[\w.]*\w)?)"
)
# what the command line has in the place of an argument
_INSTEAD = {"n_channels=": "--antenna robot.toml, which feeler robot new --hinges N writes"}


class Page(TyperCommand):
    """A verb whose help has the options that matter first in a list of their own."""

    def format_options(self, ctx: Any, formatter: Any) -> None:
        """Two lists where a verb has many options."""
        shown: dict[str, list[Any]] = {"argument": [], "option": []}
        for param in self.get_params(ctx):
            if row := param.get_help_record(ctx):
                shown[param.param_type_name].append((param.name, row))
        options = dict(shown["option"])
        path = " ".join(ctx.command_path.split()[-2:])
        first = SHOWN_FIRST.get(path) or SHOWN_FIRST.get(self.name or "")
        if len(options) <= MANY_OPTIONS or not first:
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


class Verbs(typer.Typer):
    """A Typer whose commands have such pages."""

    def command(self, name: str | None = None, **how: Any) -> Any:
        """As Typer's own."""
        return super().command(name, **{"cls": Page, **how})


def list_options(group: Any, words: list[str]) -> dict[str, str]:
    """Options of the verb that words on the command line name: Python's name, and the shell's."""
    for word in words:
        if isinstance(group, TyperGroup) and word in group.commands:
            group = group.commands[word]
    longest = {p.name: max(p.opts, key=len) for p in group.params if p.opts}
    return {name: option for name, option in longest.items() if option.startswith("--")}


def say_in_shell(message: str, options: dict[str, str]) -> str:
    """A message of the library in the words of the command line.

    ``frame_rate=`` becomes ``--frame-rate`` and ``gaps='bridge'`` ``--gaps bridge``, where the verb
    has the option.
    """

    def turn(found: re.Match) -> str:
        option = options.get(found["name"])
        if option is None:
            return found[0]
        value = found["word"] or found["bare"]
        return f"{option} {value}" if value and value != "True" else option

    for argument, words in _INSTEAD.items():
        message = message.replace(argument, words)
    return _ARGUMENT.sub(turn, message)
