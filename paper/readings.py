"""Every natural reading of the paper's sentences, computed: rows, verdicts, and on which choices
agreement depends.

``readings.toml`` declares the sentences, their choices and options; the first option of each choice
is nearest to the paper's words, and all of these together are the main reading. The stages that
hold what is needed compute the rows (``readings_computed``); :func:`judge_sentences` says what
follows.
"""

import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from itertools import combinations, pairwise, product
from math import factorial
from types import SimpleNamespace
from typing import Any, Literal

import numpy as np
import pandas as pd
from scipy.stats import binom
from sklearn.tree import DecisionTreeClassifier

from feeler.analysis import INDICES
from feeler.errors import InvalidInput
from feeler.files import make_record
from feeler.records import Record
from feeler.report import Section
from paper.table import Results, Value, read_declared, show

WORDS = (
    "reproduced under the paper's own words",
    "reproduced only under another reading",
    "not reproduced under any reading",
    "cannot be compared",
)
"""Verdicts on a sentence."""
OWN_WORDS, ANOTHER, NOT, NEVER = WORDS
COLUMNS = (
    *("sentence", "quantity", "figure", "statement", "reading", "main", "natural", "group"),
    *("value", "low", "high", "n", "null", "unit", "share", "looser", "stricter"),
    *("agrees", "identical"),
)
"""Of a row. ``null``: the value of identical touches. ``share``: of draws of single fits that
agree, with the declared threshold, a ``looser`` and a ``stricter`` one. ``agrees``: 1, 0, or NaN
where the spreads do not let it be told. ``identical``: whether identical touches show the same
effect.
"""
NATURAL = ("stated", "natural", "possible", "far")
"""How natural an option is, and a reading is as natural as its least natural option."""
FILE = "readings.json"
_ORDERS = ("order", "greatest", "least")
_SURE = 0.95  # share of draws of fits that says yes; 1 - _SURE says no
_OVERLAP = 0.005  # how often 95 % intervals of the same value are apart: P(|z| > 1.96 √2)
_MOST_WAYS = 2  # of each side that are said
_MOST_LEAVES, _LEAF = 8, 0.01  # of a rule; a leaf must be worth this share of the readings
_CLEAR = 0.9  # share of the readings that agree where a sentence comes out

_Spread = tuple[float, float, float]
"""Value, low, high; low and high are NaN where nothing was drawn."""

# What is declared.


class Option(Record):
    """One choice that the paper's words leave open.

    Attributes
    ----------
    options : Mapping[str, str]
        A word of ``NATURAL`` for each option, the one nearest to the paper's words first.
    why : str
        Why the first is nearest.
    indices : tuple[str, ...]
        Of a sentence for several indices those that have this choice; empty: all.
    """

    name: str
    asks: str
    why: str
    options: Mapping[str, str]
    indices: tuple[str, ...] = ()

    def _check(self) -> None:
        if unknown := {*self.options.values()} - {*NATURAL}:
            raise InvalidInput(
                f"choice {self.name!r}: unknown word {unknown.pop()!r}; valid:"
                f" {', '.join(NATURAL)}."
            )


