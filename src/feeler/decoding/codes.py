"""The codes a classifier can be given: jointly fitted, fixed-basis with and without sparseness,
raw; and the null.
"""

from collections.abc import Sequence
from typing import Annotated, Any

import numpy as np

from feeler.checked import checked
from feeler.dispersion.blocks import check_tensors
from feeler.errors import InvalidInput
from feeler.tensors.labels import label_like

CODES = ("joint", "sparse", "ridge", "raw")
"""Activations fitted together with the bases (the paper's recipe), activations for fixed bases with
and without the sparseness constraint, and the tensors themselves; ``feeler.encoding.LABELS`` has a
label for each.
"""


@checked
def make_codes(tensors: Any, encoder: Any, kinds: Sequence[str] = CODES) -> dict[str, Any]:
    """Every kind of code of the same tensors, after one fit of the bases; labelled where the
    tensors are.

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
    dims = {kind: ("trial", "sensor" if kind == "raw" else "component", "time") for kind in kinds}
    return {kind: label_like(codes[kind], tensors, dims[kind], kind) for kind in kinds}


@checked
def encode_with(
    tensors: Annotated[np.ndarray, "trial sensor time"], encoder: Any, kind: str
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
def make_null(tensors: Any, n_copies: int | None = None) -> np.ndarray:
    """One and the same tensor, as often as there were trials: a pipeline that tells these apart
    measures itself.

    The tensor with the median energy of the set is taken. Whatever accuracy above chance the copies
    reach, labelled as if they were different touches, comes from the method and not from touch.
    """
    array = check_tensors(tensors, least=1)
    energy = (array**2).sum(axis=(1, 2))
    typical = np.argsort(energy, kind="stable")[len(array) // 2]
    return np.repeat(array[typical][None], n_copies or len(array), axis=0)
