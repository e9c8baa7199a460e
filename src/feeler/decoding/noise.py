"""Noisy copies in few coordinates, for methods that see only distances and angles."""

import numpy as np


def draw_rotated(
    coordinates: np.ndarray,
    n_entries: int,
    owner: np.ndarray,
    sd: np.ndarray,
    rng: np.random.Generator,
    n_learned: int | None = None,
) -> np.ndarray:
    """Noisy copies in far fewer coordinates, for PCA, LDA and support vector machines.

    These methods see only distances and angles.

    Isotropic noise looks the same after any rotation. Turned so that the first axes span the clean
    vectors, all that m noisy copies show outside that span is the Gram matrix of m Gaussian
    vectors, a Wishart matrix; its Bartlett factor L (chi-distributed diagonal, normal below) has
    exactly that Gram matrix in m coordinates. Of copies that are only compared with those m, the
    coordinates along them are normal and all others are of no account. So 600 copies of 21,280
    entries, of which 300 are learned, become 600 vectors of about 330, with the same joint
    distribution of all inner products that count.

    Parameters
    ----------
    coordinates
        Of the clean vectors in a basis of their span (trial, rank), from :func:`span`.
    n_entries
        Entries of a clean vector.
    owner
        Which clean vector each copy is made from (copy,).
    sd
        Noise of each copy (copy,), the same for all its entries.
    n_learned
        The first so many copies are compared with each other and with all others; the others only
        with them and with the clean vectors. None: all with all.

    Returns
    -------
    Noisy copies (copy, coordinate); the clean vectors have zeros beyond ``coordinates``.
    """
    n_copies, rank = owner.size, coordinates.shape[1]
    learned = n_copies if n_learned is None else n_learned
    rest = n_entries - rank
    noise = rng.standard_normal((n_copies, rank + min(rest, learned)), dtype=np.float32)
    noise = noise.astype(float)
    if rest >= learned:
        factor = noise[:learned, rank:]
        factor[np.triu_indices(learned, 1)] = 0
        np.fill_diagonal(factor, np.sqrt(rng.chisquare(rest - np.arange(learned))))
    noise *= sd[:, None]
    noise[:, :rank] += coordinates[owner]
    return noise


def span(clean: np.ndarray) -> np.ndarray:
    """Coordinates (trial, rank) of flat clean vectors in an orthonormal basis of their span."""
    energy, axes = np.linalg.eigh(clean @ clean.T)
    keep = energy > energy[-1] * 1e-12
    return axes[:, keep] * np.sqrt(energy[keep])
