"""Deciding: when to stop, and whether beliefs mean what they say."""

from typing import Annotated

import numpy as np
import xarray as xr

from feeler.checked import checked
from feeler.errors import InvalidInput


@checked
def decide(
    belief: Annotated[np.ndarray, "episode sample object"], threshold: float
) -> tuple[np.ndarray, np.ndarray]:
    """Sample at which the greatest belief first reaches a threshold (episode,), and the answer
    then.

    Who never is so sure answers with the last sample.
    """
    belief = np.asarray(belief, dtype=float)
    if not 0 < threshold <= 1:
        raise InvalidInput(f"threshold must be a probability in (0, 1], got {threshold}.")
    sure = belief.max(axis=2) >= threshold
    when = np.where(sure.any(axis=1), sure.argmax(axis=1), belief.shape[1] - 1)
    return when, belief[np.arange(len(belief)), when].argmax(axis=1)


@checked
def measure_calibration(
    belief: Annotated[np.ndarray, "answer object"],
    target: Annotated[np.ndarray, "answer"],
    n_bins: int = 10,
) -> xr.Dataset:
    """A reliability diagram: how often answers of each degree of sureness are right.

    Returns
    -------
    xarray.Dataset
        By bin of sureness (the greatest belief): ``sureness`` (mean), ``right`` (share), ``count``;
        attribute ``error``, the mean
        |right − sureness| over all answers (expected calibration error), and ``accuracy``.
    """
    belief, target = np.asarray(belief, dtype=float), np.asarray(target)
    if len(belief) != len(target) or not len(target) or n_bins < 1:
        raise InvalidInput(
            f"{len(belief)} beliefs need as many targets, at least one, got {len(target)}."
        )
    sure, right = belief.max(axis=1), belief.argmax(axis=1) == target
    place = np.minimum((sure * n_bins).astype(int), n_bins - 1)
    count = np.bincount(place, minlength=n_bins)
    with np.errstate(invalid="ignore"):
        mean = np.bincount(place, sure, n_bins) / count
        share = np.bincount(place, right, n_bins) / count
    error = float(np.nansum(count * np.abs(share - mean)) / len(target))
    data = {
        name: ("bin", values)
        for name, values in (("sureness", mean), ("right", share), ("count", count))
    }
    return xr.Dataset(data, attrs={"error": error, "accuracy": float(right.mean())})
