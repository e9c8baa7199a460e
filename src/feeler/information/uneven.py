r"""Noise whose sd differs from entry to entry, such as noise that grows with the signal.

One of K known tensors x_k (equally likely) arrives as y = x_j + λ g_j n, with n white and g_j the
sd of each entry at level λ = 1. The observer knows all x_k and how large the noise of each entry is
in the mean over touches, ḡ² = ⟨g_k²⟩, and weighs entries by it:

    ln p(k|y) = −½ Σ (y − x_k)² / (λ ḡ)² + const.

It does not take the noise itself for a signal, though its size differs between touches: thousands
of entries would else betray the touch at any level, by their scatter alone. Where all g_k are equal
it is the ideal observer of :func:`feeler.information.compute_information`.

Of the noise only its products with the weighed tensors count, u_k = Σ g_j n x_k / ḡ²: normal, with
covariance Σ g_j² x_k x_l / ḡ⁴, from which they are drawn. Noise of a tensor's size is never drawn.
"""

from typing import Annotated, NamedTuple

import numpy as np
from scipy.optimize import brentq
from scipy.special import logsumexp

from feeler.errors import InvalidInput
from feeler.information.bits import Information, check_level, merge_same
from feeler.records.checked import checked
from feeler.tensors.scaling import check_squares, find_scale

_SPAN = (1e-4, 1e4)  # of the greatest weighed distance: where the level is sought


class _Weighed(NamedTuple):
    """Squared distances (sent, candidate), and products with the noise (draw, sent, candidate), of
    tensors and sd in units of their own; ``units`` are these, of tensors and of sd.
    """

    far: np.ndarray
    drawn: np.ndarray
    units: tuple[float, float]


@checked
def compute_told(
    tensors: Annotated[np.ndarray, "trial ..."],
    sd: np.ndarray,
    *,
    n_draws: Annotated[int, "> 0"] = 100,
    random_state: Annotated[int, "≥ 0"] = 0,
) -> Information:
    """What is told of an equally likely touch in noise with an sd of each entry's own.

    Parameters
    ----------
    tensors
        One known tensor per touch, (trial, …).
    sd
        Of each entry's noise, broadcastable to that shape, as :meth:`feeler.task.Noise.sd` says.
    n_draws
        Pairs of drawn noise; the error falls as their square root.

    Returns
    -------
    Information
        Share named right, and log₂ K + ⟨log₂ p(true)⟩, a lower bound on the mutual information.

    Raises
    ------
    InvalidInput
        Fewer than two tensors, an sd of another shape, or one that is not > 0.
    """
    weighed = _weigh(tensors, sd, n_draws, random_state)
    return _judge(weighed, _find_level(weighed))


@checked
def find_told(
    tensors: Annotated[np.ndarray, "trial ..."],
    sd: np.ndarray,
    accuracy: float = 0.75,
    *,
    n_draws: Annotated[int, "> 0"] = 100,
    random_state: Annotated[int, "≥ 0"] = 0,
) -> float:
    """The factor on ``sd`` at which this share of the touches is named right.

    Parameters as of :func:`compute_told`. NaN where no factor does it: tensors are too alike.
    """
    weighed = _weigh(tensors, sd, n_draws, random_state)
    scale = float(np.sqrt(weighed.far.max()))
    if not scale:
        return float("nan")
    low, high = np.log(np.array(_SPAN) * scale)

    def lack(log_level: float) -> float:
        return _judge(weighed, float(np.exp(log_level))).accuracy - accuracy

    if lack(low) <= 0 or lack(high) >= 0:
        return float("nan")
    return float(np.exp(brentq(lack, low, high, xtol=1e-4)) / _find_level(weighed))


def _find_level(weighed: _Weighed) -> float:
    """The unit of the sd over that of the tensors."""
    known, sd = weighed.units
    check_level(sd, known)
    return sd / known


def _weigh(
    tensors: np.ndarray, sd: np.ndarray, n_draws: int, random_state: Annotated[int, "≥ 0"]
) -> _Weighed:
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
    far, first = merge_same(square[:, None] + square - 2 * energy)
    drawn = drawn[:, :, first]
    drawn -= np.einsum("njj->nj", drawn)[:, :, None].copy()
    return _Weighed(far, drawn, units)


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


def _judge(weighed: _Weighed, level: float) -> Information:
    """Share right and bits at a level, from pairs of drawn noise."""
    count = len(weighed.far)
    rights, logs = [], []
    for drawn in (weighed.drawn, -weighed.drawn):
        ratio = drawn / level - weighed.far / (2 * level**2)  # of the one that was sent: 0
        rights.append(np.mean(ratio.argmax(axis=2) == np.arange(count), axis=1))
        logs.append(-np.mean(logsumexp(ratio, axis=2), axis=1) / np.log(2))
    right, told = np.mean(rights, axis=0), np.mean(logs, axis=0)
    errors = [
        float(one.std(ddof=1) / np.sqrt(one.size)) if one.size > 1 else float("nan")
        for one in (right, told)
    ]
    return Information(
        bits=float(np.log2(count) + told.mean()),
        bits_error=errors[1],
        accuracy=float(right.mean()),
        accuracy_error=errors[0],
    )
