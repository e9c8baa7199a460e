"""Where two configurations differ."""

import json
from typing import Any

MAX_DIFFERENCES = 5


def find_differences(stored: Any, asked: Any, name: str = "") -> list[str]:
    """Up to five places where two configurations differ, as ``name: stored → asked``."""
    if isinstance(stored, dict) and isinstance(asked, dict):
        pairs = [
            (_join(name, key), stored.get(key), asked.get(key)) for key in sorted({*stored, *asked})
        ]
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