class Sentence(Record):
    """A sentence of the paper with a number or an order, and how a reading of it is judged.

    Attributes
    ----------
    claims : tuple[str, ...]
        The statements of ``statements.toml`` that it answers.
    kind : str
        ``order`` (groups rise in this order), ``greatest`` or ``least`` (the last group is above,
        or below, all others), ``value`` (each group within ``tolerance``, relative, of its
        target), ``factor`` (1 − value within ``tolerance`` as a factor of 1 − target), ``dip`` (the
        middle group is the least), ``above`` or ``below`` the target.
    least : float
        Smallest effect that counts; of a bound, counted from a target of 0.
    share : float
        The same as a share of the greatest value, where ``least`` is not declared.
    of : str
        What values are ``n`` of; of one draw nothing is decided. Empty or "nothing": not asked.
    ratio : bool
        Whether effects are logarithms of ratios, not differences.
    identical : str
        ``order``: agreement that identical touches show too is no evidence of touch. Other words:
        why nothing is asked of them.
    measure : str
        What computes it (``readings_computed``); ``values``: ``key`` of the sections' values.
    """

    id: str
    claims: tuple[str, ...] = ()
    figure: str
    says: str
    paper: str
    section: str
    measure: str
    kind: Literal["order", "greatest", "least", "value", "factor", "dip", "above", "below"]
    groups: tuple[str, ...]
    target: tuple[float, ...] = ()
    tolerance: float = 0.0
    least: float = 0.0
    share: float = 0.0
    ratio: bool = False
    unit: str = ""
    of: str = ""
    identical: str = ""
    key: str = ""
    index: str = ""
    choice: tuple[Option, ...] = ()

    @property
    def main(self) -> dict[str, str]:
        """The option nearest to the paper's words of every choice."""
        return {one.name: next(iter(one.options)) for one in self.choice}

    def is_main(self, chosen: Mapping[str, str]) -> bool:
        """Whether every choice that a reading makes is the first."""
        return all(self.main[name] == option for name, option in chosen.items())

    def list_chosen(self) -> list[dict[str, str]]:
        """The choices of every reading, the main one first."""
        names = [one.name for one in self.choice]
        return [
            dict(zip(names, options, strict=True))
            for options in product(*(one.options for one in self.choice))
        ]

    def list_keys(self) -> set[str]:
        """Every value that it reads."""
        return {
            self.key.format(group=group, **chosen)
            for chosen in self.list_chosen()
            for group in self.groups
            if self.key
        }

    def find_chance(self, spread: _Spread, n: int, starts: bool) -> float:
        """How often noise agrees, as a share, about: values alone as often as their order is the
        one that is asked for; ``n`` starts of fits an n-th as often, intervals hardly ever.
        """
        k = len(self.groups)
        by_order = {
            "order": 1 / factorial(k),
            **dict.fromkeys(("dip", "greatest", "least"), 1 / k),
        }
        if self.of == "nothing" or self.kind not in by_order:
            return 0.0
        if np.isfinite(spread[1:]).all() and not starts:
            return _OVERLAP
        return by_order[self.kind] / (n if starts else 1)

    def weigh(self, chosen: Mapping[str, str]) -> str:
        """How natural a reading is."""
        known = {one.name: one.options for one in self.choice}
        words = [known[name][option] for name, option in chosen.items()]
        return max(words, key=NATURAL.index, default=NATURAL[0])


@cache
def load_sentences() -> tuple[Sentence, ...]:
    """Every sentence of ``readings.toml``; one for several indices of dispersion is several."""
    found: dict[str, Sentence] = {}
    for entry in read_declared("readings.toml")["sentence"]:
        plain = dict(entry)
        indices, same = plain.pop("indices", [""]), plain.pop("choices_of", None)
        for index in indices:
            own = {
                key: value.format(index=index) if key == "id" and index else value
                for key, value in plain.items()
            }
            if index:
                own["says"] = own["says"].replace("{index}", INDICES[index].label)
                own |= {"index": index}
                if not INDICES[index].is_similarity:
                    own |= {"groups": own["groups"][::-1], "ratio": True, "least": 0.1}
            source = found[same.replace("pearson", index or "pearson")] if same else None
            options: Any = source.choice if source else own.get("choice", ())
            if not source:
                options = tuple(
                    make_record(Option, one, f"readings.toml, {own['id']}") for one in options
                )
                options = tuple(
                    one for one in options if not one.indices or index in one.indices
                )
            own["choice"] = options
            found[own["id"]] = make_record(Sentence, own, f"readings.toml, {own['id']}")
    return tuple(found.values())


# Whether a reading agrees with the sentence.


@np.errstate(divide="ignore", invalid="ignore")
def measure_effect(sentence: Sentence, values: Sequence[float]) -> float:
    """By how much the groups' values agree: the least of the differences that the sentence asks
    for, or minus the greatest deviation from the targets (relative; of ``factor`` the factor).
    """
    found = np.asarray(values, dtype=float)
    if sentence.ratio:
        found = np.log(found)  # of zeros, differences are NaN: no agreement
    match sentence.kind:
        case "order":
            steps = np.diff(found)
            return (
                float(found[-1] - found[0]) if (steps > 0).all() else float(min(steps.min(), 0))
            )
        case "greatest":
            return float(found[-1] - found[:-1].max())
        case "least":
            return float(found[:-1].min() - found[-1])
        case "dip":
            return float(min(found[0], found[2]) - found[1])
        case "above":
            return float((found - sentence.target).min())
        case "below":
            return float((np.asarray(sentence.target) - found).min())
        case "value":
            return -float(np.abs(found / sentence.target - 1).max())
        case _:
            with np.errstate(divide="ignore"):
                factors = np.abs(np.log((1 - found) / (1 - np.asarray(sentence.target))))
            return -float(np.exp(factors.max()))


