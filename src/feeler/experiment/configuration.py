"""What a result must carry so that anyone can make it again: antenna, trials, clock, contact, engine, versions, seed."""

import hashlib
import json
import platform
from dataclasses import asdict, fields
from functools import cache
from importlib.metadata import version

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.physics.clock import Clock
from feeler.physics.scene import Contact
from feeler.touch.trial import Trial

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
    feature = {name: _plain(getattr(trial.feature, name)) for name in (f.name for f in fields(trial.feature))}
    plain = {field.name: getattr(trial, field.name) for field in fields(trial) if field.name != "feature"}
    return {"feature": {"kind": trial.feature.kind, **feature}, **plain}


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


def digest(configuration: object) -> str:
    """A short fingerprint of plain data; equal data, equal fingerprint."""
    return hashlib.sha256(json.dumps(configuration, sort_keys=True).encode()).hexdigest()[:16]


def _plain(value: object) -> object:
    return value.tolist() if isinstance(value, np.ndarray) else value
