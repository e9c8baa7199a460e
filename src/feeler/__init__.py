"""feeler: insect-like tactile sensors, from mechanics to what they can discriminate.

Describe an antenna, touch it, and learn from its tactile tensors what it can discriminate.
Units are g, mm, ms (so N, N·mm, MPa and m/s) and rad throughout.
"""

from importlib import import_module

from feeler import renamed as _renamed  # old names, with a warning

# Nothing is loaded before it is used: the command line answers at once, and who only encodes need
# not wait for the physics. Editors and type checkers read the same names in __init__.pyi.
_HOMES = {
    "Antenna": "feeler.antenna.segments",
    "Ball": "feeler.objects.shapes",
    "BaseMotion": "feeler.objects.motion",
    "Body": "feeler.physics.body",
    "Box": "feeler.objects.shapes",
    "ConvolutiveNMF": "feeler.encoding.model",
    "LogRange": "feeler.draw",
    "Mesh": "feeler.objects.meshes",
    "Object": "feeler.objects.bodies",
    "Outline": "feeler.objects.outlines",
    "Peg": "feeler.objects.shapes",
    "Simulation": "feeler.physics.simulation",
    "Simulations": "feeler.physics.simulation",
    "Trial": "feeler.objects.trials",
    "Triangle": "feeler.objects.shapes",
    "Wall": "feeler.objects.bodies",
    "bend": "feeler.experiments.mechanics",
    "hit": "feeler.experiments.mechanics",
    "load": "feeler.tensors.formats",
    "load_antenna": "feeler.antenna.files",
    "release": "feeler.experiments.mechanics",
    "sample_antennas": "feeler.antenna.animals",
    "sample_trials": "feeler.objects.task",
    "save": "feeler.tensors.formats",
    "save_antenna": "feeler.antenna.files",
    "touch": "feeler.experiments.tactile",
}
_PACKAGES = (
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

__all__ = sorted([*_HOMES, "presets"])


def __getattr__(name: str) -> object:
    if name == "__version__":
        from importlib.metadata import version

        return version("feeler")
    if name in _HOMES:
        globals()[name] = found = getattr(import_module(_HOMES[name]), name)
        return found
    if name in (*_PACKAGES, *_renamed.PACKAGES):
        return import_module(f"feeler.{name}")
    raise AttributeError(
        f"module 'feeler' has no attribute {name!r}; public names: {', '.join(__dir__())}"
    )


def __dir__() -> list[str]:
    return sorted({*_HOMES, *_PACKAGES})
