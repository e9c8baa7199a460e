"""The verdict on every statement, by tests that were declared before the results were looked at."""

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from feeler.analysis import INDICES
from feeler.report.page import Section
from paper.context import Context
from paper.readings import WORDS, Finding, collect, judge_sentences
from paper.scale import SCALES
from paper.statements import Criterion, Statement, load_statements
from paper.table import Results, Value, find_unit, split_key

OWN_WORDS, ANOTHER, NOT, NEVER = WORDS
"""The four verdicts on a statement of the paper. The last: it is an input, its data are not
published, this run did not compute it, or the intervals do not decide it.
"""
_OURS = {
    OWN_WORDS: "holds",
    ANOTHER: "holds under some readings only",
    NOT: "does not hold",
    NEVER: "cannot be decided",
}
_WORSE = (OWN_WORDS, ANOTHER, NEVER, NOT)
_MARKS = dict(zip(WORDS, ("good", "half", "bad", "none"), strict=True))
_SHARE = 0.05
"""The least effect in units for which statements.toml declares none, as a share of the greater."""


@dataclass(frozen=True)
class Outcome:
    """Whether a test holds (None: the run does not decide it), why, and how that would change."""

    holds: bool | None
    why: str


@dataclass(frozen=True, kw_only=True)
class Reading:
    """A statement under one reading: our numbers, and whether all of its tests hold."""

    name: str
    ours: str
    holds: bool | None
    why: str


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A statement with its verdict, the reason, and what was found under each of its readings, the
    one nearest to the paper's words first.
    """

    statement: Statement
    verdict: str
    why: str
    readings: tuple[Reading, ...] = ()

    @property
    def word(self) -> str:
        """The verdict as it is said of a statement of the paper or of ours."""
        return _OURS[self._shown] if self.statement.whose == "ours" else self.verdict

    @property
    def mark(self) -> str:
        """What kind of verdict it is, for a page's colours."""
        return _MARKS[self._shown]

    @property
    def _shown(self) -> str:
        """Of a statement of ours, whose readings are its conditions, each has to hold."""
        ours = self.statement.whose == "ours" and self.holds
        return ANOTHER if ours and not all(one.holds for one in self.readings) else self.verdict

    @property
    def holds(self) -> bool:
        """Whether the statement holds under the reading nearest to its words."""
        return self.verdict == OWN_WORDS


def decide(agrees: Sequence[bool | None]) -> str:
    """The verdict from whether the statement holds under each reading, the main one first.

    Not reproduced needs evidence against it under every reading.
    """
    if agrees[0]:
        return OWN_WORDS
    if any(agrees):
        return ANOTHER
    return NEVER if None in agrees else NOT


def judge_statements(sections: Sequence[Section], context: Context) -> list[Judged]:
    """The verdict on every statement, also where a section is missing; where the readings of its
    sentences were computed, from these.
    """
    results = Results.collect(sections)
    made = {section.name: section.scale or context.scale for section in sections}
    found = defaultdict(list)
    for finding in judge_sentences(collect(sections)).values():
        for name in finding.statements if len(finding.rows) else ():
            found[name].append(finding)
    judged = []
    for statement in load_statements():
        scale = made.get(statement.section, context.scale)
        one = judge(statement, results, scale, context.is_cockroach)
        ready = _is_enough(scale, statement) and context.is_cockroach
        judged.append(_follow(one, found[one.statement.id]) if ready else one)
    return judged


def _follow(judged: Judged, findings: Sequence[Finding]) -> Judged:
    """The verdict from the readings of its sentences: the worst of them."""
    if not findings or judged.statement.why:
        return judged
    verdict = max((one.verdict for one in findings), key=_WORSE.index)
    held = {OWN_WORDS: True, ANOTHER: False, NOT: False}
    readings = tuple(
        Reading(
            name=one.sentence.says if len(findings) > 1 else "",
            ours=one.note,
            holds=held.get(one.verdict),
            why=one.line,
        )
        for one in findings
    )
    lines = dict.fromkeys(one.line.rstrip(".") for one in findings if one.line)
    return replace(judged, verdict=verdict, why="; ".join(lines), readings=readings)


