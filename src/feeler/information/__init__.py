"""Information: how much a noisy tensor tells about the touch. No simulator needed."""

from feeler.information.bits import (
    Information,
    compute_information,
    find_noise,
    measure_information,
)
from feeler.information.energy import compute_energies, compute_energy, scale_peaks
from feeler.information.fisher import compute_bounds, compute_fisher
from feeler.information.sensitivity import (
    PARAMETERS,
    Parameter,
    differentiate_touches,
    scale_derivatives,
)
from feeler.information.uneven import compute_told, find_told

__all__ = [
    "PARAMETERS",
    "Information",
    "Parameter",
    "compute_bounds",
    "compute_energies",
    "compute_energy",
    "compute_fisher",
    "compute_information",
    "compute_told",
    "differentiate_touches",
    "find_noise",
    "find_told",
    "measure_information",
    "scale_derivatives",
    "scale_peaks",
]
