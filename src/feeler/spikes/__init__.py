"""Spikes: from bending to what a nerve says. Sensilla, their trains, and who reads them."""

from feeler.renamed import find_renamed
from feeler.spikes.recordings import (
    SensillumFit,
    compare_trains,
    compute_psth,
    cut_trains,
    fit_sensillum,
    measure_trains,
    measure_van_rossum,
    read_onsets,
    read_trains,
)
from feeler.spikes.sensilla import (
    CAMPANIFORM,
    HAIR,
    Population,
    Sensillum,
    find_gain,
    place_sensilla,
)
from feeler.spikes.trains import (
    SPIKE_CODES,
    Firing,
    PoissonObserver,
    SpikeClassifier,
    attach_trains,
    count_spikes,
    draw_spikes,
    thin_spikes,
)

__all__ = [
    "CAMPANIFORM",
    "HAIR",
    "SPIKE_CODES",
    "Firing",
    "PoissonObserver",
    "Population",
    "Sensillum",
    "SensillumFit",
    "SpikeClassifier",
    "attach_trains",
    "compare_trains",
    "compute_psth",
    "count_spikes",
    "cut_trains",
    "draw_spikes",
    "find_gain",
    "fit_sensillum",
    "measure_trains",
    "measure_van_rossum",
    "place_sensilla",
    "read_onsets",
    "read_trains",
    "thin_spikes",
]


__getattr__ = find_renamed(__name__)
__dir__ = __all__.copy
