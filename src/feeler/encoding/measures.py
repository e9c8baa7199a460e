"""Measures of codes: sparseness, and the exact projection onto vectors of a given one; entropy of
bases and activations; location from the dominant component.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.stats import rankdata

from feeler.compiled import compiled, nested
from feeler.encoding.inputs import check_choice, check_sparseness
from feeler.errors import InvalidInput
from feeler.validation import Count, Seed, checked

# Hoyer's sparseness of a vector, and the projection.


@checked
def hoyer_sparseness(
    vectors: Annotated[np.ndarray, "... element"], axis: int = -1
) -> np.ndarray:
    """Sparseness s(h) = (√n − ‖h‖₁/‖h‖₂)/(√n − 1) of vectors.

    It is 0 where all entries are equal, and 1 where a single entry is not zero.

    Parameters
    ----------
    vectors : np.ndarray
        Any shape; n is the length along ``axis``.
    axis : int, default=-1
        The axis that the vectors lie along.

    Returns
    -------
    np.ndarray
        One number per vector, in [0, 1]; NaN for a vector of zeros, whose sparseness is undefined.

    References
    ----------
    Hoyer 2004, J. Mach. Learn. Res. 5:1457, eq. in section 3.1.
    """
    vectors = np.asarray(vectors, dtype=float)
    if not -vectors.ndim <= axis < vectors.ndim:
        raise InvalidInput(f"vectors of shape {vectors.shape} have no axis {axis}.")
    root = np.sqrt(vectors.shape[axis])
    if root <= 1:
        raise InvalidInput(
            f"Sparseness needs at least 2 entries per vector; got {vectors.shape} along axis"
            f" {axis}."
        )
    peak = np.max(np.abs(vectors), axis=axis, keepdims=True)
    # squares of very small entries would underflow
    scaled = np.abs(vectors) / np.where(peak > 0, peak, 1)
    largest, length = scaled.sum(axis=axis), np.sqrt((scaled**2).sum(axis=axis))
    undefined = length == 0
    sparseness = (root - largest / np.where(undefined, 1, length)) / (root - 1)
    return np.where(undefined, np.nan, sparseness)[()]


@checked
def project_to_sparseness(vector: np.ndarray, sparseness: float) -> np.ndarray:
    """The non-negative vector of exactly this sparseness that lies nearest to ``vector``.

    The nearest point keeps its own length free: with u the unit vector of the asked sparseness that
    maximises ⟨vector, u⟩, the result is max(0, ⟨vector, u⟩)·u, because the best u does not depend
    on the length. u is the soft threshold max(vector − λ, 0) scaled to unit length, with the one λ
    that gives ‖u‖₁ = √n − sparseness·(√n − 1).

    Parameters
    ----------
    vector : np.ndarray
        One vector of at least 2 entries.
    sparseness : float
        Hoyer sparseness, in [0, 1).

    Returns
    -------
    np.ndarray
        Of the same shape; all zeros where no vector of this sparseness points the same way as
        ``vector``.

    References
    ----------
    Hoyer 2004, J. Mach. Learn. Res. 5:1457 (projection operator); Thom, Rapp & Palm 2015, Int. J.
    Comput. Vis. 114:168 (the threshold form and its uniqueness).
    """
    vector = np.ascontiguousarray(vector, dtype=float)
    if vector.ndim != 1 or vector.size < 2:
        raise InvalidInput(
            f"The projection takes one vector of at least 2 entries; got shape {vector.shape}."
        )
    check_sparseness(sparseness)
    result = np.empty_like(vector)
    project_row(vector, l1_of_unit_vector(vector.size, sparseness), result)
    return result


def l1_of_unit_vector(size: int, sparseness: float) -> float:
    """‖u‖₁ of a vector u of unit length, ``size`` entries and this sparseness."""
    root = np.sqrt(size)
    return float(root - sparseness * (root - 1))


@compiled(fastmath={"reassoc", "contract"})  # sums in vector registers
def project_row(v, l1, out):
    """Write into ``out`` the point nearest to ``v`` among the h ≥ 0 with ‖h‖₁ = l1·‖h‖₂."""
    n = v.size
    if l1 * l1 >= n * (1 - 1e-12):  # sparseness 0: all entries equal
        total = 0.0
        for i in range(n):
            total += v[i]
        for i in range(n):
            out[i] = max(total, 0.0) / n
        return
    top = v[0]
    for i in range(1, n):
        top = max(top, v[i])
    ties = 0
    for i in range(n):
        out[i] = v[i] - top  # differences from the peak: exact where they matter
        ties += out[i] == 0.0
    if ties > l1 * l1:
        _rank_ties(out)
    threshold = _threshold(out, l1)
    zero = v.dtype.type(0)
    dot, square = zero, zero
    for i in range(n):
        w = max(out[i] - threshold, zero)
        out[i] = w
        dot += w * v[i]
        square += w * w
    scale = max(dot, zero) / square if square > zero else zero
    for i in range(n):
        out[i] *= scale


@nested
def _rank_ties(z):
    """Prefer the earlier of equal peaks, by a ramp of 1 in 10⁶.

    Too many equal peaks would leave the nearest point undefined.
    """
    low = 0.0
    for i in range(z.size):
        low = min(low, z[i])
    step = 1e-6 * (-low if low < 0.0 else 1.0) / z.size
    for i in range(z.size):
        z[i] -= step * i
    top = z[0]
    for i in range(1, z.size):
        top = max(top, z[i])
    for i in range(z.size):
        z[i] -= top


@nested(fastmath={"reassoc", "contract"})  # sums in vector registers
def _threshold(z, l1):
    """λ for which w = max(z − λ, 0) has ‖w‖₁ = l1·‖w‖₂. max(z) is 0.

    On a fixed set of k active entries with mean m and variance q, ‖w‖₁² = l1²‖w‖₂² gives m − λ =
    l1·√(q/(k − l1²)). Dropping the entries below λ and solving again (Hoyer's loop) only raises λ,
    and ends at the exact one.
    """
    number = z.dtype.type
    l1, zero, one = number(l1), number(0), number(1)
    threshold, active = number(-np.inf), number(z.size)
    total, square = zero, zero
    for i in range(z.size):
        total += z[i]
        square += z[i] * z[i]
    while True:
        mean = total / active
        # the peak is 0 and active, so that the spread is no small rest of a difference
        spread = max(square - total * mean, zero)
        threshold = max(threshold, mean - l1 * np.sqrt(spread / active / (active - l1 * l1)))
        left, total, square = zero, zero, zero
        for i in range(z.size):
            value = z[i] if z[i] > threshold else zero
            left += one if z[i] > threshold else zero
            total += value
            square += value * value
        if left == active or left <= l1 * l1:
            return threshold
        active = left


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
