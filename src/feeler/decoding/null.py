"""Two tests of codes that are fitted together with their bases: identical touches, and every touch
twice.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from sklearn.base import clone

from feeler.decoding.classifiers import make_fitting_lda
from feeler.decoding.codes import make_null
from feeler.decoding.sweep import Plan, Sweep, compute_sweep
from feeler.task.noise import Relative


@dataclass(frozen=True, kw_only=True, eq=False)
class JointFit:
    """Jointly fitted codes, and how the fit ended."""

    codes: np.ndarray
    """(trial, component, time)"""
    n_iter: int
    converged: bool
    """Whether the fit ended by its tolerance, not by its iterations."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Twins:
    """Accuracies on the codes of a set in which every touch stands twice."""

    same: Sweep
    """Trained and tested on noisy copies of the first of each pair: what the paper's recipe
    measures.
    """
    other: Sweep
    """Tested on copies of the second: what of it belongs to the touch."""
    fitted: JointFit

    @property
    def kept(self) -> float:
        """Share of the accuracy above chance that carries over to the twin; at least 0."""
        above = self.same.ratios > 0
        height = self.same.noisy[above].mean() - self.same.chance
        return (
            float(max(self.other.noisy[above].mean() - self.other.chance, 0.0) / height)
            if height > 0
            else 0.0
        )


def _fit_jointly(tensors: np.ndarray, encoder: Any, n_iter: int) -> JointFit:
    """Codes of one joint fit of up to ``n_iter`` iterations, where the encoder has such a limit."""
    known = encoder.get_params()
    fitted = (
        clone(encoder)
        .set_params(**({"max_iter": n_iter} if "max_iter" in known else {}))
        .fit(tensors)
    )
    done = int(getattr(fitted, "n_iter_", 0))
    return JointFit(codes=fitted.activations_, n_iter=done, converged=done < n_iter)


def fit_null(tensors: np.ndarray, encoder: Any, n_iter: int) -> JointFit:
    """Joint codes of one of the tensors, repeated as if it were different touches (``make_null``)."""
    return _fit_jointly(make_null(tensors), encoder, n_iter)


def compare_twins(
    tensors: np.ndarray, labels: np.ndarray, encoder: Any, plan: Plan, *, random_state: int = 0
) -> Twins:
    """Each tensor twice in one joint fit; train on noisy copies of one twin, test on noisy copies
    of the other.

    A code that belongs to the touch gives both twins the same, and then both accuracies are equal.
    """
    fitted = _fit_jointly(np.concatenate([tensors, tensors]), encoder, plan.null_iter)
    first, second = np.split(fitted.codes, 2)
    options: dict[str, Any] = {
        "ratios": plan.ratios, "n_copies": plan.n_copies, "n_repeats": plan.n_repeats, "noise": Relative(each="vector"),
        "estimator": make_fitting_lda(len(labels), plan.n_copies), "random_state": random_state,
    }  # fmt: skip
    same = compute_sweep(first, labels, **options)
    return Twins(
        same=same,
        other=compute_sweep(first, labels, held_out=(second, labels), **options),
        fitted=fitted,
    )
