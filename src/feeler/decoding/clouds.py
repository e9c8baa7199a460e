"""Classes as clouds: how likely each is, and whether a touch is like any of them."""

from typing import Any

import numpy as np
from scipy.special import log_softmax, softmax

from feeler.decoding.components import PrincipalComponents
from feeler.decoding.labels import Labels
from feeler.decoding.reader import Reader
from feeler.decoding.transfer import TEMPERATURES
from feeler.errors import InvalidInput

_FOLDS = 4  # [C] parts that are held out in turn for temperature and limit


class CloudReader(Reader):
    """A multivariate t cloud for each class, all of one shape, on principal components.

    The score of class c is −(ν + k)/2 · log(1 + d²_c / ν) for the Mahalanobis distance d_c to its
    mean among k components. Temperature and limit come from touches that were held out, group by
    group: the temperature makes probabilities as sure as they are right there
    (arXiv:1706.04599), and beyond the limit lay ``alarm`` of them.

    Parameters
    ----------
    n_components
        Principal components k of all training tensors, fewer where they cannot give as many.
    shrinkage
        Share of the covariance that is its diagonal.
    freedom
        ν; small: touches far out are common.
    step
        Samples that are averaged to one.
    alarm
        Share of the known touches that may be called strange.

    Attributes
    ----------
    classes_
        Labels, sorted.
    temperature_ : float
        T of the probabilities.
    limit_ : float
        Squared distance to the nearest class, beyond which a touch is strange.
    """

    def __init__(
        self,
        n_components: int = 80,
        shrinkage: float = 0.3,
        freedom: float = 5.0,
        step: int = 10,
        alarm: float = 0.05,
    ) -> None:
        self.n_components = n_components
        self.shrinkage = shrinkage
        self.freedom = freedom
        self.step = step
        self.alarm = alarm

    def fit(self, X: Any, y: Labels, groups: Any = None) -> "CloudReader":
        """Learn from tensors (trial, sensor, time); trials of one group (a robot) are held out
        together.
        """
        X = np.asarray(X, dtype=float)
        if len(X) != len(y) or not np.isfinite(X).all():
            raise InvalidInput(
                f"clouds need whole tensors and a label for each; got {len(X)} tensors,"
                f" {len(y)} labels."
            )
        self._keep(X, y)
        self.groups_ = np.asarray(groups if groups is not None else np.arange(len(X)))
        self.classes_ = sorted(set(y))
        number = np.array([self.classes_.index(label) for label in y])
        folds = np.unique(self.groups_, return_inverse=True)[1] % _FOLDS
        squared = np.full((len(X), len(self.classes_)), np.inf)
        for fold in np.unique(folds):
            held = folds == fold
            known = set(number[~held])
            if len(known) == len(self.classes_):
                self._shape(X[~held], number[~held])
                squared[held] = self._measure(X[held])
        seen = np.isfinite(squared).all(axis=1)
        if len(self.classes_) < 2 or not seen.any():
            raise InvalidInput(
                "clouds need 2 classes or more, and each in at least two groups of touches."
            )
        self.temperature_ = _temper(self._score(squared[seen]), number[seen])
        self.limit_ = float(np.quantile(squared[seen].min(axis=1), 1 - self.alarm))
        self._shape(X, number)
        return self

    def measure_strangeness(self, X: Any, until: float | None = None) -> np.ndarray:
        """Squared distance to the nearest class over the limit (trial,); > 1 is unlike all of them,
        NaN without contact.
        """
        reader, seen = self._look(X, until)
        squared = np.full(len(seen), np.nan)
        whole = np.isfinite(seen).all(axis=(1, 2))
        if whole.any():
            squared[whole] = reader._measure(np.asarray(seen)[whole]).min(axis=1)
        return squared / reader.limit_

    def _decide(self, X: Any) -> np.ndarray:
        X = np.asarray(X, dtype=float)
        scores = np.full((len(X), len(self.classes_)), np.nan)
        whole = np.isfinite(X).all(axis=(1, 2))
        if whole.any():
            scores[whole] = self._score(self._measure(X[whole])) / self.temperature_
        return scores

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        return softmax(scores, axis=1)

    def _renew(self) -> "CloudReader":
        """A copy for shorter tensors, which holds out the same groups."""
        return _Again(self.groups_, **self.get_params())

    def _score(self, squared: np.ndarray) -> np.ndarray:
        k = self._means.shape[1]
        return -0.5 * (self.freedom + k) * np.log1p(squared / self.freedom)

    def _shape(self, X: np.ndarray, number: np.ndarray) -> None:
        """Means of the classes, and what makes their common covariance round."""
        flat = self._flatten(X)
        count = min(self.n_components, *flat.shape, len(flat) - 1)
        self._components = PrincipalComponents(count).fit(flat)
        places = np.asarray(self._components.transform(flat))
        classes = range(len(self.classes_))
        self._means = np.array([places[number == c].mean(axis=0) for c in classes])
        off = places - self._means[number]
        spread = off.T @ off / max(len(off) - len(self._means), 1)
        own = np.diag(np.diag(spread) + 1e-12 * np.trace(spread))
        mixed = (1 - self.shrinkage) * spread + self.shrinkage * own
        self._round = np.linalg.inv(np.linalg.cholesky(mixed))

    def _measure(self, X: np.ndarray) -> np.ndarray:
        """Squared Mahalanobis distances (trial, class)."""
        places = np.asarray(self._components.transform(self._flatten(X)))
        off = (places[:, None] - self._means) @ self._round.T
        return np.sum(off * off, axis=2)

    def _flatten(self, X: np.ndarray) -> np.ndarray:
        step = min(self.step, X.shape[2])
        whole = X.shape[2] // step * step
        thin = X[:, :, X.shape[2] - whole :].reshape(len(X), X.shape[1], -1, step).mean(axis=3)
        return thin.reshape(len(X), -1)


class _Again(CloudReader):
    """The same reader for another length of touches."""

    def __init__(self, groups: np.ndarray, **parameters: Any) -> None:
        super().__init__(**parameters)
        self.groups = groups

    def fit(self, X: Any, y: Labels, groups: Any = None) -> "CloudReader":
        """As the reader that it stems from."""
        return super().fit(X, y, self.groups if groups is None else groups)


def _temper(scores: np.ndarray, true: np.ndarray) -> float:
    """The T with the greatest mean log probability of the true classes."""
    chosen = np.arange(true.size), true
    fits = [log_softmax(scores / t, axis=1)[chosen].mean() for t in TEMPERATURES]
    return float(TEMPERATURES[int(np.argmax(fits))])


def measure_calibration(
    probability: np.ndarray, right: np.ndarray, bins: int = 10
) -> tuple[float, np.ndarray]:
    """Expected calibration error of answers, and the reliability diagram behind it.

    Parameters
    ----------
    probability, right
        Of each answer (trial,): its probability, and whether it was right.
    bins
        Of equal width between 0 and 1.

    Returns
    -------
    error
        Mean of |share right − mean probability| over the bins, weighed by their answers.
    table
        (bin, 3) mean probability, share right and number of answers; NaN where there is none.
    """
    probability, right = np.asarray(probability, dtype=float), np.asarray(right, dtype=bool)
    place = np.minimum((probability * bins).astype(int), bins - 1)
    table = np.full((bins, 3), np.nan)
    table[:, 2] = np.bincount(place, minlength=bins)
    for k in np.unique(place):
        table[k, :2] = probability[place == k].mean(), right[place == k].mean()
    gaps = np.nan_to_num(np.abs(table[:, 1] - table[:, 0]))
    return float(np.average(gaps, weights=table[:, 2])), table
