"""Statements of the paper and of this project, in the paper's order: the tests by which each is
judged, declared in statements.toml before the results were looked at, and the verdict.
"""

import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import Annotated, Any, Literal

from feeler.errors import InvalidInput
from feeler.files import make_record
from feeler.records import Choice, Record
from feeler.report import Section
from paper.context import Context
from paper.readings import (
    ANOTHER,
    NEVER,
    NOT,
    OWN_WORDS,
    WORDS,
    Finding,
    Option,
    Sentence,
    collect,
    judge_sentence,
    judge_sentences,
    load_sentences,
    read_values,
    tabulate,
)
from paper.scale import SCALES
from paper.table import Results, find_unit, read_declared, show, split_key

# Statements of the paper and of this project, each with the tests by which it is judged; all
# are declared in statements.toml, in the paper's order.

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
            return {
                "kind": kind,
                "key": f"{text[: bracket.start()]}{{group}}{text[bracket.end() :]}",
                "groups": tuple(names),
            }
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
            choice = (
                Option(
                    name="reading",
                    asks=self.says,
                    why="",
                    options=dict.fromkeys(self.readings, "natural"),
                ),
            )
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


# The verdict on every statement, by tests that were declared before the results were looked
# at.

_OURS = {
    OWN_WORDS: "holds",
    ANOTHER: "holds under some conditions only",
    NOT: "does not hold",
    NEVER: "cannot be decided",
}
_WORSE = (OWN_WORDS, ANOTHER, NEVER, NOT)
MARKS = dict(zip(WORDS, ("good", "half", "bad", "none"), strict=True))


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A statement with its verdict, the reason, our numbers, and what was found on each of its
    sentences; the verdict is the worst of these.
    """

    statement: Statement
    verdict: str
    why: str
    ours: str = "–"
    findings: tuple[Finding, ...] = ()

    @property
    def word(self) -> str:
        """The verdict as it is said of a statement of the paper or of ours."""
        return _OURS[self._shown] if self.statement.whose == "ours" else self.verdict

    @property
    def mark(self) -> str:
        """What kind of verdict it is, for a page's colours."""
        return MARKS[self._shown]

    @property
    def holds(self) -> bool:
        """Whether it holds under the reading nearest to its words."""
        return self.verdict == OWN_WORDS

    @property
    def _shown(self) -> str:
        """Of a statement of ours, whose readings are its conditions, each has to hold."""
        ours = self.statement.whose == "ours" and self.holds
        agrees = [agree for one in self.findings for agree in one.agrees]
        return ANOTHER if ours and not all(agrees) else self.verdict


def judge_statements(sections: Sequence[Section], context: Context) -> list[Judged]:
    """The verdict on every statement, also where a section is missing."""
    results = Results.collect(sections)
    made = {section.name: section.scale or context.scale for section in sections}
    known = judge_sentences(collect(sections))
    return [
        judge(
            statement,
            results,
            made.get(statement.section, context.scale),
            context.is_cockroach,
            known,
        )
        for statement in load_statements()
    ]


def judge(
    statement: Statement,
    results: Results,
    scale: str,
    is_cockroach: bool = True,
    known: Mapping[str, Finding] | None = None,
) -> Judged:
    """Hold one statement against our values; ``known``: findings of readings.toml's sentences."""
    if statement.given and is_cockroach:
        asked = statement.judge_given()
        if all(results.get(key) for key in asked.list_keys()):
            return replace(judge(asked, results, scale), statement=statement)
    sentences = statement.list_sentences()
    words = _OURS if statement.whose == "ours" else None
    findings = tuple(
        (known or {}).get(one.id)
        or judge_sentence(one, tabulate(read_values(one, results)), words)
        for one in sentences
    )
    values = {key: value for key in statement.list_shown() if (value := results.get(key))}
    named = len({split_key(key)[2] for key in values}) > 1
    said = (
        f"{split_key(key)[2]} {show(value)}" if named else show(value)
        for key, value in values.items()
    )
    shown = "; ".join(said) or "–"
    ours = "; ".join(one.ours for one in findings if one.ours != "–") or shown
    why = statement.why or ("" if is_cockroach else "another antenna than the paper's")
    if not why and [*SCALES].index(scale) < [*SCALES].index(statement.scale):
        why = f"too little is computed at {scale} scale; {statement.scale} judges it"
    if why:
        return Judged(statement=statement, verdict=NEVER, why=why, ours=ours)
    verdict = max((one.verdict for one in findings), key=_WORSE.index)
    failed = [one for one in findings if one.verdict == verdict]
    why = "; ".join(dict.fromkeys(one.line.rstrip(".") for one in failed))
    if len(findings) > 1:
        held = sum(one.verdict == OWN_WORDS for one in findings)
        why = f"{held} of {len(findings)} tests hold; {why}"
    return Judged(statement=statement, verdict=verdict, why=why, ours=ours, findings=findings)


def count_verdicts(judged: Sequence[Judged], whose: str = "paper") -> dict[str, int]:
    """How many statements of the paper, or of ours, got which verdict."""
    found = Counter(one.word for one in judged if one.statement.whose == whose)
    words = tuple(_OURS.values()) if whose == "ours" else WORDS
    return {word: found[word] for word in words}


def summarise_counts(judged: Sequence[Judged]) -> str:
    """Both counts in a line."""
    return "; ".join(
        f"{title}: " + ", ".join(f"{n} {word}" for word, n in counts.items() if n)
        for title, whose in (("statements of the paper", "paper"), ("of our own", "ours"))
        if any((counts := count_verdicts(judged, whose)).values())
    )


def count_intervals(judged: Sequence[Judged]) -> int:
    """How many tests rest on an interval: at 95 %, one in twenty is expected to err by chance."""
    return sum(
        len(finding.agrees)
        for one in judged
        if one.statement.of != "nothing"
        for finding in one.findings
    )
