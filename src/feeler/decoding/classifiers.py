"""Classifiers by name, as scikit-learn estimators on few principal components."""

from collections.abc import Callable, Iterable, Sequence
from importlib.metadata import entry_points
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackError, eigsh
from scipy.special import softmax
from sklearn.base import (
    BaseEstimator,
    ClassifierMixin,
    ClassNamePrefixFeaturesOutMixin,
    TransformerMixin,
    clone,
)
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.exceptions import NotFittedError
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC
from sklearn.utils import get_tags
from sklearn.utils.metaestimators import available_if
from sklearn.utils.validation import check_is_fitted, validate_data

from feeler.errors import InvalidInput
from feeler.records import Registry
from feeler.tensors.transforms import (
    check_axes,
    check_squares,
    label_like,
    read_axes,
    refuse_masked,
    stack_planes,
)
from feeler.validation import checked, show

# Class labels of trials: feature × size × location.

Labels = Sequence[Any] | Annotated[np.ndarray, "trial ..."]
"""One class per trial."""
# [P] six features (three shapes, two sizes) at five locations: 30 classes
_CLASS = ("feature", "size", "location")


@checked
def make_labels(trials: Any, by: Sequence[str] = _CLASS) -> np.ndarray:
    """One readable label per trial, e.g. ``ball 1.5 0.5``.

    Parameters
    ----------
    trials
        A Dataset (or anything indexed by name that gives one value per trial) with the coordinates
        in ``by``.
    by
        What makes a class.
    """
    columns = []
    for name in by:
        try:
            columns.append(np.asarray(trials[name]))
        except (KeyError, TypeError, IndexError):
            raise InvalidInput(
                f"the trials have no coordinate {name!r}; labels need {', '.join(by)}."
            ) from None
    return np.array([_write_label(row) for row in zip(*columns, strict=True)])


def read_labels(values: Labels, what: str = "labels") -> np.ndarray:
    """Labels as an array (trial,) whose values can be discriminated and sorted; tuples stay tuples.

    Raises
    ------
    InvalidInput
        Not one for each trial, or of several kinds, None or NaN among them.
    """
    listed = getattr(values, "values", values)
    try:
        sound = all(one == one for one in sorted(set(listed)))
    except TypeError:
        sound = False
    if not sound:
        raise InvalidInput(
            f"{what} must be texts or numbers, one for each trial, all of one kind and none"
            f" missing, got {show(values)}."
        )
    return list_classes([*listed])


def sort_classes(labels: Iterable[Any]) -> np.ndarray:
    """Each label once, sorted, as an array (class,); tuples stay tuples."""
    return list_classes(sorted(set(labels)))


def list_classes(classes: Sequence[Any]) -> np.ndarray:
    """Classes as an array (class,) in their order; tuples stay tuples."""
    nested = any(isinstance(one, tuple) for one in classes)
    return _keep_objects(classes) if nested else np.array(classes)


def number_labels(labels: Iterable[Any], classes: np.ndarray) -> np.ndarray:
    """The number of each label among the classes (trial,)."""
    place = {name: number for number, name in enumerate(classes)}
    return np.array([place[label] for label in labels], dtype=int)


def check_counts(tensors: Any, labels: Any, what: str = "labels") -> None:
    """Refuse labels that are not one for each tensor, or of other trials than these are."""
    count = getattr(tensors, "sizes", {}).get("trial", len(tensors))
    if len(labels) != count:
        raise InvalidInput(f"{count} tensors but {len(labels)} {what}; give one for each.")
    mine, theirs = (getattr(one, "indexes", {}).get("trial") for one in (tensors, labels))
    rows: Any = getattr(labels, "index", None)  # of a Series: the same trials in another order
    if mine is not None and hasattr(rows, "equals") and {*rows} == {*mine}:
        theirs = rows
    if mine is not None and theirs is not None and not mine.equals(theirs):
        raise InvalidInput(
            f"{what} are of other trials than the tensors, or in another order, by their"
            " coordinate trial or index. Take those of the tensors, such as X.feature, or .values."
        )


