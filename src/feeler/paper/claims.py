"""Claims of the paper, and the verdict on each, by rules fixed in claims.toml before looking."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import pairwise

from feeler.paper.context import Context
from feeler.report.section import Section

PROFILES = ("exponential", "linear", "constant")  # [P] in the order claimed
READ_BETTER = {
    "speed": "slower touch is classified better",
    "profile": "exponential is classified best, constant worst",
}
SPREADS_MORE = {
    "speed": "slower touch spreads tensors more",
    "profile": "exponential spreads tensors most, constant least",
}
VERDICTS = ("reproduced", "partly", "not reproduced", "not comparable")


@dataclass(frozen=True, kw_only=True)
class Claim:
    """One claim: what the paper says and where, its value, and how ours is held against it.

    ``kind`` is ``value`` (within ``tolerance`` of ``target``, relative), ``order`` (``keys`` rise in the order given),
    ``above`` (the key exceeds ``target``), ``below``, or ``none`` (not comparable, ``why`` says why).
    """

    id: str
    where: str
    says: str
    paper: str
    tag: str
    kind: str
    section: str
    keys: tuple[str, ...] = ()
    target: float = 0.0
    tolerance: float = 0.0
    null: str = ""
    """Key of what the same pipeline reaches where there is nothing to find; a claim that it matches has no evidence."""
    why: str = ""


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A claim with our number (as text), the verdict, and a word why."""

    claim: Claim
    ours: str
    verdict: str
    why: str


@cache
def load_claims() -> tuple[Claim, ...]:
    """Every claim of claims.toml."""
    data = tomllib.loads(files("feeler.paper").joinpath("claims.toml").read_text())
    return tuple(Claim(**entry | {"keys": tuple(entry.get("keys", ()))}) for entry in data["claim"])


def judge_claims(sections: list[Section], context: Context) -> list[Judged]:
    """The verdict on every claim, also where a section is missing or the claim fails."""
    values = {key: value for section in sections for key, value in section.values.items()}
    return [judge(claim, values, context) for claim in load_claims()]


def judge(claim: Claim, values: dict[str, object], context: Context) -> Judged:
    """Hold one claim against our values."""
    if claim.kind == "none" or not context.is_cockroach:
        shown = "; ".join(_show(values[key]) for key in claim.keys if values.get(key) is not None)
        why = claim.why if context.is_cockroach else "another antenna than the paper's"
        return Judged(claim=claim, ours=shown or "–", verdict="not comparable", why=why)
    missing = [key for key in claim.keys if values.get(key) is None]
    if missing:
        why = f"not computed in this run (scale {context.scale}): {', '.join(missing)}"
        return Judged(claim=claim, ours="–", verdict="not comparable", why=why)
    if undefined := [values[key] for key in claim.keys if isinstance(values[key], dict) and "undefined" in values[key]]:
        verdict = "not reproduced" if claim.kind == "value" else "not comparable"
        return Judged(claim=claim, ours="undefined", verdict=verdict, why=undefined[0]["undefined"])
    numbers = [_number(values[key]) for key in claim.keys]
    rule = {"value": _judge_value, "order": _judge_order, "above": _judge_above, "below": _judge_below}[claim.kind]
    verdict, why = rule(claim, numbers)
    if claim.null and values.get(claim.null) is not None and verdict != "not reproduced":
        verdict, why = _judge_null(verdict, why, numbers, _number(values[claim.null]))
    return Judged(claim=claim, ours="; ".join(_show(values[key]) for key in claim.keys), verdict=verdict, why=why)


Interval = tuple[float, float, float]


def _judge_null(verdict: str, why: str, numbers: list[Interval], null: Interval) -> tuple[str, str]:
    if null[0] < min(number[0] for number in numbers):
        return verdict, why
    return (
        "partly",
        f"{why}, but the null reaches {null[0]:.2g}: such numbers arise where there is nothing to tell apart",
    )


def _number(value: object) -> Interval:
    """(value, low, high); a plain number has no spread."""
    if isinstance(value, dict):
        low, high = value.get("low"), value.get("high")
        return (
            float(value["value"]),
            float(value["value"] if low is None else low),
            float(value["value"] if high is None else high),
        )
    return (float(value),) * 3


def _judge_value(claim: Claim, numbers: list[Interval]) -> tuple[str, str]:
    (value, low, high), margin = numbers[0], claim.tolerance * abs(claim.target)
    if abs(value - claim.target) <= margin:
        return "reproduced", f"within {claim.tolerance:.0%}"
    if low <= claim.target <= high:
        return "partly", "outside the tolerance, but within our spread"
    return "not reproduced", f"off by {(value - claim.target) / claim.target:+.0%}, tolerance {claim.tolerance:.0%}"


def _judge_order(claim: Claim, numbers: list[Interval]) -> tuple[str, str]:
    points = [number[0] for number in numbers]
    rising = [b > a for a, b in pairwise(points)]
    apart = numbers[-1][1] > numbers[0][2] or numbers[0][1:] == numbers[0][:1] * 2
    if all(rising):
        return (
            ("reproduced", "in the claimed order")
            if apart
            else ("partly", "in the claimed order, but the spreads of the ends overlap")
        )
    if points[-1] > points[0]:
        return "partly", "the ends are in the claimed order, the middle is not"
    return "not reproduced", "the ends are not in the claimed order"


def _judge_above(claim: Claim, numbers: list[Interval]) -> tuple[str, str]:
    value, low, _ = numbers[0]
    if low > claim.target:
        return "reproduced", f"above {claim.target:g} with its whole spread"
    return (
        ("partly", f"above {claim.target:g}, its spread is not")
        if value > claim.target
        else ("not reproduced", f"not above {claim.target:g}")
    )


def _judge_below(claim: Claim, numbers: list[Interval]) -> tuple[str, str]:
    value, _, high = numbers[0]
    if high < claim.target:
        return "reproduced", f"below {claim.target:g} with its whole spread"
    return (
        ("partly", f"below {claim.target:g}, its spread is not")
        if value < claim.target
        else ("not reproduced", f"not below {claim.target:g}")
    )


def _show(value: object) -> str:
    if isinstance(value, dict):
        if "undefined" in value:
            return f"undefined: {value['undefined']}"
        spread = "" if value.get("low") is None else f" ({value['low']:.3g}…{value['high']:.3g})"
        return f"{value['value']:.3g}{spread}"
    return f"{value:.4g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
