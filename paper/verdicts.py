"""The verdict on every claim, by rules fixed before looking.

Evidence: *reproduced*, *partly*, *not reproduced*; of our own claims *holds*, *partly*, *does not
hold*. Everything else is no evidence for or against and is not counted with it: *by construction*,
*circular*, *depends on a definition* that the paper does not give, *no evidence* (identical touches
do as well, or the spreads do not let it be told), *not judged* (in this run: n = 1, or too small a
scale), *not comparable*.

What is counted are statements: the claims that read one effect are one statement together.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

from feeler.report.page import Section, to_json
from paper.claims import Claim, load_claims
from paper.context import Context
from paper.scale import SCALES

EVIDENCE = ("reproduced", "partly", "not reproduced")
OTHERS = (
    *("by construction", "circular", "depends on a definition", "no evidence"),
    *("not judged", "not comparable"),
)
_VERDICTS = EVIDENCE + OTHERS
_OWN_WORDS = {"reproduced": "holds", "not reproduced": "does not hold"}
_MOST, _HALF = 0.75, 0.5
"""Shares of a declared family of set-ups, or of the indices, in which a statement must hold to be
reproduced, and partly.
"""

_REVERSED = "reversed: the ends stand in the opposite order"

_Values = Mapping[str, Any]
_Spread = tuple[float, float, float]
"""Value, low, high."""


@dataclass(frozen=True, kw_only=True)
class ClaimResult:
    """A claim with our numbers, the verdict, and a word why.

    Attributes
    ----------
    readings : tuple[Judged, ...]
        The verdict under each of the claim's definitions, in their order.
    values : tuple[tuple[str, Any], ...]
        Keys with what this run found; None where it found nothing.
    """

    claim: Claim
    ours: str
    verdict: str
    why: str
    readings: tuple["ClaimResult", ...] = ()
    values: tuple[tuple[str, Any], ...] = ()

    @property
    def is_evidence(self) -> bool:
        """Whether it counts in the headline of its kind, the paper's claims or ours."""
        return self.verdict in EVIDENCE

    @property
    def word(self) -> str:
        """The verdict as it is said of the paper's claim or of ours."""
        return (
            _OWN_WORDS.get(self.verdict, self.verdict)
            if self.claim.whose == "ours"
            else self.verdict
        )

    def describe(self) -> dict[str, object]:
        """Everything as plain data: what ``numbers.json`` keeps and pages draw."""
        names = ("id", "whose", "section", "where", "says", "paper", "tag", "kind", "target")
        claim = {name: getattr(self.claim, name) for name in (*names, "tolerance", "standing")}
        readings = zip(self.claim.definitions, self.readings, strict=False)
        return {
            **claim,
            **self._describe_reading(),
            "evidence": self.is_evidence,
            "definitions": [
                {"name": name, **one._describe_reading()} for name, one in readings
            ],
        }

    def _describe_reading(self) -> dict[str, object]:
        values = to_json(dict(self.values))
        return {"verdict": self.word, "ours": self.ours, "why": self.why, "values": values}


def judge_claims(sections: list[Section], context: Context) -> list[ClaimResult]:
    """The verdict on every claim, also where a section is missing or the claim fails."""
    values = {key: value for section in sections for key, value in section.values.items()}
    made = {section.name: section.scale or context.scale for section in sections}
    return [
        judge(claim, values, replace(context, scale=made.get(claim.section, context.scale)))
        for claim in load_claims()
    ]


def judge_statements(judged: Sequence[ClaimResult], whose: str = "paper") -> dict[str, str]:
    """The verdict on every statement of the paper, or of ours.

    An effect that several claims read is reproduced where all of them are, partly where some are
    (or are partly), else not reproduced where one is not. It is not judged while one of them is
    not judged in this run. A statement in which none is evidence has the first claim's verdict.
    """
    found: dict[str, list[str]] = {}
    for one in judged:
        if one.claim.whose == whose:
            found.setdefault(one.claim.statement, []).append(one.verdict)
    return {statement: _join(verdicts) for statement, verdicts in found.items()}


