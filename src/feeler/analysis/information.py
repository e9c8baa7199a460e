"""Information that a noisy tensor conveys about the touch: bits, ideal accuracy, Fisher
information and bounds.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
import xarray as xr
from scipy.optimize import brentq
from scipy.special import logsumexp

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.objects.trials import Trial
from feeler.records import Gt, Registry
from feeler.tensors.transforms import SQUARED, check_squares, find_scale, require_variables
from feeler.validation import Count, Seed, checked

# Energies: the inner products of tensors, all that white noise lets one use of them.


@checked
def compute_energy(tensors: Annotated[np.ndarray, "trial ..."]) -> np.ndarray:
    """Inner products (trial, trial) of the tensors less their mean, in their unit squared.

    The mean is the same for all, so it tells nothing; without it nearly equal tensors keep their
    digits.

    Raises
    ------
    InvalidInput
        Fewer than two tensors, or values that are not finite.
    """
    flat = _flatten_energy(tensors)
    check_squares(flat)
    flat = flat - flat.mean(axis=0)
    return flat @ flat.T


@checked
def compute_energies(
    tensors: Annotated[np.ndarray, "trial sensor time"], ends: Sequence[int], start: int = 0
) -> np.ndarray:
    """Energies (end, trial, trial) of the samples from ``start`` to each of ``ends``.

    Each window goes on where the one before ended, so that all of them cost hardly more than the
    longest.
    """
    tensors = np.asarray(tensors, dtype=float)
    check_squares(_flatten_energy(tensors))
    edges = np.array([start, *ends])
    if edges.min() < 0 or np.any(np.diff(edges) < 0) or edges[-1] > tensors.shape[2]:
        raise InvalidInput(
            f"ends must rise from start={start} to at most {tensors.shape[2]} samples, got"
            f" {list(ends)}."
        )
    centred = tensors - tensors.mean(axis=0)
    parts = [centred[:, :, a:b].reshape(len(tensors), -1) for a, b in pairwise(edges)]
    return np.cumsum([part @ part.T for part in parts], axis=0)


@checked
def scale_peaks(tensors: Annotated[np.ndarray, "trial ..."]) -> np.ndarray:
    """Each tensor divided by its own peak, so that noise of sd σ is σ of each peak.

    So neither loudness nor the level of the noise says which touch it was. Noise whose level
    follows the peak of an unscaled tensor would betray it: over 20,000 entries a level can be told
    to half a per cent (``sd`` of one value per tensor in
    :func:`feeler.analysis.compute_information` shows how much).

    Raises
    ------
    InvalidInput
        A tensor that is zero everywhere, or not finite.
    """
    tensors = np.asarray(tensors, dtype=float)
    if tensors.size == 0:
        raise InvalidInput(f"there are no tensors to scale: their shape is {tensors.shape}.")
    peak = np.abs(tensors).reshape(len(tensors), -1).max(axis=1)
    if (bad := np.flatnonzero(~(np.isfinite(peak) & (peak > 0)))).size:
        raise InvalidInput(
            f"tensor {bad[0]} is zero everywhere, or not finite, and has no peak; leave it out."
        )
    return tensors / peak.reshape(-1, *[1] * (tensors.ndim - 1))


def _flatten_energy(tensors: np.ndarray) -> np.ndarray:
    if np.size(tensors) == 0:
        raise InvalidInput("information needs at least two tensors of finite values, got none.")
    flat = np.asarray(tensors, dtype=float).reshape(len(tensors), -1)
    if len(flat) < 2 or not np.isfinite(flat).all():
        raise InvalidInput(
            f"information needs at least two tensors of finite values, got {len(flat)}, of which"
            f" {np.isfinite(flat).all(axis=1).sum()} are finite."
        )
    return flat


# Bits: exact mutual information of touch and noisy tensor, and the ideal accuracy.
#
# One of K known tensors x_k (equally likely) arrives as y = x_j + σ_j n, with n white Gaussian
# of D entries. An observer who knows all x_k and σ_k needs only the likelihood ratios
#
#     ln p(y|k)/p(y|j) = D ln(σ_j/σ_k) + Q/2 (1 − σ_j²/σ_k²)
#                        − [d_jk² + 2 σ_j (u_j − u_k)] / (2 σ_k²),
#
# where d_jk² = ‖x_j − x_k‖², u_k = n·x_k and Q = ‖n‖². All of it follows from the inner
# products G of the tensors: u is normal with covariance G, drawn as u = C z with C Cᵀ = G and z
# of r = rank G entries, and Q = ‖z‖² + χ² of the D − r other directions. So noise of a tensor's
# size is never drawn, and nothing is lost. The ratios give the posterior p(k|y), and
#
#     I = log₂ K + ⟨Σ_k p(k|y) log₂ p(k|y)⟩   and   accuracy = ⟨max_k p(k|y)⟩,
#
# both as means over j and over drawn n: unbiased Monte Carlo, with nothing binned. Draws come
# in pairs n, −n, which are used for all j alike; the standard error is that of the mean over
# pairs.

_N_DRAWS = 100
_ROOM = 2_000_000  # [C] likelihood ratios at a time: 16 MB
_SAME = 1e-7  # of the greatest distance: nearer tensors are one [C]
_FAINT = -200.0  # nats: single precision makes 0 of the weight of all below
_SPAN_BITS = (1e-6, 1e6)  # of the greatest distance between tensors: where the noise is sought


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
    n_draws: Count = _N_DRAWS,
    random_state: Seed = 0,
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
        compute_energy(np.divide(tensors, unit)),
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
    n_draws: Count = _N_DRAWS,
    random_state: Seed = 0,
) -> Information:
    """The same from inner products (:func:`compute_energy`).

    ``entries`` is D, which is needed where ``sd`` differs.
    """
    coordinates, levels = _spread(energy), _check_sd(sd, len(energy), entries)
    unit = find_scale(coordinates)
    _check_level(levels, unit)
    return _measure(coordinates / unit, levels / unit, entries, n_draws, random_state)


def _measure(
    coordinates: np.ndarray, sd: np.ndarray, entries: int, n_draws: int, random_state: int
) -> Information:
    count, rank = coordinates.shape
    rng = np.random.default_rng(random_state)
    square = np.einsum("kr,kr->k", coordinates, coordinates)
    distance, same = _merge_same(square[:, None] + square - 2 * coordinates @ coordinates.T)
    # directions without tensors, where noise still discriminates levels
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


def _merge_same(distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


def _check_level(sd: np.ndarray | float, unit: float) -> None:
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
    n_draws: Count = _N_DRAWS,
    random_state: Seed = 0,
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
    coordinates = _spread(compute_energy(np.divide(tensors, unit)))
    count = len(coordinates)
    if not 1 / count < accuracy < 1:
        raise InvalidInput(
            f"accuracy must lie between 1/{count} (guessing) and 1, got {accuracy}."
        )
    scale = float(np.linalg.norm(coordinates, axis=1).max())

    def measure(log_sd: float) -> Information:
        return _measure(coordinates, np.full(count, np.exp(log_sd)), 0, n_draws, random_state)

    low, high = np.log(np.array(_SPAN_BITS) * max(scale, 1e-300))
    if not scale or measure(low).accuracy <= accuracy:
        return float("nan"), float("nan")
    found = brentq(lambda x: measure(x).accuracy - accuracy, low, high, xtol=1e-4)
    step = 0.02
    slope = (measure(found + step).accuracy - measure(found - step).accuracy) / (2 * step)
    sd = unit * float(np.exp(found))
    return sd, float(sd * measure(found).accuracy_error / abs(slope))


# Noise whose sd differs from entry to entry, such as noise that grows with the signal.
#
# One of K known tensors x_k (equally likely) arrives as y = x_j + λ g_j n, with n white and g_j
# the sd of each entry at level λ = 1. The observer knows all x_k and how large the noise of
# each entry is in the mean over touches, ḡ² = ⟨g_k²⟩, and weighs entries by it:
#
#     ln p(k|y) = −½ Σ (y − x_k)² / (λ ḡ)² + const.
#
# It does not take the noise itself for a signal, though its size differs between touches:
# thousands of entries would else betray the touch at any level, by their scatter alone. Where
# all g_k are equal it is the ideal observer of :func:`feeler.analysis.compute_information`.
#
# Of the noise only its products with the weighed tensors count, u_k = Σ g_j n x_k / ḡ²: normal,
# with covariance Σ g_j² x_k x_l / ḡ⁴, from which they are drawn. Noise of a tensor's size is
# never drawn.

_SPAN = (1e-4, 1e4)  # of the greatest weighed distance: where the level is sought


@checked
def compute_information_known_noise(
    tensors: Annotated[np.ndarray, "trial ..."],
    sd: np.ndarray,
    *,
    n_draws: Count = 100,
    random_state: Seed = 0,
) -> Information:
    """What is told of an equally likely touch in noise with an sd of each entry's own.

    Parameters
    ----------
    tensors
        One known tensor per touch, (trial, …).
    sd
        Of each entry's noise, broadcastable to that shape, as :meth:`feeler.objects.Noise.sd` says.
    n_draws
        Pairs of drawn noise; the error falls as their square root.

    Returns
    -------
    Information
        Share classified correctly, and log₂ K + ⟨log₂ p(true)⟩, a lower bound on the mutual
        information.

    Raises
    ------
    InvalidInput
        Fewer than two tensors, an sd of another shape, or one that is not > 0.
    """
    far, drawn, units = _weigh(tensors, sd, n_draws, random_state)
    return _judge(far, drawn, _find_level(*units))


@checked
def find_told(
    tensors: Annotated[np.ndarray, "trial ..."],
    sd: np.ndarray,
    accuracy: float = 0.75,
    *,
    n_draws: Count = 100,
    random_state: Seed = 0,
) -> float:
    """The factor on ``sd`` at which this share of the touches is classified correctly.

    Parameters as of :func:`compute_information_known_noise`. NaN where no factor does it:
    tensors are too alike.
    """
    far, drawn, units = _weigh(tensors, sd, n_draws, random_state)
    scale = float(np.sqrt(far.max()))
    if not scale:
        return float("nan")
    low, high = np.log(np.array(_SPAN) * scale)

    def lack(log_level: float) -> float:
        return _judge(far, drawn, float(np.exp(log_level))).accuracy - accuracy

    if lack(low) <= 0 or lack(high) >= 0:
        return float("nan")
    return float(np.exp(brentq(lack, low, high, xtol=1e-4)) / _find_level(*units))


def _find_level(known: float, sd: float) -> float:
    """The unit of the sd over that of the tensors."""
    _check_level(sd, known)
    return sd / known


def _weigh(
    tensors: np.ndarray, sd: np.ndarray, n_draws: int, random_state: Seed
) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
    """Squared distances (sent, candidate), and products with the noise (draw, sent, candidate), of
    tensors and sd in units of their own; and these units, of tensors and of sd.
    """
    known, noise = _flatten(tensors, sd)
    units = find_scale(known), find_scale(noise)
    known, noise = known / units[0], noise / units[1]
    mean = np.sqrt(np.mean(noise**2, axis=0))
    known = (known - known.mean(axis=0)) / mean
    check_squares(known, "tensors over their sd")
    energy = known @ known.T
    square = np.diag(energy)
    share = (noise / mean) ** 2
    if share.shape[1] == 1:  # one sd for all entries of a touch
        covariance = share[:, :, None] * energy
    else:
        covariance = np.array([(known * own) @ known.T for own in share])
    values, axes = np.linalg.eigh(covariance)
    root = axes * np.sqrt(np.maximum(values, 0.0))[:, None, :]
    z = np.random.default_rng(random_state).standard_normal((n_draws, *root.shape[:2]))
    drawn = np.einsum("jkr,njr->njk", root, z, optimize=True)
    far, first = _merge_same(square[:, None] + square - 2 * energy)
    drawn = drawn[:, :, first]
    drawn -= np.einsum("njj->nj", drawn)[:, :, None].copy()
    return far, drawn, units


def _flatten(tensors: np.ndarray, sd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Tensors (trial, entry) and their sd (trial, entry or 1)."""
    known, noise = np.asarray(tensors, dtype=float), np.asarray(sd, dtype=float)
    noise = noise.reshape((1,) * (known.ndim - noise.ndim) + noise.shape)
    try:
        whole = np.broadcast_to(noise, known.shape)
    except ValueError:
        raise InvalidInput(
            f"sd must have the tensors' shape {known.shape}, or lengths of 1 where it is the same,"
            f" got {np.shape(sd)}."
        ) from None
    if len(known) < 2:
        raise InvalidInput(
            "at least two tensors are needed: with one there is nothing to tell."
        )
    if not (np.isfinite(known).all() and np.isfinite(noise).all() and np.all(noise > 0)):
        raise InvalidInput("tensors must be finite and sd > 0 everywhere; a floor keeps it so.")
    if noise.size == len(noise):
        whole = np.broadcast_to(noise.reshape(-1, 1), (len(known), 1))
    return known.reshape(len(known), -1), whole.reshape(len(known), -1)


