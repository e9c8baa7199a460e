"""The bases: their multiplicative updates, their order and scale, and how alike two sets are."""

from itertools import combinations
from typing import Annotated

import numpy as np
from scipy.optimize import linear_sum_assignment

from feeler.compiled import compiled
from feeler.errors import InvalidInput
from feeler.records.checked import checked

Bases = Annotated[np.ndarray, "component sensor lag"]
_Others = Annotated[
    np.ndarray, "partner sensor shift"
]  # as many sensors, but other bases and lags
# scikit-learn's NMF puts it in place of a vanishing denominator
_TINY = float(np.finfo(np.float32).eps)


def multiply_bases(
    components: np.ndarray, seen: np.ndarray, gram: np.ndarray, n_sweeps: int
) -> tuple[np.ndarray, float, float]:
    """Multiplicative updates W ← W·B/(W C), of which none raises the loss (Lee & Seung 2001).

    Parameters
    ----------
    components : np.ndarray
        Bases W (component, sensor, lag).
    seen : np.ndarray
        B, the data correlated with the activations (component, sensor, lag).
    gram : np.ndarray
        C, the activations correlated with each other (component, lag, component, lag).
    n_sweeps : int
        Number of updates.

    Returns
    -------
    components : np.ndarray
        The new bases.
    shared, square : float
        ⟨B, W⟩ and ⟨W, W C⟩, of which the loss ½‖V‖² − ⟨B, W⟩ + ½⟨W, W C⟩ consists.
    """
    n_components, n_sensors, n_lags = components.shape
    size = n_components * n_lags
    flat = components.transpose(1, 0, 2).reshape(n_sensors, size)
    # the Fourier transform leaves −1e-16
    target = np.maximum(seen, 0).transpose(1, 0, 2).reshape(n_sensors, size)
    square = gram.reshape(size, size)
    pulled = flat @ square
    for _ in range(n_sweeps):
        flat = flat / np.where(pulled == 0, _TINY, pulled) * target  # this order: no overflow
        # numbers that fade for ever end up slowing the processor
        flat[flat < 1e-50 * flat.max()] = 0
        pulled = flat @ square
    bases = np.ascontiguousarray(
        flat.reshape(n_sensors, n_components, n_lags).transpose(1, 0, 2)
    )
    return bases, float(np.vdot(target, flat)), float(np.vdot(flat, pulled))


def descend_bases(
    components: np.ndarray, seen: np.ndarray, gram: np.ndarray, n_sweeps: int
) -> tuple[np.ndarray, float, float]:
    """Each entry of the bases in turn to where the loss is lowest, the others held.

    An entry that was zero can come back, which no multiplication can do. Parameters and returns are
    those of :func:`multiply_bases`.

    References
    ----------
    Cichocki & Phan 2009, IEICE Trans. Fundam. E92-A:708 (HALS).
    """
    n_components, n_sensors, n_lags = components.shape
    size = n_components * n_lags
    flat = components.transpose(1, 0, 2).reshape(n_sensors, size)
    target = seen.transpose(1, 0, 2).reshape(n_sensors, size)
    square = gram.reshape(size, size)
    flat = np.ascontiguousarray(flat)
    _descend_entries(flat, np.ascontiguousarray(target), square, n_sweeps)
    bases = np.ascontiguousarray(
        flat.reshape(n_sensors, n_components, n_lags).transpose(1, 0, 2)
    )
    return bases, float(np.vdot(target, flat)), float(np.vdot(flat, flat @ square))


@compiled(fastmath={"reassoc", "contract"})  # sums in vector registers
def _descend_entries(rows, target, square, n_sweeps):
    """Lower ½ w·C w − b·w for each row w ≥ 0 and b of ``target``, entry by entry, in place."""
    for n in range(rows.shape[0]):
        row, wanted = rows[n], target[n]
        for _ in range(n_sweeps):
            for i in range(row.size):
                if square[i, i] > 0.0:
                    pulled = 0.0
                    for j in range(row.size):
                        pulled += square[i, j] * row[j]
                    row[i] = max(row[i] + (wanted[i] - pulled) / square[i, i], 0.0)