def check_labels(tensors: Any, labels: Any) -> np.ndarray:
    """Labels (trial,), if they are one for each tensor, and not all of one class."""
    check_counts(tensors, labels)
    found = read_labels(labels)
    if len(set(found)) < 2:
        raise InvalidInput(
            "only one class: nothing to discriminate. Give at least two classes."
        )
    return found


def _keep_objects(values: Sequence[Any]) -> np.ndarray:
    """An array (value,) of what NumPy would take apart."""
    found = np.empty(len(values), dtype=object)
    found[:] = values
    return found


def _write_label(label: Any) -> Any:
    """A label of several parts as one text; any other as it is."""
    if not isinstance(label, tuple):
        return label
    numbers = (float, np.floating)
    return " ".join(f"{one:g}" if isinstance(one, numbers) else str(one) for one in label)


# Principal components of few trials with many entries, exact.

_PRECISION = 1e-12


class PrincipalComponents(ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator):
    """Exact PCA through the smaller of the Gram and the covariance matrix.

    scikit-learn's ``PCA`` with the same ``n_components``, up to sign; its automatic solver would be
    a randomised approximation at this size, which the flat noise spectrum here does not suit.

    Parameters
    ----------
    n_components
        Components kept; fewer where there are fewer trials or entries, or where the trials span
        fewer directions about their mean, as n trials span n − 1 at most: what rounding leaves of
        the others says nothing.

    Attributes
    ----------
    components_ (component, entry), mean_ (entry,), explained_variance_ (component,),
    explained_variance_ratio_ (component,)
    """

    def __init__(self, n_components: int = 30):
        self.n_components = n_components

    def fit(self, X, y=None):
        """Find the components of ``X`` (trial, entry).

        Raises
        ------
        InvalidInput
            No component asked for, or numbers whose squares are none.
        """
        X = validate_data(self, X, dtype=float, ensure_min_samples=2)
        check_squares(X, "training trials")
        self.mean_ = X.mean(axis=0)
        self.components_, energy, total = _find_components(X - self.mean_, self.n_components)
        self.explained_variance_ = energy / (len(X) - 1)
        self.explained_variance_ratio_ = energy / total
        return self

    @property
    def _n_features_out(self) -> int:
        """By which scikit-learn names the columns of ``set_output``."""
        return len(self.components_)

    def transform(self, X):
        """Coordinates (trial, component) of ``X``; labelled where ``X`` is."""
        check_is_fitted(self)
        values = validate_data(self, X, dtype=float, reset=False)
        return label_like(
            (values - self.mean_) @ self.components_.T, X, ("trial", "component"), "coordinate"
        )


def _find_components(centred: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray, float]:
    """At most k unit components (component, entry), the sum of squares of rows (trial, entry) along
    each, and over all.
    """
    if k < 1:
        raise InvalidInput(f"n_components must be at least 1; got {k!r}.")
    k, tiny = min(k, *centred.shape), np.finfo(float).tiny
    if len(centred) <= centred.shape[1]:
        energy, left = _find_longest(centred @ centred.T, k)
        axes = left.T @ centred
    else:
        energy, right = _find_longest(centred.T @ centred, k)
        axes = right.T
    order = np.argsort(energy)[::-1]
    order = order[: max(1, np.count_nonzero(energy > _PRECISION * energy.max()))]
    norm = np.linalg.norm(axes[order], axis=1, keepdims=True)
    total = max(float(np.vdot(centred, centred)), tiny)
    return axes[order] / np.maximum(norm, tiny), np.maximum(energy[order], 0.0), total


