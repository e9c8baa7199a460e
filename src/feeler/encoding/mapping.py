"""Do the bases map to contact location? How well location follows from the component that dominates
a code.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.stats import rankdata

from feeler.checked import checked
from feeler.errors import InvalidInput


@dataclass(frozen=True, kw_only=True)
class LocationMapping:
    """How contact location and dominant component hang together, against shuffled locations."""

    information: float
    """Mutual information between the dominant component and the location, bits."""
    information_null: float
    """Its mean over shuffles: what so few trials yield by chance, bits."""
    ceiling: float
    """The entropy of the locations or log₂(components), whichever is less: no code can do better,
    bits.
    """
    p_information: float
    """Share of shuffles, the real order counted as one, with at least this information."""
    correlation: float
    """Spearman's rank correlation of location with where along the antenna the active bases act, in
    [−1, 1].
    """
    p_correlation: float
    """Share of shuffles, the real order counted as one, with a correlation at least as far from 0.
    """
    share: np.ndarray
    """Mean share of each component in the energy of a code, (location, component)."""
    locations: np.ndarray
    """The locations, ascending."""


@checked
def map_locations(
    activations: Annotated[np.ndarray, "trial component time"],
    locations: Annotated[np.ndarray, "trial"],
    places: Annotated[np.ndarray, "component"],
    *,
    n_shuffles: int = 999,
    rng: np.random.Generator | int | None = 0,
) -> LocationMapping:
    """Score how contact location follows from which component is most active.

    A component's share of a trial is its energy Σ_t H² over that of all components (bases have unit
    length). Trials with a code of zeros are left out.

    Parameters
    ----------
    activations : (trial, component, time), codes on fixed bases; prefer the ridge code, which is
    unique. locations : (trial,), where each contact was, any unit.
    places : (component,), where each basis acts: `locate_components(components_)`.
    n_shuffles : how many shuffles of the locations make the null.
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
    real = _information(dominant, which), _correlation(centre, order)
    generator = np.random.default_rng(rng)
    shuffles = [generator.permutation(which.size) for _ in range(n_shuffles)]
    null = np.array(
        [
            (_information(dominant, which[shuffle]), _correlation(centre, order[shuffle]))
            for shuffle in shuffles
        ]
    ).reshape(n_shuffles, 2)
    entropy = _information(which, which)
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


def _information(first: np.ndarray, second: np.ndarray) -> float:
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
