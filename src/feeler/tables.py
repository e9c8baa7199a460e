"""Tables of numbers from delimited text: headings, units, and one reader for all commands."""

import csv
import io
import itertools
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from feeler.errors import InvalidInput
from feeler.files import read_text
from feeler.validation import checked

# The heading of a table of text: notes, names and units of the columns, and what stands between
# cells.

_MAX_COMMENTS = 200  # [C]
ROW = "row"
"""Name of a first column without one where others say the time."""
_MAX_PREAMBLE = 50  # [C] lines that a data logger writes above the names of the columns
_UNIT = re.compile(
    r"[(\[].{0,20}[)\]]|-|1|%|a\.?u\.?|1/\w+|px|pixels?|counts|°|°?C|"
    r"[nuµμmckM]?(?:s|sec|seconds?|rad|deg|F|V|A|K|Hz|N|m|g|Pa|ohm|Ω)(?:/\w{1,3})?|pF|fF|",
    re.IGNORECASE,
)


@dataclass(frozen=True, kw_only=True)
class Heading:
    """Header lines.

    ``start`` is the number of the last line that belongs to it, ``names`` those of the columns,
    ``delimiter`` a comma, semicolon or tab, or a blank for blanks of any length.
    """

    notes: dict[str, str]
    start: int
    names: list[str]
    delimiter: str


TIME_UNITS = {
    **dict.fromkeys(("ms", "msec", "msecs", "millis", "millisecond", "milliseconds"), 1.0),
    **dict.fromkeys(("s", "sec", "secs", "second", "seconds"), 1e3),
    **dict.fromkeys(("us", "µs", "μs", "micros", "microsecond", "microseconds"), 1e-3),
    "ns": 1e-6,
}
"""Units of time as headers say them, in ms."""
# how PlotJuggler (CSV export) and ROS 1 (rostopic echo -p) call their clocks, which say no unit
_CLOCKS = {"__time": "s", "%time": "ns"}
_OF_TIME = "times?|t|time[ _-]?stamps?|elapsed(?:[ _-]?time)?"


def find_times(columns: Sequence[str], events: str = "") -> dict[str, str]:
    """Columns of times, each with the unit that its name says, a key of ``TIME_UNITS``, or ``""``:
    ``time_ms``, ``Time [s]``, ``t``, ``timestamp (us)``, ``elapsed time``, ``seconds``. ``events``
    are others, as in ``onset|spike``, alone or before ``time``.
    """
    begin = f"(?:(?:{events})[ _.]?)?(?:{_OF_TIME}|{events})" if events else f"(?:{_OF_TIME})"
    units = "|".join(sorted(TIME_UNITS, key=len, reverse=True))
    pattern = re.compile(
        rf"{begin}(?:[\s_.,(\[-]+(?P<unit>{units})|(?P<joined>ms|us))?\s*[)\]]?"
        rf"|(?P<alone>{'|'.join(unit for unit in TIME_UNITS if len(unit) > 2 or unit == 'ms')})",
        re.IGNORECASE,
    )
    found = {}
    for column in columns:
        if match := pattern.fullmatch(column):
            found[column] = next(filter(None, match.groups()), "").lower()
        elif column in _CLOCKS:
            found[column] = _CLOCKS[column]
    return found


_NAMED = re.compile(r"(?P<name>.*?)(?:[\s_]*[\[(](?P<in>[^\])]*)[\])]|[\s_](?P<bare>[^\s_]+))?")


def split_unit(column: str) -> tuple[str, str]:
    """Name and unit of a column: ``length_um``, ``force (mN)``, ``diameter [µm]``."""
    match = _NAMED.fullmatch(column.strip())
    if match is None:
        return column, ""
    unit = (match["in"] or match["bare"] or "").strip()
    return match["name"].strip().replace(" ", "_"), re.sub(r"^[uμ](?=[mN])", "µ", unit)


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


def find_heading(lines: Iterator[tuple[int, str]], known: Sequence[str] = ()) -> Heading | None:
    """The heading of numbered lines; None where no line is left under the notes.

    The names are the first line whose cells are as many as those of the numbers below it, or that
    has one of the ``known`` names in small letters; or, where a logger has written none there, the
    last note of as many cells. Units in a row of their own are put behind the names: ``time`` above
    ``(ms)`` is ``time (ms)``.
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
    return _name_columns(notes, texts, above, known)


def sniff_columns(start: bytes) -> list[str]:
    """Names of a table's columns by how its file begins; none where it is no table."""
    if b"\0" in start:
        return []
    text = join_lines(start.decode("utf-8-sig", "ignore").replace("\r\n", "\n"))
    heading = find_heading(enumerate(text.split("\n"), 1))
    return [] if heading is None else heading.names