def project(
    sets: Sequence[np.ndarray], n_components: int
) -> tuple[list[np.ndarray], tuple[float, float]]:
    """Every set (trial, ...) in the principal components of the first, as
    :class:`PrincipalComponents` gives them, and which shares of the variance of the first and of
    the last they keep.
    """
    flat = [one.reshape(len(one), -1) for one in sets]
    mean = flat[0].mean(axis=0)
    centred = flat[0] - mean
    axes, energy, total = _find_components(centred, n_components)
    found = [centred @ axes.T, *((one - mean) @ axes.T for one in flat[1:])]
    return found, (float(energy.sum() / total), share_kept(flat[-1], axes))


def _find_longest(square: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
    """The k greatest eigenvalues of a symmetric matrix and their vectors, by Lanczos' method where
    it is three times as fast; it stops at 1e-12 of them.
    """
    n = len(square)
    if n < 20 * k:
        return eigh(square, subset_by_index=(n - k, n - 1))
    start = np.random.default_rng(0).standard_normal(n)  # ones would lie in the null space
    try:
        return eigsh(square, k, which="LA", ncv=min(3 * k, n), tol=_PRECISION, v0=start)
    except ArpackError:  # such as for trials that are all the same
        return eigh(square, subset_by_index=(n - k, n - 1))


def share_kept(X: np.ndarray, axes: np.ndarray) -> float:
    """Share of the variance of ``X`` (trial, entry) about its own mean that orthonormal axes
    (component, entry) keep.
    """
    centred = X - X.mean(axis=0)
    total = float(np.vdot(centred, centred))
    kept = centred @ axes.T
    return float(np.vdot(kept, kept)) / total if total > 0 else float("nan")


# The Classifier: whatever says from a tensor which touch it was, by when it is asked.

NO_CONTACT = ("no contact", float("nan"), float("nan"))
"""What a touch without contact is called."""

CLASSIFIERS: Registry[Any] = Registry(
    "classifier",
    {one.name: one.value for one in entry_points(group="feeler.classifiers")}
    | {
        "lda": "feeler.decoding.classifiers:make_lda",
        "svm": "feeler.decoding.classifiers:make_svm",
        "cnn": "feeler.decoding.network:TouchNetwork",
        "templates": "feeler.decoding.observers:TemplateClassifier",
        "stream": "feeler.decoding.streams:StreamDecoder",
        "ideal": "feeler.decoding.observers:IdealObserver",
    },
)
"""What makes each known classifier, by name. ``CLASSIFIERS.register(name, make)`` adds one to this
process; a package adds one everywhere, the command line included, by an entry point of the group
``feeler.classifiers``: ``mine = "my_package:make"``."""


def describe_classifier(classifier: Any) -> str:
    """A text that another classifier does not have: by it what was computed is found again."""
    file = Path(str(classifier).partition(":")[0])
    source = file.read_text(encoding="utf-8") if file.suffix == ".py" else ""
    return f"{classifier}\n{source}"


class _NotFitted(InvalidInput, NotFittedError):
    """Not fitted; scikit-learn's own error too."""


class Classifier(ClassifierMixin, BaseEstimator):
    """Says which touch a tensor is of. A scikit-learn classifier of tensors (trial, sensor, time).

    A subclass gives ``fit``, which calls ``_keep``, and ``_decide``. Asked about a deadline, it
    then learns the samples up to it as a task of its own. Where evidence adds up in time, a
    subclass gives ``decide`` instead.

    Attributes
    ----------
    classes_
        Labels, sorted, as an array; a label may be a tuple.
    """

    classes_: np.ndarray
    shape_: tuple[int, ...]
    knows_noise = False
    """Whether it learns clean tensors and is told the noise, by its parameter ``noise``."""

    @property
    def n_features_in_(self) -> int:
        """Sensors of the tensors that it learned; of a table its columns."""
        check_is_fitted(self)
        return int(self.shape_[0])

    def fit(self, X: Any, y: Labels) -> "Classifier":
        """Learn from tensors (trial, sensor, time) with one label each."""
        raise NotImplementedError

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Scores (trial, class), the answer's the greatest; NaN rows for tensors without contact.

        ``until`` is the deadline [ms since contact]; None: the whole touch.
        """
        classifier, seen = self._look(X, until)
        return classifier._decide(seen)

    def predict_proba(self, X: Any, until: float | None = None) -> Any:
        """Probability of each class.

        Parameters
        ----------
        X
            Tensors (trial, sensor, time).
        until
            Only samples up to this time are used [ms since contact]; None: the whole touch.

        Returns
        -------
        Probabilities (trial, class), NaN without contact; labelled where the tensors are.
        """
        found = self._weigh(self.decide(X, until))
        found = label_like(found, X, ("trial", "class"), "probability")
        if isinstance(found, np.ndarray):
            return found
        # a tuple as make_labels writes one
        return found.assign_coords({"class": [_write_label(label) for label in self.classes_]})

    def predict(self, X: Any, until: float | None = None) -> Any:
        """The best label of each tensor (trial,), ``NO_CONTACT`` where there was none."""
        scores = self.decide(X, until)
        unseen = np.isnan(scores).any(axis=1)
        found = self.classes_[np.where(unseen, 0, scores.argmax(axis=1))]
        if unseen.any() or isinstance(X, xr.DataArray):
            found = _keep_objects(found.tolist())
        for k in np.flatnonzero(unseen):
            found[k] = NO_CONTACT
        return label_like(found, X, ("trial",), "label")

    def score(
        self,
        X: Any,
        y: Labels,
        sample_weight: np.ndarray | None = None,
        until: float | None = None,
    ) -> float:
        """Share of labels that are right, in all of their parts."""
        found = self.predict(X, until)
        check_counts(found, y)
        pairs = (getattr(one, "values", one) for one in (found, y))
        right = [answer == true for answer, true in zip(*pairs, strict=True)]
        return float(np.average(right, weights=sample_weight))

    def __sklearn_tags__(self) -> Any:
        """Tensors come in three dimensions."""
        tags = super().__sklearn_tags__()
        tags.input_tags.two_d_array, tags.input_tags.three_d_array = False, True
        return tags

    def _decide(self, X: Any) -> np.ndarray:
        """Scores (trial, class) of tensors like those of the fit."""
        raise NotImplementedError

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        """Probabilities from scores."""
        return scores

    def _keep(self, X: Any, y: Any, **beside: Any) -> None:
        """Remember what is taught, for deadlines that may be asked for later; labels that no
        classifier learns from are refused.
        """
        if (isinstance(y, Sequence | np.ndarray) or hasattr(y, "values")) and np.ndim(X) == 3:
            check_labels(X, y)
        refuse_masked(X)
        self._axes = read_axes(X, aligned=True)
        self._taught = (stack_planes(X), y, beside)
        self._parts: dict[int, Classifier] = {}
        self.shape_ = _get_shape(self._taught[0])

    def _require(self, X: Any = None) -> Any:
        """Tensors with dims in order; refused if it is unfitted, or of other sensors or samples."""
        try:
            check_is_fitted(self)
        except NotFittedError:
            raise _NotFitted(
                "the classifier was asked before it was fitted; call fit(tensors, labels) first."
            ) from None
        X = stack_planes(X)
        known: tuple[int, ...] = getattr(self, "shape_", ())
        given = _get_shape(X)
        if len(known) == len(given) == 2 and known != given:
            raise InvalidInput(
                f"the classifier learned tensors of {known[0]} sensors × {known[1]} samples, got"
                f" {given[0]} × {given[1]}. Give it touches of the same sensors and window."
            )
        refuse_masked(X)
        check_axes(X, getattr(self, "_axes", {}))
        return X

    def _look(self, X: Any, until: float | None) -> tuple["Classifier", Any]:
        """The classifier for a deadline, fitted when first asked for, and what it may see."""
        X = self._require(X)
        if until is None or (end := count_until(X, until)) == np.shape(X)[2]:
            return self, X
        if not hasattr(self, "_taught"):
            raise InvalidInput(
                "this classifier came from a file, which holds no touches to learn a deadline from;"
                " fit it again, or ask without until=."
            )
        if end not in self._parts:
            tensors, labels, beside = self._taught
            self._parts[end] = self._renew().fit(tensors[:, :, :end], labels, **beside)
        return self._parts[end], X[:, :, :end]

    def _renew(self) -> "Classifier":
        """An unfitted copy that takes shorter tensors."""
        return clone(self)


@checked
def count_until(tensors: Any, until: float) -> int:
    """Samples of tensors (trial, sensor, time) up to a moment after contact.

    Parameters
    ----------
    tensors
        A DataArray with the coordinate ``time`` [ms], whose contact is at ``lead`` [ms], or at 0
        without this coordinate; or an array whose samples of 1 ms begin with contact.
    until
        The moment [ms since contact].

    Returns
    -------
    int
        At most all samples.

    Raises
    ------
    InvalidInput
        Trials whose contact begins at different times, or no sample up to the moment.
    """
    time = np.arange(1.0, np.shape(tensors)[2] + 1)
    if isinstance(tensors, xr.DataArray) and "time" in tensors.coords:
        lead = np.unique(tensors.coords.get("lead", 0.0))
        if lead.size > 1:
            raise InvalidInput(
                f"contact begins {lead[0]:g} to {lead[-1]:g} ms after the first sample; a deadline"
                " needs trials of one lead."
            )
        time = tensors["time"].values - lead[0]
    count = int(np.sum(time <= until + 1e-9))
    if count < 1:
        raise InvalidInput(
            f"no sample lies within {until:g} ms of contact; ask for a later one."
        )
    return count


@checked
def measure_classifier(
    classifier: Any, tensors: Any, labels: Labels, until: float | None = None
) -> tuple[float, float]:
    """Accuracy of a fitted classifier, and the bits that it gets from touches with known labels.

    Parameters
    ----------
    classifier
        A fitted :class:`Classifier`.
    tensors
        Touches (trial, sensor, time).
    labels
        Class of each.
    until
        Deadline [ms since contact]; None: the whole touch.

    Returns
    -------
    accuracy
        Share of touches classified correctly.
    bits
        log₂ K + mean log₂ p(true), a lower bound on the mutual information of class and tensor
        (Barber & Agakov 2003). A touch without noticed contact counts as a guess.
    """
    if not hasattr(classifier, "predict_proba"):
        raise InvalidInput(f"classifier must be a fitted Classifier, got {classifier!r:.60}.")
    chance = np.asarray(classifier.predict_proba(tensors, until), dtype=float)
    classes = list(classifier.classes_)
    if unknown := [label for label in labels if label not in classes]:
        raise InvalidInput(f"the classifier never learned the class {unknown[0]!r}.")
    check_counts(tensors, labels)
    seen = np.isfinite(chance).all(axis=1)
    chance[~seen] = 1 / len(classes)
    true = np.array([classes.index(label) for label in labels])
    own = np.maximum(chance[np.arange(true.size), true], np.finfo(float).tiny)
    right = seen & (chance.argmax(axis=1) == true)
    return float(right.mean()), float(np.log2(len(classes)) + np.log2(own).mean())


def _get_shape(X: Any) -> tuple[int, ...]:
    """Lengths of one tensor or row; none for what only turns into an array."""
    return tuple(getattr(X, "shape", ())[1:])


# Classifiers as scikit-learn pipelines; everything they learn, they learn in ``fit``.

_N_COMPONENTS = 30  # [P] "selected the first 30 features"
_LDA_TOL = 1e-4  # scikit-learn's, of singular values within classes
_MOST_SCORES = 2**23  # at a time, which bounds memory


class _FlatPipeline(Classifier, Pipeline):
    """A pipeline that takes tables (trial, entry), and tensors (trial, sensor, time) flattened."""

    def fit(self, X: Any, y: Any = None, **params: Any) -> "_FlatPipeline":
        """Fit all steps."""
        self._keep(X, y)
        try:
            return Pipeline.fit(self, _flatten(X), y, **params)
        except IndexError:
            if not isinstance(self.steps[-1][1], LinearDiscriminantAnalysis):
                raise
            raise InvalidInput(  # scikit-learn's LDA needs spread within classes
                "the tensors of each class are all the same: give some with noise, or a classifier"
                " that is told the noise."
            ) from None

    def predict(self, X: Any, until: float | None = None, **params: Any) -> Any:
        """The label of each trial; labelled where the tensors are."""
        classifier, seen = self._look(X, until)
        found = Pipeline.predict(classifier, _flatten(seen), **params)
        return label_like(found, X, ("trial",), "label")

    @available_if(lambda self: hasattr(self.steps[-1][1], "decision_function"))
    def decision_function(self, X: Any, **params: Any) -> np.ndarray:
        """Scores (trial, class) of the last step; (trial,) where there are two classes."""
        return Pipeline.decision_function(self, _flatten(X), **params)

    def _decide(self, X: Any) -> np.ndarray:
        """Probabilities, or votes as such where the last step gives none."""
        if hasattr(self.steps[-1][1], "predict_proba"):
            return Pipeline.predict_proba(self, _flatten(X))
        return softmax(compute_decision_scores(self.decision_function(X)), axis=1)

    def __sklearn_tags__(self) -> Any:
        """Two dimensions or three; principal components are of double precision."""
        tags = super().__sklearn_tags__()
        tags.input_tags.two_d_array = True
        if tags.transformer_tags is not None:
            tags.transformer_tags.preserves_dtype = ["float64"]
        return tags


class _Own(Classifier):
    """A method of the user's own, of tensors or of tables."""

    def __init__(self, method: Any) -> None:
        self.method = method

    def fit(self, X: Any, y: Any) -> "_Own":
        """Fit a copy of the method."""
        self._keep(X, y)
        self.classes_, self.flat_ = np.unique(y), not _takes_tensors(self.method)
        self.method_ = clone(self.method, safe=False)
        try:
            self.method_.fit(self._form(X), y)
        except Exception as error:
            if self.flat_:
                error.add_note(f"{type(self.method).__name__} was given a table. {_TABLES}")
            raise
        return self

    def predict(self, X: Any, until: float | None = None) -> Any:
        """What the method answers."""
        own, seen = self._look(X, until)
        return label_like(own._ask("predict", seen), X, ("trial",), "label")

    def _decide(self, X: Any) -> np.ndarray:
        if hasattr(self.method_, "predict_proba"):
            return self._ask("predict_proba", X)
        votes = self._ask("predict", X)[:, None] == self.classes_
        return softmax(votes.astype(float), axis=1)

    def _ask(self, what: str, X: Any) -> np.ndarray:
        return np.asarray(getattr(self.method_, what)(self._form(X)))

    def _form(self, X: Any) -> Any:
        return _flatten(X) if self.flat_ else np.asarray(X)


_TABLES = (
    "A scikit-learn estimator gets tables (trial, entry) unless its tags say three_d_array or"
    " no_validation; anything else gets tensors (trial, sensor, time)."
)


def _takes_tensors(method: Any) -> bool:
    """By its tags, or by those of its first step or of the estimator that it wraps."""
    if not hasattr(method, "__sklearn_tags__"):
        return True
    tags = get_tags(method)
    if tags.no_validation or tags.input_tags.three_d_array:
        return True
    steps = getattr(method, "steps", None) or getattr(method, "estimators", None)
    inner = steps[0][1] if steps else getattr(method, "estimator", None)
    return inner is not None and _takes_tensors(inner)


def adopt(method: Any, name: str) -> Classifier:
    """A method as a classifier of tensors (trial, sensor, time).

    Parameters
    ----------
    method
        A ``Classifier``, or anything with ``fit(tensors, labels)`` and ``predict(tensors)``. A
        scikit-learn estimator gets tables (trial, entry) unless its tags, or those of a pipeline's
        first step, say ``three_d_array`` or ``no_validation``. Without ``predict_proba``
        probabilities are the softmax of votes.
    name
        What gave it, for the message.

    Raises
    ------
    InvalidInput
        It has no ``fit`` or no ``predict``.
    """
    if isinstance(method, Classifier):
        return method
    if not all(callable(getattr(method, one, None)) for one in ("fit", "predict")):
        raise InvalidInput(
            f"{name} must give something with fit(tensors, labels) and predict(tensors), got"
            f" {show(method)}."
        )
    return _Own(method)


@checked
def make_lda(n_components: int | None = _N_COMPONENTS) -> _FlatPipeline:
    """Principal components, then linear discriminant analysis: the paper's classifier.

    Parameters
    ----------
    n_components
        Principal components kept; None for LDA on the entries themselves.

    Notes
    -----
    Paper, "Feature classification from tactile tensors".
    """
    return _chain(n_components, LinearDiscriminantAnalysis())


def fit_lda(rows: np.ndarray, classes: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    """What says the class of rows (row, entry), as scikit-learn's ``LinearDiscriminantAnalysis``.

    Parameters
    ----------
    rows, classes
        To learn from; classes are numbered from 0, and each occurs.
    """
    counts = np.bincount(classes)
    starts = np.cumsum(counts) - counts
    means = np.add.reduceat(rows[np.argsort(classes, kind="stable")], starts)
    means /= counts[:, None]
    within = rows - means[classes]
    square = within.T @ within
    scale = np.sqrt(np.diag(square) / len(rows))
    scale[scale == 0] = 1.0
    square /= max(len(rows) - counts.size, 1)
    energy, turn = np.linalg.eigh(square / np.outer(scale, scale))
    keep = energy > _LDA_TOL**2
    white = turn[:, keep] / np.sqrt(energy[keep]) / scale[:, None]
    centre = means.mean(axis=0)
    centres = (means - centre) @ white
    offset = np.log(counts / len(rows)) - 0.5 * (centres**2).sum(axis=1)

    def classify(asked: np.ndarray) -> np.ndarray:
        parts = np.array_split(asked, 1 + len(asked) * counts.size // _MOST_SCORES)
        return np.concatenate(
            [((part - centre) @ white @ centres.T + offset).argmax(axis=1) for part in parts]
        )

    return classify


@checked
def make_svm(
    n_components: int | None = _N_COMPONENTS, *, kernel: str = "linear", C: float = 1.0
) -> _FlatPipeline:
    """Principal components, one scale, one-vs-one support vector machine (the paper's, for robots).

    Parameters
    ----------
    n_components
        Principal components kept; None for all entries.
    kernel, C
        Of ``sklearn.svm.SVC``; the paper states neither [C].

    Notes
    -----
    Its probabilities are the softmax of its votes, and not calibrated; for calibrated ones wrap it
    in ``sklearn.calibration.CalibratedClassifierCV``.
    """
    return _chain(n_components, StandardScaler(), SVC(kernel=kernel, C=C))


def compute_decision_scores(decision: np.ndarray) -> np.ndarray:
    """Scores (trial, class) of a support vector machine, which gives two classes one number."""
    return np.stack([-decision, decision], axis=1) if decision.ndim == 1 else decision


def _chain(n_components: int | None, *steps: Any) -> _FlatPipeline:
    first = () if n_components is None else (PrincipalComponents(n_components),)
    return _FlatPipeline(make_pipeline(*first, *steps).steps)


def _flatten(X: Any) -> Any:
    X = stack_planes(X)
    return np.reshape(np.asarray(X), (len(X), -1)) if getattr(X, "ndim", 2) > 2 else X
