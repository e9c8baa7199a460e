"""What the study found, as benchmarks/spikes.py keeps it."""

import json
from importlib.resources import files
from typing import Any


def load_measured() -> tuple[dict[str, dict[str, list[float]]], dict[str, Any]]:
    """Kept results, and when and with which seed they were made.

    By "profile/speed/code/variant/window" the accuracy, bits, share of places named right and
    spikes of a touch, a number for each set. NaN: there were fewer spikes than were to be kept.
    """
    kept = files("feeler.studies.spiking").joinpath("measured.json")
    found = json.loads(kept.read_text(encoding="utf-8"))
    return found["cells"], found["about"]
