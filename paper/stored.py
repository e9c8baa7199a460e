"""Results that take long to make, stored with the paper's sections, which read them."""

from typing import Any

from feeler.studies.shipped import read_shipped


def load_stored(name: str) -> tuple[Any, str]:
    """What the file of this name holds, and a sentence that says so."""
    held = read_shipped("paper", name)
    about = held["about"]
    said = (
        f"Stored results, made on {about['date']} with seed {about['seed']};"
        " benchmarks/questions.py makes them anew."
    )
    return held["found"], said