def _judge(far: np.ndarray, products: np.ndarray, level: float) -> Information:
    """Share right and bits at a level, from pairs of drawn noise."""
    count = len(far)
    rights, logs = [], []
    for drawn in (products, -products):
        ratio = drawn / level - far / (2 * level**2)  # of the one that was sent: 0
        rights.append(np.mean(ratio.argmax(axis=2) == np.arange(count), axis=1))
        logs.append(-np.mean(logsumexp(ratio, axis=2), axis=1) / np.log(2))
    accuracy, accuracy_error = _average([np.mean(rights, axis=0)])
    told, bits_error = _average([np.mean(logs, axis=0)])
    return Information(
        bits=float(np.log2(count) + told),
        bits_error=bits_error,
        accuracy=accuracy,
        accuracy_error=accuracy_error,
    )


# Fisher information about properties of a touch, and the least error it leaves.


@checked
def compute_fisher(
    derivatives: Annotated[np.ndarray, "parameter ..."], sd: Annotated[float, Gt(0)]
) -> np.ndarray:
    """Fisher information (parameter, parameter) of a tensor x(θ) in white Gaussian noise.

    ∂x/∂θ_a · ∂x/∂θ_b / σ².

    Parameters
    ----------
    derivatives
        ∂x/∂θ (parameter, …) [unit of the tensor per unit of the parameter].
    sd
        Standard deviation of each entry's noise, in the unit of the tensor.
    """
    if np.size(derivatives) == 0:
        raise InvalidInput("derivatives must be of one parameter or more, and of some entries.")
    if not 1e-150 < sd < 1e150:
        raise InvalidInput(
            f"sd must be above 1e-150 and below 1e150, whose squares are numbers, got {sd:g}."
        )
    flat = np.asarray(derivatives, dtype=float).reshape(len(derivatives), -1)
    if not np.isfinite(flat).all():
        raise InvalidInput(
            "derivatives must be finite; a touch without contact has no information to give."
        )
    unit = find_scale(np.asarray(sd))  # exact: squares of very small numbers would underflow
    flat = flat / unit
    check_squares(flat, "derivatives over sd")
    return flat @ flat.T / (sd / unit) ** 2


