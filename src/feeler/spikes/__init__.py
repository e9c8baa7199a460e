"""Spikes: from bending to what a nerve says. Sensilla, their trains, and who reads them."""

from feeler.spikes.sensilla import (
    CAMPANIFORM,
    HAIR,
    Population,
    Sensillum,
    find_gain,
    place_sensilla,
)
from feeler.spikes.trains import (
    POISSON,
    SPIKE_CODES,
    Firing,
    PoissonReader,
    SensillaStream,
    SpikeReader,
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


def __dir__() -> list[str]:
    return sorted(__all__)