def _is_enough(scale: str, statement: Statement) -> bool:
    """Whether a scale computes enough to judge a statement."""
    return [*SCALES].index(scale) >= [*SCALES].index(statement.scale)


def judge(
    statement: Statement, results: Results, scale: str, is_cockroach: bool = True
) -> Judged:
    """Hold one statement against our values."""
    if statement.given and is_cockroach:
        asked = statement.judge_given()
        if all(results.get(key) for key in asked.list_keys()):
            return replace(
                judge(asked, results, scale), statement=statement.replace(of=asked.of)
            )
    names = statement.readings or ("",)
    found = tuple(
        _judge_reading(one, name, results, scale)
        for one, name in zip(statement.list_readings(), names, strict=True)
    )
    if statement.why or not is_cockroach:
        why = statement.why or "another antenna than the paper's"
        return Judged(statement=statement, verdict=NEVER, why=why, readings=found)
    verdict = decide([one.holds for one in found])
    shown = [f"{one.name}: {one.why}" if one.name else one.why for one in found]
    why = shown[0] if len({one.why for one in found}) == 1 else "; ".join(shown)
    return Judged(statement=statement, verdict=verdict, why=why, readings=found)


def _judge_reading(one: Statement, name: str, results: Results, scale: str) -> Reading:
    tests = one.parse_tests()
    keys = [key for test in tests for key in test.keys] or [*one.shows]
    ours = _show_values(keys, results)
    outcomes = [_judge_test(test, one, results, scale) for test in tests]
    held = [outcome.holds for outcome in outcomes]
    holds = False if False in held else None if None in held or not held else True
    whys = dict.fromkeys(
        f"{label}{outcome.why}"
        for label, outcome in zip(_name_tests(tests), outcomes, strict=True)
        if len(held) == 1 or outcome.holds is holds is not True
    )
    why = "; ".join(whys)
    if len(held) > 1:
        why = f"{held.count(True)} of {len(held)} tests hold{': ' * bool(why)}{why}"
    return Reading(name=name, ours=ours, holds=holds, why=why)


def _name_tests(tests: Sequence[Criterion]) -> list[str]:
    """What is each test's own in the names of its values, in front of what is said of it."""
    parts = [test.keys[0].split(".") for test in tests]
    common = set.intersection(*map(set, parts)) if parts else set()
    own = [[part for part in one if part not in common] for one in parts]
    return ["" if len(tests) == 1 else f"{' '.join(one)}: " for one in own]


def _judge_test(test: Criterion, one: Statement, results: Results, scale: str) -> Outcome:
    if not _is_enough(scale, one):
        return Outcome(None, f"too little is computed at {scale} scale; {one.scale} judges it")
    nulls = [one.make_null(key) for key in test.keys] if one.null else []
    found = [results.get(key) for key in (*test.keys, *nulls)]
    known = [value for value in found if value is not None]
    if len(known) < len(found):
        return Outcome(None, f"not computed in this run (scale {scale})")
    if any(np.isnan(value.value) for value in known):
        return Outcome(None, "undefined in this run")
    if one.of != "nothing" and min(value.n for value in known) < 2:
        return Outcome(None, f"n = 1 ({one.of}): one draw has no spread")
    values, null = known[: len(test.keys)], known[len(test.keys) :]
    outcome = _TESTS[test.kind](test, values)
    if outcome.holds and null and (reason := _match_null(test, values, null)):
        return Outcome(None, f"{outcome.why}, but {reason}: no evidence")
    return outcome


def _find_least(test: Criterion, values: Sequence[Value]) -> float:
    """The least effect that counts."""
    least = find_unit(split_key(test.keys[0])[0])[1]
    return _SHARE * max(abs(one.value) for one in values) if least is None else least


