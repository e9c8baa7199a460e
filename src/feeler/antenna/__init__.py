"""What an antenna is: profiles, morphology, sensors, presets. No simulator in here."""

from feeler.antenna.modes import compute_base_response, compute_modes
from feeler.antenna.profiles import PROFILES, Constant, Exponential, Linear, Sigmoid, Tabulated
from feeler.antenna.segments import Antenna, make_even_sensors
from feeler.antenna.variants import SampledAntennas, sample_antennas

__all__ = [
    "PROFILES",
    "Antenna",
    "Constant",
    "Exponential",
    "Linear",
    "SampledAntennas",
    "Sigmoid",
    "Tabulated",
    "compute_base_response",
    "compute_modes",
    "make_even_sensors",
    "sample_antennas",
]

__dir__ = __all__.copy
