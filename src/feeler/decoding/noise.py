"""Noisy copies of codes: how much noise, relative to what, drawn how."""

from dataclasses import dataclass

import numpy as np

from feeler.errors import InvalidInput
from feeler.registry import Registry

LEAST_RATIO = (
    1e-6  # at noise 0 copies are identical and LDA's within-class spread is 0: this is its limit
)
PARTS = {"vector": 2, "tensor": (1, 2)}


@dataclass(frozen=True, kw_only=True)
class Noise:
    """A model of noise; a new one gives ``compute_size``, or draws its copies otherwise than
    Gaussian.
    """

    each: str = "vector"
    """What a ratio is a share of, where the model asks: the greatest magnitude of each ``vector``
    h_i(t) of each trial, or of each ``tensor``."""
    reference: float | None = None
    """Greatest magnitude over everything that is compared; None: over the codes at hand."""

    def __post_init__(self) -> None:
        if self.each not in PARTS:
            raise InvalidInput(
                f"noise is relative to each of {', '.join(PARTS)}, got {self.each!r}."
            )

    @property
    def is_even(self) -> bool:
        """Whether the noise is Gaussian with one sd over all entries of a trial: ``draw_rotated``
        is then exact.
        """
        return False

    def compute_size(self, codes: np.ndarray) -> np.ndarray:
        """What a ratio of 1 means, broadcastable to ``codes`` (trial, vector, time)."""
        raise NotImplementedError

    def sd(self, codes: np.ndarray, ratio: float) -> np.ndarray:
        """Standard deviation, broadcastable to ``codes``; a ratio of 0.1 is 10 %."""
        if not np.isfinite(ratio) or ratio < 0:
            raise InvalidInput(f"noise must be a ratio ≥ 0 (0.1 is 10 %), got {ratio}.")
        return max(ratio, LEAST_RATIO) * self.compute_size(codes)

    def draw(
        self, codes: np.ndarray, ratio: float, n_copies: int, rng: np.random.Generator
    ) -> np.ndarray:
        """``n_copies`` of every trial with fresh noise (copy · trial, vector, time), the set in
        turn.
        """
        return draw_copies(codes, self.sd(codes, ratio), n_copies, rng)


NOISES: Registry[type[Noise]] = Registry("noise model")
"""Every known model by its name; ``NOISES.register(name, model)`` adds one."""


@NOISES.register("relative")
@dataclass(frozen=True, kw_only=True)
class Relative(Noise):
    """sd = ratio × the greatest magnitude of each vector (the paper's), or of each tensor.

    Notes
    -----
    Paper, "Feature classification from tactile tensors": deviation relative to each activation
    vector's maximum.
    """

    @property
    def is_even(self) -> bool:
        """True for noise relative to whole tensors."""
        return self.each == "tensor"

    def compute_size(self, codes: np.ndarray) -> np.ndarray:
        """Greatest magnitude of each vector or tensor."""
        return np.abs(codes).max(axis=PARTS[self.each], keepdims=True)


@NOISES.register("common")
@dataclass(frozen=True, kw_only=True)
class Common(Noise):
    """sd = ratio × ``reference``: the same absolute noise everywhere, as a sensor with a fixed
    noise floor has.
    """

    @property
    def is_even(self) -> bool:
        """True."""
        return True

    def compute_size(self, codes: np.ndarray) -> np.ndarray:
        """The reference."""
        return np.full((1, 1, 1), np.abs(codes).max() if self.reference is None else self.reference)


def draw_copies(
    codes: np.ndarray, sd: np.ndarray, n_copies: int, rng: np.random.Generator
) -> np.ndarray:
    """``n_copies`` of every trial with fresh Gaussian noise (copy · trial, vector, time), the set
    in turn.
    """
    if n_copies < 1:
        raise InvalidInput(f"n_copies must be ≥ 1, got {n_copies}.")
    noise = rng.standard_normal((n_copies, *codes.shape), dtype=np.float32)
    copies = np.multiply(noise, sd, dtype=float)
    copies += codes
    return copies.reshape(-1, *codes.shape[1:])


def draw_rotated(
    clean: np.ndarray, owner: np.ndarray, sd: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Noisy copies in far fewer coordinates, for methods that only see distances and angles (PCA,
    LDA, SVM).

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
    """Coordinates of the clean vectors in an orthonormal basis of their span (trial, rank), from
    their Gram matrix.
    """
    energy, axes = np.linalg.eigh(clean @ clean.T)
    keep = energy > energy[-1] * 1e-12
    return axes[:, keep] * np.sqrt(energy[keep])
