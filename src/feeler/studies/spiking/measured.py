"""What the study found, as benchmarks/spikes.py keeps it."""

from typing import Any

from feeler.studies.shipped import read_shipped


def load_measured() -> tuple[dict[str, dict[str, list[float]]], dict[str, Any]]:
    """Kept results, and when and with which seed they were made.

    By "profile/speed/code/variant/window" the accuracy, bits, share of places named right and
    spikes of a touch, a number for each set. NaN: there were fewer spikes than were to be kept.
    """
    found = read_shipped("spiking", "measured.json")
    return found["cells"], found["about"]