_LEAST = 1e-9  # share of the information that rounding may give or take


@checked
def compute_bounds(
    fisher: Annotated[np.ndarray, "parameter parameter"], joint: bool = True
) -> np.ndarray:
    """Cramér–Rao bounds (parameter,): the least sd of an unbiased estimate.

    In the units of the parameters.

    ``joint``: the other parameters are unknown too, √(F⁻¹)_aa; otherwise they are known, 1/√F_aa,
    which is never greater. A parameter that the tensor does not tell, or not apart from the others,
    has the bound ∞; those that it tells have the same bounds as without that one.

    Raises
    ------
    InvalidInput
        No information matrix: entries that are not finite, or directions of negative information.
    """
    fisher = np.asarray(fisher, dtype=float)
    size = np.sqrt(np.abs(np.diag(fisher)))
    unit = np.where(size > 0, size, 1.0)
    scaled = fisher / unit[:, None] / unit
    least = np.linalg.eigvalsh(scaled)[0] if np.isfinite(scaled).all() else np.nan
    if not least >= -_LEAST:
        raise InvalidInput(
            "fisher must be finite, and negative in no direction, as compute_fisher gives it."
        )
    if not joint:
        scaled = np.diag(np.diag(scaled))
    told, axes = np.linalg.eigh(scaled)
    lost = told <= len(told) * np.finfo(float).eps * told[-1]
    spread = (axes[:, ~lost] ** 2 / told[~lost]).sum(axis=1)
    confused = (axes[:, lost] ** 2).sum(axis=1) > _LEAST
    return np.where(confused, np.inf, np.sqrt(spread) / unit)


