"""The trivial baseline: where and when a tensor peaks, and nothing else."""

from typing import Annotated, Any

import numpy as np

from feeler.checked import checked
from feeler.dispersion.blocks import check_tensors
from feeler.tensors.labels import label_like


class PeakEncoder:
    """Position and time of a tensor's greatest entry, each as a fraction in [0, 1].

    A peak is known to its sample only, so a uniform dither of one sample is added: without it the
    copies of a trial would be identical and the classifier's within-class spread 0.

    Parameters
    ----------
    random_state
        Seed of the dither.
    """

    @checked
    def __init__(self, random_state: Annotated[int, "≥ 0"] = 0):
        self._rng = np.random.default_rng(random_state)

    def __call__(self, tensors: Any) -> Any:
        """(trial, 2, 1): position along the antenna, time."""
        array = check_tensors(tensors, least=1)
        _, n_sensors, n_samples = array.shape
        peak = np.unravel_index(
            array.reshape(len(array), -1).argmax(axis=1), (n_sensors, n_samples)
        )
        dither = self._rng.uniform(-0.5, 0.5, (len(array), 2))
        found = ((np.stack(peak, axis=1) + 0.5 + dither) / (n_sensors, n_samples))[:, :, None]
        return label_like(found, tensors, ("trial", "component", "time"), "peak")
