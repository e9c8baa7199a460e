"""What the verdicts do not say in one line: sentences of the report's first page, filled with the
run's own numbers.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Any

from feeler.studies.paper.claims import read_declared
from feeler.studies.paper.verdicts import EVIDENCE, Judged, count_verdicts

FINDINGS = "findings.toml"
PLACE = re.compile(r"\{([^{}:]+):([^{}]+)\}")
"""``{key of a value:format}``"""


def list_topics(values: Mapping[str, Any], judged: Sequence[Judged]) -> list[dict[str, Any]]:
    """The first screen's sentences: ``title``, ``section``, ``words`` and ``counts``.

    The words are filled with the run's values, and empty without them; the counts say how many
    statements of the topic got each verdict that is evidence.
    """
    topics = []
    for one in read_declared(FINDINGS)["topic"]:
        chosen = [found for found in judged if re.match(one["claims"], found.claim.id)]
        counts = {word: count_verdicts(chosen)[word] for word in EVIDENCE}
        words = fill(" ".join(one["words"].split()), values)
        topics.append(one | {"words": words, "counts": counts})
    return topics


def list_numbers(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """The first screen's numbers that this run has, each with what it is."""
    found = [
        (fill(one["number"], values), fill(" ".join(one["words"].split()), values))
        for one in read_declared(FINDINGS)["number"]
    ]
    return [(number, words) for number, words in found if number and words]


@cache
def _load_findings() -> tuple[dict[str, str], ...]:
    """Every finding of findings.toml: its ``name``, the ``section`` that shows it, and its
    ``words``.
    """
    return tuple(
        {key: " ".join(text.split()) for key, text in one.items()}
        for one in read_declared(FINDINGS)["finding"]
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
