"""Example files, made by a surrogate robot and labelled so (``benchmarks/robot_examples.py``)."""

from importlib.resources import files
from pathlib import Path

from feeler.errors import InvalidInput

EXAMPLES = {
    "recording": "surrogate_ball_tip_fast.csv",
    "calibration": "surrogate_calibration_table.csv",
    "release": "surrogate_release.csv",
}


def get_example(name: str) -> Path:
    """Path of an example file.

    ``recording`` holds capacitance, ``calibration`` a bench table, ``release`` angles.
    """
    if name not in EXAMPLES:
        raise InvalidInput(f"unknown example {name!r}; valid: {', '.join(EXAMPLES)}.")
    return Path(str(files("feeler.robot") / "data" / EXAMPLES[name]))
