"""Ideal observers and templates in known noise, classes as distributions, and novelty detection."""

import warnings
from collections.abc import Hashable, Sequence
from typing import Any

import numpy as np
from scipy.spatial.distance import cdist
from scipy.special import logsumexp, softmax
from sklearn.base import clone

from feeler.analysis.indices import check_tensors
from feeler.decoding.classifiers import (
    Classifier,
    Labels,
    PrincipalComponents,
    check_counts,
    check_labels,
    count_until,
    list_classes,
    number_labels,
    read_labels,
    sort_classes,
)
from feeler.decoding.transfer import find_temperature
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.objects.noise import Noise, parse_noise
from feeler.tensors.transforms import (
    SQUARED,
    check_squares,
    find_scale,
    read_axes,
)

# Classifiers that are told the noise: templates with scatter, and the ideal observer.
#
# The ideal observer has the exact posterior over known touches in Gaussian noise of known size.

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


class _Told(Classifier):
    """A classifier that knows the noise: it is told its size, and learns from clean tensors."""

    knows_noise = True
    sd_: np.ndarray

    def __init__(self, noise: float | str | Noise = "relative:0.1") -> None:
        self.noise = noise

    def _learn(self, X: Any, y: Labels) -> tuple[np.ndarray, np.ndarray]:
        """Known tensors (trial, sensor, time) and their labels, of at least two classes."""
        tensors = check_tensors(X)
        labels = check_labels(X, y)
        self._axes = read_axes(X, aligned=True)
        self.noise_ = parse_noise(self.noise)
        self.shape_ = tensors.shape[1:]
        self.classes_ = sort_classes(labels)
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
    classifier: Any, tensors: np.ndarray, labels: Labels, *, everywhere: bool = True
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
            text = (
                f"{type(classifier).__name__} got several tensors of one label that look like noisy"
                " copies. It takes each as known without noise, so it is no ideal observer of"
                " them: fit it on the clean tensors."
            )
            warnings.warn(
                ModelValidityWarning(text, f"The label '{name}' has {different.sum()}."),
                stacklevel=3,
            )
            return


class TemplateClassifier(_Told):
    """Quadratic decoder: each class a normal distribution of its own.

    With u = (y − m) / s, the distance of a tensor y from the class's mean m in units of the noise
    s, the logit of a class is −½ (|u|² − uᵀ Bᵀ S⁻¹ B u) − ½ ln det S − Σ ln s, where B is the
    scatter of the class's touches about their mean and S = 1 + B Bᵀ.

    Parameters
    ----------
    noise
        The noise that tensors will be met in, or its text; see :class:`feeler.objects.Noise`.

    Attributes
    ----------
    classes_
        Labels, sorted.
    noise_
        The noise as an object.
    means_
        Mean tensor of each class (class, sensor, time).
    """

    def fit(self, X: Any, y: Labels) -> "TemplateClassifier":
        """Learn from clean tensors (trial, sensor, time), with several touches of each class."""
        tensors, labels = self._learn(X, y)
        number = number_labels(labels, self.classes_)
        self.touches_ = [tensors[number == k] for k in range(len(self.classes_))]
        self.means_ = np.stack([own.mean(axis=0) for own in self.touches_])
        self._set_sd(self.means_)
        return self

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Logits (trial, class)."""
        X = self._require(X)
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


class IdealObserver(_Told):
    """Knows every touch and the noise: no classifier of the same touches does better.

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
    :func:`feeler.analysis.compute_information` gives this classifier's mean accuracy and bits where
    the noise of a touch is equal in all entries, without drawing noise of a tensor's size.
    """

    def fit(self, X: Any, y: Labels) -> "IdealObserver":
        """Know tensors (trial, sensor, time) without noise, one label each.

        Warns where several of one label look like noisy copies: of these it is not ideal.
        """
        self.known_, labels = self._learn(X, y)
        self.members_ = np.array(
            [[label == name for name in self.classes_.tolist()] for label in labels]
        )
        self._set_sd(self.known_)
        warn_of_copies(self, self.known_, labels)
        return self

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Log-likelihoods (trial, class), up to what all classes share."""
        X = self._require(X)
        end = None if until is None else count_until(X, until)
        tensors = self._check_size(check_tensors(X, least=1))
        cut = (part[:, :, :end] for part in (tensors, self.known_, self.sd_))
        met, known, sd = (part.reshape(len(part), -1) for part in cut)
        found = compute_log_likelihood(met, known, sd)
        weights = np.broadcast_to(self.members_.T, (len(found), *self.members_.T.shape))
        return logsumexp(found[:, None, :], axis=2, b=weights)


