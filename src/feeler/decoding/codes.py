"""The codes that a reader can be given, and two tests of those fitted with their bases.

The tests are identical touches, which tell nothing, and every touch twice.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Protocol

import numpy as np
from sklearn.base import clone

from feeler.decoding.classifiers import make_fitting_lda
from feeler.decoding.plan import Plan
from feeler.decoding.sweep import Sweep, compute_sweep
from feeler.dispersion.index import check_tensors
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.task.noise import Relative
from feeler.tensors.scaling import label_like

CODES = ("joint", "sparse", "ridge", "raw")
"""Kinds of code; ``feeler.encoding.LABELS`` has a label for each.

``joint`` activations are fitted together with the bases (the paper's recipe); ``sparse`` and
``ridge`` ones belong to fixed bases, with and without the sparseness constraint; ``raw`` is the
tensors themselves.
"""


class _Coder(Protocol):
    """What has learned bases."""

    def transform(self, tensors: Any, /, code: str) -> Any:
        """Tensors in the bases that were learned."""


class _Encoder(_Coder, Protocol):
    """What makes codes of tensors: :class:`feeler.encoding.ConvolutiveNMF`, or one like it."""

    def fit(self, tensors: Any, /) -> Any:
        """Learn bases of tensors (trial, sensor, time)."""


@checked
def make_codes(
    tensors: Any, encoder: _Encoder | None, kinds: Sequence[str] = CODES
) -> dict[str, Any]:
    """Every kind of code of the same tensors, after one fit of the bases.

    Parameters
    ----------
    tensors
        Non-negative (trial, sensor, time).
    encoder
        An unfitted encoder such as :class:`feeler.encoding.ConvolutiveNMF`; it is fitted here
        unless only ``raw`` is asked for.
    kinds
        Any of joint, sparse, ridge, raw.
    """
    array = check_tensors(tensors, least=1)
    if unknown := [kind for kind in kinds if kind not in CODES]:
        raise InvalidInput(f"unknown code {unknown[0]!r}; known: {', '.join(CODES)}.")
    codes = {}
    if set(kinds) - {"raw"}:
        if encoder is None:
            raise InvalidInput("codes need an encoder; only 'raw' does without.")
        codes["joint"] = encoder.fit(array).activations_
    codes |= {kind: encode_with(array, encoder, kind) for kind in kinds if kind != "joint"}
    dims = {
        kind: ("trial", "sensor" if kind == "raw" else "component", "time") for kind in kinds
    }
    return {kind: label_like(codes[kind], tensors, dims[kind], kind) for kind in kinds}


@checked
def encode_with(
    tensors: Annotated[np.ndarray, "trial sensor time"], encoder: _Coder | None, kind: str
) -> Any:
    """New tensors in one kind of code; jointly fitted activations do not exist for new tensors."""
    if kind == "joint":
        raise InvalidInput(
            "joint activations exist only for the tensors of the fit; use 'sparse' or 'ridge'."
        )
    if kind == "raw":
        return tensors
    if encoder is None:
        raise InvalidInput(f"the code {kind!r} needs an encoder; only 'raw' does without.")
    return encoder.transform(tensors, code=kind)


@checked
def make_null(tensors: Any, n_copies: Annotated[int, "> 0"] | None = None) -> np.ndarray:
    """One and the same tensor, as often as there were trials.

    A pipeline that tells these apart measures itself.

    The tensor with the median energy of the set is taken. Whatever accuracy above chance the copies
    reach, labelled as if they were different touches, comes from the method and not from touch.
    """
    array = check_tensors(tensors, least=1)
    energy = (array**2).sum(axis=(1, 2))
    typical = np.argsort(energy, kind="stable")[len(array) // 2]
    return np.repeat(array[typical][None], n_copies or len(array), axis=0)


@dataclass(frozen=True, kw_only=True, eq=False)
class JointFit:
    """Jointly fitted codes, and how the fit ended.

    Attributes
    ----------
    codes : np.ndarray
        (trial, component, time)
    converged : bool
        Whether the fit ended by its tolerance, not by its iterations.
    """

    codes: np.ndarray
    n_iter: int
    converged: bool


@dataclass(frozen=True, kw_only=True, eq=False)
class Twins:
    """Accuracies on the codes of a set in which every touch stands twice.

    Attributes
    ----------
    same : Sweep
        Trained and tested on noisy copies of the first twins, as in the paper's recipe.
    other : Sweep
        Tested on copies of the second twins: what of the accuracy belongs to the touch.
    """

    same: Sweep
    other: Sweep
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


def configure(encoder: Any, settings: Mapping[str, Any]) -> Any:
    """An unfitted copy of an encoder with those of the settings that it knows."""
    known = encoder.get_params()
    return clone(encoder).set_params(
        **{key: value for key, value in settings.items() if key in known}
    )


def _fit_jointly(tensors: np.ndarray, encoder: Any, n_iter: int) -> JointFit:
    """Codes of one joint fit of up to ``n_iter`` iterations, where the encoder has such a limit."""
    fitted = configure(encoder, {"max_iter": n_iter}).fit(tensors)
    done = int(getattr(fitted, "n_iter_", 0))
    return JointFit(codes=fitted.activations_, n_iter=done, converged=done < n_iter)


def fit_null(tensors: np.ndarray, encoder: Any, n_iter: int) -> JointFit:
    """Joint codes of one tensor, repeated as if it were different touches."""
    return _fit_jointly(make_null(tensors), encoder, n_iter)


def compare_twins(
    tensors: np.ndarray,
    labels: np.ndarray,
    encoder: Any,
    plan: Plan,
    *,
    random_state: Annotated[int, "≥ 0"] = 0,
) -> Twins:
    """Each tensor twice in one joint fit; one twin is learned, the other is tested.

    A code that belongs to the touch gives both twins the same, and then both accuracies are equal.
    """
    fitted = _fit_jointly(np.concatenate([tensors, tensors]), encoder, plan.null_iter)
    first, second = np.split(fitted.codes, 2)
    options: dict[str, Any] = {
        "ratios": plan.ratios,
        "n_copies": plan.n_copies,
        "n_repeats": plan.n_repeats,
        "noise": Relative(each="vector"),
        "estimator": make_fitting_lda(len(labels), plan.n_copies),
        "random_state": random_state,
    }
    same = compute_sweep(first, labels, **options)
    return Twins(
        same=same,
        other=compute_sweep(first, labels, held_out=(second, labels), **options),
        fitted=fitted,
    )
