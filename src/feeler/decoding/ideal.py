"""The ideal observer: the exact posterior over known touches in Gaussian noise of known size."""

from typing import Any

import numpy as np
from scipy.special import logsumexp, softmax

from feeler.decoding.labels import Labels
from feeler.decoding.reader import Reader, count_until
from feeler.decoding.templates import check_known
from feeler.dispersion.blocks import check_tensors
from feeler.task.noise import Noise, parse_noise


class IdealReader(Reader):
    """Knows every touch and the noise: no reader of the same touches does better.

    The touches x_c that it was fitted on are equally likely, and what is met is y = x_c + s_c n
    with independent normal n. Then ln p(y | c) = −½ Σ ((y − x_c) / s_c)² − Σ ln s_c, up to what all
    touches share; s_c may depend on the touch, and then it tells, too. A class's probability is the
    sum over its touches.

    Parameters
    ----------
    noise
        The noise that tensors will be met in, or its text; its ``sd`` of the known touches is s_c.

    Attributes
    ----------
    classes_
        Labels, sorted.
    noise_
        The noise as an object.
    known_, sd_
        The known tensors (touch, sensor, time), and the standard deviation of their noise.

    Notes
    -----
    :func:`feeler.information.compute_information` gives this reader's mean accuracy and bits where
    the noise of a touch is equal in all entries, without drawing noise of a tensor's size.
    """

    knows_noise = True

    def __init__(self, noise: str | Noise = "relative:0.1") -> None:
        self.noise = noise

    def fit(self, X: Any, y: Labels) -> "IdealReader":
        """Know tensors (trial, sensor, time) without noise, one label each."""
        self.known_, labels = check_known(X, y)
        self.noise_ = parse_noise(self.noise)
        self.shape_ = self.known_.shape[1:]
        self.classes_ = sorted(set(labels))
        self.members_ = np.array([[label == name for name in self.classes_] for label in labels])
        self.sd_ = np.broadcast_to(self.noise_.sd(self.known_), self.known_.shape)
        return self

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Log-likelihoods (trial, class), up to what all classes share."""
        self._require(X)
        end = None if until is None else count_until(X, until)
        cut = (part[:, :, :end] for part in (check_tensors(X, least=1), self.known_, self.sd_))
        met, known, sd = (part.reshape(len(part), -1) for part in cut)
        found = weigh_touches(met, known, sd)
        weights = np.broadcast_to(self.members_.T, (len(found), *self.members_.T.shape))
        return logsumexp(found[:, None, :], axis=2, b=weights)

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        return softmax(scores, axis=1)


def weigh_touches(met: np.ndarray, known: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """Log-likelihoods (…, touch) of what is met (…, entry), up to what all touches share.

    ``known`` and ``sd`` (touch, entry) are what each touch gives without noise, and its noise.
    """
    centre = known.mean(axis=0)  # less their mean, nearly equal touches keep their digits
    met, known, weight = met - centre, known - centre, 1 / sd**2
    square = met**2 @ weight.T - 2 * met @ (known * weight).T + (known**2 * weight).sum(axis=1)
    return -0.5 * square - np.log(sd).sum(axis=1)
