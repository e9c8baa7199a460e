"""Response: measured quantities of a recorded motion. No simulator needed."""

from feeler.response.decay import DampedCosine, fit_damped_cosine
from feeler.response.free import FreeResponse, measure_free_response
from feeler.response.strain import compute_strain
from feeler.response.trace import (
    check_trace,
    measure_deflection_ratios,
)

__all__ = [
    "DampedCosine",
    "FreeResponse",
    "check_trace",
    "compute_strain",
    "fit_damped_cosine",
    "measure_deflection_ratios",
    "measure_free_response",
]