# Sensitivity: how a touch's tensor changes with its place, its size and its speed.


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """One continuous property of a touch.

    Attributes
    ----------
    step : float
        Default step of the difference, in ``unit``; it is halved once as a check.
    move : Callable[[Antenna, Trial, float], Trial]
        ``move(antenna, trial, by)``: the trial with the property changed by ``by``.
    """

    unit: str
    step: float
    move: Callable[[Antenna, Trial, float], Trial]


def _move_size(antenna: Antenna, trial: Trial, by: float) -> Trial:
    if not np.isfinite(trial.feature.size):
        raise InvalidInput(
            f"the size of {trial.label} cannot change; leave the parameter 'size' out."
        )
    return replace(trial, feature=trial.feature.scale(1 + by / trial.feature.size))


PARAMETERS: Registry[Parameter] = Registry("parameter of a touch")
"""Properties by name; ``PARAMETERS.register(name, Parameter(...))`` adds one."""
PARAMETERS.register(
    "location",
    Parameter(
        unit="mm",
        step=0.02,
        move=lambda antenna, trial, by: replace(
            trial, location=trial.location + by / antenna.length
        ),
    ),
)
PARAMETERS.register("size", Parameter(unit="mm", step=0.02, move=_move_size))
PARAMETERS.register(
    "speed",
    Parameter(
        unit="%",
        step=0.1,
        move=lambda _, trial, by: replace(trial, speed=trial.speed * (1 + by / 100)),
    ),
)