def _join(verdicts: Sequence[str]) -> str:
    if "not judged" in verdicts:
        return "not judged"
    if set(verdicts) == {"reproduced"}:
        return "reproduced"
    if {"reproduced", "partly"} & set(verdicts):
        return "partly"
    return "not reproduced" if "not reproduced" in verdicts else verdicts[0]


def count_verdicts(judged: Sequence[ClaimResult], whose: str = "paper") -> dict[str, int]:
    """How many statements of the paper, or of ours, got which verdict; evidence first."""
    found = list(judge_statements(judged, whose).values())
    return {
        _OWN_WORDS.get(verdict, verdict) if whose == "ours" else verdict: found.count(verdict)
        for verdict in _VERDICTS
    }


def summarise_counts(judged: list[ClaimResult]) -> str:
    """Both counts of statements in a line: those with evidence, those without, our own."""
    paper, ours = count_verdicts(judged), count_verdicts(judged, "ours")
    parts = [
        ("statements of the paper with evidence", paper, EVIDENCE),
        ("without", paper, OTHERS),
    ]
    if any(ours.values()):
        parts.append(
            ("statements of our own", ours, tuple(word for word, n in ours.items() if n))
        )
    return "; ".join(
        f"{title}: " + ", ".join(f"{counts[word]} {word}" for word in words)
        for title, counts, words in parts
    )


def judge(claim: Claim, values: _Values, context: Context) -> ClaimResult:
    """Hold one claim against our values."""
    if claim.definitions:
        return _judge_definitions(claim, values, context)
    return _judge_keys(claim, values, context)


def _judge_definitions(claim: Claim, values: _Values, context: Context) -> ClaimResult:
    """The verdict that all definitions give; where they differ, that it depends on them."""
    found = [_judge_keys(claim.read_by(name), values, context) for name in claim.definitions]
    named = zip(claim.definitions, found, strict=True)
    ours, keys = (
        "; ".join(f"{name}: {one.ours}" for name, one in named),
        sum((one.values for one in found), ()),
    )
    words = {one.verdict for one in found}
    together: dict[str, Any] = {
        "claim": claim,
        "ours": ours,
        "readings": tuple(found),
        "values": keys,
    }
    if len(words) == 1:
        whys = dict.fromkeys(one.why for one in found)
        return ClaimResult(
            verdict=words.pop(), why="under every definition: " + "; ".join(whys), **together
        )
    said = "; ".join(
        f"{one.word}{' (reversed)' * one.why.startswith(_REVERSED)} by {name}"
        for name, one in zip(claim.definitions, found, strict=True)
    )
    if "not judged" in words:
        return ClaimResult(
            verdict="not judged", why=f"not every reading is judged: {said}", **together
        )
    why = f"readings that the paper leaves open differ: {said}{_name_nearest(claim, found)}"
    return ClaimResult(verdict="depends on a definition", why=why, **together)


def _name_nearest(claim: Claim, found: list[ClaimResult]) -> str:
    """Which definition comes nearest to the paper's number."""
    if claim.kind != "value":
        return ""
    off = {}
    for name, one in zip(claim.definitions, found, strict=True):
        value = one.values[0][1]
        if value is not None and "undefined" not in (value if isinstance(value, dict) else {}):
            off[name] = abs(_read(value)[0] - claim.target)
    return f"; nearest: {min(off, key=off.__getitem__)}" if off else ""


