"""Results that take long to make, stored with the paper's sections, which read them."""

import json
from importlib.resources import files
from typing import Any


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
