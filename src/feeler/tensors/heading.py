"""The heading of a table of text: notes, names and units of the columns, and what stands between
cells.
"""

import csv
import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass

_MAX_COMMENTS = 200  # [C]
_MAX_PREAMBLE = 50  # [C] lines that a data logger writes above the names of the columns
_UNIT = re.compile(
    r"[(\[].{0,20}[)\]]|[num]?s|sec|m?rad|deg|°|[pfn]F|counts|m?V|°?C|K|Hz|m?N|[mµ]?m|px|ohm|Ω|",
    re.IGNORECASE,
)


@dataclass(frozen=True, kw_only=True)
class Heading:
    """What stands above the numbers.

    ``start`` is the number of the last line that belongs to it, ``names`` those of the columns,
    ``delimiter`` a comma, semicolon or tab, or a blank for blanks of any length.
    """

    notes: dict[str, str]
    start: int
    names: list[str]
    delimiter: str


def is_numeral(cell: str) -> bool:
    """Whether a cell is a number as Python reads it, without its underscores."""
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def split_line(line: str, delimiter: str) -> list[str]:
    """The cells of a line, without quotes and blanks around them."""
    if delimiter == " ":
        return line.replace('"', "").split()
    if '"' not in line:
        return [cell.strip() for cell in line.split(delimiter)]
    try:
        cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        cells = line.split(delimiter)
    return [cell.strip().strip('"').strip() for cell in cells]


def find_heading(lines: Iterator[tuple[int, str]]) -> Heading | None:
    """The heading of numbered lines; None where no line is left under the notes.

    The names are the first line whose cells are as many as those of the numbers below it, or,
    where a logger has written none there, the last note of as many cells. Units in a row of their
    own are put behind the names: ``time`` above ``(ms)`` is ``time (ms)``.
    """
    notes: dict[str, str] = {}
    texts: list[str] = []  # notes as they are written
    above: list[tuple[int, str]] = []  # the first lines that are no notes
    for number, line in lines:
        text = line.strip()
        if text.startswith(("#", "%")) and not re.match(r"%?\w+[,;\t]", text):
            texts.append(text.lstrip("#% "))
            _note(notes, texts[-1], ":")
        elif text:
            above.append((number, line.rstrip("\n")))
        if len(above) > _MAX_PREAMBLE:
            break
    if not above:
        return None
    return _name_columns(notes, texts, above)


def _note(notes: dict[str, str], text: str, sign: str) -> None:
    key, found, value = text.partition(sign)
    if found and len(notes) < _MAX_COMMENTS:
        notes[key.strip().lower()[:200]] = value.strip()[:1000]


def _name_columns(
    notes: dict[str, str], texts: list[str], above: list[tuple[int, str]]
) -> Heading:
    for k, (number, line) in enumerate(above):
        delimiter = _find_delimiter(line)
        names, below = (
            split_line(line, delimiter),
            [split_line(text, delimiter) for _, text in above[k + 1 : k + 3]],
        )
        if (
            len(names) < 2
            or any(map(is_numeral, names))
            or not below
            or _differ(names, below[0])
        ):
            continue
        if any(map(is_numeral, below[0])):
            return _make(notes, above[:k], number, names, delimiter)
        if len(below) == 2 and _are_units(*below):
            both = [
                _join(*pair) for pair in itertools.zip_longest(names, below[0], fillvalue="")
            ]
            return _make(notes, above[:k], above[k + 1][0], both, delimiter)
    number, line = above[0]
    delimiter = _find_delimiter(line)
    cells = split_line(line, delimiter)
    if all(map(is_numeral, cells)) and texts:
        names = split_line(texts[-1], delimiter)
        if len(names) == len(cells) > 1 and not any(map(is_numeral, names)):
            return _make(notes, [], number - 1, names, delimiter)
    return _make(notes, [], number, cells, delimiter)


def _make(
    notes: dict[str, str],
    preamble: list[tuple[int, str]],
    start: int,
    names: list[str],
    delimiter: str,
) -> Heading:
    for _, line in preamble:
        _note(notes, line, ":" if ":" in line else delimiter)
    if len(names) > 1 and names[-1] == "":  # a trailing delimiter
        names = names[:-1]
    return Heading(notes=notes, start=start, names=names, delimiter=delimiter)


def _find_delimiter(line: str) -> str:
    """What stands between the cells: of comma, semicolon and tab the one that is there most."""
    found = max(",;\t", key=line.count)
    return found if line.count(found) or " " not in line.strip() else " "


def _differ(names: list[str], cells: list[str]) -> bool:
    """Whether a row has another number of cells; either may end in a delimiter."""
    return abs(len(names) - len(cells)) > ("" in (names[-1], cells[-1]))


def _are_units(cells: list[str], below: list[str]) -> bool:
    return (
        any(cells)
        and all(_UNIT.fullmatch(cell) for cell in cells)
        and not _differ(cells, below)
        and any(map(is_numeral, below))
    )


def _join(name: str, unit: str) -> str:
    bare = unit.strip("()[]")
    return f"{name} ({bare})" if bare else name
