"""The data contract: tactile tensors (trial, sensor, time) with units, labels and their whole
configuration.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from feeler.tensors.contract import find_breaches, validate
    from feeler.tensors.dataset import make_tensors
    from feeler.tensors.quantities import QUANTITIES, Quantity
    from feeler.tensors.scaling import fold_signs, rectify, scale_common
    from feeler.tensors.sides import measure_peak, mirror_to_left
    from feeler.tensors.unit import in_unit

# imported when first asked for: whoever reads a file in a process of its own needs none of it
_HOMES = {
    "QUANTITIES": "quantities",
    "Quantity": "quantities",
    "find_breaches": "contract",
    "fold_signs": "scaling",
    "in_unit": "unit",
    "make_tensors": "dataset",
    "measure_peak": "sides",
    "mirror_to_left": "sides",
    "rectify": "scaling",
    "scale_common": "scaling",
    "validate": "contract",
}

__all__ = [
    "QUANTITIES",
    "Quantity",
    "find_breaches",
    "fold_signs",
    "in_unit",
    "make_tensors",
    "measure_peak",
    "mirror_to_left",
    "rectify",
    "scale_common",
    "validate",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)