def compute_log_likelihood(met: np.ndarray, known: np.ndarray, sd: np.ndarray) -> np.ndarray:
    """Log-likelihoods (…, touch) of what is met (…, entry), up to what all touches share.

    ``known`` and ``sd`` (touch, entry) are what each touch gives without noise, and its noise.
    """
    centre = known.mean(axis=0)  # less their mean, nearly equal touches keep their digits
    unit = find_scale(sd)  # squares of tiny or huge numbers are none
    met, known, weight = (met - centre) / unit, (known - centre) / unit, (unit / sd) ** 2
    square = met**2 @ weight.T - 2 * met @ (known * weight).T + (known**2 * weight).sum(axis=1)
    return -0.5 * square - np.log(sd).sum(axis=1)


# Classes as clouds: how likely each is, and whether a touch is like any of them.

_FOLDS = 4  # [C] parts that are held out in turn for temperature and limits
_FAR = 0.2  # [C] share of the false alarms that the limit on the distance may give
# [C] ν of both clouds that are weighed for a stranger; small: touches far out are common
_FREEDOM = 50.0
_DIRECTIONS = 20  # [C] in which unknown may lie further out than what robots differ by

Others = tuple[np.ndarray, Sequence[Hashable]]
"""Tensors (trial, sensor, time) of unknown, and what each shares with others."""
_Training = tuple[np.ndarray, Labels, np.ndarray, Others | None]


