"""Measures of a fit: entropy of bases and activations, and location from the dominant component."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.stats import rankdata

from feeler.encoding.inputs import check_choice
from feeler.errors import InvalidInput
from feeler.validation import Count, Seed, checked

# Entropy of bases and activations, by two definitions that answer two questions.

# [D]: only 256 grey levels give numbers of the size that the paper reports (1.9 to 2.8 bits)
_LEVELS = 256


@checked
def compute_histogram_entropy(
    values: np.ndarray, *, levels: Count = _LEVELS, scale: str = "max"
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


# How well contact location follows from the component that dominates a code.


@dataclass(frozen=True, kw_only=True)
class LocationMapping:
    """How contact location and dominant component hang together, against shuffled locations.

    Attributes
    ----------
    information : float
        Mutual information between the dominant component and the location [bit].
    information_null : float
        Its mean over shuffles [bit]: what so few trials yield by chance.
    ceiling : float
        Least of the locations' entropy and log₂(components) [bit]; no code can exceed it.
    p_information : float
        Share of shuffles, the real order counted as one, with at least this information.
    correlation : float
        Spearman's correlation of location with where the active bases act, in [−1, 1].
    p_correlation : float
        Share of shuffles, the real order counted as one, with at least this |correlation|.
    share : np.ndarray
        Mean share of each component in the energy of a code, (location, component).
    locations : np.ndarray
        The locations, ascending.
    """

    information: float
    information_null: float
    ceiling: float
    p_information: float
    correlation: float
    p_correlation: float
    share: np.ndarray
    locations: np.ndarray


@checked
def map_locations(
    activations: Annotated[np.ndarray, "trial component time"],
    locations: Annotated[np.ndarray, "trial"],
    places: Annotated[np.ndarray, "component"],
    *,
    n_shuffles: int = 999,
    rng: np.random.Generator | Seed | None = 0,
) -> LocationMapping:
    """Score how contact location follows from which component is most active.

    A component's share of a trial is its energy Σ_t H² over that of all components (bases have unit
    length). Trials with a code of zeros are left out.

    Parameters
    ----------
    activations : np.ndarray
        Codes (trial, component, time) on fixed bases; prefer the ridge code, which is unique.
    locations : np.ndarray
        Where each contact was (trial,), any unit.
    places : np.ndarray
        Where each basis acts (component,), from :func:`locate_components`.
    n_shuffles : int, default=999
        Shuffles of the locations that make the null.
    rng : np.random.Generator, int or None, default=0
        Generator or seed of the shuffles.
    """
    energy = np.square(np.asarray(activations, dtype=float)).sum(axis=2)
    locations, places = np.asarray(locations), np.asarray(places, dtype=float)
    if len(locations) != len(energy) or places.shape != energy.shape[1:]:
        raise InvalidInput(
            f"Got {len(energy)} codes of {energy.shape[1]} components, {len(locations)} locations"
            f" and {places.size} places of bases; each code needs one location, each component one"
            " place."
        )
    active = energy.sum(axis=1) > 0
    energy, locations = energy[active], locations[active]
    names, which = np.unique(locations, return_inverse=True)
    if len(names) < 2:
        raise InvalidInput("A map of locations needs active codes at two locations at least.")
    share = energy / energy.sum(axis=1, keepdims=True)
    dominant, centre = share.argmax(axis=1), rankdata(share @ places)
    order = rankdata(which)
    real = _compute_information(dominant, which), _correlation(centre, order)
    generator = np.random.default_rng(rng)
    shuffles = [generator.permutation(which.size) for _ in range(n_shuffles)]
    null = np.array(
        [
            (
                _compute_information(dominant, which[shuffle]),
                _correlation(centre, order[shuffle]),
            )
            for shuffle in shuffles
        ]
    ).reshape(n_shuffles, 2)
    entropy = _compute_information(which, which)
    return LocationMapping(
        information=real[0],
        information_null=float(null[:, 0].mean()) if n_shuffles else float("nan"),
        ceiling=min(entropy, float(np.log2(len(places)))),
        p_information=float((1 + (null[:, 0] >= real[0] - 1e-12).sum()) / (1 + n_shuffles)),
        correlation=real[1],
        p_correlation=float(
            (1 + (np.abs(null[:, 1]) >= abs(real[1]) - 1e-12).sum()) / (1 + n_shuffles)
        ),
        share=np.array([share[which == i].mean(axis=0) for i in range(len(names))]),
        locations=names,
    )


def _compute_information(first: np.ndarray, second: np.ndarray) -> float:
    """Mutual information of two labellings, bits."""
    joint = np.zeros((first.max() + 1, second.max() + 1))
    np.add.at(joint, (first, second), 1 / len(first))
    independent = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    held = joint > 0
    return float((joint[held] * np.log2(joint[held] / independent[held])).sum())


def _correlation(ranks: np.ndarray, other: np.ndarray) -> float:
    """Spearman's correlation of two rankings; 0 where one does not vary."""
    spread = ranks.std() * other.std()
    return (
        float(np.mean((ranks - ranks.mean()) * (other - other.mean())) / spread)
        if spread > 0
        else 0.0
    )
