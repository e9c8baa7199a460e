"""Text for a terminal: names of files, columns and topics may hold what a terminal would obey, and
are shown with that written out.
"""

import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, TextIO

# control characters (C0, C1, DEL), what turns the direction of writing or ends a line, and halves
# of characters, by which Python holds bytes of a name that are no text; not newline and tab
_OBEYED = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff]"
)


def escape(text: str, *, lines: bool = False) -> str:
    r"""``text`` with what a terminal would obey written out, as in ``\x1b``.

    Newlines and tabs stay with ``lines``; without, the result is one line.
    """
    shown = _OBEYED.sub(lambda found: _write(found[0]), text)
    return shown if lines else re.sub(r"[\n\t]", lambda found: _write(found[0]), shown)


def _write(character: str) -> str:
    return ascii(character)[1:-1]


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
    """Standard output and error without anything that a terminal would obey.

    Parameters
    ----------
    words
        What was said on the command line; a newline in one of these names is written out too.
    """
    streams = sys.stdout, sys.stderr
    for name, stream in zip(("stdout", "stderr"), streams, strict=True):
        if not isinstance(stream, _PlainStream):
            setattr(sys, name, _PlainStream(stream, words))
    try:
        yield
    finally:
        sys.stdout, sys.stderr = streams


def _get_terminal(stream: TextIO) -> TextIO:
    """The stream itself, for what draws on a terminal and shows no names."""
    return getattr(stream, "stream", stream) if isinstance(stream, _PlainStream) else stream
