"""Noisy copies in few coordinates, for methods that see only distances and angles."""

import numpy as np


def draw_rotated(
    clean: np.ndarray, owner: np.ndarray, sd: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Noisy copies in far fewer coordinates, for PCA, LDA and support vector machines.

    These methods see only distances and angles.

    Isotropic noise looks the same after any rotation. Turned so that the first axes span the clean
    vectors, all that m noisy copies show outside that span is the Gram matrix of m Gaussian
    vectors, a Wishart matrix; its Bartlett factor L (chi-distributed diagonal, normal below) has
    exactly that Gram matrix in m coordinates. So 600 copies of 21,280 entries become 600 vectors of
    about 630, with the same joint distribution of all inner products.

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
    """Coordinates (trial, rank) of the clean vectors in an orthonormal basis of their span."""
    energy, axes = np.linalg.eigh(clean @ clean.T)
    keep = energy > energy[-1] * 1e-12
    return axes[:, keep] * np.sqrt(energy[keep])
