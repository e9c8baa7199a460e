"""Statements of the paper and of this project, each with the tests by which it is judged; all are
declared in statements.toml, in the paper's order.
"""

import re
from dataclasses import dataclass
from functools import cache
from typing import Annotated, Literal

from feeler.errors import InvalidInput
from feeler.files import make_record
from feeler.records import Choice, Record
from paper.scale import SCALES
from paper.table import read_declared

_BRACKET = re.compile(r"\[([^\[\]]+ [<>] [^\[\]]+)\]")
_VALUE = re.compile(r"(?P<key>.+) = (?P<target>\S+) ± (?P<percent>\S+) %")
_BOUND = re.compile(r"(?P<key>.+) (?P<side>[≤≥]) (?P<target>\S+)")


@dataclass(frozen=True, kw_only=True)
class Criterion:
    """One test of a statement: ``a.[x < y < z].b`` (values rise in this order), ``a.[x > y < z]``
    (the middle is the least), ``a = 1.9 ± 15 %``, ``a ≥ 0.75`` or ``a ≤ 0.05``.
    """

    kind: Literal["order", "dip", "value", "above", "below"]
    keys: tuple[str, ...]
    target: float = 0.0
    tolerance: float = 0.0

    @classmethod
    def parse(cls, text: str) -> "Criterion":
        """A test from its line."""
        if bracket := _BRACKET.search(text):
            names, signs = re.split(" [<>] ", bracket[1]), re.findall(" ([<>]) ", bracket[1])
            keys = tuple(text[: bracket.start()] + n + text[bracket.end() :] for n in names)
            if {*signs} == {"<"}:
                return cls(kind="order", keys=keys)
            if signs == [">", "<"]:
                return cls(kind="dip", keys=keys)
        elif value := _VALUE.fullmatch(text):
            share = float(value["percent"]) / 100
            return cls(
                kind="value",
                keys=(value["key"],),
                target=float(value["target"]),
                tolerance=share,
            )
        elif bound := _BOUND.fullmatch(text):
            kind: Literal["above", "below"] = "above" if bound["side"] == "≥" else "below"
            return cls(kind=kind, keys=(bound["key"],), target=float(bound["target"]))
        raise InvalidInput(
            f"{text!r} is no test; write 'a.[x < y < z]', 'a.[x > y < z]', 'a = 1.9 ± 15 %',"
            " 'a ≥ 0.75' or 'a ≤ 0.05'."
        )


class Statement(Record):
    """What is said and where, and how it is held against what a run computes.

    Attributes
    ----------
    where : str
        Where the paper says it, or the page that does.
    paper : str
        The paper's number.
    whose : Literal[paper, ours]
        Statements of our own are counted by themselves.
    section : str
        The section of the report whose values it reads.
    figure : str
        The figure beside which it is shown; empty: at the end of its section.
    tests : tuple[str, ...]
        Texts of :class:`Criterion`, all of which must hold; where there are ``readings``, each
        holds ``{reading}``.
    readings : tuple[str, ...]
        Meanings of the statement that the paper leaves open; the first is the nearest to its words.
    of : str
        What its values are ``n`` of: starts of a fit, repeats, sets of touches …; a value of one
        draw is not judged. ``nothing``: they follow from what is declared. ``touches``: the thirty
        of the paper's fixed grid, no sample of a population.
    scale : str
        Least scale that computes enough to judge it.
    null : tuple[str, str]
        What in each name is replaced by what for the value that identical touches reach.
    shows : tuple[str, ...]
        Further values that are shown, and not judged.
    why : str
        Why it cannot be compared.
    given : tuple[str, ...]
        Tests by which it is judged all the same once ``--inputs`` gives what is not published.
    note : str
        What explains the verdict where it is not reproduced.
    """

    id: str
    where: str
    says: str
    paper: str = "–"
    whose: Literal["paper", "ours"] = "paper"
    section: str = ""
    figure: str = ""
    tests: tuple[str, ...] = ()
    readings: tuple[str, ...] = ()
    of: str = ""
    scale: Annotated[str, Choice(SCALES)] = "smoke"
    null: tuple[str, ...] = ()
    shows: tuple[str, ...] = ()
    why: str = ""
    given: tuple[str, ...] = ()
    note: str = ""

    def _check(self) -> None:
        about = f"statement {self.id!r}"
        if bool(self.tests) == bool(self.why):
            raise InvalidInput(
                f"{about} needs either tests or, as `why`, why it cannot be compared."
            )
        if self.tests and not (self.of and self.section):
            raise InvalidInput(
                f"{about} does not say what its values are drawn from, or which section computes"
                ' them; set `of`, for instance to "starts" or "nothing", and `section`.'
            )
        keys = [key for test in self.parse_tests() for key in test.keys]
        if self.readings and not all("{reading}" in key for key in keys):
            raise InvalidInput(
                f"{about} has readings; each of its tests must hold {{reading}}."
            )
        if self.null and (len(self.null) != 2 or not all(self.null[0] in key for key in keys)):
            raise InvalidInput(
                f"{about} needs two texts as null: what in each name is replaced, and by what."
            )

    def parse_tests(self) -> list[Criterion]:
        """Its tests, with ``{reading}`` in their names."""
        return [Criterion.parse(text) for text in self.tests]

    def judge_given(self) -> "Statement":
        """The statement as it is judged with what its authors have given."""
        return self.replace(tests=self.given, shows=(), given=(), why="", of="nothing")

    def read_as(self, reading: str) -> "Statement":
        """The statement under one reading alone."""
        parts = {
            name: tuple(text.replace("{reading}", reading) for text in getattr(self, name))
            for name in ("tests", "shows")
        }
        return self.replace(readings=(), **parts)

    def list_readings(self) -> list["Statement"]:
        """The statement under each of its readings, the nearest to its words first."""
        return [self.read_as(name) for name in self.readings] or [self]

    def make_null(self, key: str) -> str:
        """The name of what identical touches reach."""
        return key.replace(self.null[0], self.null[1])

    def list_keys(self) -> set[str]:
        """Every value that a run must compute for it."""
        found: set[str] = set()
        for one in self.list_readings():
            keys = [key for test in one.parse_tests() for key in test.keys]
            found |= {*keys, *one.shows, *(map(self.make_null, keys) if self.null else ())}
        return found


@cache
def load_statements() -> tuple[Statement, ...]:
    """Every statement of statements.toml: the paper's in its order, then ours."""
    return tuple(
        make_record(Statement, entry, f"statements.toml, statement {entry.get('id')}")
        for entry in read_declared("statements.toml")["statement"]
    )