def find_threshold(sentence: Sentence, values: Sequence[float] = ()) -> float:
    """The effect from which on a reading of these values agrees."""
    if sentence.kind in ("value", "factor"):
        return -sentence.tolerance
    if sentence.kind in ("above", "below") and any(sentence.target):
        return 0.0
    return sentence.least or sentence.share * float(np.abs(values).max(initial=0.0))


_TINY = float(np.finfo(float).tiny)
"""A difference that is asked for is more than none at all."""


def agree(
    sentence: Sentence, spreads: Sequence[_Spread], least: float | None = None
) -> bool | None:
    """Whether the groups' values agree with the sentence; None where their spreads leave it open.

    Evidence is asked for both ways: agreement must survive the spreads of the groups, and so must
    its absence. Of an order the ends must be apart; the groups between them must be in order.
    ``least`` replaces the sentence's own threshold.
    """
    points = [value for value, *_ in spreads]
    if not np.isfinite(points).all():
        return None
    threshold = find_threshold(sentence, points) if least is None else least
    bound = threshold if any(sentence.target) else max(threshold, _TINY)
    ends = [
        [value] if not np.isfinite([low, high]).all() else [low, high]
        for value, low, high in spreads
    ]
    if sentence.kind in ("value", "factor"):
        for one, target in zip(ends, sentence.target, strict=True):
            one += [target] if min(one) < target < max(one) else []
    asked = sentence
    if sentence.kind == "order" and len(spreads) > 2:
        asked = sentence.replace(groups=(sentence.groups[0], sentence.groups[-1]))
        ends, reversed_ = (
            [ends[0], ends[-1]],
            [min(one) > max(other) for one, other in pairwise(ends)],
        )
        if any(reversed_):
            return False
    others = [measure_effect(asked, chosen) for chosen in product(*ends)]
    if max(others) < bound:
        return False
    if measure_effect(sentence, points) < bound:
        return None
    return True if min(others) >= (bound if any(sentence.target) else 0) else None


def decide(agrees: Sequence[bool | None], chances: Sequence[float] = ()) -> str:
    """The verdict from whether each reading agrees, the main one first, and how often noise does
    (:meth:`Sentence.find_chance`).

    Not reproduced: the main reading speaks against it, and none for it. Where the main reading is
    not decided and no other agrees, nothing can be said; nor where no more readings agree than of
    noise would (binomial test), unless the main one does and noise hardly ever would.
    """
    if not any(agrees):
        return NOT if agrees[0] is False else NEVER
    yes, n = sum(map(bool, agrees)), len(agrees)
    chances = chances or [0.0] * n
    if binom.sf(yes - 1, n, float(np.mean(chances))) > 1 - _SURE and not (
        agrees[0] and chances[0] <= 1 - _SURE
    ):
        return NEVER
    return OWN_WORDS if agrees[0] else ANOTHER


# Rows of one sentence.

Reading = tuple[dict[str, str], dict[str, Any], dict[str, float]]
"""Choices; by group a value, (value, low, high, n) or starts; by group the null's value."""


