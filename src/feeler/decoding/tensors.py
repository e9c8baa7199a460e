"""Decoders take tensors and give labels back: to each array the labels of what was asked, and tags
that say what they take.
"""

from typing import Any

import numpy as np
import xarray as xr
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.pipeline import Pipeline
from sklearn.utils.metaestimators import available_if

from feeler.decoding.labels import Labels, write_label
from feeler.tensors.labels import label_like

NO_CONTACT = ("no contact", float("nan"), float("nan"))
"""What a touch without contact is called."""


class TensorClassifier(ClassifierMixin, BaseEstimator):
    """A classifier of tensors (trial, sensor, time), whose labels may be tuples; a subclass gives
    ``decide``.
    """

    classes_: Any

    def decide(self, X: Any) -> np.ndarray:
        """Scores (trial, class), the answer's the greatest; NaN rows for tensors without contact."""
        raise NotImplementedError

    def _weigh(self, scores: np.ndarray) -> np.ndarray:
        return scores

    def predict_proba(self, X: Any) -> Any:
        """Probability (trial, class), NaN without contact; labelled where the tensors are."""
        found = label_like(self._weigh(self.decide(X)), X, ("trial", "class"), "probability")
        return _name_classes(found, self.classes_)

    def predict(self, X: Any) -> Any:
        """The best label of each tensor, ``NO_CONTACT`` where there was none; labelled where the
        tensors are.
        """
        best = [-1 if np.isnan(row).any() else int(row.argmax()) for row in self.decide(X)]
        found = [NO_CONTACT if k < 0 else self.classes_[k] for k in best]
        if not isinstance(X, xr.DataArray):
            return found if isinstance(self.classes_, list) else np.array(found)
        answers = np.empty(len(found), dtype=object)
        answers[:] = found
        return label_like(answers, X, ("trial",), "label")

    def score(self, X: Any, y: Labels, sample_weight: np.ndarray | None = None) -> float:
        """Share of labels that are right, in all of their parts."""
        right = [found == true for found, true in zip(self.predict(np.asarray(X)), y, strict=True)]
        return float(np.average(right, weights=sample_weight))

    def __sklearn_tags__(self) -> Any:
        """Tensors come in three dimensions."""
        tags = super().__sklearn_tags__()
        tags.input_tags.two_d_array, tags.input_tags.three_d_array = False, True
        return tags


class FlatPipeline(Pipeline):
    """A pipeline that takes tables (trial, entry), and tensors (trial, sensor, time) flattened."""

    def fit(self, X: Any, y: Any = None, **params: Any) -> "FlatPipeline":
        """Fit all steps."""
        return super().fit(_flatten(X), y, **params)

    def predict(self, X: Any, **params: Any) -> Any:
        """The label of each trial; labelled where the tensors are."""
        return label_like(super().predict(_flatten(X), **params), X, ("trial",), "label")

    @available_if(lambda self: hasattr(self.steps[-1][1], "predict_proba"))
    def predict_proba(self, X: Any, **params: Any) -> Any:
        """Probability (trial, class); labelled where the tensors are."""
        found = label_like(
            super().predict_proba(_flatten(X), **params), X, ("trial", "class"), "probability"
        )
        return _name_classes(found, self.classes_)

    def score(self, X: Any, y: Any = None, sample_weight: Any = None, **params: Any) -> float:
        """Share of labels that are right."""
        return super().score(_flatten(X), y, sample_weight, **params)

    def __sklearn_tags__(self) -> Any:
        """Two dimensions, or three; principal components are of double precision whatever came in."""
        tags = super().__sklearn_tags__()
        tags.input_tags.three_d_array = True
        if tags.transformer_tags is not None:
            tags.transformer_tags.preserves_dtype = ["float64"]
        return tags


def _flatten(X: Any) -> Any:
    return np.reshape(np.asarray(X), (len(X), -1)) if getattr(X, "ndim", 2) > 2 else X


def _name_classes(found: Any, classes: Any) -> Any:
    """Class names beside their probabilities, a tuple as :func:`make_labels` writes one."""
    if isinstance(found, np.ndarray):
        return found
    return found.assign_coords({"class": [write_label(label) for label in classes]})