class StudentTClassifier(Classifier):
    """A multivariate t cloud for each class, all of one shape, on principal components.

    The score of class c is −(ν + k)/2 · log(1 + d²_c / ν) for the Mahalanobis distance d_c to its
    mean among k components. Temperature and limits come from touches that were held out, group by
    group: the temperature makes probabilities as sure as they are right there
    (arXiv:1706.04599), and beyond one limit or the other lay ``alarm`` of them. One limit is on the
    distance to the nearest class. The other, where unknown were shown, is on how much likelier a
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
        Strangeness of the training (trial,), each judged by clouds that did not learn its group.
    confusion_ : np.ndarray
        (true class, class named): how many of these training, judged so, were called what.

    Notes
    -----
    Tensors in which a sensor has no value at all are judged by a classifier of the other sensors,
    which is fitted to the same training set when it is first asked for.
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
        self, X: Any, y: Labels, groups: Any = None, unknown: Others | None = None
    ) -> "StudentTClassifier":
        """Learn from tensors (trial, sensor, time); trials of one group (a robot) are held out
        together. ``unknown`` are touches that are not to be known: tensors, and what each shares
        with others (place and speed), looked at for as long as the others last.
        """
        check_counts(X, y)
        self._axes, X = read_axes(X, aligned=True), check_tensors(X, least=1)
        owners = np.asarray(groups if groups is not None else np.arange(len(X)))
        shown = None
        if unknown is not None:
            others = np.asarray(unknown[0], dtype=float)[:, :, : X.shape[2]]
            shown = self._average(others), list(unknown[1])
        self.shape_ = X.shape[1:]
        return self._learn(self._average(X), [*read_labels(y)], owners, shown)

    def _learn(
        self, means: np.ndarray, y: Labels, groups: np.ndarray, unknown: Others | None
    ) -> "StudentTClassifier":
        """Learn from tensors (trial, sensor, mean of ``step`` samples)."""
        self._training: _Training = (means, y, groups, unknown)
        self._without: dict[tuple[int, ...], StudentTClassifier] = {}
        self.classes_ = sort_classes(y)
        number = number_labels(y, self.classes_)
        flat, other, kinds = means.reshape(len(means), -1), None, list[Hashable]()
        if unknown is not None:
            other = np.reshape(unknown[0], (len(unknown[0]), -1))
            kinds = list(unknown[1])
        squared = np.full((len(flat), len(self.classes_)), np.inf)
        likelier = np.full(len(flat), -np.inf)
        folds = np.unique(groups, return_inverse=True)[1] % _FOLDS
        for fold in np.unique(folds):
            held = folds == fold
            if len(set(number[~held])) == len(self.classes_):
                self._shape(flat[~held], number[~held], other, kinds)
                squared[held], likelier[held] = self._measure(flat[held])
        seen = np.isfinite(squared).all(axis=1)
        if len(self.classes_) < 2 or not seen.any():
            raise InvalidInput(
                "clouds need 2 classes or more, and each in at least two groups of touches."
            )
        self.confusion_ = np.zeros((len(self.classes_),) * 2, dtype=int)
        np.add.at(self.confusion_, (number[seen], squared[seen].argmin(axis=1)), 1)
        self.temperature_ = find_temperature(self._score(squared[seen]), number[seen])
        self._limit(squared[seen].min(axis=1), likelier[seen])
        self.held_out_ = np.full(len(flat), np.nan)
        self.held_out_[seen] = self._compare(squared[seen].min(axis=1), likelier[seen])
        self._shape(flat, number, other, kinds)
        return self

    def _look(self, X: Any, until: float | None) -> tuple["StudentTClassifier", Any]:
        """The classifier for a deadline, a whole number of means, and for the sensors that have
        values; fitted when first asked for.
        """
        X = self._require(X)
        end = np.shape(X)[2] if until is None else count_until(X, until)
        X = np.asarray(X, dtype=float)
        there = np.isfinite(X).any(axis=(0, 2))
        there = there if there.any() else np.ones_like(there)
        step = min(self.step, X.shape[2])
        first, count = X.shape[2] % step, (end - X.shape[2] % step) // step
        if count < 1:
            raise InvalidInput(f"a deadline needs {first + step} samples or more, got {end}.")
        means, y, groups, unknown = self._training
        if there.all() and count == means.shape[2]:
            return self, X
        key, end = (*np.flatnonzero(there), -count), first + count * step
        if key not in self._without:
            part: StudentTClassifier = clone(self)
            part.shape_ = int(there.sum()), end
            others = unknown and (unknown[0][:, there, :count], unknown[1])
            part._learn(means[:, there, :count], y, groups, others)
            self._without[key] = part
        return self._without[key], X[:, there, :end]

    def pack(self, *, training: bool = True) -> tuple[dict[str, np.ndarray], dict[str, Any]]:
        """Arrays and settings (as JSON) of all that was learned, for :meth:`unpack`.

        ``training`` also keeps the training set (in single precision), from which deadlines and
        missing sensors are learned when they are first asked about.
        """
        self._require()
        limits = [self.temperature_, self.limit_, *self._odds]
        arrays = {
            "means": self._means,
            "round": self._round,
            "mean": self._components.mean_,
            "components": self._components.components_,
            "confusion": self.confusion_,
            "held_out": self.held_out_,
            "limits": np.array(limits, dtype=float),
        }
        if self._others is not None:
            arrays |= {f"others{name}": values for name, values in vars(self._others).items()}
        settings = {
            "parameters": self.get_params(),
            "classes": self.classes_.tolist(),
            "kinds": [],
        }
        settings["shape"] = [int(length) for length in self.shape_]
        if training:
            means, y, groups, unknown = self._training
            arrays["taught"] = means.astype(np.float32)
            arrays["labels"] = number_labels(y, self.classes_)
            arrays["groups"] = np.unique(groups, return_inverse=True)[1]
            if unknown is not None:
                arrays["strangers"] = np.asarray(unknown[0]).astype(np.float32)
                settings["kinds"] = list(unknown[1])
        return arrays, settings

    @classmethod
    def unpack(
        cls,
        arrays: dict[str, np.ndarray],
        settings: dict[str, Any],
        taught: _Training | None = None,
    ) -> "StudentTClassifier":
        """What :meth:`pack` gave; ``taught`` is the training set where it is kept elsewhere."""
        made = cls(**settings["parameters"])
        made.classes_ = list_classes([_freeze_label(label) for label in settings["classes"]])
        made.shape_ = tuple(settings["shape"])
        made._means, made._round = arrays["means"], arrays["round"]
        made._components = PrincipalComponents(len(arrays["components"]))
        made._components.mean_, made._components.components_ = (
            arrays["mean"],
            arrays["components"],
        )
        made._components.n_features_in_ = arrays["mean"].size
        made.confusion_, made.held_out_ = arrays["confusion"], arrays["held_out"]
        made.temperature_, made.limit_, *odds = map(float, arrays["limits"])
        made._odds = (odds[0], odds[1])
        made._others = None
        if "others_means" in arrays:
            made._others = _NoveltyDetector.__new__(_NoveltyDetector)
            names = ("_means", "_spread", "_along")
            vars(made._others).update({name: arrays[f"others{name}"] for name in names})
        if taught is None:
            others = None
            if "strangers" in arrays:
                kinds = [_freeze_label(kind) for kind in settings["kinds"]]
                others = arrays["strangers"].astype(float), kinds
            labels = [made.classes_[k] for k in arrays["labels"]]
            taught = arrays["taught"].astype(float), labels, arrays["groups"], others
        made._training, made._without = taught, {}
        return made

    def measure_strangeness(self, X: Any, until: float | None = None) -> np.ndarray:
        """How strange each touch is (trial,); > 1 is unlike all classes, NaN without contact.

        The greater of two: the squared distance to the nearest class over its limit; and 1 plus by
        how much it is likelier a stranger's than the limit allows, in standard deviations of the
        known touches that were held out.
        """
        classifier, seen = self._look(X, until)
        strange = np.full(len(seen), np.nan)
        whole = np.isfinite(seen).all(axis=(1, 2))
        if whole.any():
            squared, likelier = classifier._measure(
                classifier._flatten(np.asarray(seen)[whole])
            )
            strange[whole] = classifier._compare(squared.min(axis=1), likelier)
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
        """Strangeness from distances and from how much likelier unknown are (trial,)."""
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
        return -0.5 * (self.freedom + self._means.shape[1]) * np.log1p(squared / self.freedom)

    def _shape(
        self,
        flat: np.ndarray,
        number: np.ndarray,
        other: np.ndarray | None,
        kinds: Sequence[Hashable],
    ) -> None:
        """Means of the classes, what makes their common covariance round, and unknown there."""
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
        if other is not None:
            self._others = _NoveltyDetector(self._place(other), kinds)

    def _place(self, flat: np.ndarray) -> np.ndarray:
        """Where touches lie among components, in units in which classes are round."""
        return np.asarray(self._components.transform(flat)) @ self._round.T

    def _measure(self, flat: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Squared Mahalanobis distances (trial, class), and how much likelier unknown are."""
        places = self._place(flat)
        off = places[:, None] - self._means @ self._round.T
        squared = np.sum(off * off, axis=2)
        if self._others is None:
            return squared, np.full(len(flat), -np.inf)
        return squared, self._others.weigh(places, squared.min(axis=1))

    def _flatten(self, X: Any) -> np.ndarray:
        return self._average(np.asarray(X, dtype=float)).reshape(len(X), -1)

    def _average(self, X: np.ndarray) -> np.ndarray:
        """Means (trial, sensor, mean) of ``step`` samples each, up to the last sample."""
        check_squares(X)
        step = min(self.step, X.shape[2])
        return X[:, :, X.shape[2] % step :].reshape(len(X), X.shape[1], -1, step).mean(axis=3)


def _freeze_label(label: Any) -> Any:
    """A label that JSON gave back."""
    return tuple(label) if isinstance(label, list) else label


class _NoveltyDetector:
    """A t cloud around each kind's mean, wide where unknown differ among each other.

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