def make_rows(
    sentence: Sentence, readings: Iterator[Reading] | Sequence[Reading]
) -> list[dict[str, Any]]:
    """Rows (``COLUMNS`` and ``choices``) of the readings; a small scale has not every group of an
    order.
    """
    rows = []
    declared = sentence
    for chosen, by_group, nulls in readings:
        groups = tuple(group for group in declared.groups if group in by_group)
        if len(groups) < (2 if declared.kind in _ORDERS else len(declared.groups)):
            continue
        sentence = declared.replace(groups=groups)
        spreads = [_spread(by_group[group]) for group in sentence.groups]
        share = looser = stricter = np.nan
        agrees = agree(sentence, [spread[:3] for spread in spreads])
        if sentence.of not in ("", "nothing") and min(spread[3] for spread in spreads) < 2:
            agrees = None
        if isinstance(next(iter(by_group.values())), np.ndarray):
            starts = [by_group[group] for group in sentence.groups]
            least = find_threshold(sentence)
            share, looser, stricter = (
                _share_draws(sentence, starts, chosen, threshold)
                for threshold in (least, *_list_around(sentence, least))
            )
            agrees = _is_sure(share)
            if min(spread[3] for spread in spreads) < 2:  # one start is no sample of fits
                looser, stricter, agrees = np.nan, np.nan, None
        null = [nulls.get(group, np.nan) for group in sentence.groups]
        identical = (
            sentence.identical == "order"
            and np.isfinite(null).all()
            and agree(sentence, [(value, np.nan, np.nan) for value in null]) is True
        )
        rows += [
            {
                "sentence": sentence.id,
                "quantity": sentence.measure,
                "figure": sentence.figure,
                "statement": sentence.says,
                "reading": "; ".join(f"{name}: {option}" for name, option in chosen.items()),
                "main": sentence.is_main(chosen),
                "natural": sentence.weigh(chosen),
                "group": group,
                "value": spread[0],
                "low": spread[1],
                "high": spread[2],
                "n": spread[3],
                "null": beside,
                "unit": sentence.unit,
                "share": share,
                "looser": looser,
                "stricter": stricter,
                "agrees": np.nan if agrees is None else float(agrees),
                "identical": bool(identical),
                "choices": dict(chosen),
            }
            for group, spread, beside in zip(sentence.groups, spreads, null, strict=True)
        ]
    return rows


def _spread(found: Any) -> tuple[float, float, float, int]:
    if isinstance(found, np.ndarray):
        return float(found[0]), float(found.min()), float(found.max()), len(found)
    if isinstance(found, tuple):
        value, low, high, n = found
        return float(value), float(low), float(high), int(n)
    return float(found), np.nan, np.nan, 1


def _share_draws(
    sentence: Sentence, starts: list[np.ndarray], chosen: Mapping[str, str], threshold: float
) -> float:
    """Share of draws in which the sentence holds with this threshold.

    Starts of a fit stand best first. Where all groups are read from one fit (speeds), a draw is one
    of its starts; otherwise one start for each group, or of the choice ``best of all starts`` the
    best of as many as there are, drawn with replacement. As in :func:`agree` the groups between the
    ends of an order may overlap their neighbours, as long as the medians of all are in order.
    """
    ordered = (np.diff([np.median(found) for found in starts]) > 0).all()
    if sentence.kind == "order" and ordered:
        ends = sentence.groups[0], sentence.groups[-1]
        sentence, starts = sentence.replace(groups=ends), [starts[0], starts[-1]]
    weights, fit = [], chosen.get("fit")
    for n in map(len, starts):
        left = ((n - np.arange(n + 1)) / n) ** n
        weights.append(
            left[:-1] - left[1:] if fit == "best of all starts" else np.full(n, 1 / n)
        )
    draws: Iterator[tuple[int, ...]] = product(*(range(len(found)) for found in starts))
    if fit is None and "slow" in sentence.groups:
        draws = iter([(k,) * len(starts) for k in range(len(starts[0]))])
        weights = [weights[0], *(np.ones_like(w) for w in weights[1:])]
    total = 0.0
    for drawn in draws:
        values = [found[k] for found, k in zip(starts, drawn, strict=True)]
        if measure_effect(sentence, values) >= threshold:
            total += float(np.prod([w[k] for w, k in zip(weights, drawn, strict=True)]))
    return total


# Of all sections together: rows, verdicts, and the choices on which agreement depends.


@dataclass(frozen=True, kw_only=True, eq=False)
class Finding:
    """What the readings of one sentence say.

    Attributes
    ----------
    verdict : str
        One of ``WORDS``.
    line : str
        On which choices agreement depends, with the readings that this rule does not fit.
    note : str
        The main reading, which natural departures from it change the answer, and identical touches.
    moves : str
        How the verdict moves with its threshold.
    ours : str
        The main reading's values with their intervals.
    agrees : tuple[bool | None, ...]
        Whether each reading agrees, the main one first.
    rows : pd.DataFrame
        ``COLUMNS`` and ``choices``.
    """

    sentence: Sentence
    verdict: str
    line: str
    note: str
    moves: str
    ours: str = "–"
    agrees: tuple[bool | None, ...] = ()
    rows: pd.DataFrame = field(repr=False)


