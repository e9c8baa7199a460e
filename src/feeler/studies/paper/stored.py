"""Results that take long to make, stored with the paper's sections, which read them."""

import json
from datetime import UTC, datetime
from importlib.resources import files
from pathlib import Path
from typing import Any

from feeler.report.section import to_json

_DIGITS = 5


def store(name: str, found: Any, seed: int) -> Path:
    """Write this file beside this module: what was found, when and with which seed."""
    about = {"date": f"{datetime.now(UTC):%Y-%m-%d}", "seed": seed}
    text = json.dumps({"about": about, "found": to_json(found)}, sort_keys=True)
    lean = json.loads(text, parse_float=lambda number: float(f"{float(number):.{_DIGITS}g}"))
    path = Path(__file__).with_name(name)
    path.write_text(json.dumps(lean, sort_keys=True) + "\n", encoding="utf-8")
    return path


def load_stored(name: str) -> tuple[Any, str]:
    """What the file of this name holds, and a sentence that says so."""
    path = files("feeler.studies.paper").joinpath(name)
    held = json.loads(path.read_text(encoding="utf-8"))
    about = held["about"]
    said = (
        f"Stored results, made on {about['date']} with seed {about['seed']};"
        " benchmarks/questions.py makes them anew."
    )
    return held["found"], said
