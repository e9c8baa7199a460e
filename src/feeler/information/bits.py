r"""Bits: exact mutual information of touch and noisy tensor, and the ideal accuracy.

One of K known tensors x_k (equally likely) arrives as y = x_j + σ_j n, with n white Gaussian of D
entries. An observer who knows all x_k and σ_k needs only the likelihood ratios

    ln p(y|k)/p(y|j) = D ln(σ_j/σ_k) + Q/2 (1 − σ_j²/σ_k²) − [d_jk² + 2 σ_j (u_j − u_k)] / (2 σ_k²),

where d_jk² = ‖x_j − x_k‖², u_k = n·x_k and Q = ‖n‖². All of it follows from the inner products G of
the tensors: u is normal with covariance G, drawn as u = C z with C Cᵀ = G and z of r = rank G
entries, and Q = ‖z‖² + χ² of the D − r other directions. So noise of a tensor's size is never
drawn, and nothing is lost. The ratios give the posterior p(k|y), and

    I = log₂ K + ⟨Σ_k p(k|y) log₂ p(k|y)⟩   and   accuracy = ⟨max_k p(k|y)⟩,

both as means over j and over drawn n: unbiased Monte Carlo, with nothing binned. Draws come in
pairs n, −n, which are used for all j alike; the standard error is that of the mean over pairs.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from scipy.optimize import brentq

from feeler.errors import InvalidInput
from feeler.information.energy import compute_energy
from feeler.records.checked import checked
from feeler.tensors.scaling import SQUARED, find_scale

_N_DRAWS = 100
_ROOM = 2_000_000  # [C] likelihood ratios at a time: 16 MB
_SAME = 1e-7  # of the greatest distance: nearer tensors are one [C]
_FAINT = -200.0  # nats: single precision makes 0 of the weight of all below
_SPAN = (1e-6, 1e6)  # of the greatest distance between tensors: where the noise is sought


@dataclass(frozen=True, kw_only=True)
class Information:
    """What an ideal observer learns from one noisy tensor.

    Attributes
    ----------
    bits : float
        Mutual information with the touch [bit], at most log₂ K.
    bits_error : float
        Its standard error [bit], from the drawn noise; the tensors are taken as they are.
    accuracy : float
        Share of touches that the maximum-likelihood decoder names right.
    accuracy_error : float
        Its standard error.
    """

    bits: float
    bits_error: float
    accuracy: float
    accuracy_error: float


@checked
def compute_information(
    tensors: Annotated[np.ndarray, "trial ..."],
    sd: float | np.ndarray,
    *,
    n_draws: Annotated[int, "> 0"] = _N_DRAWS,
    random_state: Annotated[int, "≥ 0"] = 0,
) -> Information:
    """Mutual information between an equally likely touch and its tensor in white noise.

    Exact Monte Carlo of Gaussian noise.

    Parameters
    ----------
    tensors
        One known tensor per touch, (trial, …).
    sd
        Standard deviation of each entry's noise, in the unit of the tensors; one per trial where
        they differ (then the level of the noise tells, too). For noise relative to peaks hand in
        ``scale_peaks(tensors)``.
    n_draws
        Pairs of drawn noise; the error falls as their square root.

    Raises
    ------
    InvalidInput
        Fewer than two tensors, values that are not finite, or ``sd`` not > 0.

    Notes
    -----
    Equations in the module's docstring. Takes some 40 ms for 90 tensors of 56 × 380.
    """
    entries = int(np.prod(np.shape(tensors)[1:]))
    levels = _check_sd(sd, len(tensors), entries)
    unit = find_scale(np.asarray(tensors, dtype=float))
    return measure_information(
        compute_energy(tensors / unit),
        _share(levels, unit),
        entries=entries,
        n_draws=n_draws,
        random_state=random_state,
    )


@checked
def measure_information(
    energy: Annotated[np.ndarray, "trial trial"],
    sd: float | np.ndarray,
    *,
    entries: int = 0,
    n_draws: Annotated[int, "> 0"] = _N_DRAWS,
    random_state: Annotated[int, "≥ 0"] = 0,
) -> Information:
    """The same from inner products (:func:`compute_energy`).

    ``entries`` is D, which is needed where ``sd`` differs.
    """
    coordinates, levels = _spread(energy), _check_sd(sd, len(energy), entries)
    unit = find_scale(coordinates)
    check_level(levels, unit)
    return _measure(coordinates / unit, levels / unit, entries, n_draws, random_state)


def _measure(
    coordinates: np.ndarray, sd: np.ndarray, entries: int, n_draws: int, random_state: int
) -> Information:
    count, rank = coordinates.shape
    rng = np.random.default_rng(random_state)
    square = np.einsum("kr,kr->k", coordinates, coordinates)
    distance, same = merge_same(square[:, None] + square - 2 * coordinates @ coordinates.T)
    # directions without tensors, where noise still tells levels apart
    free = entries - rank if np.ptp(sd) else 0
    size = max(1, _ROOM // (2 * count * count))
    doubts, rights = [], []
    for first in range(0, n_draws, size):
        z = rng.standard_normal((min(size, n_draws - first), rank))
        rest = rng.chisquare(free, len(z)) if free else 0.0
        drawn = (np.concatenate([z, -z]) @ coordinates.T)[:, same]
        total = np.tile(np.einsum("nr,nr->n", z, z) + rest, 2)
        doubt, right = _compare(distance, drawn, total, sd, entries)
        doubts.append(doubt.reshape(2, -1).mean(axis=0))
        rights.append(right.reshape(2, -1).mean(axis=0))
    (bits, bits_error), (accuracy, accuracy_error) = _average(doubts), _average(rights)
    return Information(
        bits=max(float(np.log2(count) - bits / np.log(2)), 0.0),
        bits_error=float(bits_error / np.log(2)),
        accuracy=accuracy,
        accuracy_error=accuracy_error,
    )


def merge_same(distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squared distances (trial, trial) in which those of the same tensors are 0, and for each
    tensor the first that is the same (trial,).

    Rounding of inner products leaves up to 1e-8 of the greatest distance between tensors that are
    equal; in less noise than that they would be discriminated.
    """
    distance = np.maximum(distance, 0.0)
    same = distance <= _SAME**2 * distance.max()
    np.fill_diagonal(same, True)
    first = same.argmax(axis=1)
    distance[same] = 0.0
    return distance[first][:, first], first


