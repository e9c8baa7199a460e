"""Classes as clouds: how likely each is, and whether a touch is like any of them."""

from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np
from scipy.special import softmax

from feeler.decoding.components import PrincipalComponents
from feeler.decoding.labels import Labels
from feeler.decoding.reader import Reader
from feeler.decoding.transfer import find_temperature
from feeler.errors import InvalidInput
from feeler.tensors.scaling import check_squares, fold_planes

_FOLDS = 4  # [C] parts that are held out in turn for temperature and limits
_FAR = 0.2  # [C] share of the false alarms that the limit on the distance may give
# [C] ν of both clouds that are weighed for a stranger; small: touches far out are common
_FREEDOM = 50.0
_DIRECTIONS = 20  # [C] in which strangers may lie further out than what robots differ by

Others = tuple[np.ndarray, Sequence[Hashable]]
"""Tensors (trial, sensor, time) of strangers, and what each shares with others."""


class CloudReader(Reader):
    """A multivariate t cloud for each class, all of one shape, on principal components.

    The score of class c is −(ν + k)/2 · log(1 + d²_c / ν) for the Mahalanobis distance d_c to its
    mean among k components. Temperature and limits come from touches that were held out, group by
    group: the temperature makes probabilities as sure as they are right there
    (arXiv:1706.04599), and beyond one limit or the other lay ``alarm`` of them. One limit is on the
    distance to the nearest class. The other, where strangers were shown, is on how much likelier a
    touch is theirs.

    Parameters
    ----------
    n_components
        Principal components k of all training tensors, fewer where they cannot give as many.
    shrinkage
        Share of the covariance that is its diagonal; None: k/(k + f) for its degrees of freedom f.
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
    held_out_ : np.ndarray
        Strangeness of the lessons (trial,), each judged by clouds that did not learn its group.
    """

    def __init__(
        self,
        n_components: int = 80,
        shrinkage: float | None = None,
        freedom: float = 5.0,
        step: int = 10,
        alarm: float = 0.05,
    ) -> None:
        self.n_components = n_components
        self.shrinkage = shrinkage
        self.freedom = freedom
        self.step = step
        self.alarm = alarm

    def fit(
        self, X: Any, y: Labels, groups: Any = None, strangers: Others | None = None
    ) -> "CloudReader":
        """Learn from tensors (trial, sensor, time); trials of one group (a robot) are held out
        together. ``strangers`` are touches that are not to be known: tensors, and what each shares
        with others (place and speed), looked at for as long as the others last.
        """
        X = np.asarray(fold_planes(X), dtype=float)
        if len(X) != len(y) or not np.isfinite(X).all():
            raise InvalidInput(
                f"clouds need whole tensors and a label for each; got {len(X)} tensors,"
                f" {len(y)} labels."
            )
        self._keep(X, y, groups=groups, strangers=strangers)
        self.groups_ = np.asarray(groups if groups is not None else np.arange(len(X)))
        self.strangers_ = strangers
        self.classes_ = sorted(set(y))
        number = np.array([self.classes_.index(label) for label in y])
        other = None
        if strangers is not None:
            other = self._flatten(np.asarray(strangers[0])[:, :, : X.shape[2]])
        flat, squared = self._flatten(X), np.full((len(X), len(self.classes_)), np.inf)
        likelier = np.full(len(X), -np.inf)
        folds = np.unique(self.groups_, return_inverse=True)[1] % _FOLDS
        for fold in np.unique(folds):
            held = folds == fold
            if len(set(number[~held])) == len(self.classes_):
                self._shape(flat[~held], number[~held], other)
                squared[held], likelier[held] = self._measure(flat[held])
        seen = np.isfinite(squared).all(axis=1)
        if len(self.classes_) < 2 or not seen.any():
            raise InvalidInput(
                "clouds need 2 classes or more, and each in at least two groups of touches."
            )
        self.temperature_ = find_temperature(self._score(squared[seen]), number[seen])
        self._limit(squared[seen].min(axis=1), likelier[seen])
        self.held_out_ = np.full(len(X), np.nan)
        self.held_out_[seen] = self._compare(squared[seen].min(axis=1), likelier[seen])
        self._shape(flat, number, other)
        return self

    def measure_strangeness(self, X: Any, until: float | None = None) -> np.ndarray:
        """How strange each touch is (trial,); > 1 is unlike all classes, NaN without contact.

        The greater of two: the squared distance to the nearest class over its limit; and 1 plus by
        how much it is likelier a stranger's than the limit allows, in standard deviations of the
        known touches that were held out.
        """
        reader, seen = self._look(X, until)
        strange = np.full(len(seen), np.nan)
        whole = np.isfinite(seen).all(axis=(1, 2))
        if whole.any():
            squared, likelier = reader._measure(reader._flatten(np.asarray(seen)[whole]))
            strange[whole] = reader._compare(squared.min(axis=1), likelier)
        return strange

    def _limit(self, nearest: np.ndarray, likelier: np.ndarray) -> None:
        """Both limits: together they spare all but ``alarm`` of touches held out."""
        shown = np.isfinite(likelier).all()
        far = self.alarm * (_FAR if shown else 1.0)
        self.limit_ = float(np.quantile(nearest, 1 - far))
        self._odds = (np.inf, 1.0)
        if shown:
            near = likelier[nearest <= self.limit_]
            limit = np.quantile(near, 1 - (self.alarm - far) / (1 - far))
            self._odds = (float(limit), float(near.std()) or 1.0)

    def _compare(self, nearest: np.ndarray, likelier: np.ndarray) -> np.ndarray:
        """Strangeness from distances and from how much likelier strangers are (trial,)."""
        limit, spread = self._odds
        return np.maximum(nearest / self.limit_, 1 + (likelier - limit) / spread)

    def _decide(self, X: Any) -> np.ndarray:
        X = np.asarray(X, dtype=float)
        scores = np.full((len(X), len(self.classes_)), np.nan)
        whole = np.isfinite(X).all(axis=(1, 2))
        if whole.any():
            squared, _ = self._measure(self._flatten(X[whole]))
            scores[whole] = self._score(squared) / self.temperature_
        return scores

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        return softmax(scores, axis=1)

    def _score(self, squared: np.ndarray) -> np.ndarray:
        k = self._means.shape[1]
        return -0.5 * (self.freedom + k) * np.log1p(squared / self.freedom)

    def _shape(self, flat: np.ndarray, number: np.ndarray, other: np.ndarray | None) -> None:
        """Means of the classes, what makes their common covariance round, and strangers there."""
        everything = flat if other is None else np.concatenate([flat, other])
        count = min(self.n_components, *flat.shape, len(flat) - 1)
        self._components = PrincipalComponents(count).fit(everything)
        places = np.asarray(self._components.transform(flat))
        classes = range(len(self.classes_))
        self._means = np.array([places[number == c].mean(axis=0) for c in classes])
        off = places - self._means[number]
        freedom = max(len(off) - len(self._means), 1)
        spread = off.T @ off / freedom
        own = np.diag(np.diag(spread) + 1e-12 * np.trace(spread))
        share = count / (count + freedom) if self.shrinkage is None else self.shrinkage
        self._round = np.linalg.inv(np.linalg.cholesky((1 - share) * spread + share * own))
        self._others = None
        if other is not None and self.strangers_ is not None:
            self._others = Strangers(self._place(other), self.strangers_[1])

    def _place(self, flat: np.ndarray) -> np.ndarray:
        """Where touches lie among components, in units in which classes are round."""
        return np.asarray(self._components.transform(flat)) @ self._round.T

    def _measure(self, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Squared Mahalanobis distances (trial, class), and how much likelier strangers are."""
        places = self._place(flat)
        off = places[:, None] - self._means @ self._round.T
        squared = np.sum(off * off, axis=2)
        if self._others is None:
            return squared, np.full(len(flat), -np.inf)
        return squared, self._others.weigh(places, squared.min(axis=1))

    def _flatten(self, X: Any) -> np.ndarray:
        X = np.asarray(X, dtype=float)
        check_squares(X)
        step = min(self.step, X.shape[2])
        whole = X.shape[2] // step * step
        thin = X[:, :, X.shape[2] - whole :].reshape(len(X), X.shape[1], -1, step).mean(axis=3)
        return thin.reshape(len(X), -1)


class Strangers:
    """A t cloud around each kind's mean, wide where strangers differ among each other.

    Parameters
    ----------
    places
        Strangers (trial, coordinate), in coordinates in which each known class is round.
    kinds
        What each shares with others, such as place and speed of the touch.
    """

    def __init__(self, places: np.ndarray, kinds: Sequence[Hashable]) -> None:
        names = sorted(set(kinds), key=repr)
        number = np.array([names.index(kind) for kind in kinds])
        self._means = np.array([places[number == k].mean(axis=0) for k in range(len(names))])
        off = places - self._means[number]
        spread, along = np.linalg.eigh(off.T @ off / max(len(off) - len(names), 1))
        self._spread = np.maximum(spread[::-1][:_DIRECTIONS], 1.0)
        self._along = along[:, ::-1][:, :_DIRECTIONS]

    def weigh(self, places: np.ndarray, nearest: np.ndarray) -> np.ndarray:
        """How much likelier each place (trial, coordinate) is of a stranger than of a class, whose
        squared distance is ``nearest`` (trial,) [nat].
        """
        off = places[:, None] - self._means
        own = off @ self._along
        squared = np.sum(off * off, axis=2) - np.sum(own * own * (1 - 1 / self._spread), axis=2)
        weight = 0.5 * (_FREEDOM + places.shape[1])
        strange = -weight * np.log1p(squared.min(axis=1) / _FREEDOM)
        known = -weight * np.log1p(nearest / _FREEDOM)
        return np.asarray(strange - known - 0.5 * np.log(self._spread).sum())
