"""The Reader: whatever says from a tensor which touch it was, by when it is asked."""

from typing import Any, Protocol

import numpy as np
import xarray as xr
from sklearn.base import BaseEstimator, ClassifierMixin, clone
from sklearn.exceptions import NotFittedError
from sklearn.utils.validation import check_is_fitted

from feeler.decoding.labels import Labels, write_label
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.registry import Registry
from feeler.tensors.scaling import fold_planes, label_like

NO_CONTACT = ("no contact", float("nan"), float("nan"))
"""What a touch without contact is called."""

READERS: Registry[Any] = Registry(
    "reader",
    {
        "lda": "feeler.decoding.classifiers:make_lda",
        "svm": "feeler.decoding.classifiers:make_svm",
        "cnn": "feeler.decoding.cnn:TouchNetwork",
        "templates": "feeler.decoding.told:TemplateReader",
        "stream": "feeler.decoding.decoder:StreamDecoder",
        "ideal": "feeler.decoding.told:IdealReader",
    },
)
"""What makes each known reader, by name; ``READERS.register(name, make)`` adds one."""


class _NotFitted(InvalidInput, NotFittedError):
    """Asked before it was fitted; scikit-learn's own error too."""


class Reader(ClassifierMixin, BaseEstimator):
    """Says which touch a tensor is of. A scikit-learn classifier of tensors (trial, sensor, time).

    A subclass gives ``fit``, which calls ``_keep``, and ``_decide``. Asked about a deadline, it
    then learns the samples up to it as a task of its own. Where evidence adds up in time, a
    subclass gives ``decide`` instead.

    Attributes
    ----------
    classes_
        Labels, sorted; a label may be a tuple.
    """

    classes_: Any
    knows_noise = False
    """Whether it learns clean tensors and is told the noise, by its parameter ``noise``."""

    def fit(self, X: Any, y: Labels) -> "Reader":
        """Learn from tensors (trial, sensor, time) with one label each."""
        raise NotImplementedError

    def decide(self, X: Any, until: float | None = None) -> np.ndarray:
        """Scores (trial, class), the answer's the greatest; NaN rows for tensors without contact.

        ``until`` is the deadline [ms since contact]; None: the whole touch.
        """
        reader, seen = self._look(X, until)
        return reader._decide(seen)

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
        return _name_classes(
            label_like(found, X, ("trial", "class"), "probability"), self.classes_
        )

    def predict(self, X: Any, until: float | None = None) -> Any:
        """The best label of each tensor, ``NO_CONTACT`` where there was none."""
        scores = self.decide(X, until)
        best = [-1 if np.isnan(row).any() else int(row.argmax()) for row in scores]
        found = [NO_CONTACT if k < 0 else self.classes_[k] for k in best]
        if not isinstance(X, xr.DataArray):
            return found if isinstance(self.classes_, list) else np.array(found)
        answers = np.empty(len(found), dtype=object)
        answers[:] = found
        return label_like(answers, X, ("trial",), "label")

    def score(
        self,
        X: Any,
        y: Labels,
        sample_weight: np.ndarray | None = None,
        until: float | None = None,
    ) -> float:
        """Share of labels that are right, in all of their parts."""
        found = self.predict(X, until)
        found = found.values if isinstance(found, xr.DataArray) else found
        right = [answer == true for answer, true in zip(found, y, strict=True)]
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
        """Remember what is taught, for deadlines that may be asked for later."""
        self._taught = (fold_planes(X), y, beside)
        self._parts: dict[int, Reader] = {}
        self.shape_ = _get_shape(self._taught[0])

    def _require(self, X: Any = None) -> None:
        """Refuse to answer unfitted, or about tensors of other sensors or samples."""
        try:
            check_is_fitted(self)
        except NotFittedError:
            raise _NotFitted(
                "the reader was asked before it was fitted; call fit(tensors, labels) first."
            ) from None
        known: tuple[int, ...] = getattr(self, "shape_", ())
        given = _get_shape(X)
        if len(known) == len(given) == 2 and known != given:
            raise InvalidInput(
                f"the reader learned tensors of {known[0]} sensors × {known[1]} samples, got"
                f" {given[0]} × {given[1]}. Give it touches of the same sensors and window."
            )

    def _look(self, X: Any, until: float | None) -> tuple["Reader", Any]:
        """The reader for a deadline, fitted when first asked for, and what it may see."""
        X = fold_planes(X)
        self._require(X)
        if until is None or (end := count_until(X, until)) == np.shape(X)[2]:
            return self, X
        if not hasattr(self, "_taught"):
            raise InvalidInput(
                "this reader came from a file, which holds no touches to learn a deadline from;"
                " fit it again, or ask without until=."
            )
        if end not in self._parts:
            tensors, labels, beside = self._taught
            self._parts[end] = self._renew().fit(tensors[:, :, :end], labels, **beside)
        return self._parts[end], X[:, :, :end]

    def _renew(self) -> "Reader":
        """An unfitted copy that takes shorter tensors."""
        return clone(self)


@checked
def count_until(tensors: Any, until: float) -> int:
    """Samples of tensors (trial, sensor, time) up to a moment after contact.

    Parameters
    ----------
    tensors
        A DataArray with the coordinates ``time`` [ms] and ``lead`` (time of contact) [ms]; or an
        array whose samples of 1 ms begin with contact.
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
    if isinstance(tensors, xr.DataArray) and {"time", "lead"} <= {*tensors.coords}:
        lead = np.unique(tensors["lead"])
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


class _Fitted(Protocol):
    """What can be asked: a fitted :class:`Reader`, or one like it."""

    classes_: Any

    def predict_proba(self, tensors: Any, until: float | None = None, /) -> Any:
        """Probability of each class, by a deadline [ms since contact]."""


@checked
def measure_reader(
    reader: _Fitted, tensors: Any, labels: Labels, until: float | None = None
) -> tuple[float, float]:
    """Accuracy of a fitted reader, and the bits that it gets from touches with known labels.

    Parameters
    ----------
    reader
        A fitted :class:`Reader`.
    tensors
        Touches (trial, sensor, time).
    labels
        Class of each.
    until
        Deadline [ms since contact]; None: the whole touch.

    Returns
    -------
    accuracy
        Share of touches named right.
    bits
        log₂ K + mean log₂ p(true), a lower bound on the mutual information of class and tensor
        (Barber & Agakov 2003). A touch without noticed contact counts as a guess.
    """
    chance = np.asarray(reader.predict_proba(tensors, until), dtype=float)
    classes = list(reader.classes_)
    if unknown := [label for label in labels if label not in classes]:
        raise InvalidInput(f"the reader never learned the class {unknown[0]!r}.")
    if len(labels) != len(chance):
        raise InvalidInput(
            f"{len(chance)} touches but {len(labels)} labels; give one for each."
        )
    seen = np.isfinite(chance).all(axis=1)
    chance[~seen] = 1 / len(classes)
    true = np.array([classes.index(label) for label in labels])
    own = np.maximum(chance[np.arange(true.size), true], np.finfo(float).tiny)
    right = seen & (chance.argmax(axis=1) == true)
    return float(right.mean()), float(np.log2(len(classes)) + np.log2(own).mean())


def _get_shape(X: Any) -> tuple[int, ...]:
    """Lengths of one tensor or row; none for what only turns into an array."""
    return tuple(getattr(X, "shape", ())[1:])


def _name_classes(found: Any, classes: Any) -> Any:
    """Class names beside their probabilities, a tuple as :func:`make_labels` writes one."""
    if isinstance(found, np.ndarray):
        return found
    return found.assign_coords({"class": [write_label(label) for label in classes]})
