"""What an antenna is: profiles, morphology, sensors, presets. No simulator in here."""

from feeler.antenna.animals import SampledAntennas, sample_antennas
from feeler.antenna.profiles import PROFILES, Constant, Exponential, Linear, Sigmoid
from feeler.antenna.segments import (
    Antenna,
    compute_base_response,
    compute_modes,
    make_even_sensors,
)

__all__ = [
    "PROFILES",
    "Antenna",
    "Constant",
    "Exponential",
    "Linear",
    "SampledAntennas",
    "Sigmoid",
    "compute_base_response",
    "compute_modes",
    "make_even_sensors",
    "sample_antennas",
]

__dir__ = __all__.copy
