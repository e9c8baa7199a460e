"""Entropy of bases and activations, by two definitions that answer two questions."""

from typing import Annotated

import numpy as np

from feeler.encoding.inputs import check_choice
from feeler.errors import InvalidInput
from feeler.records.checked import checked

# [D]: only 256 grey levels give numbers of the size that the paper reports (1.9 to 2.8 bits)
_LEVELS = 256


@checked
def compute_histogram_entropy(
    values: np.ndarray, *, levels: Annotated[int, "> 0"] = _LEVELS, scale: str = "max"
) -> float:
    """Entropy [bit] of the grey levels of an array taken as a picture.

    −Σ p log₂ p over the histogram says how many values occur, however they are arranged: 0 for a
    flat picture, log₂(levels) at most. It depends on the scaling.

    Parameters
    ----------
    values : np.ndarray
        One basis or activation vector of any shape, ≥ 0.
    levels : int, default=256
        Grey levels; 256 is MATLAB's ``entropy`` of a picture.
    scale : {"max", "none"}, default="max"
        ``max`` stretches the largest entry to the top level. ``none`` takes 1 as the top level and
        clips above, as MATLAB does with a picture of doubles.
    """
    values = _check(values)
    check_choice("scale", scale, ("max", "none"))
    top = values.max() if scale == "max" else 1.0
    if top > 0:
        values = values / top
    grey = np.floor(np.minimum(values, 1) * (levels - 1) + 0.5).astype(int)
    return _entropy(np.bincount(grey.ravel(), minlength=levels).astype(float))


@checked
def compute_mass_entropy(values: np.ndarray) -> float:
    """Entropy [bit] of an array taken as a distribution of mass over its entries.

    −Σ p log₂ p with p = v/Σv says how many entries share the mass: 0 where one holds it all,
    log₂(size) where all hold the same. Scaling changes nothing. NaN for an array of zeros.

    Parameters
    ----------
    values : np.ndarray
        One basis or activation vector of any shape, ≥ 0.
    """
    values = _check(values)
    return _entropy(values.ravel()) if values.max() > 0 else float("nan")


@checked
def compute_entropies(
    arrays: Annotated[np.ndarray, "... array element"], definition: str = "histogram"
) -> np.ndarray:
    """Entropy of each array along the first axis (array,) [bit].

    Parameters
    ----------
    arrays : np.ndarray
        (array, …), ≥ 0.
    definition : {"histogram", "mass"}, default="histogram"
        :func:`compute_histogram_entropy` or :func:`compute_mass_entropy`.
    """
    definitions = {"histogram": compute_histogram_entropy, "mass": compute_mass_entropy}
    check_choice("definition", definition, tuple(definitions))
    return np.array([definitions[definition](array) for array in arrays])


def _check(values: np.ndarray) -> np.ndarray:
    values = np.asarray(values, dtype=float)
    if values.size == 0:
        raise InvalidInput("The entropy of an empty array is undefined.")
    if not (np.isfinite(values).all() and (values >= 0).all()):
        raise InvalidInput(
            "Entropy is defined here for finite, non-negative entries, as bases and activations"
            " have."
        )
    return values


def _entropy(weights: np.ndarray) -> float:
    share = weights[weights > 0] / weights.sum()
    share = share[share > 0]  # a weight far below the sum may vanish in the division
    return float(max(-(share * np.log2(share)).sum(), 0.0))