@checked
def locate_components(components: Bases) -> np.ndarray:
    """Where along the antenna each basis acts.

    Parameters
    ----------
    components : np.ndarray
        Bases (component, sensor, lag).

    Returns
    -------
    np.ndarray
        Centre of mass over sensors (component,), 0 at the first sensor and 1 at the last; 1 for a
        basis of zeros.
    """
    profile = components.sum(axis=2)
    mass = profile.sum(axis=1)
    place = np.linspace(0, 1, components.shape[1])
    return np.where(mass > 0, profile @ place / np.where(mass > 0, mass, 1), 1.0)


def canonicalise(
    components: np.ndarray, activations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Order the components from base to tip and give each basis unit length.

    The activations take over the lengths, so that the reconstruction stays the same.
    """
    order, length = _find_canon(components)
    return components[order] / length[:, None, None], activations[:, order] * length[:, None]


def canonicalise_sums(
    components: np.ndarray, seen: np.ndarray, gram: np.ndarray
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """The same with the sums over activations that :func:`.learn_batch` goes on from: the data
    correlated with them (component, sensor, lag), and with each other (component, lag, component,
    lag).
    """
    order, length = _find_canon(components)
    seen = seen[order] * length[:, None, None]
    gram = gram[order][:, :, order] * length[:, None, None, None] * length[:, None]
    return components[order] / length[:, None, None], (seen, gram)


def _find_canon(components: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Order from base to tip, and the length of each basis in that order; 1 for one of zeros."""
    order = np.argsort(locate_components(components), kind="stable")
    length = np.sqrt((components[order] ** 2).sum(axis=(1, 2)))
    return order, np.where(length > 0, length, 1.0)


@checked
def compute_basis_similarity(
    first: Bases, second: _Others, *, shift: bool = True
) -> np.ndarray:
    """Greatest cosine over all shifts between each basis of one set and each of another.

    Parameters
    ----------
    first, second : np.ndarray
        Bases (component, sensor, lag); the numbers of components and lags may differ.
    shift : bool, default=True
        False: the cosine at the lags where both stand.

    Returns
    -------
    np.ndarray
        (component of first, component of second), in [0, 1]: 1 for the same basis, however it is
        scaled or, with ``shift``, shifted within the lags.
    """
    length = first.shape[2] + second.shape[2]
    spectra = [np.fft.rfft(_to_unit(bases), length) for bases in (first, second)]
    overlap = np.einsum("asf,bsf->abf", spectra[0], spectra[1].conj())
    cosines = np.fft.irfft(overlap, length)
    return np.clip(cosines.max(axis=2) if shift else cosines[:, :, 0], 0, 1)


@checked
def match_components(
    first: Bases, second: _Others, *, shift: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Pair the bases of two sets so that their similarities have the greatest sum.

    Parameters
    ----------
    first, second : np.ndarray
        Bases (component, sensor, lag).
    shift : bool, default=True
        Whether a basis counts as the same where it is shifted within the lags.

    Returns
    -------
    order : np.ndarray
        For each basis of ``first``, the number of its partner in ``second``.
    similarity : np.ndarray
        The cosine of each pair, see :func:`compute_basis_similarity`.
    """
    similarity = compute_basis_similarity(first, second, shift=shift)
    if not np.isfinite(similarity).all():
        raise InvalidInput(
            "bases with NaN, or with numbers that are too large, have no partners."
        )
    rows, order = linear_sum_assignment(-similarity)
    return order, similarity[rows, order]


@checked
def compute_stability(restarts: list[Bases], *, shift: bool = True) -> float:
    """How alike the bases of several restarts are.

    Random non-negative bases already score far above 0, so compare scores between numbers of
    components rather than read one by itself.

    Parameters
    ----------
    restarts : list of np.ndarray
        Bases (component, sensor, lag) of each restart.
    shift : bool, default=True
        Whether a basis counts as the same where it is shifted within the lags. A basis that begins
        in the middle of its pattern then looks like one that holds all of it, so compare both.

    Returns
    -------
    float
        Mean cosine of matched bases over all pairs of restarts, in [0, 1]; NaN for one restart.
    """
    pairs = [
        match_components(first, second, shift=shift)[1].mean()
        for first, second in combinations(restarts, 2)
    ]
    return float(np.mean(pairs)) if pairs else float("nan")


def _to_unit(components: np.ndarray) -> np.ndarray:
    length = np.sqrt((components**2).sum(axis=(1, 2), keepdims=True))
    return components / np.where(length > 0, length, 1)
