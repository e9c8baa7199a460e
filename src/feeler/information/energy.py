"""Energies: the inner products of tensors, all that white noise lets one use of them."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Annotated

import numpy as np

from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.tensors.scaling import check_squares


@checked
def compute_energy(tensors: Annotated[np.ndarray, "trial ..."]) -> np.ndarray:
    """Inner products (trial, trial) of the tensors less their mean, in their unit squared.

    The mean is the same for all, so it tells nothing; without it nearly equal tensors keep their
    digits.

    Raises
    ------
    InvalidInput
        Fewer than two tensors, or values that are not finite.
    """
    flat = _flatten(tensors)
    check_squares(flat)
    flat = flat - flat.mean(axis=0)
    return flat @ flat.T


@checked
def compute_energies(
    tensors: Annotated[np.ndarray, "trial sensor time"], ends: Sequence[int], start: int = 0
) -> np.ndarray:
    """Energies (end, trial, trial) of the samples from ``start`` to each of ``ends``.

    Each window goes on where the one before ended, so that all of them cost hardly more than the
    longest.
    """
    tensors = np.asarray(tensors, dtype=float)
    check_squares(_flatten(tensors))
    edges = np.array([start, *ends])
    if edges.min() < 0 or np.any(np.diff(edges) < 0) or edges[-1] > tensors.shape[2]:
        raise InvalidInput(
            f"ends must rise from start={start} to at most {tensors.shape[2]} samples, got"
            f" {list(ends)}."
        )
    centred = tensors - tensors.mean(axis=0)
    parts = [centred[:, :, a:b].reshape(len(tensors), -1) for a, b in pairwise(edges)]
    return np.cumsum([part @ part.T for part in parts], axis=0)


@checked
def scale_peaks(tensors: Annotated[np.ndarray, "trial ..."]) -> np.ndarray:
    """Each tensor divided by its own peak, so that noise of sd σ is σ of each peak.

    So neither loudness nor the level of the noise says which touch it was. Noise whose level
    follows the peak of an unscaled tensor would betray it: over 20,000 entries a level can be told
    to half a per cent (``sd`` of one value per tensor in
    :func:`feeler.information.compute_information` shows how much).

    Raises
    ------
    InvalidInput
        A tensor that is zero everywhere.
    """
    tensors = np.asarray(tensors, dtype=float)
    if tensors.size == 0:
        raise InvalidInput(f"there are no tensors to scale: their shape is {tensors.shape}.")
    peak = np.abs(tensors).reshape(len(tensors), -1).max(axis=1)
    if np.any(peak == 0):
        raise InvalidInput(
            f"tensor {int(np.argmin(peak))} is zero everywhere and has no peak; leave it out."
        )
    return tensors / peak.reshape(-1, *[1] * (tensors.ndim - 1))


def _flatten(tensors: np.ndarray) -> np.ndarray:
    if np.size(tensors) == 0:
        raise InvalidInput("information needs at least two tensors of finite values, got none.")
    flat = np.asarray(tensors, dtype=float).reshape(len(tensors), -1)
    if len(flat) < 2 or not np.isfinite(flat).all():
        raise InvalidInput(
            f"information needs at least two tensors of finite values, got {len(flat)}."
        )
    return flat
