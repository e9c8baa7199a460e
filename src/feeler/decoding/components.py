"""Principal components of few trials with many entries, exact."""

import numpy as np
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackError, eigsh
from sklearn.base import BaseEstimator, ClassNamePrefixFeaturesOutMixin, TransformerMixin
from sklearn.utils.validation import check_is_fitted, validate_data

from feeler.errors import InvalidInput
from feeler.tensors.scaling import check_squares, label_like

_PRECISION = 1e-12


class PrincipalComponents(ClassNamePrefixFeaturesOutMixin, TransformerMixin, BaseEstimator):
    """Exact PCA through the smaller of the Gram and the covariance matrix.

    scikit-learn's ``PCA`` with the same ``n_components``, up to sign; its automatic solver would be
    a randomised approximation at this size, which the flat noise spectrum here does not suit.

    Parameters
    ----------
    n_components
        Components kept; fewer where the trials span fewer directions about their mean, as n trials
        span n − 1 at most: what rounding leaves of the others says nothing.

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
            Fewer trials than components, or numbers whose squares are none.
        """
        X = validate_data(self, X, dtype=float, ensure_min_samples=2)
        n, n_entries = X.shape
        k = min(self.n_components, n_entries)
        if not 1 <= k <= n:
            raise InvalidInput(
                f"{n} training trials cannot give {self.n_components} principal components. "
                f"Lower n_components to at most {n}, or train on more (copies of) trials."
            )
        check_squares(X, "training trials")
        self.mean_ = X.mean(axis=0)
        centred = X - self.mean_
        if n <= n_entries:
            energy, left = _find_longest(centred @ centred.T, k)
            axes = left.T @ centred
        else:
            energy, right = _find_longest(centred.T @ centred, k)
            axes = right.T
        order = np.argsort(energy)[::-1]
        spanned = np.count_nonzero(energy > _PRECISION * energy.max())
        order = order[: max(1, spanned)]
        norm = np.linalg.norm(axes[order], axis=1, keepdims=True)
        self.components_ = axes[order] / np.maximum(norm, np.finfo(float).tiny)
        total = np.vdot(centred, centred)
        self.explained_variance_ = np.maximum(energy[order], 0.0) / (n - 1)
        self.explained_variance_ratio_ = (
            self.explained_variance_ * (n - 1) / max(total, np.finfo(float).tiny)
        )
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


def _find_longest(square: np.ndarray, k: int) -> tuple[np.ndarray, np.ndarray]:
    """The k greatest eigenvalues of a symmetric matrix and their vectors, by Lanczos' method where
    it is three times as fast; it stops at 1e-12 of them.
    """
    n = len(square)
    if n < 10 * k:
        return eigh(square, subset_by_index=(n - k, n - 1))
    start = np.random.default_rng(0).standard_normal(n)  # ones would lie in the null space
    try:
        return eigsh(square, k, which="LA", ncv=min(3 * k, n), tol=_PRECISION, v0=start)
    except ArpackError:  # such as for trials that are all the same
        return eigh(square, subset_by_index=(n - k, n - 1))


def compute_kept_variance(components: PrincipalComponents, X: np.ndarray) -> float:
    """Share of the variance of ``X`` (trial, entry) about its own mean that the components keep."""
    centred = X - X.mean(axis=0)
    total = float(np.vdot(centred, centred))
    kept = centred @ components.components_.T
    return float(np.vdot(kept, kept)) / total if total > 0 else float("nan")
