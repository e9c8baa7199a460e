"""feeler: insect-like tactile sensors, from mechanics to what they can tell apart.

Describe an antenna, touch it, and learn from its tactile tensors what it can tell apart.
Units are g, mm, ms (so N, N·mm, MPa and m/s) and rad throughout.
"""

import ast
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

# All that feeler offers, once. Nothing is loaded before it is used: the command line answers at
# once, and who only encodes need not wait for the physics.
if TYPE_CHECKING:
    from feeler import presets as presets
    from feeler.antenna.antenna import Antenna as Antenna
    from feeler.antenna.file import load_antenna as load_antenna
    from feeler.antenna.file import save_antenna as save_antenna
    from feeler.antenna.sample import sample_antennas as sample_antennas
    from feeler.draw import LogRange as LogRange
    from feeler.encoding.model import ConvolutiveNMF as ConvolutiveNMF
    from feeler.experiment.bend import bend as bend
    from feeler.experiment.impulse import hit as hit
    from feeler.experiment.release import release as release
    from feeler.experiment.touch import touch as touch
    from feeler.physics.lanes import Simulations as Simulations
    from feeler.physics.simulation import Simulation as Simulation
    from feeler.stimulus.base import BaseMotion as BaseMotion
    from feeler.stimulus.object import Object as Object
    from feeler.stimulus.outline import Outline as Outline
    from feeler.stimulus.sample import sample_trials as sample_trials
    from feeler.stimulus.shapes import Ball as Ball
    from feeler.stimulus.shapes import Box as Box
    from feeler.stimulus.shapes import Peg as Peg
    from feeler.stimulus.shapes import Triangle as Triangle
    from feeler.stimulus.trial import Trial as Trial
    from feeler.stimulus.wall import Wall as Wall
    from feeler.tensors.formats import load as load
    from feeler.tensors.formats import save as save


def _read_homes() -> dict[str, str]:
    """By public name, its module: what stands above for editors and type checkers."""
    tree = ast.parse(Path(__file__).read_text(encoding="utf-8"))
    imports = (node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom))
    own = (node for node in imports if (node.module or "").startswith("feeler"))
    return {alias.name: str(node.module) for node in own for alias in node.names}


_HOMES = _read_homes()
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
    "spikes",
    "stimulus",
    "studio",
    "tensors",
    "tracking",
    "wall",
)
_STUDIES = ("comparison", "paper", "tradeoff")

__all__ = sorted(_HOMES)


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
    globals()[name] = found = getattr(import_module(_HOMES[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted({*_HOMES, *_ROOMS, *_STUDIES})
