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
    from feeler.antenna.files import load_antenna as load_antenna
    from feeler.antenna.files import save_antenna as save_antenna
    from feeler.antenna.segments import Antenna as Antenna
    from feeler.antenna.variants import sample_antennas as sample_antennas
    from feeler.draw import LogRange as LogRange
    from feeler.encoding.model import ConvolutiveNMF as ConvolutiveNMF
    from feeler.experiments.mechanics import bend as bend
    from feeler.experiments.mechanics import hit as hit
    from feeler.experiments.mechanics import release as release
    from feeler.experiments.tactile import touch as touch
    from feeler.objects.bodies import Object as Object
    from feeler.objects.bodies import Wall as Wall
    from feeler.objects.motion import BaseMotion as BaseMotion
    from feeler.objects.outlines import Outline as Outline
    from feeler.objects.sampling import sample_trials as sample_trials
    from feeler.objects.shapes import Ball as Ball
    from feeler.objects.shapes import Box as Box
    from feeler.objects.shapes import Peg as Peg
    from feeler.objects.shapes import Triangle as Triangle
    from feeler.objects.trials import Trial as Trial
    from feeler.physics.simulation import Simulation as Simulation
    from feeler.physics.simulation import Simulations as Simulations
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
    "analysis",
    "antenna",
    "calibration",
    "comparison",
    "decoding",
    "design",
    "encoding",
    "execute",
    "experiments",
    "learn",
    "objects",
    "physics",
    "plotting",
    "presets",
    "report",
    "robot",
    "spikes",
    "studio",
    "tensors",
    "tracking",
    "tradeoff",
    "wall",
)

__all__ = sorted(_HOMES)


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("feeler")
    if name in (*_ROOMS, "paper"):  # the last until 0.5
        return import_module(f"feeler.{name}")
    if name not in _HOMES:
        raise AttributeError(
            f"module 'feeler' has no attribute {name!r}; public names: {', '.join(__dir__())}"
        )
    globals()[name] = found = getattr(import_module(_HOMES[name]), name)
    return found


def __dir__() -> list[str]:
    return sorted({*_HOMES, *_ROOMS})
