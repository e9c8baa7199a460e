"""Noisy copies of codes: how much noise, relative to what, drawn how."""

from typing import Any

import numpy as np

from feeler.errors import InvalidInput

LEVELS = ("vector", "tensor", "common")
LEAST_RATIO = 1e-6  # at noise 0 copies are identical and LDA's within-class spread is 0: this is its limit


def as_codes(codes: Any) -> np.ndarray:
    """Codes or tensors as a finite float array (trial, vector, time).

    Raises
    ------
    InvalidInput
        Another number of dimensions (trials of unequal shapes cannot form such an array), or NaN.
    """
    try:
        array = np.asarray(codes, dtype=float)
    except (ValueError, TypeError) as error:
        raise InvalidInput(
            f"the codes do not form one array (trial, vector, time): {error}. All trials must have the same shape."
        ) from None
    if array.ndim != 3 or array.size == 0:
        raise InvalidInput(f"expected codes or tensors (trial, vector, time), got shape {array.shape}.")
    if not np.isfinite(array).all():
        raise InvalidInput("the codes hold NaN or infinite entries; drop or repair those trials first.")
    return array


def compute_noise_sd(
    codes: np.ndarray, ratio: float, level: str = "vector", reference: float | None = None
) -> np.ndarray:
    """Standard deviation of the noise, broadcastable to ``codes`` (trial, vector, time).

    Parameters
    ----------
    codes
        Clean activations (trial, component, time) or tensors (trial, sensor, time).
    ratio
        Noise ratio ≥ 0, e.g. 0.1 for 10 %.
    level
        ``vector``: ratio × the greatest magnitude of each vector h_i(t) of each trial (the paper's definition).
        ``tensor``: ratio × the greatest magnitude of each trial. ``common``: ratio × ``reference``, the same absolute
        noise everywhere, as a sensor with a fixed noise floor has.
    reference
        For ``common``: the greatest magnitude over everything that is compared; default that of ``codes`` alone.

    Notes
    -----
    Paper, "Feature classification from tactile tensors": deviation relative to each activation vector's maximum.
    """
    if not np.isfinite(ratio) or ratio < 0:
        raise InvalidInput(f"noise must be a ratio ≥ 0 (0.1 is 10 %), got {ratio}.")
    if level not in LEVELS:
        raise InvalidInput(f"noise level must be one of {', '.join(LEVELS)}, got {level!r}.")
    if level == "common":
        peak = np.full((1, 1, 1), np.abs(codes).max() if reference is None else reference)
    else:
        peak = np.abs(codes).max(axis=(1, 2) if level == "tensor" else 2, keepdims=True)
    return max(ratio, LEAST_RATIO) * peak


def draw_copies(codes: np.ndarray, sd: np.ndarray, n_copies: int, rng: np.random.Generator) -> np.ndarray:
    """``n_copies`` of every trial with fresh Gaussian noise (copy · trial, vector, time), the set in turn."""
    if n_copies < 1:
        raise InvalidInput(f"n_copies must be ≥ 1, got {n_copies}.")
    noise = rng.standard_normal((n_copies, *codes.shape), dtype=np.float32)
    copies = np.multiply(noise, sd, dtype=float)
    copies += codes
    return copies.reshape(-1, *codes.shape[1:])


def draw_rotated(
    clean: np.ndarray, owner: np.ndarray, sd: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Noisy copies in far fewer coordinates, for methods that only see distances and angles (PCA, LDA, SVM).

    Isotropic noise looks the same after any rotation. Turned so that the first axes span the clean vectors, all
    that m noisy copies show outside that span is the Gram matrix of m Gaussian vectors, a Wishart matrix; its
    Bartlett factor L (chi-distributed diagonal, normal below) has exactly that Gram matrix in m coordinates. So 600
    copies of 21,280 entries become 600 vectors of about 630, with the same joint distribution of all inner products.

    Parameters
    ----------
    clean
        Flat clean vectors (trial, entry).
    owner
        Which clean vector each copy is made from (copy,).
    sd
        Noise of each copy (copy,), the same for all its entries.

    Returns
    -------
    noisy (copy, coordinate) and clean (trial, coordinate), in the same coordinates.
    """
    n_copies, n_entries = owner.size, clean.shape[1]
    coordinates = _span(clean)
    rank = coordinates.shape[1]
    rest = n_entries - rank
    if rest < n_copies:
        return clean[owner] + sd[:, None] * rng.standard_normal((n_copies, n_entries)), clean
    factor = np.tril(rng.standard_normal((n_copies, n_copies), dtype=np.float32), -1).astype(float)
    np.fill_diagonal(factor, np.sqrt(rng.chisquare(rest - np.arange(n_copies))))
    noise = np.concatenate([rng.standard_normal((n_copies, rank)), factor], axis=1)
    padded = np.pad(coordinates, ((0, 0), (0, n_copies)))
    return padded[owner] + sd[:, None] * noise, padded


def _span(clean: np.ndarray) -> np.ndarray:
    """Coordinates of the clean vectors in an orthonormal basis of their span (trial, rank), from their Gram matrix."""
    energy, axes = np.linalg.eigh(clean @ clean.T)
    keep = energy > energy[-1] * 1e-12
    return axes[:, keep] * np.sqrt(energy[keep])
