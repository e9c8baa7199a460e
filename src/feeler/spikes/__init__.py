"""Spikes: from bending to what a nerve says. Sensilla, their trains, and who reads them."""

from feeler.spikes.population import Population, find_gain, place_sensilla
from feeler.spikes.readers import SPIKE_CODES, PoissonReader, SpikeReader
from feeler.spikes.sensillum import CAMPANIFORM, HAIR, Sensillum
from feeler.spikes.stream import SensillaStream
from feeler.spikes.train import (
    POISSON,
    Firing,
    attach_trains,
    count_spikes,
    draw_spikes,
    thin_spikes,
)

__all__ = [
    "CAMPANIFORM",
    "HAIR",
    "POISSON",
    "SPIKE_CODES",
    "Firing",
    "PoissonReader",
    "Population",
    "SensillaStream",
    "Sensillum",
    "SpikeReader",
    "attach_trains",
    "count_spikes",
    "draw_spikes",
    "find_gain",
    "place_sensilla",
    "thin_spikes",
]