def collect(sections: Sequence[Section]) -> pd.DataFrame:
    """All rows of a run: of what stages left in their folders, and of values of the sections."""
    rows: list[dict[str, Any]] = []
    for section in sections:
        path = section.folder / FILE
        if path.exists():
            rows += json.loads(path.read_text())["rows"]
    results = Results.collect(sections)
    order = {one.id: place for place, one in enumerate(load_sentences())}
    rows += [row for one in load_sentences() for row in read_values(one, results)]
    return tabulate(rows).sort_values("sentence", key=lambda ids: ids.map(order), kind="stable")


def tabulate(rows: Sequence[Mapping[str, Any]]) -> pd.DataFrame:
    """Rows as a table of ``COLUMNS`` and ``choices``."""
    table = pd.DataFrame(rows, columns=[*COLUMNS, "choices"])
    numbers = ["value", "low", "high", "null", "share", "looser", "stricter", "agrees"]
    table[numbers] = table[numbers].astype(float)
    return table


def read_values(sentence: Sentence, results: Results) -> list[dict[str, Any]]:
    """Rows of a sentence that is judged by values of the run."""
    if sentence.measure != "values":
        return []
    readings: list[Reading] = []
    for chosen in sentence.list_chosen():
        keys = {group: sentence.key.format(group=group, **chosen) for group in sentence.groups}
        found = {group: one for group, key in keys.items() if (one := results.get(key))}
        readings.append((chosen, found, {}))
    return make_rows(sentence, readings)


def judge_sentences(rows: pd.DataFrame) -> dict[str, Finding]:
    """What follows for every sentence, by its name; also where nothing was computed."""
    parts = dict(list(rows.groupby("sentence", sort=False)))
    return {
        one.id: judge_sentence(one, parts.get(one.id, rows.iloc[:0]))
        for one in load_sentences()
    }


def judge_sentence(
    sentence: Sentence, rows: pd.DataFrame, words: Mapping[str, str] | None = None
) -> Finding:
    """What the rows of a sentence say of it; ``words``: how verdicts are said, where otherwise."""
    computed = tuple(group for group in sentence.groups if group in {*rows["group"]})
    whole = computed == sentence.groups
    sentence = sentence if whole else sentence.replace(groups=computed)
    readings = list_readings(sentence, rows)
    main = next((one for one in readings if one.main), None)
    if main is None or not whole:
        said = f"only {', '.join(computed)} computed in this run" if computed else ""
        line = said or "not computed in this run"
        return Finding(
            sentence=sentence,
            verdict=NEVER,
            line=line,
            note=f"{line[0].upper()}{line[1:]}.",
            moves="",
            rows=rows,
        )
    rest = [one for one in readings if one is not main]
    line = find_rule(sentence, [(one.chosen, one.agrees) for one in readings])
    if not rest:
        line = _describe_effect(sentence, main)
    agrees, chances = zip(*((one.agrees, one.chance) for one in (main, *rest)), strict=True)
    verdict = decide(agrees, chances)
    if verdict == NEVER and any(agrees):
        line += "; no more readings agree than of noise would"
    return Finding(
        sentence=sentence,
        verdict=verdict,
        line=line,
        note=_describe_main(sentence, readings, main),
        moves=_describe_moves(sentence, readings, main, words or {}),
        ours=_say_values(sentence, main, show),
        agrees=agrees,
        rows=rows,
    )


def _describe_effect(sentence: Sentence, main: SimpleNamespace) -> str:
    """By how much the one reading does what is said, and how much is asked for."""
    if not main.defined:
        return "undefined in this run"
    if main.n < 2 and sentence.of not in ("", "nothing"):
        return f"n = 1 ({sentence.of}): one draw has no spread"
    values = [value for value, *_ in main.spreads]
    effect, least = measure_effect(sentence, values), find_threshold(sentence, values)
    match sentence.kind:
        case "value" | "factor":
            said = f"off by {-effect:.3g}, {-least:.3g} is allowed"
        case "above" | "below" if any(sentence.target):
            word = "at least" if sentence.kind == "above" else "at most"
            said = f"asked for is {word} {sentence.target[0]:g}"
        case _:
            said = f"the effect is {effect:.3g}, {least:.2g} is the least that counts"
    return said if main.agrees is not None else f"{said}; the intervals leave it open"


