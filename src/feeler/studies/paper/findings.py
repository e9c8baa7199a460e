"""What the verdicts do not say in one line: sentences of the report's first page, filled with the
run's own numbers.
"""

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any

from feeler.studies.paper.verdicts import EVIDENCE, Judged

PLACE = re.compile(r"\{([^{}:]+):([^{}]+)\}")
"""``{key of a value:format}``"""


@dataclass(frozen=True, kw_only=True)
class Topic:
    """A sentence of the first screen with how its claims fared."""

    title: str
    section: str
    words: str
    counts: Mapping[str, int]
    """How many of its claims got each verdict that is evidence."""


def list_topics(values: Mapping[str, Any], judged: Sequence[Judged]) -> list[Topic]:
    """The first screen's sentences, filled with the run's values; without them the counts speak for
    themselves.
    """
    topics = []
    for one in _load()["topic"]:
        chosen = [
            found
            for found in judged
            if found.claim.whose == "paper" and re.match(one["claims"], found.claim.id)
        ]
        counts = {
            verdict: sum(found.verdict == verdict for found in chosen) for verdict in EVIDENCE
        }
        words = fill(" ".join(one["words"].split()), values)
        topics.append(Topic(title=one["title"], section=one["section"], words=words, counts=counts))
    return topics


def list_numbers(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The first screen's numbers that this run has, each with what it is."""
    found = [
        (fill(one["number"], values), fill(" ".join(one["words"].split()), values))
        for one in _load()["number"]
    ]
    return [(number, words) for number, words in found if number and words]


@cache
def _load() -> dict[str, list[dict[str, str]]]:
    return tomllib.loads(
        files("feeler.studies.paper").joinpath("findings.toml").read_text(encoding="utf-8")
    )


@cache
def _load_findings() -> tuple[dict[str, str], ...]:
    """Every finding of findings.toml: its ``name``, the ``section`` that shows it, and its
    ``words``.
    """
    return tuple(
        {key: " ".join(text.split()) for key, text in one.items()} for one in _load()["finding"]
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


def list_findings(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Section and sentence of every finding that this run can fill."""
    return [
        (one["section"], words) for one in _load_findings() if (words := fill(one["words"], values))
    ]
