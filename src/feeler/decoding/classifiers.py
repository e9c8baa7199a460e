"""Classifiers as scikit-learn pipelines; everything they learn, they learn in ``fit``."""

from typing import Any

from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.svm import SVC

from feeler.checked import checked
from feeler.decoding.components import PrincipalComponents
from feeler.decoding.tensors import FlatPipeline

N_COMPONENTS = 30  # [P] "selected the first 30 features"


@checked
def make_lda(n_components: int | None = N_COMPONENTS) -> FlatPipeline:
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


def make_fitting_lda(n_trials: int, n_copies: int) -> FlatPipeline:
    """``make_lda`` with as many of the 30 components as ``n_copies`` of ``n_trials`` can give."""
    return make_lda(min(N_COMPONENTS, n_trials * n_copies - 1))


@checked
def make_svm(
    n_components: int | None = N_COMPONENTS, *, kernel: str = "linear", C: float = 1.0
) -> FlatPipeline:
    """Principal components, one common scale, support vector machine one-vs-one (the paper's, for
    the robot).

    Parameters
    ----------
    n_components
        Principal components kept; None for all entries.
    kernel, C
        Of ``sklearn.svm.SVC``; the paper states neither [C].

    Notes
    -----
    Its votes are no probabilities; for those wrap it in
    ``sklearn.calibration.CalibratedClassifierCV``.
    """
    return _chain(n_components, StandardScaler(), SVC(kernel=kernel, C=C))


def _chain(n_components: int | None, *steps: Any) -> FlatPipeline:
    first = () if n_components is None else (PrincipalComponents(n_components),)
    return FlatPipeline(make_pipeline(*first, *steps).steps)