def list_readings(sentence: Sentence, rows: pd.DataFrame) -> list[SimpleNamespace]:
    """Readings, in order: choices, spreads by group, whether they agree."""
    parts: dict[str, list[dict[Any, Any]]] = {}
    for row in rows.to_dict("records"):
        parts.setdefault(row["reading"], []).append(row)
    found = []
    for part in parts.values():
        first, by_group = part[0], {row["group"]: row for row in part}
        defined = all(np.isfinite(row["value"]) for row in part)
        found.append(
            SimpleNamespace(
                chosen=first["choices"],
                main=bool(first["main"]),
                natural=first["natural"],
                agrees=None if np.isnan(first["agrees"]) else bool(first["agrees"]),
                identical=bool(first["identical"]),
                share=float(first["share"]),
                around=(float(first["looser"]), float(first["stricter"])),
                n=int(min(row["n"] for row in part)),
                chance=sentence.find_chance(
                    (first["value"], first["low"], first["high"]),
                    int(first["n"]),
                    starts=bool(np.isfinite(first["share"])),
                )
                * defined,
                defined=defined,
                spreads=[
                    tuple(float(by_group[group][end]) for end in ("value", "low", "high"))
                    for group in sentence.groups
                ],
            )
        )
    return found


def find_rule(
    sentence: Sentence, readings: Sequence[tuple[Mapping[str, str], bool | None]]
) -> str:
    """One line that says on which choices agreement depends: a shallow decision tree over them,
    with the readings that it does not fit. Readings that leave it open are counted apart.
    """
    known = [(chosen, agrees) for chosen, agrees in readings if agrees is not None]
    if not known:
        return "no reading decides" if readings else ""
    yes, n = sum(agrees for _, agrees in known), len(known)
    rest = len(readings) - n
    counted = f"{yes} of {n} readings agree" + (f", {rest} say nothing" if rest else "")
    if yes in (0, n):
        word = "comes out under every reading" if yes else "comes out under no reading"
        return f"{word} ({counted})"
    chosen = [one for one, _ in known]
    table = _tabulate(sentence, chosen)
    target = np.array([agrees for _, agrees in known])
    fits = [
        DecisionTreeClassifier(max_depth=4, max_leaf_nodes=leaves, random_state=0).fit(
            table, target
        )
        for leaves in range(2, _MOST_LEAVES + 1)
    ]
    wrong = [int((tree.predict(table) != target).sum()) for tree in fits]
    best = min(range(len(fits)), key=lambda k: wrong[k] + k * max(0.5, _LEAF * n))
    leaves, said_of = fits[best].apply(table), fits[best].predict(table)
    ways: dict[bool, list[_Way]] = {True: [], False: []}
    for leaf in np.unique(leaves):
        inside = np.flatnonzero(leaves == leaf)
        shared = _find_shared(sentence, [chosen[k] for k in inside])
        way = shared, int(target[inside].sum()), len(inside)
        ways[bool(said_of[inside[0]])].append(way)
    if wrong[best] >= min(yes, n - yes):  # no better than the more frequent answer
        few = yes <= n - yes
        shared = _find_shared(sentence, [one for one, agrees in known if agrees is few])
        word = "agree" if few else "do not"
        said = _say_allowed(sentence, shared) or "nothing in common"
        return f"no simple rule over the choices; those that {word}: {said} ({counted})"
    counts = [
        (_say_allowed(sentence, allowed), agree, count)
        for side in (True, False)
        for allowed, agree, count in _merge(ways[side])
    ]
    return f"{_say_ways(counts)} ({counted}; a tree over the choices fits {n - wrong[best]} of {n})"


