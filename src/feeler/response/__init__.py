"""Response: measured quantities of a recorded motion. No simulator needed."""

from feeler.response.decay import DampedCosine, fit_damped_cosine
from feeler.response.free import FreeResponse, measure_free_response
from feeler.response.measures import (
    measure_bending_stiffness,
    measure_deflection_ratios,
    measure_restitution,
)
from feeler.response.trace import check_trace

__all__ = [
    "DampedCosine",
    "FreeResponse",
    "check_trace",
    "fit_damped_cosine",
    "measure_bending_stiffness",
    "measure_deflection_ratios",
    "measure_free_response",
    "measure_restitution",
]
