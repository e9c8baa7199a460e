"""Every command and option that a page, an example or a help text names is one that there is."""

import ast
import re
import shlex
from functools import cache
from pathlib import Path

import typer

from feeler.cli.app import app

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
CODE = [*sorted((ROOT / "src").rglob("*.py")), *sorted((ROOT / "examples").glob("*.py"))]
FOREIGN = {  # of make, pip, pytest, git and the page's own tools
    "--pyargs", "--version", "--help", "--dist", "--extra-index-url", "--upgrade", "--mjcf",
}  # fmt: skip
LEFT_OUT = {"decisions.md"}  # what was tried and dropped
QUOTED = re.compile(r"`(feeler [^`]+)`")
LINE = re.compile(r"^\s*(?:\$ |!|% )?(feeler [\w-].*)$", re.M)
BLOCK = re.compile(r"```[^\n]*\n(.*?)```", re.S)
BARE = re.compile(r"(?<![\w-])--[a-z][\w-]*")
OPTION = re.compile(r"`(--[a-z][\w-]*)[^`]*`")


@cache
def list_texts():
    """Pages, and the texts of the code: docstrings, examples, messages."""
    return [*_read_texts()]


def _read_texts():
    for path in PAGES:
        if path.name not in LEFT_OUT:
            yield path, path.read_text(encoding="utf-8")
    for path in CODE:
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                yield path, node.value


def list_lines():
    """Every command line that is named, and where."""
    for path, text in list_texts():
        inside = "\n".join(BLOCK.findall(text)) if path.suffix == ".md" else text
        joined = re.sub(r" *\\\n\s*", " ", inside)
        for line in {*QUOTED.findall(text), *LINE.findall(joined)}:
            for part in re.split(
                r"\s(?:\||&&|;|>)\s", re.split(r" #|(?<=\S) {2,}(?=\S)", line)[0]
            ):
                yield path, " ".join(part.split())


@cache
def get_app():
    """The command line, made once: it takes a tenth of a second, and is asked of each line."""
    return typer.main.get_command(app)


def find_fault(line):
    """What is wrong with a command line; nothing where it could be typed."""
    try:
        words = shlex.split(line)[1:]
    except ValueError as error:
        return str(error)
    command, name = get_app(), "feeler"
    while hasattr(command, "commands") and words and not words[0].startswith("-"):
        if words[0] == "FILE" or "." in words[0]:
            words.insert(0, "info")  # a file alone is asked what it is
        if words[0] not in command.commands:
            return f"{name} has no {words[0]!r}"
        name, command = f"{name} {words[0]}", command.commands[words.pop(0)]
    known = {o for p in command.params for o in (*p.opts, *p.secondary_opts)} | {"--help"}
    given = [word.partition("=")[0] for word in words if re.match(r"--?[a-z]", word)]
    return ", ".join(f"{name} has no {option}" for option in given if option not in known)


def is_command(line):
    """Whether it is meant as one: sentences begin with the name of the project too."""
    words = line.split()
    verbs = get_app().commands
    return words[1] in verbs or words[1].startswith("-")


def walk(command):
    """A command and all below it."""
    yield command
    for one in getattr(command, "commands", {}).values():
        yield from walk(one)


def test_a_fault_is_found():
    assert find_fault("feeler touch --tastes 3") == "feeler touch has no --tastes"
    assert find_fault("feeler robot sing") == "feeler robot has no 'sing'"
    assert find_fault("feeler touch … --store set.zarr") == ""


def test_every_command_that_is_named_can_be_typed():
    lines = [(path, line) for path, line in list_lines()]
    assert len(lines) > 100
    quoted = {line for _, text in list_texts() for line in QUOTED.findall(text)}
    meant = [
        (path, line)
        for path, line in lines
        if line.startswith("feeler ") and (line in quoted or is_command(line))
    ]
    faults = [(path.name, line, fault) for path, line in meant if (fault := find_fault(line))]
    assert not faults


def test_every_option_that_is_named_alone_is_one_of_some_command():
    commands = [*walk(get_app())]
    known = {
        o for c in commands for p in c.params for o in (*p.opts, *p.secondary_opts)
    } | FOREIGN
    named = [
        (path.name, option) for path, text in list_texts() for option in OPTION.findall(text)
    ]
    helps = [
        (c.name, getattr(one, "help", "") or "") for c in commands for one in (c, *c.params)
    ]
    named += [(name, option) for name, text in helps for option in BARE.findall(text)]
    assert len(named) > 20
    assert not [(name, option) for name, option in named if option not in known]
