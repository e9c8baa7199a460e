"""feeler: insect-like tactile sensors, from mechanics to what they can tell apart.

An antenna is touched; a touch becomes a tensor; a tensor becomes a code; a code becomes an answer. Units are g, mm, ms
(so N, N·mm, MPa and m/s) and rad throughout.
"""

from importlib import import_module
from importlib.metadata import version

from feeler import presets
from feeler.antenna import Antenna
from feeler.experiment.bend import bend
from feeler.experiment.release import release
from feeler.experiment.touch import touch  # the verb takes the room's name here; the room stays importable
from feeler.touch.feature import Ball, Box, Outline, Triangle, Wall
from feeler.touch.trial import Trial

# Rooms and names that need more than NumPy, SciPy and xarray are loaded when first used.
_LAZY = {
    "ConvolutiveNMF": "feeler.encoding",
    "hit": "feeler.experiment.impulse",
    "load": "feeler.tensors.load",
    "save": "feeler.tensors.export",
    "load_antenna": "feeler.antenna.file",
    "save_antenna": "feeler.antenna.file",
    "calibration": None,
    "decoding": None,
    "dispersion": None,
    "encoding": None,
    "paper": None,
    "plotting": None,
    "response": None,
    "robot": None,
    "tensors": None,
    "tracking": None,
    "wall": None,
}

__all__ = [
    "Antenna",
    "Ball",
    "Box",
    "ConvolutiveNMF",
    "Outline",
    "Trial",
    "Triangle",
    "Wall",
    "bend",
    "presets",
    "release",
    "touch",
]


def __getattr__(name: str) -> object:
    if name == "__version__":
        return version("feeler")
    if name not in _LAZY:
        raise AttributeError(f"module 'feeler' has no attribute {name!r}; public names: {', '.join(__dir__())}")
    room = _LAZY[name]
    return getattr(import_module(room), name) if room else import_module(f"feeler.{name}")


def __dir__() -> list[str]:
    return sorted({*__all__, *_LAZY})
