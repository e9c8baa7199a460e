"""What was declared before a study and what it has found, as these files stand in its folder."""

import json
from datetime import UTC, datetime
from functools import cache
from pathlib import Path
from typing import Any

from feeler.files import read_shipped
from feeler.provenance import to_json


@cache
def read_declared(study: str) -> dict[str, Any]:
    """What was written down before anything was run."""
    return read_shipped(f"studies.{study}", "declared.toml")


def load_stored(study: str) -> tuple[Any, str]:
    """What was found, and a sentence that says so."""
    held = read_shipped(f"studies.{study}", "results.json")
    about = held["about"]
    said = (
        f"Stored results, made on {about['date']} with seed {about['seed']};"
        f" studies/{study}/measure.py makes them anew."
    )
    return held["found"], said


def store(study: str, found: Any, seed: int, digits: int = 5) -> Path:
    """Write what was found, when and with which seed."""
    about = {"date": f"{datetime.now(UTC):%Y-%m-%d}", "seed": seed}
    text = json.dumps({"about": about, "found": to_json(found)}, sort_keys=True)
    lean = json.loads(text, parse_float=lambda number: float(f"{float(number):.{digits}g}"))
    path = Path(__file__).parent / study / "results.json"
    path.write_text(json.dumps(lean, sort_keys=True) + "\n", encoding="utf-8")
    return path