def _judge_keys(claim: Claim, values: _Values, context: Context) -> ClaimResult:
    keys = claim.keys
    known = tuple(
        (key, values.get(key)) for key in (*keys, *claim.null, *claim.twin, *claim.shows)
    )
    found = [values[key] for key in keys if values.get(key) is not None]
    names = (
        _name_apart(keys) if claim.kind in ("order", "dip") and len(found) == len(keys) else ()
    )
    ours = (
        "; ".join(" ".join(pair) for pair in zip(names, map(_show, found), strict=True))
        if names
        else ""
    )
    ours = ours or "; ".join(map(_show, found)) or "–"

    def say(verdict: str, why: str) -> ClaimResult:
        return ClaimResult(claim=claim, ours=ours, verdict=verdict, why=why, values=known)

    if not context.is_cockroach:
        return say("not comparable", "another antenna than the paper's")
    if claim.kind == "none":
        return say("not comparable", claim.why)
    if why := _find_lack(claim, values, context):
        return say("not judged", why)
    if undefined := [
        value["undefined"]
        for value in found
        if isinstance(value, dict) and "undefined" in value
    ]:
        return say("not comparable", f"undefined: {undefined[0]}")
    if why := _find_single(claim, (*found, *(values[key] for key in claim.null))):
        return say("not judged", why)
    numbers = [_read(value) for value in found]
    verdict, why = _RULES[claim.kind](claim, numbers)
    if claim.standing != "evidence":
        return say(claim.standing, f"{claim.why} ({why})")
    if claim.null and (
        reason := _match_null(claim, numbers, [_read(values[key]) for key in claim.null])
    ):
        if lack := _find_single(claim, [values[key] for key in claim.twin]):
            return say("not judged", lack)
        twin = [_read(values[key]) for key in claim.twin]
        if twin and twin[-1][2] < twin[0][1]:
            shown = ", ".join(f"{number[0]:.3g}" for number in twin)
            return say(
                "not reproduced",
                f"{_REVERSED} in what carries over to twins ({shown}); {reason}",
            )
        return say("no evidence", f"{why}, but {reason}")
    return say(verdict, why)


def _name_apart(keys: tuple[str, ...]) -> tuple[str, ...]:
    """What discriminates keys: ``lda.slow`` and ``lda.fast`` are slow and fast. A point between
    digits divides nothing.
    """
    parts = [re.split(r"(?<!\d)\.|\.(?!\d)", key) for key in keys]
    return tuple(
        " ".join(p for k, p in enumerate(own) if {q[k] for q in parts if len(q) > k} != {p})
        for own in parts
    )


def _find_lack(claim: Claim, values: _Values, context: Context) -> str:
    """What this run did not compute; empty if it did."""
    if list(SCALES).index(context.scale) < list(SCALES).index(claim.due):
        lack = f"too little is computed at {context.scale} scale"
        return f"{lack}; a run at {claim.due} scale judges it"
    needed = (*claim.keys, *claim.null, *claim.twin)
    missing = [key for key in needed if values.get(key) is None]
    return (
        f"not computed in this run (scale {context.scale}): {', '.join(missing)}"
        if missing
        else ""
    )


def _find_single(claim: Claim, values: Sequence[object]) -> str:
    """That one draw is no sample; empty if all values have more, or are not drawn."""
    if not claim.can_fail or claim.drawn == "nothing":
        return ""
    least = min(
        (value.get("n", 1) if isinstance(value, dict) else 1 for value in values), default=2
    )
    return f"n = 1 ({claim.drawn}): one draw has no spread" if least < 2 else ""


def _read(value: object) -> _Spread:
    """A plain number has no spread."""
    if not isinstance(value, dict):
        return (float(value),) * 3  # type: ignore[arg-type]
    ends = (value["value"] if value.get(end) is None else value[end] for end in ("low", "high"))
    low, high = map(float, ends)
    return float(value["value"]), low, high


def _match_null(claim: Claim, numbers: list[_Spread], null: list[_Spread]) -> str:
    """Why the null does as well: its ends stand in the order of ours, or it tells identical touches
    apart as much.
    """
    sign = 1.0 if claim.apart == "greater" else -1.0
    points, nulls = [number[0] for number in numbers], [number[0] for number in null]
    shown = ", ".join(f"{value:.3g}" for value in nulls)
    if any(sign * b >= sign * a for a, b in zip(points, nulls, strict=True)):
        return f"{claim.null_says} (null {shown})"
    if len(points) > 1 and (points[-1] - points[0]) * (nulls[-1] - nulls[0]) > 0:
        return f"identical touches give the same order of the ends (null {shown})"
    return ""


