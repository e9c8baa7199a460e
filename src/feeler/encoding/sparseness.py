"""Hoyer's sparseness of a vector, and the exact projection onto vectors of a given sparseness."""

from typing import Annotated

import numpy as np

from feeler.compiled import compiled, nested
from feeler.errors import InvalidInput
from feeler.validation import checked


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


def check_sparseness(sparseness: float) -> None:
    """Refuse what no vector can reach: outside [0, 1)."""
    if not 0 <= sparseness < 1:
        raise InvalidInput(
            f"sparseness must lie in [0, 1), or be None for no constraint; got {sparseness}. The"
            " paper uses 0.8; 1 would allow a single active moment only."
        )


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