def _say_ways(counts: Sequence[tuple[str, int, int]]) -> str:
    """Where nearly all readings agree, where nearly none does, and what is left."""
    counts = sorted(counts, key=lambda one: -one[2])
    yes = [one for one in counts if one[1] >= _CLEAR * one[2]][:_MOST_WAYS]
    no = [one for one in counts if one[1] <= (1 - _CLEAR) * one[2]][:_MOST_WAYS]
    yes = yes or [max(counts, key=lambda one: one[1] / one[2])]
    said = [
        f"{side} " + " or if ".join(f"{way} ({agree} of {n})" for way, agree, n in found)
        for side, found in (("comes out if", yes), ("not if", no))
        if found
    ]
    if mixed := [one for one in counts if one not in (*yes, *no)]:
        said.append(f"otherwise in {sum(m[1] for m in mixed)} of {sum(m[2] for m in mixed)}")
    return "; ".join(said)


def _find_shared(
    sentence: Sentence, chosen: Sequence[Mapping[str, str]]
) -> dict[str, tuple[str, ...]]:
    """The options that some readings have; of a choice that none of them has, all."""
    shared = {}
    for one in sentence.choice:
        taken = {reading[one.name] for reading in chosen if one.name in reading}
        shared[one.name] = tuple(o for o in one.options if o in taken or not taken)
    return shared


def _tabulate(sentence: Sentence, chosen: Sequence[Mapping[str, str]]) -> np.ndarray:
    """Readings (reading, column): a column for each option, or one for a choice of numbers."""
    table = []
    for one in sentence.choice:
        taken = {reading.get(one.name, "") for reading in chosen}
        if len(taken) > 1 and all(map(_is_number, one.options)):
            table.append([float(reading[one.name]) for reading in chosen])
        elif len(taken) > 1:
            table += [
                [float(reading.get(one.name) == option) for reading in chosen]
                for option in one.options
                if option in taken
            ]
    return np.array(table).T


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


_Way = tuple[dict[str, tuple[str, ...]], int, int]
"""Options of every choice, how many readings with these agree, and how many there are."""


def _merge(ways: list[_Way]) -> list[_Way]:
    """Ways of which two that differ in one choice at most are one."""
    ways = list(ways)
    while pair := next(
        (
            (one, other, differing)
            for one, other in combinations(ways, 2)
            if len(differing := [k for k, kept in one[0].items() if kept != other[0][k]]) < 2
        ),
        None,
    ):
        one, other, differing = pair
        allowed = one[0] | {name: one[0][name] + other[0][name] for name in differing}
        ways = [way for way in ways if way is not one and way is not other]
        ways.append((allowed, one[1] + other[1], one[2] + other[2]))
    return ways


def _say_allowed(sentence: Sentence, allowed: Mapping[str, tuple[str, ...]]) -> str:
    words = []
    for choice in sentence.choice:
        name, every = choice.name, list(choice.options)
        kept = [one for one in every if one in allowed[name]]
        if len(kept) == len(every):
            continue
        if all(map(_is_number, every)):
            kept = sorted(kept, key=float)
        elif len(kept) > 1 and len(kept) == len(every) - 1:
            (left,) = set(every) - set(kept)
            words.append(f"{name} is not “{left}”")
            continue
        words.append(f"{name} is “{'” or “'.join(kept)}”")
    return " and ".join(words)


def _say_values(
    sentence: Sentence, reading: SimpleNamespace, say: Callable[[Value], str] | None = None
) -> str:
    shown = (
        (
            group,
            say(Value(spread[0], spread[1], spread[2], reading.n))
            if say
            else f"{spread[0]:.3g}",
        )
        for group, spread in zip(sentence.groups, reading.spreads, strict=True)
    )
    unit = "" if sentence.unit == "share" else f" {sentence.unit}".rstrip()
    alone = len(sentence.groups) == 1
    return ", ".join(value if alone else f"{group} {value}" for group, value in shown) + unit


_ANSWER = {True: "agrees", False: "does not agree", None: "leaves it open"}


