"""``feeler``: gathers the verbs, and turns feeler's errors into one message and exit code 2."""

import io
import os
import sys
import warnings
from importlib.util import find_spec
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from feeler.cli.options import SHOWN_FIRST, Commands, add_verb, list_options, say_in_shell
from feeler.errors import FeelerError, escape, lacks_memory, plain_output, say_warnings
from feeler.files import FULL

_GROUPS = {
    "Touch and see": ("touch", "spikes", "studio", "compare", "antenna", "export"),
    "Your own animal": ("animal", "tracks", "calibrate"),
    "Your own robot": ("robot", "design"),
    "The paper and its questions": ("reproduce", "tradeoff", "active", "wall", "follow"),
    "Data": ("info", "validate", "convert", "challenge"),
}
_VERBS = tuple(verb for verbs in _GROUPS.values() for verb in verbs)

_INTERRUPTED = 130  # the shells' exit code after Ctrl-C
# the parent of all that click, or Typer's own copy of it, says of a wrong call
_WrongCall: Any = next(
    kind for kind in typer.BadParameter.__mro__ if kind.__name__ == "ClickException"
)


class _Interrupted(Exception):
    """Ctrl-C in a verb, under a name that Typer does not end the process for without a word."""


class _Verbs(TyperGroup):
    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """A file in the place of a verb asks what it is."""
        if (word := "".join(args[:1])) and word not in self.commands and word[0] != "-":
            is_file = "." in word or os.sep in word or os.path.exists(word)
            args = ["info", *args] if is_file else args
        return super().parse_args(ctx, args)

    def format_commands(self, _ctx: Any, formatter: Any) -> None:
        """Verbs by what one wants to do, in place of one long list."""
        for title, verbs in _GROUPS.items():
            with formatter.section(title):
                short = 78 - max(map(len, _VERBS))
                rows = [(verb, self.commands[verb].get_short_help_str(short)) for verb in verbs]
                formatter.write_dl(rows)

    def invoke(self, ctx: Any) -> Any:
        try:
            with plain_output(sys.argv[1:]):
                return super().invoke(ctx)
        except KeyboardInterrupt:
            raise _Interrupted from None


app = Commands(
    cls=_Verbs,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)
for verb in _VERBS:
    add_verb(app, verb)


def _show_version(asked: bool) -> None:
    if asked:
        from feeler.provenance import list_versions

        typer.echo(" ".join(f"{name} {version}" for name, version in list_versions().items()))
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="versions")
    ] = False,
) -> None:
    """Insect-like tactile sensors: describe an antenna, touch it, learn what it can discriminate.
    Units: g, mm, ms.
    """


def main() -> None:
    """Entry point of the ``feeler`` command."""
    try:
        with warnings.catch_warnings(), plain_output(sys.argv[1:]):
            say_warnings(put=put_in_shell)
            _run()
    except SystemExit as end:
        if end.code == _INTERRUPTED:
            _leave()
        raise


_NO_MEMORY = (
    "there is not enough memory (some 1.5 GiB of addresses are needed). Close other programs, raise"
    " the limit (ulimit -v), or use fewer workers; what was finished before is on disk."
)


_LEAST = 900 * 10**6  # [C] bytes of addresses, below which compiled libraries end Python itself


def _run() -> None:
    if find_spec("resource"):  # not on Windows
        import resource

        if 0 <= resource.getrlimit(resource.RLIMIT_AS)[0] < _LEAST:
            _give_up()
    try:
        sys.exit(app(standalone_mode=False))
    except _WrongCall as error:  # Typer's own words about options
        error.show(said := io.StringIO())
        print(said.getvalue().replace("Error: ", "feeler: ", 1), end="", file=sys.stderr)
        if error.ctx and "extra argument" in error.format_message():
            first = SHOWN_FIRST.get(error.ctx.info_name, ())
            known = [one.opts[0] for one in error.ctx.command.params if one.name in first]
            print("Options say what it is:", ", ".join(known) or "see --help", file=sys.stderr)
        sys.exit(error.exit_code)
    except FeelerError as error:
        if lacks_memory(error.__cause__):  # there is none for the words of the shell
            _give_up()
        _fail(put_in_shell(str(error)), 2)
    except _Interrupted:
        _fail("interrupted; whatever was finished and kept is on disk", _INTERRUPTED)
    except Exception as error:
        if lacks_memory(error):
            _give_up()
        if not isinstance(error, OSError):
            raise
        _fail(_explain(error), 2)


def _give_up() -> None:
    """End for want of memory; what is loaded by half would say more at the end."""
    print(f"feeler: {_NO_MEMORY}", file=sys.stderr)
    _leave(2)


def put_in_shell(words: str, *verbs: list[str]) -> str:
    """A message in the options of some verbs; default: of the one that was called."""
    options: dict[str, str] = {}
    group = typer.main.get_command(app)
    for verb in verbs or (sys.argv[1:],):
        options |= list_options(group, verb)
    return say_in_shell(words, options)


def _explain(error: OSError) -> str:
    if error.errno in FULL and not error.filename:  # the system does not say of which file
        return (
            f"a file could not be written to its end: {error.strerror}. Free some space, or name a"
            " folder on another disk (--out); what was finished before is on disk."
        )
    return (
        f"{error.strerror or error}: {error.filename or ''} (check the path, its permissions and"
        " free space)"
    )


def _fail(message: str, code: int) -> None:
    print(f"feeler: {escape(message, lines=True)}", file=sys.stderr)
    sys.exit(code)


def _leave(code: int = _INTERRUPTED) -> None:
    """End at once: worker threads may still be inside an engine, which the interpreter's own end
    would pull away.
    """
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)
