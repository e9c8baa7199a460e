"""feeler: insect-like tactile sensors, from mechanics to what they can tell apart.

An antenna is touched; a touch becomes a tensor; a tensor becomes a code; a code becomes an answer.
Units are g, mm, ms (so N, N·mm, MPa and m/s) and rad throughout.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from feeler import presets
    from feeler.antenna.antenna import Antenna
    from feeler.antenna.file import load_antenna, save_antenna
    from feeler.antenna.sample import sample_antennas
    from feeler.draw import LogRange
    from feeler.encoding.model import ConvolutiveNMF
    from feeler.experiment.bend import bend
    from feeler.experiment.impulse import hit
    from feeler.experiment.release import release
    from feeler.experiment.touch import touch
    from feeler.physics.lanes import Simulations
    from feeler.physics.simulation import Simulation
    from feeler.stimulus.base import BaseMotion
    from feeler.stimulus.object import Object
    from feeler.stimulus.outline import Outline
    from feeler.stimulus.sample import sample_trials
    from feeler.stimulus.shapes import Ball, Box, Triangle
    from feeler.stimulus.trial import Trial
    from feeler.stimulus.wall import Wall
    from feeler.tensors.formats import load, save

# Where each name lives. Nothing is loaded before it is used: the command line answers at once, and
# who only encodes need not wait for the physics.
_HOMES = {
    "Antenna": "antenna.antenna",
    "Ball": "stimulus.shapes",
    "BaseMotion": "stimulus.base",
    "Box": "stimulus.shapes",
    "ConvolutiveNMF": "encoding.model",
    "LogRange": "draw",
    "Object": "stimulus.object",
    "Outline": "stimulus.outline",
    "Simulation": "physics.simulation",
    "Simulations": "physics.lanes",
    "Trial": "stimulus.trial",
    "Triangle": "stimulus.shapes",
    "Wall": "stimulus.wall",
    "bend": "experiment.bend",
    "hit": "experiment.impulse",
    "load": "tensors.formats",
    "load_antenna": "antenna.file",
    "release": "experiment.release",
    "sample_antennas": "antenna.sample",
    "sample_trials": "stimulus.sample",
    "save": "tensors.formats",
    "save_antenna": "antenna.file",
    "touch": "experiment.touch",
}
_ROOMS = (
    "active",
    "antenna",
    "calibration",
    "decoding",
    "design",
    "dispersion",
    "encoding",
    "execute",
    "experiment",
    "information",
    "learn",
    "physics",
    "plotting",
    "presets",
    "report",
    "response",
    "robot",
    "stimulus",
    "studio",
    "tensors",
    "tracking",
    "wall",
)
_STUDIES = ("comparison", "paper", "tradeoff")

__all__ = [
    "Antenna",
    "Ball",
    "BaseMotion",
    "Box",
    "ConvolutiveNMF",
    "LogRange",
    "Object",
    "Outline",
    "Simulation",
    "Simulations",
    "Trial",
    "Triangle",
    "Wall",
    "bend",
    "hit",
    "load",
    "load_antenna",
    "presets",
    "release",
    "sample_antennas",
    "sample_trials",
    "save",
    "save_antenna",
    "touch",
]


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("feeler")
    if name in _ROOMS:
        return import_module(f"feeler.{name}")
    if name in _STUDIES:
        return import_module(f"feeler.studies.{name}")
    if name not in _HOMES:
        raise AttributeError(
            f"module 'feeler' has no attribute {name!r}; public names: {', '.join(__dir__())}"
        )
    globals()[name] = found = getattr(import_module(f"feeler.{_HOMES[name]}"), name)
    return found


def __dir__() -> list[str]:
    return sorted({*_HOMES, *_ROOMS, *_STUDIES})
