"""Readers that are told the noise: templates with scatter, and the ideal observer.

The ideal observer has the exact posterior over known touches in Gaussian noise of known size.
"""

import warnings
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import logsumexp, softmax

from feeler.decoding.labels import Labels
from feeler.decoding.reader import Reader, count_until
from feeler.dispersion.index import check_tensors
from feeler.errors import InvalidInput
from feeler.task.noise import Noise, parse_noise
from feeler.tensors.scaling import SQUARED, find_scale

_ROUGH = 0.2  # correlation of neighbouring samples below which a difference is noise [C]
_MOST = 0.9  # of the entries in which noisy copies differ at least [C]
_MOST_COMPARED = 50  # touches of one label that are looked at for noise


def fit_class(
    touches: np.ndarray, sd: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """A class as a normal distribution of covariance Σ = σ² 1 + Bᵀ B.

    Parameters
    ----------
    touches
        Its touches (touch, entry).
    sd
        Standard deviation of each entry's noise σ, in the unit of the touches.

    Returns
    -------
    mean (entry,), scatter B (touch, entry), and the inverse and ln det of S = σ² 1 + B Bᵀ
    """
    mean = touches.mean(axis=0)
    scatter = (touches - mean) / np.sqrt(max(len(touches) - 1, 1))
    small = scatter @ scatter.T
    small[np.diag_indices_from(small)] += sd**2
    return mean, scatter, np.linalg.inv(small), float(np.linalg.slogdet(small)[1])


class _Told(Reader):
    """A reader that knows the noise: it is told its size, and learns from clean tensors."""

    knows_noise = True
    sd_: np.ndarray

    def __init__(self, noise: str | Noise = "relative:0.1") -> None:
        self.noise = noise

    def _learn(self, X: Any, y: Labels) -> tuple[np.ndarray, np.ndarray]:
        """Known tensors (trial, sensor, time) and their labels, of at least two classes."""
        tensors, labels = check_tensors(X), np.empty(len(y), dtype=object)
        labels[:] = list(y)
        if len(labels) != len(tensors):
            raise InvalidInput(
                f"{len(tensors)} tensors but {len(labels)} labels; give one for each."
            )
        if len(set(labels)) < 2:
            raise InvalidInput(
                "only one class: nothing to tell apart. Give at least two classes."
            )
        self.noise_ = parse_noise(self.noise)
        self.shape_ = tensors.shape[1:]
        self.classes_ = sorted(set(labels))
        return tensors, labels

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        return softmax(scores, axis=1)

    def _set_sd(self, known: np.ndarray) -> None:
        """The noise of known tensors (touch, sensor, time), refused where it is none."""
        sd = np.broadcast_to(self.noise_.sd(known), known.shape)
        if not np.all(sd > 0):
            raise InvalidInput(
                f"the noise {self.noise_} is 0 in tensor {int(np.argmin(sd.min(axis=(1, 2))))}"
                " (of classes or touches, from 0): leave out tensors that are zero everywhere, or"
                " take a noise with a floor, such as 'common' or 'mixed'."
            )
        if sd.min() < SQUARED[0] * sd.max():
            raise InvalidInput(
                f"the noise {self.noise_} ranges from {sd.min():.3g} to {sd.max():.3g}, which no"
                " squares span: leave out tensors that are all but zero."
            )
        self.sd_ = sd
        self._check_size(known)

    def _check_size(self, tensors: np.ndarray) -> np.ndarray:
        """The tensors, if their squares in units of the noise are numbers."""
        least = float(self.sd_.min())
        high = np.abs(tensors).max(initial=0.0)
        if high / SQUARED[1] > least:
            raise InvalidInput(
                f"the tensors reach {high:.3g}, the noise is {least:.3g}: more than"
                f" {SQUARED[1]:g} times as much. Give the noise in the unit of the tensors."
            )
        return tensors


def warn_of_copies(
    reader: Any, tensors: np.ndarray, labels: Labels, *, everywhere: bool = True
) -> None:
    """Say where tensors (trial, sensor, time) of one label look like noisy copies of each other.

    An ideal observer knows the touches without noise. Several different ones may bear one label, as
    where the place is not asked for; those differ smoothly in time. Noise does not: next to nothing
    of what a tensor differs by from its nearest fellow carries over to the next sample. Nor do
    sparse codes, but they are the same in most entries; Gaussian noise is ``everywhere``.
    """
    for name in dict.fromkeys(labels):
        own = tensors[np.array([label == name for label in labels])][:_MOST_COMPARED]
        flat = own.reshape(len(own), -1) / find_scale(own)
        apart = cdist(flat, flat, "sqeuclidean")
        apart[apart == 0] = np.inf  # itself, and what is the same
        different = np.isfinite(apart).any(axis=1)
        off = (flat - flat[apart.argmin(axis=1)])[different].reshape(-1, *tensors.shape[1:])
        if not off.size or (everywhere and np.mean(off != 0) < _MOST):
            continue
        if np.vdot(off[..., 1:], off[..., :-1]) < _ROUGH * np.vdot(off, off):
            warnings.warn(
                f"{type(reader).__name__} got {different.sum()} different tensors of the label"
                f" '{name}' that look like noisy copies. It takes each as known without noise,"
                " so it is no ideal observer of them: fit it on the clean tensors.",
                UserWarning,
                stacklevel=3,
            )
            return


class TemplateReader(_Told):
    """Quadratic decoder: each class a normal distribution of its own.

    With u = (y − m) / s, the distance of a tensor y from the class's mean m in units of the noise
    s, the logit of a class is −½ (|u|² − uᵀ Bᵀ S⁻¹ B u) − ½ ln det S − Σ ln s, where B is the
    scatter of the class's touches about their mean and S = 1 + B Bᵀ.

    Parameters
    ----------
    noise
        The noise that tensors will be met in, or its text; see :class:`feeler.task.Noise`.

    Attributes
    ----------
    classes_
        Labels, sorted.
    noise_
        The noise as an object.
    means_
        Mean tensor of each class (class, sensor, time).
    """

    def fit(self, X: Any, y: Labels) -> "TemplateReader":
        """Learn from clean tensors (trial, sensor, time), with several touches of each class."""
        tensors, labels = self._learn(X, y)
        self.touches_ = [tensors[labels == name] for name in self.classes_]
        self.means_ = np.stack([own.mean(axis=0) for own in self.touches_])
        self._set_sd(self.means_)
        return self

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Logits (trial, class)."""
        self._require(X)
        tensors = self._check_size(check_tensors(X, least=1))
        end = None if until is None else count_until(X, until)
        logits = np.empty((len(tensors), len(self.classes_)))
        for k, touches in enumerate(self.touches_):
            sd = self.sd_[k, :, :end].ravel()
            own = touches[:, :, :end].reshape(len(touches), -1) / sd
            mean, scatter, inverse, logdet = fit_class(own, 1.0)
            far = tensors[:, :, :end].reshape(len(tensors), -1) / sd - mean
            along = far @ scatter.T
            within = np.einsum("tr,rs,ts->t", along, inverse, along)
            square = np.einsum("te,te->t", far, far)
            logits[:, k] = -0.5 * (square - within + logdet) - np.log(sd).sum()
        return logits


class IdealReader(_Told):
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

    def fit(self, X: Any, y: Labels) -> "IdealReader":
        """Know tensors (trial, sensor, time) without noise, one label each.

        Warns where several of one label look like noisy copies: of these it is not ideal.
        """
        self.known_, labels = self._learn(X, y)
        self.members_ = np.array(
            [[label == name for name in self.classes_] for label in labels]
        )
        self._set_sd(self.known_)
        warn_of_copies(self, self.known_, labels)
        return self

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Log-likelihoods (trial, class), up to what all classes share."""
        self._require(X)
        end = None if until is None else count_until(X, until)
        tensors = self._check_size(check_tensors(X, least=1))
        cut = (part[:, :, :end] for part in (tensors, self.known_, self.sd_))
        met, known, sd = (part.reshape(len(part), -1) for part in cut)
        found = weigh_touches(met, known, sd)
        weights = np.broadcast_to(self.members_.T, (len(found), *self.members_.T.shape))
        return logsumexp(found[:, None, :], axis=2, b=weights)


def weigh_touches(met: np.ndarray, known: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """Log-likelihoods (…, touch) of what is met (…, entry), up to what all touches share.

    ``known`` and ``sd`` (touch, entry) are what each touch gives without noise, and its noise.
    """
    centre = known.mean(axis=0)  # less their mean, nearly equal touches keep their digits
    unit = find_scale(sd)  # squares of tiny or huge numbers are none
    met, known, weight = (met - centre) / unit, (known - centre) / unit, (unit / sd) ** 2
    square = met**2 @ weight.T - 2 * met @ (known * weight).T + (known**2 * weight).sum(axis=1)
    return -0.5 * square - np.log(sd).sum(axis=1)
