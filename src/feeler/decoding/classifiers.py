"""Classifiers as scikit-learn pipelines; everything they learn, they learn in ``fit``."""

from typing import Any

import numpy as np
from scipy.special import softmax
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.pipeline import Pipeline, make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

from feeler.decoding.components import PrincipalComponents
from feeler.decoding.reader import Reader
from feeler.records.checked import checked
from feeler.tensors.scaling import label_like

_N_COMPONENTS = 30  # [P] "selected the first 30 features"


class _FlatPipeline(Reader, Pipeline):
    """A pipeline that takes tables (trial, entry), and tensors (trial, sensor, time) flattened."""

    def fit(self, X: Any, y: Any = None, **params: Any) -> "_FlatPipeline":
        """Fit all steps."""
        self._keep(X, y)
        return Pipeline.fit(self, _flatten(X), y, **params)

    def predict(self, X: Any, until: float | None = None, **params: Any) -> Any:
        """The label of each trial; labelled where the tensors are."""
        reader, seen = self._look(X, until)
        found = Pipeline.predict(reader, _flatten(seen), **params)
        return label_like(found, X, ("trial",), "label")

    def _decide(self, X: Any) -> np.ndarray:
        """Probabilities, or votes as such where the last step gives none."""
        if hasattr(self.steps[-1][1], "predict_proba"):
            return Pipeline.predict_proba(self, _flatten(X))
        return softmax(spread_votes(self.decision_function(_flatten(X))), axis=1)

    def __sklearn_tags__(self) -> Any:
        """Two dimensions or three; principal components are of double precision."""
        tags = super().__sklearn_tags__()
        tags.input_tags.two_d_array = True
        if tags.transformer_tags is not None:
            tags.transformer_tags.preserves_dtype = ["float64"]
        return tags


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


def make_fitting_lda(n_trials: int, n_copies: int) -> _FlatPipeline:
    """``make_lda`` with as many of the 30 components as ``n_copies`` of ``n_trials`` can give."""
    return make_lda(min(_N_COMPONENTS, n_trials * n_copies - 1))


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


def spread_votes(decision: np.ndarray) -> np.ndarray:
    """Scores (trial, class) of a support vector machine, which gives two classes one number."""
    return np.stack([-decision, decision], axis=1) if decision.ndim == 1 else decision


def _chain(n_components: int | None, *steps: Any) -> _FlatPipeline:
    first = () if n_components is None else (PrincipalComponents(n_components),)
    return _FlatPipeline(make_pipeline(*first, *steps).steps)


def _flatten(X: Any) -> Any:
    return np.reshape(np.asarray(X), (len(X), -1)) if getattr(X, "ndim", 2) > 2 else X
