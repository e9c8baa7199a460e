"""Configurations: what a set of trials was made with, as one canonical text that can be compared."""

import dataclasses
import hashlib
import json
import math
import os
from typing import Any

import numpy as np

from feeler.errors import InvalidInput

MAX_DIFFERENCES = 5


def make_plain(value: Any) -> Any:
    """``value`` in JSON's types: arrays become lists, dataclasses dictionaries, infinities and NaN words."""
    if isinstance(value, np.ndarray | list | tuple):
        return [make_plain(item) for item in (value.tolist() if isinstance(value, np.ndarray) else value)]
    if isinstance(value, np.generic):
        return make_plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if value is None or isinstance(value, str | int | bool):
        return value
    if isinstance(value, dict):
        return {str(key): make_plain(item) for key, item in value.items()}
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: make_plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise InvalidInput(f"a configuration holds numbers, texts, lists and dictionaries; got {type(value).__name__}.")


def write_canonical(configuration: dict[str, Any]) -> str:
    """The configuration as JSON with sorted keys: equal configurations give equal texts."""
    return json.dumps(make_plain(configuration), sort_keys=True, ensure_ascii=False, separators=(",", ":"))


def compute_digest(configuration: dict[str, Any]) -> str:
    """SHA-256 of the canonical text, in hexadecimal."""
    return hashlib.sha256(write_canonical(configuration).encode()).hexdigest()


def find_differences(stored: Any, asked: Any, name: str = "") -> list[str]:
    """Up to five places where two configurations differ, as ``name: stored → asked``."""
    if isinstance(stored, dict) and isinstance(asked, dict):
        pairs = [(_join(name, key), stored.get(key), asked.get(key)) for key in sorted({*stored, *asked})]
    elif isinstance(stored, list) and isinstance(asked, list) and len(stored) == len(asked):
        pairs = [(f"{name}[{n}]", a, b) for n, (a, b) in enumerate(zip(stored, asked, strict=True))]
    else:
        return [] if stored == asked else [f"{name}: {_show(stored)} → {_show(asked)}"]
    found: list[str] = []
    for place, a, b in pairs:
        if len(found) < MAX_DIFFERENCES and a != b:
            found += find_differences(a, b, place)
    return found[:MAX_DIFFERENCES]


def _join(name: str, key: str) -> str:
    return f"{name}.{key}" if name else key


def _show(value: Any) -> str:
    text = "nothing" if value is None else json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else text[:57] + "…"
