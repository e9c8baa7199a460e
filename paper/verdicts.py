"""The verdict on every statement, by tests that were declared before the results were looked at."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from feeler.report.page import Section
from paper.context import Context
from paper.readings import (
    ANOTHER,
    NEVER,
    NOT,
    OWN_WORDS,
    WORDS,
    Finding,
    collect,
    judge_sentence,
    judge_sentences,
    read_values,
    tabulate,
)
from paper.scale import SCALES
from paper.statements import Statement, load_statements
from paper.table import Results, show, split_key

_OURS = {
    OWN_WORDS: "holds",
    ANOTHER: "holds under some readings only",
    NOT: "does not hold",
    NEVER: "cannot be decided",
}
_WORSE = (OWN_WORDS, ANOTHER, NEVER, NOT)
_MARKS = dict(zip(WORDS, ("good", "half", "bad", "none"), strict=True))


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
        return _MARKS[self._shown]

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
    findings = tuple(
        (known or {}).get(one.id) or judge_sentence(one, tabulate(read_values(one, results)))
        for one in sentences
    )
    shown = _show_values(statement.list_shown(), results)
    ours = "; ".join(one.ours for one in findings if one.ours != "–") or shown
    if statement.why or not is_cockroach:
        why = statement.why or "another antenna than the paper's"
        return Judged(statement=statement, verdict=NEVER, why=why, ours=ours)
    if [*SCALES].index(scale) < [*SCALES].index(statement.scale):
        why = f"too little is computed at {scale} scale; {statement.scale} judges it"
        return Judged(statement=statement, verdict=NEVER, why=why, ours=ours)
    verdict = max((one.verdict for one in findings), key=_WORSE.index)
    failed = [one for one in findings if one.verdict == verdict]
    why = "; ".join(dict.fromkeys(one.line.rstrip(".") for one in failed))
    if len(findings) > 1:
        held = sum(one.verdict == OWN_WORDS for one in findings)
        why = f"{held} of {len(findings)} tests hold; {why}"
    return Judged(statement=statement, verdict=verdict, why=why, ours=ours, findings=findings)


def _show_values(keys: Sequence[str], results: Results) -> str:
    found = [(key, value) for key in keys if (value := results.get(key)) is not None]
    groups = [split_key(key)[2] for key, _ in found]
    named = len({*groups}) > 1
    return (
        "; ".join(
            f"{group} {show(value)}" if named else show(value)
            for group, (_, value) in zip(groups, found, strict=True)
        )
        or "–"
    )


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
