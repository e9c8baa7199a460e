"""Claims of the paper, and the verdict on each, by rules fixed in claims.toml before looking."""

import tomllib
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from itertools import pairwise

from feeler.errors import InvalidInput
from feeler.paper.context import Context
from feeler.report.section import Section
from feeler.scale import SCALES

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
    due: str = "smoke"
    """Least scale that computes enough to judge it."""
    null: str = ""
    """Key of what the same pipeline reaches where there is nothing to find; a claim that it matches has no evidence."""
    why: str = ""

    def __post_init__(self) -> None:
        SCALES[self.due]  # refuses what is no scale
        if self.kind not in (*RULES, "none"):
            raise InvalidInput(
                f"claim {self.id!r} has the unknown kind {self.kind!r}; valid: {', '.join(RULES)}, none."
            )


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
    found = [values[key] for key in claim.keys if values.get(key) is not None]
    if why := _find_hindrance(claim, values, context):
        return Judged(claim=claim, ours="; ".join(map(_show, found)) or "–", verdict="not comparable", why=why)
    if undefined := [value["undefined"] for value in found if isinstance(value, dict) and "undefined" in value]:
        verdict = "not reproduced" if claim.kind == "value" else "not comparable"
        return Judged(claim=claim, ours="undefined", verdict=verdict, why=undefined[0])
    numbers = [_read(value) for value in found]
    verdict, why = RULES[claim.kind](claim, numbers)
    if claim.null and values.get(claim.null) is not None and verdict != "not reproduced":
        verdict, why = _judge_null(verdict, why, numbers, _read(values[claim.null]))
    return Judged(claim=claim, ours="; ".join(map(_show, found)), verdict=verdict, why=why)


def _find_hindrance(claim: Claim, values: dict[str, object], context: Context) -> str:
    """Why the claim cannot be judged in this run; empty if it can."""
    if not context.is_cockroach:
        return "another antenna than the paper's"
    if claim.kind == "none":
        return claim.why
    if list(SCALES).index(context.scale) < list(SCALES).index(claim.due):
        return f"{context.scale} scale computes too little to judge it; due at {claim.due} scale"
    missing = [key for key in claim.keys if values.get(key) is None]
    return f"not computed in this run (scale {context.scale}): {', '.join(missing)}" if missing else ""


Spread = tuple[float, float, float]
"""Value, low, high."""


def _read(value: object) -> Spread:
    """A plain number has no spread."""
    if not isinstance(value, dict):
        return (float(value),) * 3
    ends = (value["value"] if value.get(end) is None else value[end] for end in ("low", "high"))
    return (float(value["value"]), *map(float, ends))


def _judge_null(verdict: str, why: str, numbers: list[Spread], null: Spread) -> tuple[str, str]:
    if null[0] < min(number[0] for number in numbers):
        return verdict, why
    words = f"the null reaches {null[0]:.2g}: such numbers arise where there is nothing to tell apart"
    return "partly", f"{why}, but {words}"


def _judge_value(claim: Claim, numbers: list[Spread]) -> tuple[str, str]:
    (value, low, high), margin = numbers[0], claim.tolerance * abs(claim.target)
    if abs(value - claim.target) <= margin:
        return "reproduced", f"within {claim.tolerance:.0%}"
    if low <= claim.target <= high:
        return "partly", "outside the tolerance, but within our spread"
    return "not reproduced", f"off by {(value - claim.target) / claim.target:+.0%}, tolerance {claim.tolerance:.0%}"


def _judge_order(claim: Claim, numbers: list[Spread]) -> tuple[str, str]:
    points = [number[0] for number in numbers]
    apart = numbers[-1][1] > numbers[0][2] or numbers[0][1:] == numbers[0][:1] * 2
    if points[-1] <= points[0]:
        return "not reproduced", "the ends are not in the claimed order"
    if not all(b > a for a, b in pairwise(points)):
        return "partly", "the ends are in the claimed order, the middle is not"
    if not apart:
        return "partly", "in the claimed order, but the spreads of the ends overlap"
    return "reproduced", "in the claimed order"


def _judge_bound(claim: Claim, numbers: list[Spread]) -> tuple[str, str]:
    """Above or below the target."""
    side, (value, low, high) = f"{claim.kind} {claim.target:g}", numbers[0]
    sign = 1.0 if claim.kind == "above" else -1.0
    if min(sign * low, sign * high) > sign * claim.target:
        return "reproduced", f"{side} with its whole spread"
    if sign * value > sign * claim.target:
        return "partly", f"{side}, its spread is not"
    return "not reproduced", f"not {side}"


RULES = {"value": _judge_value, "order": _judge_order, "above": _judge_bound, "below": _judge_bound}


def _show(value: object) -> str:
    if isinstance(value, dict):
        if "undefined" in value:
            return f"undefined: {value['undefined']}"
        spread = "" if value.get("low") is None else f" ({value['low']:.3g}…{value['high']:.3g})"
        return f"{value['value']:.3g}{spread}"
    return f"{value:.4g}" if isinstance(value, int | float) and not isinstance(value, bool) else str(value)