def _judge_value(test: Criterion, values: Sequence[Value]) -> Outcome:
    """Within the tolerance, or outside of it, with the whole interval."""
    (value, low, high, _), target = values[0], test.target
    margin = test.tolerance * abs(target)
    inside = [abs(end - target) <= margin for end in (value, low, high)]
    off = f"off by {(value - target) / target:+.0%}, {test.tolerance:.0%} are allowed"
    if all(inside):
        return Outcome(True, off)
    if any(inside) or low <= target <= high:
        return Outcome(None, f"{off}; its interval lies on both sides")
    return Outcome(False, off)


def _judge_order(test: Criterion, values: Sequence[Value]) -> Outcome:
    """The ends apart in the order that is said, by more than their intervals and by the least
    effect; those between are in order.
    """
    first, last, least = values[0], values[-1], _find_least(test, values)
    rise = last.value - first.value
    said = f"the ends differ by {rise:.3g}, {least:.2g} is the least effect"
    if last.high < first.low:
        return Outcome(False, f"reversed: {said}")
    if last.low <= first.high and (first.low < first.high or last.low < last.high):
        return Outcome(None, f"{said}; their intervals overlap")
    if rise < least:
        return Outcome(False, said)
    for one, other in pairwise(values):
        if one.value >= other.value:
            decided = one.low > other.high
            word = "out of order" if decided else "not told from its neighbour"
            return Outcome(False if decided else None, f"{said}; the middle is {word}")
    return Outcome(True, said)


def _judge_dip(test: Criterion, values: Sequence[Value]) -> Outcome:
    """The middle below both neighbours by more than the intervals; or above one by more."""
    before, middle, after = values
    said = f"{before.value:.3g}, {middle.value:.3g}, {after.value:.3g}"
    if middle.low > before.high or middle.low > after.high:
        return Outcome(False, f"{said}: above a neighbour beyond the intervals")
    if middle.high < before.low and middle.high < after.low:
        return Outcome(True, f"{said}: below both neighbours")
    if before.low == before.high and middle.low == middle.high and after.low == after.high:
        return Outcome(False, f"{said}: not below both neighbours")
    return Outcome(None, f"{said}: the intervals overlap")


def _judge_bound(test: Criterion, values: Sequence[Value]) -> Outcome:
    """Above or below the target with the whole interval; a gain (target 0) by the least effect."""
    (value, low, high, _), sign = values[0], 1.0 if test.kind == "above" else -1.0
    near, far = sorted((sign * low, sign * high))
    word = "at least" if sign > 0 else "at most"
    said = f"{value:.3g}, asked for is {word} {test.target:g}"
    said += f"; it holds for any threshold {'up to' if sign > 0 else 'from'} {sign * near:.3g}"
    least = 0.0 if test.target else _find_least(test, values)
    if near < sign * test.target:
        return Outcome(None if far > sign * test.target else False, said)
    if not test.target and sign * value < least:
        return Outcome(False, f"{said}; less than the least effect, {least:.2g}")
    return Outcome(True, said)


_TESTS = {
    "value": _judge_value,
    "order": _judge_order,
    "dip": _judge_dip,
    "above": _judge_bound,
    "below": _judge_bound,
}


def _match_null(test: Criterion, values: Sequence[Value], null: Sequence[Value]) -> str:
    """Why the null does as well: identical touches are discriminated as much in some group, or
    reach the same order.
    """
    alike = any(
        part in INDICES and INDICES[part].is_similarity for part in test.keys[0].split(".")
    )
    sign = -1.0 if alike else 1.0
    shown = ", ".join(f"{one.value:.3g}" for one in null)
    if any(sign * b.value >= sign * a.value for a, b in zip(values, null, strict=True)):
        return f"the null does as well in at least one group (null {shown})"
    if len(null) > 1 and null[-1].value > null[0].value:
        return f"identical touches give the same order of the ends (null {shown})"
    return ""


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


def show(value: Value) -> str:
    """A value with its interval."""
    if np.isnan(value.value):
        return "undefined"
    if value.low < value.high:
        return f"{value.value:.3g} ({value.low:.3g} to {value.high:.3g})"
    return f"{value.value:.4g}"


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
        len(one.statement.tests) * len(one.readings)
        for one in judged
        if one.statement.tests and one.statement.of != "nothing" and one.verdict != NEVER
    )
