"""Statements of the paper and of this project, each with the tests by which it is judged; all are
declared in statements.toml, in the paper's order.
"""

import re
from functools import cache
from typing import Annotated, Any, Literal

from feeler.errors import InvalidInput
from feeler.files import make_record
from feeler.records import Choice, Record
from paper.readings import Option, Sentence, load_sentences
from paper.scale import SCALES
from paper.table import find_unit, read_declared, split_key

_BRACKET = re.compile(r"\[([^\[\]]+ [<>] [^\[\]]+)\]")
_VALUE = re.compile(r"(?P<key>.+) = (?P<target>\S+) ± (?P<percent>\S+) %")
_BOUND = re.compile(r"(?P<key>.+) (?P<side>[≤≥]) (?P<target>\S+)")
_SHARE = 0.05  # least effect where a unit declares none, as a share of the greater value


def list_lines(text: str) -> list[str]:
    """``a.[x < y].b`` as ``a.x.b`` and ``a.y.b``."""
    if not (bracket := _BRACKET.search(text)):
        return [text]
    names = re.split(" [<>] ", bracket[1])
    return [f"{text[: bracket.start()]}{name}{text[bracket.end() :]}" for name in names]


def parse_test(text: str) -> dict[str, Any]:
    """What a line asks of values, as fields of a :class:`~paper.readings.Sentence`:
    ``a.[x < y < z].b`` (they rise in this order), ``a.[x > y < z]`` (the middle is the least),
    ``a = 1.9 ± 15 %``, ``a ≥ 0.75`` or ``a ≤ 0.05``.
    """
    if bracket := _BRACKET.search(text):
        names, signs = re.split(" [<>] ", bracket[1]), re.findall(" ([<>]) ", bracket[1])
        kind = {"<" * len(signs): "order", "><": "dip"}.get("".join(signs))
        if kind:
            key = f"{text[: bracket.start()]}{{group}}{text[bracket.end() :]}"
            return {"kind": kind, "key": key, "groups": tuple(names)}
    elif found := _VALUE.fullmatch(text) or _BOUND.fullmatch(text):
        parts = found.groupdict()
        side = {"≥": "above", "≤": "below"}.get(parts.get("side", ""), "value")
        share = float(parts.get("percent", 0.0)) / 100
        about = {"kind": side, "key": parts["key"], "groups": ("",)}
        return about | {"target": (float(parts["target"]),), "tolerance": share}
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
        Lines of :func:`parse_test`, all of which must hold; where there are ``readings``, each
        holds ``{reading}``. None where sentences of readings.toml answer it.
    readings : tuple[str, ...]
        Meanings of the statement that the paper leaves open; the first is the nearest to its words.
    of : str
        What its values are ``n`` of: starts of a fit, repeats, sets of touches …; a value of one
        draw is not judged. ``nothing``: they follow from what is declared. ``touches``: the thirty
        of the paper's fixed grid, no sample of a population.
    scale : str
        Least scale that computes enough to judge it.
    shows : tuple[str, ...]
        Further values that are shown, and not judged; ``a.[x < y]`` are two.
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
    shows: tuple[str, ...] = ()
    why: str = ""
    given: tuple[str, ...] = ()
    note: str = ""

    def _check(self) -> None:
        about = f"statement {self.id!r}"
        if self.tests and self.why:
            raise InvalidInput(
                f"{about} has tests and, as `why`, why it cannot be compared; leave out one."
            )
        if self.tests and not (self.of and self.section):
            raise InvalidInput(
                f"{about} does not say what its values are drawn from, or which section computes"
                ' them; set `of`, for instance to "starts" or "nothing", and `section`.'
            )
        keys = [parse_test(text)["key"] for text in (*self.tests, *self.given)]
        if self.readings and not all("{reading}" in key for key in keys):
            raise InvalidInput(
                f"{about} has readings; each of its tests must hold {{reading}}."
            )

    def judge_given(self) -> "Statement":
        """The statement as it is judged with what its authors have given."""
        return self.replace(tests=self.given, shows=(), given=(), why="", of="nothing")

    def list_sentences(self) -> tuple[Sentence, ...]:
        """What is judged: the sentences of readings.toml that answer it, or its own tests."""
        if not self.tests:
            return tuple(one for one in load_sentences() if self.id in one.claims)
        choice: tuple[Option, ...] = ()
        if self.readings:
            options = dict.fromkeys(self.readings, "natural")
            choice = (Option(name="reading", asks=self.says, why="", options=options),)
        return tuple(self._make_sentence(text, choice) for text in self.tests)

    def _make_sentence(self, text: str, choice: tuple[Option, ...]) -> Sentence:
        about = parse_test(text)
        unit, least = find_unit(split_key(about["key"].format(group="", reading=""))[0])
        return Sentence(
            id=text,
            figure=self.figure,
            says=self.says,
            paper=self.paper,
            section=self.section,
            measure="values",
            least=least or 0.0,
            share=_SHARE if least is None else 0.0,
            unit=unit,
            of=self.of,
            choice=choice,
            **about,
        )

    def list_shown(self) -> list[str]:
        """Names of the values of ``shows``."""
        return [name for text in self.shows for name in list_lines(text)]

    def list_keys(self) -> set[str]:
        """Every value that a run must compute for it."""
        found = {key for one in self.list_sentences() for key in one.list_keys()}
        return found | {*self.list_shown()}


@cache
def load_statements() -> tuple[Statement, ...]:
    """Every statement of statements.toml: the paper's in its order, then ours.

    Raises
    ------
    InvalidInput
        One has no tests, no sentence of readings.toml, and no word why it cannot be compared.
    """
    found = tuple(
        make_record(Statement, entry, f"statements.toml, statement {entry.get('id')}")
        for entry in read_declared("statements.toml")["statement"]
    )
    for one in found:
        if not (one.why or one.list_sentences()):
            raise InvalidInput(
                f"statement {one.id!r} needs tests, a sentence in readings.toml that claims it, or,"
                " as `why`, why it cannot be compared."
            )
    return found
