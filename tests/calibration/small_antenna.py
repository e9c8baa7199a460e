"""A small antenna on which a whole calibration takes a second."""

import numpy as np

from feeler.antenna import Antenna

N = 12


def make_small(stiffness: float = 1.0, damping: float = 1.0) -> Antenna:
    """Twelve segments whose hinges fall off exponentially; rings at about 20 Hz."""
    index = np.arange(N)
    return Antenna(
        segment_length=np.full(N, 3.5),
        segment_mass=2.0e-3 * np.exp(-0.25 * index) / np.exp(-0.25 * index).sum(),
        radius=0.225,
        stiffness=stiffness * 0.8 * np.exp(-0.55 * index),
        damping=damping * 1.2 * np.exp(-0.45 * index),
        name="small",
    )