def _compare(
    distance: np.ndarray, drawn: np.ndarray, total: np.ndarray, sd: np.ndarray, entries: int
) -> tuple[np.ndarray, np.ndarray]:
    """Mean entropy [nat] and mean greatest value of the posterior over the sent tensor (draw,)."""
    ratio = (drawn[:, None, :] - drawn[:, :, None]) * sd[:, None]  # (draw, sent, candidate)
    ratio -= distance / 2
    ratio /= sd**2
    if np.ptp(sd):
        share = sd[:, None] / sd
        ratio += entries * np.log(share) + total[:, None, None] / 2 * (1 - share**2)
    ratio -= ratio.max(axis=2)[:, :, None]
    # differences from the best: seven digits are far more than the drawn noise leaves
    ratio = np.maximum(ratio, _FAINT, out=ratio).astype(np.float32)
    weight = np.exp(ratio)
    whole = weight.sum(axis=2)
    doubt = np.log(whole) - np.einsum("nsk,nsk->ns", weight, ratio) / whole
    return doubt.mean(axis=1, dtype=float), (1 / whole).mean(axis=1, dtype=float)


def _average(parts: list[np.ndarray]) -> tuple[float, float]:
    values = np.concatenate(parts)
    error = values.std(ddof=1) / np.sqrt(values.size) if values.size > 1 else np.nan
    return float(values.mean()), float(error)


def _spread(energy: np.ndarray) -> np.ndarray:
    """Coordinates (trial, rank) of points with these inner products."""
    energy = np.asarray(energy, dtype=float)
    if len(energy) < 2 or energy.shape[0] != energy.shape[1] or not np.isfinite(energy).all():
        raise InvalidInput(
            "inner products must be a finite square matrix of two or more, got shape"
            f" {energy.shape}."
        )
    values, axes = np.linalg.eigh(energy)
    keep = values > 1e-14 * max(values[-1], 0.0)
    return axes[:, keep] * np.sqrt(values[keep])


def _share(sd: np.ndarray | float, unit: float) -> np.ndarray:
    with np.errstate(over="ignore"):  # ∞ is refused
        return np.asarray(sd) / unit


def check_level(sd: np.ndarray | float, unit: float) -> None:
    """Refuse noise so far from the size of what it covers, about ``unit``, that the squares of its
    shares are no numbers.
    """
    share = _share(sd, unit)
    low, high = float(np.min(share)), float(np.max(share))
    if not SQUARED[0] <= low <= high <= SQUARED[1]:
        raise InvalidInput(
            f"sd must lie between {SQUARED[0]:g} and {SQUARED[1]:g} of what tensors differ by, got"
            f" {low:.3g}{f' to {high:.3g}' if high > low else ''} of it: give it in the unit of the"
            " tensors."
        )


def _check_sd(sd: object, count: int, entries: int) -> np.ndarray:
    values = np.asarray(sd, dtype=float)
    if values.shape not in ((), (count,)) or not (
        np.isfinite(values).all() and np.all(values > 0)
    ):
        raise InvalidInput(
            f"sd must be one number > 0, or one for each of the {count} tensors, got {sd}."
        )
    values = np.broadcast_to(values, (count,))
    if np.ptp(values) and entries < count:
        raise InvalidInput(
            f"where sd differs, entries= must be the size of a tensor (≥ {count}), got {entries}."
        )
    return values


@checked
def find_noise(
    tensors: Annotated[np.ndarray, "trial ..."],
    accuracy: float = 0.75,
    *,
    n_draws: Annotated[int, "> 0"] = _N_DRAWS,
    random_state: Annotated[int, "≥ 0"] = 0,
) -> tuple[float, float]:
    """Noise at which an ideal decoder names this share of the touches right, ± its error.

    Both in the unit of the tensors (for ``scale_peaks``: in peaks). The same noise is drawn at
    every level, so that the accuracy is a smooth function of the level. Undefined (NaN) where
    tensors are so alike that no noise is small enough.

    Raises
    ------
    InvalidInput
        An accuracy at which one could guess, or ≥ 1.
    """
    unit = find_scale(np.asarray(tensors, dtype=float))
    coordinates = _spread(compute_energy(tensors / unit))
    count = len(coordinates)
    if not 1 / count < accuracy < 1:
        raise InvalidInput(
            f"accuracy must lie between 1/{count} (guessing) and 1, got {accuracy}."
        )
    scale = float(np.linalg.norm(coordinates, axis=1).max())

    def measure(log_sd: float) -> Information:
        return _measure(coordinates, np.full(count, np.exp(log_sd)), 0, n_draws, random_state)

    low, high = np.log(np.array(_SPAN) * max(scale, 1e-300))
    if not scale or measure(low).accuracy <= accuracy:
        return float("nan"), float("nan")
    found = brentq(lambda x: measure(x).accuracy - accuracy, low, high, xtol=1e-4)
    step = 0.02
    slope = (measure(found + step).accuracy - measure(found - step).accuracy) / (2 * step)
    sd = unit * float(np.exp(found))
    return sd, float(sd * measure(found).accuracy_error / abs(slope))
