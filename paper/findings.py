"""What the report says in words: the answer, the story, and what verdicts do not say in one line;
sentences filled with the run's own numbers.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from paper.claims import load_effects
from paper.declared import read_declared
from paper.verdicts import EVIDENCE, ClaimResult, judge_statements

_FINDINGS, _STORY = "findings.toml", "story.toml"
OPEN = "depends on a definition"
PLACE = re.compile(r"\{([^{}:]+):([^{}]+)\}")
"""``{key of a value:format}``"""


def choose_answer(judged: Sequence[ClaimResult]) -> str:
    """The answer to the report's question: the first of ``story.toml`` whose claims all hold."""
    hold = _list_held(judged)
    return next(
        one["words"] for one in read_declared(_STORY)["answer"] if hold >= {*one["holds"]}
    )


def list_headlines(
    values: Mapping[str, Any], judged: Sequence[ClaimResult]
) -> list[dict[str, str]]:
    """The first screen's findings whose claims hold and which this run can fill: ``number``,
    ``words``, ``when`` it is true and the ``section`` that shows it; sentences that it cannot fill
    are left out.
    """
    hold, texts = _list_held(judged), ("number", "words", "when", "section")
    found = [
        {name: fill_sentences(one[name], values) for name in texts}
        for one in read_declared(_STORY)["headline"]
        if hold >= {*one["holds"]}
    ]
    return [one for one in found if all(one.values())]


def list_abstract(judged: Sequence[ClaimResult]) -> list[dict[str, str]]:
    """What the paper's abstract says of touch and gradient: its ``words``, each with its
    ``verdict`` in this run, and where this depends on a definition what it hangs on (``open``).
    """
    found = judge_statements(judged)
    shown = [one for one in read_declared(_STORY)["abstract"] if one["statement"] in found]
    verdicts = [found[one["statement"]] for one in shown]
    return [
        {"words": one["words"], "verdict": word, "open": one["open"] * (word == OPEN)}
        for one, word in zip(shown, verdicts, strict=True)
    ]


def list_not_reproduced(judged: Sequence[ClaimResult]) -> list[dict[str, str]]:
    """Statements of the paper that are not reproduced, or only in part: ``words`` and ``why``, in
    the claim's own words where ``story.toml`` has none.
    """
    told = {one["statement"]: one for one in read_declared(_STORY)["unmet"]}
    long = load_effects() | {one.claim.id: one.claim.says for one in judged}
    return [
        told.get(name) or {"words": long[name], "why": ""}
        for name, word in judge_statements(judged).items()
        if word in EVIDENCE and word != "reproduced"
    ]


def _list_held(judged: Sequence[ClaimResult]) -> set[str]:
    return {one.claim.id for one in judged if one.verdict == "reproduced"}


def list_screens(values: Mapping[str, Any]) -> list[dict[str, str]]:
    """The story: ``title``, ``figure`` and ``words`` of every screen; sentences that this run
    cannot fill are left out.
    """
    return [
        one | {"words": fill_sentences(one["words"], values)}
        for one in read_declared(_STORY)["screen"]
    ]


def _split(words: str) -> list[str]:
    """Sentences."""
    return re.split(r"(?<=[.?!]) (?=[A-Z])", " ".join(words.split()))


@cache
def _load_findings() -> tuple[dict[str, str], ...]:
    """Every finding of findings.toml: its ``name``, the ``section`` that shows it, and its
    ``words``.
    """
    return tuple(
        {key: " ".join(text.split()) for key, text in one.items()}
        for one in read_declared(_FINDINGS)["finding"]
    )


def fill(words: str, values: Mapping[str, Any]) -> str:
    """The sentence with a run's values in it; empty where one is missing or undefined."""
    found = {key: _read(values.get(key)) for key, _ in PLACE.findall(words)}
    return (
        ""
        if None in found.values()
        else PLACE.sub(lambda place: format(found[place[1]], place[2]), words)
    )


def _read(value: Any) -> float | None:
    return value.get("value") if isinstance(value, Mapping) else value


def fill_sentences(words: str, values: Mapping[str, Any]) -> str:
    """The text with a run's values in it, without the sentences of which one is missing."""
    return " ".join(filter(None, (fill(sentence, values) for sentence in _split(words))))


def list_findings(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Section and sentence of every finding that this run can fill."""
    return [
        (one["section"], words)
        for one in _load_findings()
        if (words := fill(one["words"], values))
    ]
