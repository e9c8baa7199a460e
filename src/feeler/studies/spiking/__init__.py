"""Spikes: what the trains of an antenna's sensilla tell, as declared.toml says."""

from feeler.studies.spiking.measured import load_measured
from feeler.studies.spiking.study import SpikeStudy, Variant, load_spiking

__all__ = ["SpikeStudy", "Variant", "load_measured", "load_spiking"]
