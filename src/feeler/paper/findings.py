"""What the verdicts do not say in one line: sentences of the report's first page, filled with the run's own numbers."""

import re
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

PLACE = re.compile(r"\{([^{}:]+):([^{}]+)\}")
"""``{key of a value:format}``"""


@cache
def load_findings() -> tuple[dict[str, str], ...]:
    """Every finding of findings.toml: its ``name``, the ``section`` that shows it, and its ``words``."""
    found = tomllib.loads(files("feeler.paper").joinpath("findings.toml").read_text(encoding="utf-8"))["finding"]
    return tuple({key: " ".join(text.split()) for key, text in one.items()} for one in found)


def fill(words: str, values: Mapping[str, Any]) -> str:
    """The sentence with a run's values in it; empty where one is missing or undefined."""
    found = {key: _read(values.get(key)) for key, _ in PLACE.findall(words)}
    return "" if None in found.values() else PLACE.sub(lambda place: format(found[place[1]], place[2]), words)


def _read(value: Any) -> float | None:
    return value.get("value") if isinstance(value, Mapping) else value


def list_findings(values: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Section and sentence of every finding that this run can fill."""
    return [(one["section"], words) for one in load_findings() if (words := fill(one["words"], values))]