@checked
def differentiate_touches(
    antenna: Antenna,
    trials: Sequence[Trial] | Trial,
    parameters: Sequence[str] = ("location", "size", "speed"),
    *,
    step: Annotated[float, Gt(0)] = 1.0,
    quantity: str = "angle",
    **options: Any,
) -> xr.Dataset:
    """∂x/∂θ of each touch by central differences of simulated tensors, with a check.

    Every difference is taken twice, with the parameter's own step h and with h/2; the latter is
    given back. The smooth contact (the default) is what makes the limit exist: with ``hard``
    contact it does not.

    Parameters
    ----------
    parameters
        Names of :data:`PARAMETERS`: ``location`` [mm along the antenna], ``size`` [mm, half-width],
        ``speed`` [%].
    step
        Multiplies every parameter's step.
    options
        What :func:`feeler.touch` takes beside: duration, engine, timestep, contact, workers …

    Returns
    -------
    xarray.Dataset
        ``derivative`` (parameter, trial, sensor, time); ``change`` (parameter, trial), ‖D(h) −
        D(h/2)‖ / ‖D(h/2)‖, which for a converged central difference is about 3/4 of the error of
        D(h), itself four times that of what is given; and ``unit`` of each parameter.
    """
    from feeler.experiments.tactile import touch  # who only reads tensors needs no engine

    trials = [trials] if isinstance(trials, Trial) else list(trials)
    known = [PARAMETERS[name] for name in parameters]
    steps = np.array([[step * p.step * share for share in (1.0, 0.5)] for p in known])
    moved = [
        p.move(antenna, trial, sign * h)
        for p, hs in zip(known, steps, strict=True)
        for h in hs
        for sign in (1.0, -1.0)
        for trial in trials
    ]
    tensors = touch(antenna, moved, **options)
    require_variables(tensors, quantity)
    values = tensors[quantity].values
    up, down = np.moveaxis(
        values.reshape(len(known), 2, 2, len(trials), *values.shape[1:]), 2, 0
    )
    wide, close = np.moveaxis((up - down) / (2 * steps[:, :, None, None, None]), 1, 0)
    size = np.linalg.norm(close, axis=(2, 3))
    with np.errstate(invalid="ignore", divide="ignore"):
        change = np.linalg.norm(wide - close, axis=(2, 3)) / size
    return xr.Dataset(
        {
            "derivative": (("parameter", "trial", "sensor", "time"), close),
            "change": (("parameter", "trial"), change),
        },
        {
            "parameter": list(parameters),
            "unit": ("parameter", [p.unit for p in known]),
            "time": tensors["time"].values,
        },
    )


@checked
def scale_derivatives(
    derivatives: Annotated[np.ndarray, "parameter trial ..."],
    tensors: Annotated[np.ndarray, "trial ..."],
) -> np.ndarray:
    """Derivatives of x/p from those of x, where p is each tensor's peak: (∂x − x ∂p/p) / p.

    What :func:`feeler.analysis.scale_peaks` is to tensors. The peak is taken to stay where it
    is.

    Raises
    ------
    InvalidInput
        Shapes that do not go together, or a tensor that is zero everywhere.
    """
    moves, values = np.asarray(derivatives, dtype=float), np.asarray(tensors, dtype=float)
    if (
        moves.shape[1:] != values.shape
        or not np.abs(values).reshape(len(values), -1).max(axis=1).all()
    ):
        raise InvalidInput(
            f"derivatives {moves.shape} need tensors {moves.shape[1:]} with a peak, got"
            f" {values.shape}."
        )
    flat, along = values.reshape(len(values), -1), moves.reshape(*moves.shape[:2], -1)
    top = np.abs(flat).argmax(axis=1)
    peak = np.take_along_axis(flat, top[:, None], 1)  # with its sign, which cancels
    change = np.take_along_axis(
        along, np.broadcast_to(top[None, :, None], (*moves.shape[:2], 1)), 2
    )
    return ((along - flat * (change / peak)) / np.abs(peak)).reshape(moves.shape)