def _judge_within(claim: Claim, numbers: list[_Spread]) -> tuple[str, str]:
    """Within the tolerance, or outside of it, with the whole spread."""
    value, *ends = numbers[0]
    margin = claim.tolerance * abs(claim.target)
    inside = [abs(end - claim.target) <= margin for end in (value, *ends)]
    beside = min(ends) <= claim.target <= max(ends)
    asked = f"{claim.target - margin:.3g} to {claim.target + margin:.3g}"
    why = f"off by {(value - claim.target) / claim.target:+.0%}; asked for were {asked}"
    if all(inside):
        return "reproduced", f"within {asked}"
    if any(inside) or beside:
        return "no evidence", f"{why}, and its spread lies on both sides of that"
    return "not reproduced", why


def _judge_value(claim: Claim, numbers: list[_Spread]) -> tuple[str, str]:
    """The same; partly, within twice the tolerance."""
    verdict, why = _judge_within(claim, numbers)
    near = abs(numbers[0][0] - claim.target) <= 2 * claim.tolerance * abs(claim.target)
    if verdict == "not reproduced" and near:
        return "partly", f"{why}, within twice of it"
    return verdict, why


def _judge_order(claim: Claim, numbers: list[_Spread]) -> tuple[str, str]:
    """The ends apart by more than their spreads, and those between in the claimed order."""
    (first, _, top), (last, bottom, most) = numbers[0], numbers[-1]
    points = [number[0] for number in numbers]
    if bottom < most < numbers[0][1]:  # said only where there is a spread
        return "not reproduced", f"{_REVERSED}, beyond the spreads of the ends"
    if bottom <= top and any(low < high for _, low, high in (numbers[0], numbers[-1])):
        return "no evidence", "the spreads of the ends overlap: no order can be told"
    if last <= first:
        return "not reproduced", "the ends are not in the claimed order"
    if not all(b > a for a, b in pairwise(points)):
        return "partly", "the ends are in the claimed order, the middle is not"
    return "reproduced", "in the claimed order"


def _judge_dip(claim: Claim, numbers: list[_Spread]) -> tuple[str, str]:
    """The middle less than both neighbours, by more than the spreads."""
    before, middle, after = numbers
    if not middle[0] < min(before[0], after[0]):
        return "not reproduced", "not less than both neighbours"
    if middle[2] >= min(before[1], after[1]) and middle[1] < middle[2]:
        return "no evidence", "less than both neighbours, but their spreads overlap"
    return "reproduced", "less than both neighbours"


def _judge_bound(claim: Claim, numbers: list[_Spread]) -> tuple[str, str]:
    """Above or below the target, with the whole spread."""
    side, (value, low, high) = f"{claim.kind} {claim.target:g}", numbers[0]
    sign = 1.0 if claim.kind == "above" else -1.0
    near, far = sorted((sign * low, sign * high))
    if near > sign * claim.target:
        return "reproduced", side if low == high else f"{side} with its whole spread"
    if low < high and far > sign * claim.target:
        word = side if sign * value > sign * claim.target else f"not {side}"
        return "no evidence", f"{word}, but its spread lies on both sides"
    return "not reproduced", f"not {side}"


def _judge_share(claim: Claim, numbers: list[_Spread]) -> tuple[str, str]:
    """In how much of what was declared (set-ups, indices) it holds."""
    share = numbers[0][0]
    why = f"holds in {share:.0%}; {_MOST:.0%} are asked for, {_HALF:.0%} are partly"
    return (
        "reproduced" if share >= _MOST else "partly" if share >= _HALF else "not reproduced",
        why,
    )


_RULES = {
    "value": _judge_value,
    "within": _judge_within,
    "order": _judge_order,
    "dip": _judge_dip,
    "above": _judge_bound,
    "below": _judge_bound,
    "share": _judge_share,
}


def _show(value: object) -> str:
    if isinstance(value, dict):
        if "undefined" in value:
            return f"undefined: {value['undefined']}"
        spread = (
            "" if value.get("low") is None else f" ({value['low']:.3g}…{value['high']:.3g})"
        )
        spread = " (n = 1)" if value.get("n") == 1 else spread
        return f"{value['value']:.3g}{spread}"
    return (
        f"{value:.4g}"
        if isinstance(value, int | float) and not isinstance(value, bool)
        else str(value)
    )
