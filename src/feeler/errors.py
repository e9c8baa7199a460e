"""Errors of feeler: each says what is wrong, what was got, what would be right and what to do; and
text for a terminal.
"""

import errno
import re
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from importlib.util import find_spec
from io import TextIOWrapper
from pathlib import Path
from typing import Any, TextIO

from feeler.renamed import find_renamed

# Text for a terminal: names of files, columns and topics may hold what a terminal would obey,
# and are shown with that written out.

# control characters (C0, C1, DEL), what turns the direction of writing or ends a line, and halves
# of characters, by which Python holds bytes of a name that are no text; not newline and tab
_OBEYED = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def escape(text: str, *, lines: bool = False) -> str:
    r"""``text`` with what a terminal would obey written out, as in ``\x1b``.

    Newlines and tabs stay with ``lines``; without, the result is one line.
    """
    shown = _OBEYED.sub(lambda found: ascii(found[0])[1:-1], text)
    return shown if lines else shown.replace("\n", r"\n").replace("\t", r"\t")


class _PlainStream:
    """A text stream that writes every text as :func:`escape` shows it.

    A carriage return at either end of a text stays: a line that is written anew begins so.
    """

    def __init__(self, stream: TextIO, words: Sequence[str] = ()) -> None:
        self.stream = stream
        parts = {part for word in words for part in re.split("[/=:]", word) if "\n" in part}
        stems = {part.rpartition(".")[0] for part in parts}
        self._names = sorted(
            (name for name in parts | stems if "\n" in name), key=len, reverse=True
        )

    def write(self, text: str) -> int:
        """Write a text; how many characters it has."""
        for name in self._names:
            text = text.replace(name, escape(name))
        inner = text.strip("\r")
        before, _, after = text.partition(inner) if inner else (text, "", "")
        return self.stream.write(before + escape(inner, lines=True) + after)

    def writelines(self, texts: Any) -> None:
        """Write several texts."""
        for text in texts:
            self.write(text)

    def __getattr__(self, name: str) -> Any:
        if name in ("buffer", "stream"):  # who writes bytes would go round this
            raise AttributeError(name)
        return getattr(self.stream, name)