def _note(notes: dict[str, str], text: str, sign: str) -> None:
    key, found, value = text.partition(sign)
    if found and len(notes) < _MAX_COMMENTS:
        notes[key.strip().lower()[:200]] = value.strip()[:1000]


def _name_columns(
    notes: dict[str, str],
    texts: list[str],
    above: list[tuple[int, str]],
    known: Sequence[str],
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
        if len(below) == 2 and _are_units(*below):
            pairs = itertools.zip_longest(names, below[0], fillvalue="")
            both = [
                f"{name} ({bare})"
                if (bare := unit.strip("()[]- "))
                and not re.search(rf"\b{re.escape(bare)}\W?$", re.sub("_", " ", name))
                else name
                for name, unit in pairs
            ]
            return _make(notes, above[:k], above[k + 1][0], both, delimiter)
        if any(map(is_numeral, below[0])) or {name.lower() for name in names} & {*known}:
            over = split_line(above[k - 1][1], delimiter) if k else []
            if len({*names}) < len(names) and over and not _differ(over, names):
                names = _join_rows(over, names)
            return _make(notes, above[:k], number, names, delimiter)
    number, line = above[0]
    delimiter = _find_delimiter(line)
    cells = split_line(line, delimiter)
    if all(map(is_numeral, cells)) and texts:
        names = split_line(texts[-1], delimiter)
        if len(names) == len(cells) > 1 and not any(map(is_numeral, names)):
            return _make(notes, [], number - 1, names, delimiter)
    return _make(notes, [], number, cells, delimiter)


def _join_rows(over: list[str], names: list[str]) -> list[str]:
    """Names of two rows, of which the upper one spans several columns: ``tip`` above ``x`` and
    ``y`` is ``tip_x`` and ``tip_y``.
    """
    joined, last = [], ""
    for upper, lower in itertools.zip_longest(over, names, fillvalue=""):
        last = upper or last
        joined.append("_".join(filter(None, (last, lower))) if lower else upper)
    return joined


def _make(
    notes: dict[str, str],
    preamble: list[tuple[int, str]],
    start: int,
    names: list[str],
    delimiter: str,
) -> Heading:
    for _, line in preamble:
        _note(notes, line, ":" if ":" in line else delimiter)
    while len(names) > 1 and names[-1] == "":  # trailing delimiters
        names = names[:-1]
    return Heading(notes=notes, start=start, names=names, delimiter=delimiter)


def _find_delimiter(line: str) -> str:
    """What stands between the cells: of tab, semicolon and comma the one that is there most."""
    found = max("\t;,", key=line.count)
    return found if line.count(found) or " " not in line.strip() else " "


def _differ(names: list[str], cells: list[str]) -> bool:
    """Whether a row has another number of cells; either may end in delimiters."""
    longer, n = max(names, cells, key=len), min(len(names), len(cells))
    return any(longer[n:])


def _are_units(cells: list[str], below: list[str]) -> bool:
    return (
        not all(cell.lower() in _MISSING or is_numeral(cell) for cell in cells)
        and all(_UNIT.fullmatch(cell) for cell in cells)
        and not _differ(cells, below)
        and any(map(is_numeral, below))
    )


# Tables of numbers from delimited text: the one door for tracks, recordings and calibration
# tables.

MAX_BYTES = 64 * 2**20  # [C] an eight-channel recording of 10 minutes at 1 kHz takes 40 MB
_MAX_CELLS = 12_000_000  # [C] ~100 MB of numbers
MAX_COLUMNS = 1024  # [C]
_MAX_LINE = 65_536  # [C] characters
_MAX_NUMBER = (
    1e30  # [C] no measured quantity is larger, and the products of larger ones overflow
)
_MISSING = ("", "nan", "na", "n/a", "#n/a", "-nan", "nan(ind)", "null", "none", "-", "--", ".")
_LOOKED_AT = 1000  # rows in which a column's first word or number is looked for
_CELL = r"(?:^|(?<=[;\t\n \"]))[+-]?\d*{}\d+(?:[eE][+-]?\d+)?(?=[;\t\n \"]|$)"
_COMMA, _POINT = re.compile(_CELL.format(",")), re.compile(_CELL.format(r"\."))
_BROKEN = re.compile(r'(?m)(?:^|(?<=[,;\t]))"[^"\n]{0,99}\n[^"]{0,99}"(?=[,;\t]|$)')
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_POINTED = re.compile(r"[+-]?[1-9]\d{0,2}(\.\d{3})+")


@dataclass(frozen=True, kw_only=True)
class Table:
    """Named columns of numbers with the comments above them.

    ``columns`` names, ``values`` (row, column) with NaN for an empty cell, ``notes`` from lines ``#
    key: value``, ``line`` (row,) the line number of each row in the file, ``source`` the file's
    name, ``words`` the columns that hold text, each with that of all rows (row,), empty where there
    is none; their values are NaN.
    """

    columns: tuple[str, ...]
    values: np.ndarray
    notes: dict[str, str]
    line: np.ndarray
    source: str
    words: dict[str, np.ndarray] = field(default_factory=dict)

    def column(self, name: str) -> np.ndarray:
        """Values (row,) of the column called ``name``; the error lists the columns there are."""
        if name not in self.columns:
            raise InvalidInput(
                f"{self.source}: no column {name!r}; its columns are {_list(self.columns)}."
            )
        self.refuse_words(name)
        return self.values[:, self.columns.index(name)]

    def quantity(
        self, names: Sequence[str], units: Mapping[str, float]
    ) -> tuple[np.ndarray, str]:
        """Values (row,) of the column of one of these names, in the unit whose factor is 1, and the
        unit that its heading says, one of ``units``: ``length_um``, ``Force [mN]``.

        Raises
        ------
        InvalidInput
            No such column, more than one, one without a unit or with an unknown one, or an empty
            cell.
        """
        found = self.find_quantity(names, units)
        if found is None:
            raise InvalidInput(
                f"{self.source}: no column {names[0]} with its unit ({_list_valid(names, units)});"
                f" its columns are {', '.join(self.columns[:12])}."
            )
        return found

    def find_quantity(
        self, names: Sequence[str], units: Mapping[str, float]
    ) -> tuple[np.ndarray, str] | None:
        """As :meth:`quantity`; None where there is no such column."""
        found = []
        for column in self.columns:
            name, unit = split_unit(column)
            if not {name.lower(), name.lower().removesuffix("s"), column.lower()} & {*names}:
                continue
            if unit not in units:
                raise InvalidInput(
                    f"{self.source}: column {column!r} does not say its unit. Call it"
                    f" {_list_valid(names, units)}."
                )
            values = self.column(column)
            if np.isnan(values).any():
                line = int(self.line[np.argmax(np.isnan(values))])
                raise InvalidInput(
                    f"{self.source} line {line}: {column} is empty. Fill it in, or leave the row"
                    " out."
                )
            found.append((column, units[unit] * values, unit))
        if len(found) > 1:
            both = ", ".join(column for column, _, _ in found)
            raise InvalidInput(
                f"{self.source}: which of {both} is the {names[0]}? Leave one of them."
            )
        return found[0][1:] if found else None

    def first_word(self, name: str) -> str:
        """The first text in a column of text that is not empty."""
        return next((text[:40] for text in self.words[name].tolist() if text), "")

    def refuse_words(self, *names: str) -> None:
        """Raise InvalidInput if one of these columns holds text where numbers are needed."""
        for name in names:
            if name in self.words:
                raise InvalidInput(
                    f"{self.source}: column {name!r} holds text ({self.first_word(name)!r}),"
                    " numbers are needed. Write numbers; times as ms or s since the start."
                )


def join_lines(text: str) -> str:
    """The same text with a blank for each line break within a quoted cell, as headers have."""
    return _BROKEN.sub(lambda cell: cell[0].replace("\n", " "), text)


@checked
def read_table(
    path: str | os.PathLike,
    *,
    max_bytes: int = MAX_BYTES,
    max_cells: int = _MAX_CELLS,
    words: bool | Sequence[str] = False,
) -> Table:
    """Read a delimited text file (comma, semicolon, tab or blanks) with one header row; nothing in
    it is ever executed.

    Lines that start with ``#`` before the header are notes, ``# key: value``, and so is what a
    logger writes above the header without a sign. Units may stand in a row of their own below the
    names, and of two rows of names the upper one may span several columns. Empty cells, ``NaN``,
    ``NA``, ``N/A``, ``null``, ``none``, ``-`` and ``.`` are missing values. Everything else must be
    a number of at most 1e30. Decimal commas are read where semicolons, tabs or blanks stand between
    the cells, and all decimals of the file are commas.

    Parameters
    ----------
    words
        Take columns that begin with text, too: their values are NaN, and ``Table.words`` has what
        they hold. Columns of these names, in small letters, are text whatever they hold.

    Raises
    ------
    InvalidInput
        Not a regular file, larger than the limits, not UTF-8 text, no header, a row of the wrong
        width, or a cell that is no number (named by line and column).
    """
    text = join_lines(read_text(path, max_bytes))
    if re.match(r"\s*\"?scorer\"?[,;\t]", text):  # its names stand in several rows
        raise InvalidInput(
            f"{Path(path).name} is a table by DeepLabCut: feeler info says if of tracks or labels."
        )
    return parse_table(text, source=Path(path).name, max_cells=max_cells, words=words)


@checked
def parse_table(
    text: str,
    *,
    source: str = "text",
    max_cells: int = _MAX_CELLS,
    words: bool | Sequence[str] = False,
    bare: Sequence[str] = (),
    heading: Heading | None = None,
) -> Table:
    """As :func:`read_table`, from text that has already been read; with a ``heading`` of one's own
    where a program writes its names in another way, and ``bare`` names where there is none.
    """
    known = () if isinstance(words, bool) else words
    heading = heading or find_heading(enumerate(io.StringIO(text), 1), known)
    if heading is None:
        raise InvalidInput(
            f"{source}: no header row. The first line names the columns, separated by commas."
        )
    if bare and all(map(is_numeral, heading.names)):
        heading = replace(heading, start=heading.start - 1, names=[*bare])
    columns = _check_names(heading.names, source)
    if heading.delimiter != ",":
        text = _set_points(text, heading, source)
    always = [name for name in columns if name.lower() in known]
    found = [*always, *(_find_words(text, heading, columns) if words else ())]
    values, numbers, texts = _read_rows(text, heading, columns, source, max_cells, found)
    return Table(
        columns=columns,
        values=values,
        notes=heading.notes,
        line=numbers,
        source=source,
        words={name: np.array(texts[name], dtype=str) for name in columns if name in texts},
    )


def _check_names(names: list[str], source: str) -> tuple[str, ...]:
    clocked = any(re.match("time|frame", name, re.IGNORECASE) for name in names)
    if len(names) > 1 and names[0] in (
        "",
        "Unnamed: 0",
    ):  # numbers of rows, as pandas and R have
        names = [ROW if clocked else "frame", *names[1:]]
    columns = tuple(names)
    if sum(map(len, columns)) > _MAX_LINE:
        raise InvalidInput(
            f"{source}: the header has more than {_MAX_LINE:,} characters. Is it a table?"
        )
    if len(columns) > MAX_COLUMNS:
        raise InvalidInput(
            f"{source}: {len(columns)} columns, more than the limit of {MAX_COLUMNS}."
        )
    if any(not name for name in columns) or all(is_numeral(name) for name in columns):
        raise InvalidInput(
            f"{source}: the first row must name every column, got {_list(columns)}. Add a header"
            " row."
        )
    if len(set(columns)) < len(columns):
        double = next(name for name in columns if columns.count(name) > 1)
        raise InvalidInput(
            f"{source}: two columns are called {double!r}. Give each its own name."
        )
    return columns


def _set_points(text: str, heading: Heading, source: str) -> str:
    """The same lines, with points below the heading where decimals have commas, as in much of
    Europe.

    Raises
    ------
    InvalidInput
        Some have commas and others points, or each comma or point might part thousands.
    """
    rows = itertools.islice(_list_rows(text, heading.start), _LOOKED_AT)
    for cells in zip(*(split_line(line, heading.delimiter) for _, line in rows), strict=False):
        parted = [cell for cell in cells if "." in cell]
        digits = [len(cell) for cell in cells if cell.isdigit()]
        if parted and all(map(_POINTED.fullmatch, parted)) and max(digits, default=0) == 3:
            raise InvalidInput(
                f"{source}: is {parted[0]!r} a decimal, or are these thousands? Write nothing"
                " between thousands, or all numbers of the column with a decimal point."
            )
    lines = text.split("\n")
    below = "\n".join(lines[heading.start :])
    found = _COMMA.search(below)
    if found is None:
        return text
    line = heading.start + below.count("\n", 0, found.start()) + 1
    if point := _POINT.search(below):
        raise InvalidInput(
            f"{source} line {line}: {found[0]!r} has a decimal comma, {point[0]!r} a decimal point."
            " Use a decimal point everywhere."
        )
    if all(_THOUSANDS.fullmatch(one[0]) for one in _COMMA.finditer(below)):
        raise InvalidInput(
            f"{source} line {line}: is {found[0]!r} a decimal, or are these thousands? Use a"
            " decimal point, and nothing between thousands."
        )
    heading.notes["decimals"] = "commas"
    changed = _COMMA.sub(lambda cell: cell[0].replace(",", "."), below)
    return "\n".join([*lines[: heading.start], changed])


def _list_rows(text: str, start: int) -> Iterator[tuple[int, str]]:
    """Numbered lines after line ``start`` that are neither blank nor notes; tabs alone are a row
    of empty cells.
    """
    # one at a time: a list of lines would take many times the text's memory
    for number, line in enumerate(io.StringIO(text), 1):
        note = re.match(r"\s*#(?!N/A)", line, re.IGNORECASE)
        if number > start and not note and line.strip(" \r\n"):
            yield number, line.rstrip("\n")


def _find_words(text: str, heading: Heading, columns: tuple[str, ...]) -> list[str]:
    """Columns whose first cell that is not empty is no number."""
    first: dict[str, str] = {}
    for _, line in itertools.islice(_list_rows(text, heading.start), _LOOKED_AT):
        for name, cell in zip(columns, split_line(line, heading.delimiter), strict=False):
            if name not in first and cell.lower() not in _MISSING:
                first[name] = cell
        if len(first) == len(columns):
            break
    return [
        name
        for name, cell in first.items()
        if not is_numeral(re.sub("[_,]", "", cell))  # wrong numbers are no text
    ]


def _read_rows(
    text: str,
    heading: Heading,
    columns: tuple[str, ...],
    source: str,
    max_cells: int,
    words: list[str],
) -> tuple[np.ndarray, np.ndarray, dict[str, list[str]]]:
    width, count = len(columns), sum(1 for _ in _list_rows(text, heading.start))
    if count * width > max_cells:
        raise InvalidInput(
            f"{source}: {count:,} rows × {width} columns exceed {max_cells:,} cells. Split it."
        )
    values, numbers = np.full((count, width), np.nan), np.empty(count, dtype=int)
    taken = [k for k, name in enumerate(columns) if name not in words]
    texts: dict[str, list[str]] = {name: [] for name in words}
    for row, (number, line) in enumerate(_list_rows(text, heading.start)):
        numbers[row] = number
        cells = split_line(line, heading.delimiter) if len(line) <= _MAX_LINE else []
        if len(cells) > width and not any(cells[width:]):
            cells = cells[:width]
        if len(cells) != width:
            raise InvalidInput(
                f"{source} line {number}: {len(cells)} cells where the header has {width} columns."
            )
        values[row, taken] = _read_cells(cells, taken, columns, source, number)
        for name, kept in texts.items():
            kept.append(cells[columns.index(name)])
    return values, numbers, texts


def _read_cells(
    cells: list[str], taken: list[int], columns: tuple[str, ...], source: str, number: int
) -> list[float]:
    try:
        values = [float(cells[k]) for k in taken]
    except ValueError:
        values = []
    plain = not any("_" in cells[k] for k in taken)
    if values and plain and all(-_MAX_NUMBER <= value <= _MAX_NUMBER for value in values):
        return values
    return [_read_cell(cells[k], source, number, columns[k]) for k in taken]


def _read_cell(cell: str, source: str, number: int, column: str) -> float:
    if cell.lower() in _MISSING:
        return np.nan
    value = np.inf
    if is_numeral(cell):
        value = float(cell)
    if not np.isfinite(value):
        hint = " Use a decimal point." if "," in cell else ""
        raise InvalidInput(
            f"{source} line {number}, column {column!r}: {cell[:40]!r} is no finite number.{hint}"
        )
    if abs(value) > _MAX_NUMBER:
        raise InvalidInput(
            f"{source} line {number}, column {column!r}: {cell[:40]!r} is larger than anything"
            f" measured ({_MAX_NUMBER:g}). Mark a missing value by an empty cell."
        )
    return value


def _list_valid(names: Sequence[str], units: Mapping[str, float]) -> str:
    """Names that a column with its unit may have."""
    return ", ".join(f"{names[0]}_{unit.replace('µ', 'u')}" for unit in list(units)[:4])


def _list(names: tuple[str, ...]) -> str:
    shown = ", ".join(name[:40] for name in names[:20])
    return shown + (f", … ({len(names)} in all)" if len(names) > 20 else "")
