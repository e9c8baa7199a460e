"""The data contract: tactile tensors (trial, sensor, time) with units, labels and their whole
configuration.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from feeler.renamed import find_renamed

if TYPE_CHECKING:
    from feeler.tensors.schema import (
        QUANTITIES,
        Quantity,
        find_errors,
        make_tensors,
        validate,
    )
    from feeler.tensors.transforms import (
        fold_signs,
        in_unit,
        measure_peak,
        mirror_to_left,
        rectify,
        scale_common,
    )

# imported when first asked for: whoever reads a file in a process of its own needs none of it
_HOMES = {
    "QUANTITIES": "schema",
    "Quantity": "schema",
    "find_errors": "schema",
    "fold_signs": "transforms",
    "in_unit": "transforms",
    "make_tensors": "schema",
    "measure_peak": "transforms",
    "mirror_to_left": "transforms",
    "rectify": "transforms",
    "scale_common": "transforms",
    "validate": "schema",
}

__all__ = [
    "QUANTITIES",
    "Quantity",
    "find_errors",
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
        return find_renamed(__name__)(name)
    return getattr(import_module(f"{__name__}.{_HOMES[name]}"), name)


__dir__ = __all__.copy