def _describe_main(
    sentence: Sentence, readings: list[SimpleNamespace], main: SimpleNamespace
) -> str:
    words = [f"The main reading {_ANSWER[main.agrees]}: {_say_values(sentence, main)}"]
    if np.isfinite(main.share):
        words[0] += f" (in {main.share:.0%} of draws of {main.n} starts each)"
    if not main.defined:
        words = ["Under the main reading the numbers are undefined"]
    if main.identical and main.agrees:
        words.append(
            "identical touches show the same effect there, so it is no evidence of touch"
        )
        other = [one for one in readings if one.agrees and not one.identical]
        if other:
            words.append(f"{len(other)} other readings agree in which identical touches do not")
    flips = [
        f"{name} “{option}”"
        for one in readings
        if len(changed := _list_changes(sentence, one)) == 1
        and one.natural in NATURAL[:2]
        and one.defined
        and one.agrees is not main.agrees
        for name, option in changed.items()
    ]
    if flips:
        words.append(f"as natural and with another answer: {', '.join(flips)}")
    if main.agrees is not True and (near := [one for one in readings if one.agrees]):
        best = min(
            near,
            key=lambda one: (len(_list_changes(sentence, one)), NATURAL.index(one.natural)),
        )
        said = ", ".join(f"{k} “{v}”" for k, v in _list_changes(sentence, best).items())
        words.append(f"nearest that agrees: {said} ({_say_values(sentence, best)})")
    if undefined := sum(not one.defined for one in readings):
        words.append(f"undefined in {undefined} of {len(readings)} readings")
    chance = [one for one in readings if one.agrees is None and np.isfinite(one.share)]
    if chance and main.agrees is not True:
        most = max(chance, key=lambda one: one.share)
        said = ", ".join(f"{k} “{v}”" for k, v in most.chosen.items())
        words.append(f"by chance of the starts in {most.share:.0%} of draws at most ({said})")
    return "; ".join(words) + "."


def _list_changes(sentence: Sentence, reading: SimpleNamespace) -> dict[str, str]:
    """Choices in which a reading departs from the main one."""
    return {k: v for k, v in reading.chosen.items() if v != sentence.main[k]}


def _describe_moves(
    sentence: Sentence,
    readings: list[SimpleNamespace],
    main: SimpleNamespace,
    words: Mapping[str, str],
) -> str:
    """The verdict with thresholds around the one that was declared."""
    points = [value for value, *_ in main.spreads]
    asked, best = find_threshold(sentence, points), measure_effect(sentence, points)
    target = sentence.target[0] if any(sentence.target) else 0.0
    wide = _list_around(sentence, asked)
    if sentence.kind in ("value", "factor"):
        name, now, reach = "tolerance", -asked, f"; main reading: {-best:.3g}"
        shown = [-one for one in wide]
    elif sentence.kind in ("above", "below") and target:
        name, now, reach = "target", target, ""
        sign = 1 if sentence.kind == "above" else -1
        shown = [target + sign * one for one in wide]
    else:
        name, now, reach = "least effect", asked, f"; main reading: {best:.3g}"
        shown = wide
    said = [f"{name} {now:.3g}{reach * bool(np.isfinite(best))}"]
    others = [one for one in readings if one is not main]
    for k, (threshold, value) in enumerate(zip(wide, shown, strict=True)):
        answers = [
            _is_sure(one.around[k])
            if np.isfinite(one.share)
            else agree(sentence, one.spreads, threshold)
            for one in (main, *others)
        ]
        counted = f" ({sum(map(bool, answers))} of {len(answers)} agree)" * bool(others)
        verdict = decide(answers, [one.chance for one in (main, *others)])
        said.append(f"with {value:.3g}: {words.get(verdict, verdict)}{counted}")
    return "; ".join(said)


def _list_around(sentence: Sentence, asked: float) -> list[float]:
    """A looser and a stricter threshold than the one that was declared."""
    target = sentence.target[0] if any(sentence.target) else 0.0
    if sentence.kind == "factor":
        return [-(sentence.tolerance**k) for k in (2.0, 0.5)]
    if sentence.kind == "value":
        return [2.0 * asked, 0.5 * asked]
    if sentence.kind in ("above", "below") and target:
        step = 0.1 * abs(target)  # no share is above 1
        whole = sentence.kind == "above" and sentence.unit == "share"
        return [-step, min(step, 1 - target) if whole else step]
    return [0.5 * asked, 2.0 * asked]


def _is_sure(share: float) -> bool | None:
    """What a share of draws of the starts says; NaN says nothing."""
    return True if share >= _SURE else False if share <= 1 - _SURE else None
