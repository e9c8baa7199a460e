"""Results that take long to make, stored with the paper's sections, which read them."""

import json
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

from feeler.provenance import make_key
from feeler.report.section import to_json

_DIGITS = 5


def store(name: str, found: Any, module: str, seed: int) -> None:
    """Write ``<name>.json`` beside this module: what was found, when, with which seed and code."""
    about = {"date": f"{datetime.now(UTC):%Y-%m-%d}", "seed": seed, "code": make_key({}, module)}
    text = json.dumps({"about": about, "found": to_json(found)}, sort_keys=True)
    lean = json.loads(text, parse_float=lambda number: float(f"{float(number):.{_DIGITS}g}"))
    path = Path(__file__).with_name(f"{name}.json")
    path.write_text(json.dumps(lean, sort_keys=True) + "\n", encoding="utf-8")


def load_stored(name: str) -> tuple[Any, str]:
    """What was stored under this name, and a sentence that says so."""
    path = files("feeler.studies.paper").joinpath(f"{name}.json")
    held = json.loads(path.read_text(encoding="utf-8"))
    about = held["about"]
    said = (
        f"Stored results, made on {about['date']} with seed {about['seed']};"
        " benchmarks/questions.py makes them anew."
    )
    return held["found"], said