@contextmanager
def plain_output(words: Sequence[str] = ()) -> Iterator[None]:
    """Standard output and error without anything that a terminal would obey; signs that its
    encoding lacks are written as Python writes them.

    Parameters
    ----------
    words
        What was said on the command line; a newline in one of these names is written out too.
    """
    streams = sys.stdout, sys.stderr
    for name, stream in zip(("stdout", "stderr"), streams, strict=True):
        if isinstance(stream, TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
        if not isinstance(stream, _PlainStream | None):  # None: it was closed
            setattr(sys, name, _PlainStream(stream, words))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = streams


def get_terminal(stream: TextIO) -> TextIO:
    """The stream itself, for what draws on a terminal and shows no names."""
    return getattr(stream, "stream", stream) if isinstance(stream, _PlainStream) else stream


class FeelerError(Exception):
    """Base of every error that feeler raises on purpose; the command line turns it into one line
    and exit code 2.
    """


class InvalidInput(FeelerError, ValueError):
    """A value, file or combination that cannot be used as given.

    Attributes
    ----------
    tables : tuple[str | int, ...]
        The fields (and places in them, from 1) that lead to that record from the outermost one.
    """

    subject = ""
    """What the message is about, where it begins so: the class of a record."""
    tables: tuple[str | int, ...] = ()


class SimulationDivergedError(FeelerError, RuntimeError):
    """A simulation left the finite numbers.

    ``label`` and ``time`` [ms] say which and when; ``angle`` [rad] and ``velocity`` [rad/ms] are
    the last finite state.
    """

    state_file = ""
    """Where :func:`feeler.touch` has kept that state."""

    def __init__(
        self,
        label: str,
        time: float,
        angle=None,
        velocity=None,
        advice="Use a smaller timestep",
    ) -> None:
        super().__init__(
            f"the simulation of '{label}' diverged at {time:g} ms. {advice}; the other trials are"
            " not affected."
        )
        self.label, self.time, self.angle, self.velocity = label, time, angle, velocity
        self.advice = advice

    def __reduce__(self):
        return type(self), (self.label, self.time, self.angle, self.velocity, self.advice)


class DetailedWarning(UserWarning):
    """A warning whose text is the same each time, so that Python's filters show it once per place.

    ``details`` are the numbers and names of this time; they are printed behind the text.
    """

    def __init__(self, text: str, details: str = "") -> None:
        super().__init__(text)
        self.details = details

    def __format__(self, spec: str) -> str:
        return format(f"{self.args[0]} {self.details}".rstrip(), spec)


class AccuracyWarning(DetailedWarning):
    """Some touches did not reach the accuracy that was asked for; ``details`` names them."""


class ModelValidityWarning(DetailedWarning):
    """A model is used outside its valid range; ``details`` say by how much."""


class StoreError(FeelerError, OSError):
    """A store that is locked, damaged, or made by another configuration."""


class OutOfMemory(FeelerError, MemoryError):
    """What was asked for needs more memory than there is, or than its worker may have."""


class MissingDependencyError(FeelerError, ImportError):
    """An optional dependency is not installed; the message holds the install command."""


def suggest(word: object, valid: Iterable[str]) -> str:
    """`` Did you mean '…'?`` of the nearest valid word, or nothing where none is near."""
    near = get_close_matches(str(word), list(valid), n=1)
    return f" Did you mean {near[0]!r}?" if near else ""


def require_extra(module: str, extra: str, what: str) -> None:
    """Raise MissingDependencyError at once if a library is not installed: before anything is
    computed.
    """
    if find_spec(module) is None:
        raise MissingDependencyError(f"{what} needs {module}: pip install 'feeler[{extra}]'.")


_SHORT = (
    *("Cannot allocate memory", "failed to map segment", "can't start new thread"),
    *("without exception set", "without setting an exception"),  # Python's own C
)


def lacks_memory(error: BaseException | None) -> bool:
    """Whether this, or what led to it, is a lack of memory: a library that finds no room to load
    or to start says it otherwise.
    """
    if error is None:
        return False
    said = isinstance(error, MemoryError) or getattr(error, "errno", None) == errno.ENOMEM
    said = said or any(words in str(error) for words in _SHORT)
    return said or lacks_memory(error.__cause__ or error.__context__)


_SAID: list[str] = []


def list_said() -> list[str]:
    """What :func:`say_warnings` has printed of feeler's own warnings since it was called."""
    return list(_SAID)


_PLAIN = (
    "AccuracyWarning",
    "ModelValidityWarning",
    "ConvergenceWarning",
)  # the last is scikit-learn's


def say_warnings(
    said: set[str] | None = None, put: Callable[[str], str] = lambda words: words
) -> None:
    """From now on print each kind of warning once, as one sentence without file and line; a
    library's own begins with its name.

    Two warnings are of one kind if they differ in their numbers alone. Those in ``said`` count as
    printed; what is printed is added to it. Whoever asks Python for warnings (``python -W``,
    PYTHONWARNINGS) sees those of libraries as Python shows them. ``put`` translates
    messages for the command line.
    """
    show = warnings.showwarning
    known = set() if said is None else said

    def say(message, category, filename, lineno, file=None, line=None) -> None:
        plain = bool({base.__name__ for base in category.__mro__} & {*_PLAIN})
        renamed = issubclass(category, FutureWarning) and _name_library(filename) == "feeler"
        ours = plain or renamed
        if not ours and sys.warnoptions:
            show(message, category, filename, lineno, file, line)
            return
        words = f"{message}" if ours else f"{_name_library(filename)}: {_cut(str(message))}"
        kind = re.sub(r"[\d.]+", "", words)
        if kind not in known:
            print(f"feeler: warning: {escape(put(words))}", file=file or sys.stderr)
            _SAID.extend([put(words)] if ours else [])
        known.add(kind)

    _SAID.clear()
    warnings.showwarning = say


def _name_library(file: str) -> str:
    """The package that a source file belongs to."""
    parts = Path(file).with_suffix("").parts
    places = [k for k, part in enumerate(parts) if part in ("site-packages", "src")]
    return parts[places[-1] + 1] if places and places[-1] + 1 < len(parts) else parts[-1]


def _cut(words: str) -> str:
    """The first 300 characters of a message, in one line."""
    line = " ".join(words.split())
    return line if len(line) <= 300 else line[:299] + "…"


__getattr__ = find_renamed(__name__)
