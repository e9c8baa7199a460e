"""The one table of results: a row for each number of a run, of which verdicts, pages, README's and
the docs' numbers and the expected values are views; two tables are compared row by row.
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from feeler.errors import InvalidInput
from feeler.files import read_shipped, writing
from feeler.report import Section
from paper.context import OWN

COLUMNS = (
    *("quantity", "figure", "statement", "reading", "group"),
    *("value", "low", "high", "n", "unit"),
)
_INDEX = ["quantity", "reading", "group"]
RESULTS = "results.csv"
KEPT = Path(__file__).parent / "kept" / RESULTS
"""The table of the cached run at paper scale, of which README's and the docs' numbers are views."""

_POINT = re.compile(r"(?<!\d)\.|\.(?!\d)")
_GROUPS = {
    *("slow", "medium", "fast", "slowest", "middle", "fastest", "exponential", "linear"),
    *("uniform", "matched", "graded", "rival", "contact", OWN),
}
_GROUP = re.compile(r"-?\d[\d.]*|M\d|every \d+|stiffness x [\d.]+|\d+ Hz|.+ over .+")
_NOISES = {"common", "relative"}
PLACE = re.compile(r"\{([^{}:]+):([^{}]+)\}")
"""``{name of a value:format}``; the format ``ci`` gives the interval of a share."""


class Value(NamedTuple):
    """A number, the ends of its interval (itself where it has none), and what it is one of."""

    value: float
    low: float
    high: float
    n: int


def show(value: Value) -> str:
    """A value with its interval."""
    if np.isnan(value.value):
        return "undefined"
    if value.low < value.high:
        return f"{value.value:.3g} ({value.low:.3g} to {value.high:.3g})"
    return f"{value.value:.4g}"


@cache
def read_declared(name: str) -> dict[str, Any]:
    """What a TOML file of this folder declares."""
    return read_shipped("paper", name)


@cache
def split_key(key: str) -> tuple[str, str, str]:
    """Quantity, reading and group of a value, such as ``dispersion.380 ms window.nmi.slow``: a part
    is a group if it is a speed, a profile or a number of something, a reading if it is more than
    one word or a kind of noise. A point between digits divides nothing.
    """
    parts: dict[str, list[str]] = {"quantity": [], "reading": [], "group": []}
    for part in _POINT.split(key):
        is_group = part in _GROUPS or _GROUP.fullmatch(part)
        is_reading = " " in part or part in _NOISES
        parts["group" if is_group else "reading" if is_reading else "quantity"].append(part)
    return ".".join(parts["quantity"]), "; ".join(parts["reading"]), " ".join(parts["group"])


@cache
def find_unit(quantity: str) -> tuple[str, float | None]:
    """Unit of a quantity and the least effect that counts in it; None: 5 % of the greater value."""
    for one in read_declared("statements.toml")["unit"]:
        if any(fnmatch(quantity, pattern) for pattern in one["quantities"]):
            return one["name"], one.get("least")
    return "", None


@cache
def find_figure(quantity: str) -> str:
    """Figure of the paper that a quantity belongs to; empty: it is beyond the paper."""
    for one in read_declared("statements.toml")["figure"]:
        if any(fnmatch(quantity, pattern) for pattern in one.get("quantities", ())):
            return one["name"]
    return ""


class Results:
    """A table of results, in which a value is found by its name.

    Attributes
    ----------
    table : pandas.DataFrame
        Columns ``COLUMNS``, sorted by quantity, reading and group.
    """

    def __init__(self, table: pd.DataFrame):
        self.table = table
        columns = (table[name].fillna("") for name in _INDEX)
        numbers = table[["value", "low", "high", "n"]].itertuples(index=False)
        self._found = dict(
            zip(zip(*columns, strict=True), map(Value._make, numbers), strict=True)
        )

    @classmethod
    def make(cls, values: Mapping[str, Any]) -> "Results":
        """The table of these values by name; what is a list is no number and is left out."""
        from paper.statements import load_statements

        uses = defaultdict(list)
        for statement in load_statements():
            for key in statement.list_keys():
                uses[key].append(statement.id)
        rows = [
            make_row(key, value, "; ".join(uses[key]))
            for key, value in values.items()
            if not isinstance(value, list)
        ]
        table = pd.DataFrame(rows, columns=list(COLUMNS)).sort_values(_INDEX)
        return cls(table.reset_index(drop=True))

    @classmethod
    def collect(cls, sections: Iterable[Section]) -> "Results":
        """The table of a run."""
        return cls.make({key: value for one in sections for key, value in one.values.items()})

    @classmethod
    def read(cls, path: Path) -> "Results":
        """The table of a CSV file that :meth:`write` wrote.

        Raises
        ------
        InvalidInput
            The file has other columns.
        """
        if not path.is_file():
            raise InvalidInput(f"there is no table {str(path)!r}; a run writes OUT/{RESULTS}.")
        table = pd.read_csv(path, dtype=dict.fromkeys(["figure", "statement", *_INDEX], str))
        if missing := {*COLUMNS} - {*table.columns}:
            raise InvalidInput(
                f"{path} is no table of results: it lacks the columns {', '.join(sorted(missing))}"
                "."
            )
        return cls(
            table.fillna({name: "" for name in (*_INDEX, "figure", "statement", "unit")})
        )

    def write(self, path: Path) -> None:
        """As CSV, with nine digits; the file appears under its name only when it is whole."""
        with writing(path) as part:
            self.table.to_csv(part, index=False, float_format="%.9g")

    def get(self, key: str) -> Value | None:
        """The value of this name; None: the run has not computed it."""
        return self._found.get(split_key(key))

    def fill(self, words: str) -> str:
        """The text with values in place of ``{name:format}``, without the sentences of which a
        value is missing or undefined.
        """
        sentences = re.split(r"(?<=[.?!]) (?=[A-Z])", " ".join(words.split()))
        return " ".join(filter(None, map(self._fill, sentences)))

    def _fill(self, sentence: str) -> str:
        found = {key: self.get(key) for key, _ in PLACE.findall(sentence)}
        if any(one is None or np.isnan(one.value) for one in found.values()):
            return ""
        return PLACE.sub(lambda place: _format(found[place[1]], place[2]), sentence)


def fill_front(results: Results) -> list[list[str]] | None:
    """The one table of README and of the report's first screen, header first; None where the run
    lacks a cell.
    """
    front = read_declared("statements.toml")["front"]
    rows = [[results.fill(cell) for cell in row] for row in front["rows"]]
    return [front["head"], *rows] if all(map(all, rows)) else None


def _format(value: Value | None, form: str) -> str:
    assert value is not None
    if form == "ci":
        return f"{value.low:.0%} to {value.high:.0%}"
    return format(int(value.value) if form == "d" else value.value, form)


def make_row(key: str, value: Any, statement: str) -> tuple[Any, ...]:
    quantity, reading, group = split_key(key)
    cell = value if isinstance(value, Mapping) else {"value": value}
    number = cell.get("value", np.nan)
    ends = (number if cell.get(end) is None else cell[end] for end in ("low", "high"))
    about = quantity, find_figure(quantity), statement, reading, group
    return (*about, number, *ends, cell.get("n", 1), find_unit(quantity)[0])


def compare(first: pd.DataFrame, second: pd.DataFrame, tolerance: float) -> pd.DataFrame:
    """Rows whose values differ by more than a share ``tolerance``, or that one table lacks.
    Another antenna than the paper's is compared with the paper's exponential one.

    Returns
    -------
    pandas.DataFrame
        ``first`` and ``second`` value by quantity, reading and group; ``apart``: their intervals do
        not overlap.
    """
    first, second = (
        one.assign(group=one["group"].str.replace(OWN, "exponential"))
        for one in (first, second)
    )
    both = pd.merge(
        first, second, on=_INDEX, how="outer", suffixes=("_first", "_second"), indicator=True
    )
    a, b = both["value_first"], both["value_second"]
    same = np.isclose(a, b, rtol=tolerance, atol=1e-12, equal_nan=True)
    apart = (both["low_first"] > both["high_second"]) | (
        both["low_second"] > both["high_first"]
    )
    found = both[_INDEX].assign(first=a, second=b, apart=apart)
    return found[~same | (both["_merge"] != "both")].reset_index(drop=True)
