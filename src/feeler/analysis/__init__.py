"""Analyses of tensors: dispersion, information, responses. No simulator needed."""

from feeler.analysis.dispersion import (
    Closest,
    Dispersion,
    Interval,
    bootstrap_difference,
    bootstrap_mean,
    compute_dispersion,
    find_closest,
    search_closest,
)
from feeler.analysis.indices import (
    INDICES,
    Index,
    compute_mse,
    compute_nmi,
    compute_pearson,
    compute_ssim,
)
from feeler.analysis.information import (
    Information,
    Parameter,
    compute_bounds,
    compute_energies,
    compute_energy,
    compute_fisher,
    compute_information,
    compute_information_known_noise,
    differentiate_touches,
    find_noise,
    find_told,
    measure_information,
    scale_derivatives,
    scale_peaks,
)
from feeler.analysis.response import (
    DampedCosine,
    FreeResponse,
    check_trace,
    compute_strain,
    measure_deflection_ratios,
    measure_free_response,
)
from feeler.renamed import find_renamed
from feeler.tensors.transforms import scale_common

__all__ = [
    "INDICES",
    "Closest",
    "DampedCosine",
    "Dispersion",
    "FreeResponse",
    "Index",
    "Information",
    "Interval",
    "Parameter",
    "bootstrap_difference",
    "bootstrap_mean",
    "check_trace",
    "compute_bounds",
    "compute_dispersion",
    "compute_energies",
    "compute_energy",
    "compute_fisher",
    "compute_information",
    "compute_information_known_noise",
    "compute_mse",
    "compute_nmi",
    "compute_pearson",
    "compute_ssim",
    "compute_strain",
    "differentiate_touches",
    "find_closest",
    "find_noise",
    "find_told",
    "measure_deflection_ratios",
    "measure_free_response",
    "measure_information",
    "scale_common",
    "scale_derivatives",
    "scale_peaks",
    "search_closest",
]

__getattr__ = find_renamed(__name__)
__dir__ = __all__.copy
