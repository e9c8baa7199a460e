"""What a result must carry so that anyone can make it again: antenna, trials, clock, contact, engine, code, seed."""

import hashlib
import json
import platform
import time
from dataclasses import asdict, fields
from functools import cache
from importlib.metadata import version
from pathlib import Path

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.errors import StoreError
from feeler.physics.clock import Clock
from feeler.physics.scene import Contact
from feeler.stimulus.trial import Trial

SOURCE = Path(__file__).parents[1]
CODE = ("antenna", "stimulus", "physics", "experiment", "tensors/dataset.py")  # what can change a simulated number
_LOADED = time.time()  # s; a file changed later is not the code that runs
LICENCE = "CC0-1.0"  # of data made by simulation; change it in the file's attributes if yours is another


@cache
def list_versions() -> dict[str, str]:
    """Versions of Python and of every package that can change a number."""
    packages = ("feeler", "mujoco", "numpy", "scipy", "numba", "xarray", "scikit-learn")
    return {"python": platform.python_version(), **{name: version(name) for name in packages}}


def describe_antenna(antenna: Antenna) -> dict[str, object]:
    """The antenna as plain data, exact."""
    return {field.name: _plain(getattr(antenna, field.name)) for field in fields(antenna)}


def describe_trial(trial: Trial) -> dict[str, object]:
    """The trial as plain data."""
    plain = {field.name: getattr(trial, field.name) for field in fields(trial) if field.name != "feature"}
    return {"feature": trial.feature.to_plain(), **plain}


def describe_run(antenna: Antenna, trials: list[Trial], clock: Clock, contact: Contact, engine: str, seed: int) -> dict:
    """The complete resolved configuration of a set of touches."""
    return {
        "antenna": describe_antenna(antenna),
        "trials": [describe_trial(trial) for trial in trials],
        "clock": asdict(clock),
        "contact": asdict(contact),
        "engine": engine,
        "seed": seed,
        "units": "g, mm, ms",
    }


def list_source(room: str) -> list[Path]:
    """The Python and data files of a room, or the one file, in a fixed order."""
    path = SOURCE / room
    return [path] if path.is_file() else sorted(p for p in path.rglob("*") if p.suffix in (".py", ".toml", ".csv"))


def hash_files(files: list[Path]) -> str:
    """Fingerprint of source files: their places in the package and their bytes."""
    text = b"".join(str(path.relative_to(SOURCE)).encode() + path.read_bytes() for path in files)
    return hashlib.sha256(text).hexdigest()[:16]


def describe_code() -> dict[str, str]:
    """Fingerprints of the code that simulates, by room: they tell apart what one version number does not.

    Raises
    ------
    StoreError
        A file was changed after Python had loaded it, so that the code on disk is not the code that runs.
    """
    for path in (path for room in CODE for path in list_source(room)):
        if _LOADED < path.stat().st_mtime <= time.time():
            raise StoreError(
                f"feeler's own code changed while it was running ({path.relative_to(SOURCE)}): results would be "
                "stored as those of code that did not make them. Start Python again and repeat the command."
            )
    return {room: hash_files(list_source(room)) for room in CODE}


def digest(configuration: object) -> str:
    """A short fingerprint of plain data; equal data, equal fingerprint."""
    return hashlib.sha256(json.dumps(configuration, sort_keys=True).encode()).hexdigest()[:16]


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value
