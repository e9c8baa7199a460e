"""Tables of numbers from delimited text: the one door for tracks, recordings and calibration
tables.
"""

import io
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from feeler.checked import checked
from feeler.errors import InvalidInput
from feeler.files import read_text
from feeler.foreign import name_start

MAX_BYTES = 64 * 2**20  # [C] an eight-channel recording of 10 minutes at 1 kHz takes 40 MB
MAX_CELLS = 12_000_000  # [C] ~100 MB of numbers
MAX_COLUMNS = 1024  # [C]
MAX_COMMENTS = 200  # [C]
MAX_LINE = 65_536  # [C] characters
MAX_NUMBER = 1e30  # [C] no measured quantity is larger, and the products of larger ones overflow
MISSING = ("", "nan", "na", "null", "none", "-")


@dataclass(frozen=True, kw_only=True)
class Table:
    """Named columns of numbers with the comments above them.

    ``columns`` names, ``values`` (row, column) with NaN for an empty cell, ``notes`` from lines ``#
    key: value``, ``line`` (row,) the line number of each row in the file, ``source`` the file's
    name.
    """

    columns: tuple[str, ...]
    values: np.ndarray
    notes: dict[str, str]
    line: np.ndarray
    source: str

    def column(self, name: str) -> np.ndarray:
        """Values (row,) of the column called ``name``; the error lists the columns there are."""
        if name not in self.columns:
            raise InvalidInput(
                f"{self.source}: no column {name!r}; its columns are {_list(self.columns)}."
            )
        return self.values[:, self.columns.index(name)]


@checked
def read_table(
    path: str | os.PathLike, *, max_bytes: int = MAX_BYTES, max_cells: int = MAX_CELLS
) -> Table:
    """Read a delimited text file (comma, semicolon or tab) with one header row; nothing in it is
    ever executed.

    Lines that start with ``#`` before the header are notes, ``# key: value``. Empty cells, ``NaN``,
    ``NA``, ``null``, ``none`` and ``-`` are missing values. Everything else must be a number of at
    most 1e30 with a decimal point.

    Raises
    ------
    InvalidInput
        Not a regular file, larger than the limits, not UTF-8 text, no header, a row of the wrong
        width, or a cell that is no number (named by line and column).
    """
    text = read_text(path, max_bytes)
    if words := name_start(text[:512].encode()):  # a table of its own kind, which is no plain one
        raise InvalidInput(f"{Path(path).name} is {words}.")
    return parse_table(text, source=Path(path).name, max_cells=max_cells)


@checked
def parse_table(text: str, *, source: str = "text", max_cells: int = MAX_CELLS) -> Table:
    """As :func:`read_table`, from text that has already been read."""
    notes, start, header = _read_notes(text)
    if not header:
        raise InvalidInput(
            f"{source}: no header row. The first line names the columns, separated by commas."
        )
    delimiter = _find_delimiter(header)
    columns = _read_header(header, delimiter, source)
    values, numbers = _read_rows(text, start, delimiter, columns, source, max_cells)
    return Table(columns=columns, values=values, notes=notes, line=numbers, source=source)


def _list_lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines with their numbers, one at a time: a list of them would take many times the text's
    memory.
    """
    return enumerate(io.StringIO(text), 1)


def _read_notes(text: str) -> tuple[dict[str, str], int, str]:
    """Notes, and number and text of the header line."""
    notes: dict[str, str] = {}
    for number, line in _list_lines(text):
        stripped = line.strip()
        if stripped.startswith("#"):
            key, colon, value = stripped.lstrip("# ").partition(":")
            if colon and len(notes) < MAX_COMMENTS:
                notes[key.strip().lower()[:200]] = value.strip()[:1000]
        elif stripped:
            return notes, number, line.rstrip("\n")
    return notes, 0, ""


def _find_delimiter(header: str) -> str:
    return max(",;\t", key=header.count)


def _split(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def _read_header(line: str, delimiter: str, source: str) -> tuple[str, ...]:
    if len(line) > MAX_LINE:
        raise InvalidInput(
            f"{source}: the header has {len(line):,} characters, more than {MAX_LINE:,}. Is it a"
            " table?"
        )
    columns = tuple(_split(line, delimiter))
    if len(columns) > 1 and columns[-1] == "":  # a trailing delimiter
        columns = columns[:-1]
    if len(columns) > MAX_COLUMNS:
        raise InvalidInput(
            f"{source}: {len(columns)} columns, more than the limit of {MAX_COLUMNS}."
        )
    if any(not name for name in columns) or all(_is_number(name) for name in columns):
        raise InvalidInput(
            f"{source}: the first row must name every column, got {_list(columns)}. Add a header"
            " row."
        )
    if len(set(columns)) < len(columns):
        double = next(name for name in columns if columns.count(name) > 1)
        raise InvalidInput(f"{source}: two columns are called {double!r}. Give each its own name.")
    return columns


def _list_rows(text: str, start: int) -> Iterator[tuple[int, str]]:
    """Numbered lines after line ``start`` that are neither empty nor notes."""
    for number, line in _list_lines(text):
        if number > start and not line.isspace() and not line.lstrip().startswith("#"):
            yield number, line.rstrip("\n")


def _read_rows(text, start, delimiter, columns, source, max_cells) -> tuple[np.ndarray, np.ndarray]:
    width, count = len(columns), sum(1 for _ in _list_rows(text, start))
    if count * width > max_cells:
        raise InvalidInput(
            f"{source}: {count:,} rows × {width} columns exceed {max_cells:,} cells. Split it."
        )
    values, numbers = np.empty((count, width)), np.empty(count, dtype=int)
    for row, (number, line) in enumerate(_list_rows(text, start)):
        numbers[row] = number
        cells = _split(line, delimiter) if len(line) <= MAX_LINE else []
        if len(cells) == width + 1 and cells[-1] == "":
            cells = cells[:-1]
        if len(cells) != width:
            raise InvalidInput(
                f"{source} line {number}: {len(cells)} cells where the header has {width} columns."
            )
        try:
            values[row] = [float(cell) for cell in cells]
        except ValueError:
            values[row] = [
                _read_cell(cell, source, number, name)
                for cell, name in zip(cells, columns, strict=True)
            ]
        if not np.all(np.abs(values[row]) <= MAX_NUMBER) or "_" in line:  # also where NaN stands
            values[row] = [
                _read_cell(cell, source, number, name)
                for cell, name in zip(cells, columns, strict=True)
            ]
    return values, numbers


def _read_cell(cell: str, source: str, number: int, column: str) -> float:
    if cell.lower() in MISSING:
        return np.nan
    value = np.inf
    if _is_number(cell):
        value = float(cell)
    if not np.isfinite(value):
        hint = " Use a decimal point." if "," in cell else ""
        raise InvalidInput(
            f"{source} line {number}, column {column!r}: {cell[:40]!r} is no finite number.{hint}"
        )
    if abs(value) > MAX_NUMBER:
        raise InvalidInput(
            f"{source} line {number}, column {column!r}: {cell[:40]!r} is larger than anything"
            f" measured ({MAX_NUMBER:g}). Mark a missing value by an empty cell."
        )
    return value


def _is_number(cell: str) -> bool:
    try:
        float(cell)
    except ValueError:
        return False
    return "_" not in cell


def _list(names: tuple[str, ...]) -> str:
    shown = ", ".join(name[:40] for name in names[:20])
    return shown + (f", … ({len(names)} in all)" if len(names) > 20 else "")
