"""Templates: each class is one mean tensor, the scatter of its touches about it, and known noise."""

from typing import Any

import numpy as np
from scipy.special import softmax

from feeler.decoding.labels import Labels
from feeler.decoding.reader import Reader, count_until
from feeler.dispersion.blocks import check_tensors
from feeler.errors import InvalidInput
from feeler.task.noise import Noise, parse_noise


def fit_class(touches: np.ndarray, sd: float) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
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


def check_known(X: Any, y: Labels) -> tuple[np.ndarray, np.ndarray]:
    """Known tensors as an array (trial, sensor, time) and their labels, at least two classes."""
    tensors, labels = check_tensors(X), np.empty(len(y), dtype=object)
    labels[:] = list(y)
    if len(labels) != len(tensors):
        raise InvalidInput(f"{len(tensors)} tensors but {len(labels)} labels; give one for each.")
    if len(set(labels)) < 2:
        raise InvalidInput("only one class: nothing to tell apart. Give at least two classes.")
    return tensors, labels


class TemplateReader(Reader):
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

    knows_noise = True

    def __init__(self, noise: str | Noise = "relative:0.1") -> None:
        self.noise = noise

    def fit(self, X: Any, y: Labels) -> "TemplateReader":
        """Learn from clean tensors (trial, sensor, time), with several touches of each class."""
        tensors, labels = check_known(X, y)
        self.noise_ = parse_noise(self.noise)
        self.shape_ = tensors.shape[1:]
        self.classes_ = sorted(set(labels))
        self.touches_ = [tensors[labels == name] for name in self.classes_]
        self.means_ = np.stack([own.mean(axis=0) for own in self.touches_])
        self.sd_ = np.broadcast_to(self.noise_.sd(self.means_), self.means_.shape)
        return self

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Logits (trial, class)."""
        self._require(X)
        tensors = check_tensors(X, least=1)
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

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        return softmax(scores, axis=1)
