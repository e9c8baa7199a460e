"""Codes of tensors on fixed bases: each trial by itself, so the same tensor has the same code
wherever it stands.
"""

from collections.abc import Callable
from typing import Annotated

import numpy as np

from feeler.checked import checked
from feeler.encoding.activations import descend_activations
from feeler.encoding.convolution import (
    compute_spectra,
    correlate_with_bases,
    fourier_length,
    invert_spectra,
)
from feeler.encoding.gram import compute_basis_gram
from feeler.encoding.least_squares import MOST_PIVOTS, polish_nonnegative, solve_nonnegative
from feeler.encoding.sparseness import l1_of_unit_vector, project_row

BLOCK = 8  # trials per task [C]
APPROACH = 150  # steps towards the ridge code [C]: then exact pivoting ends after two or three
# steps of the code without a ridge [C]: the residual then moves by less than 1e-4 of itself
POLISH = 300


@checked
def encode(
    tensors: Annotated[np.ndarray, "trial sensor time"],
    components: Annotated[np.ndarray, "component sensor lag"],
    code: str,
    *,
    sparseness: float | None = 0.8,
    ridge: float = 0.1,
    max_sweeps: int = 500,
    tol: float = 1e-5,
    run: Callable = map,
) -> tuple[np.ndarray, bool]:
    """Activations (trial, component, time) of tensors (trial, sensor, time) on bases (component,
    sensor, lag).

    Parameters
    ----------
    code : which code.
        "ridge": h ≥ 0 with the least ½‖V − V̂‖² + ½·ridge·‖W‖²·‖h‖², ‖W‖² the mean squared length
        of a basis, so that ridge has no unit. Strictly convex: one answer, solved exactly, and one
        that moves little when the tensor does. "nonnegative": towards the least ‖V − V̂‖ over h ≥
        0, by 300 accelerated gradient steps from near the ridge code. Where bases are smooth, very
        different h do almost as well; fixed start and steps make it one answer. "sparse": the least
        ½‖V − V̂‖² among activations whose every row has exactly this sparseness, or is zero; by
        projected gradient from the projected, nearly solved ridge code. Not convex: the fixed start
        makes it one answer, not the best.
    max_sweeps, tol : the sparse code ends after this many sweeps, or when one lowers the loss by
    less than tol times
        what the code explains.

    Returns
    -------
    activations, and whether all trials got there.
    """
    n_trials, _, n_times = tensors.shape
    n_components, _, n_lags = components.shape
    length = fourier_length(n_times, n_lags)
    basis_spectra = compute_spectra(components, length)
    kernel, edge = compute_basis_gram(components)
    ridged = _add_ridge(kernel, edge, ridge)
    l1 = 0.0 if sparseness is None or code != "sparse" else l1_of_unit_vector(n_times, sparseness)
    activations = np.zeros((n_trials, n_components, n_times))

    def encode_block(block: slice) -> bool:
        rows = activations[block]
        seen = np.concatenate(
            [_see_alone(tensor, basis_spectra, length) for tensor in tensors[block]]
        )
        polish_nonnegative(seen, *ridged, rows, APPROACH)
        if code == "nonnegative":
            polish_nonnegative(seen, kernel, edge, rows, POLISH)
            return True
        if code == "ridge":
            return solve_nonnegative(seen, *ridged, rows) < MOST_PIVOTS
        for trial in rows:
            for row in trial:
                project_row(row.copy(), l1, row)
        steps = np.ones(rows.shape[:2])
        return (
            descend_activations(seen, kernel, edge, rows, steps, l1, False, max_sweeps, tol)
            < max_sweeps
        )

    blocks = [slice(start, start + BLOCK) for start in range(0, n_trials, BLOCK)]
    return activations, all(list(run(encode_block, blocks)))


def _see_alone(tensor: np.ndarray, basis_spectra: np.ndarray, length: int) -> np.ndarray:
    """The bases correlated with one tensor, (1, component, time); alone, so that no neighbour even
    rounds it.
    """
    spectra = compute_spectra(tensor[None], length)
    seen = np.empty((2, 1, basis_spectra.shape[1], spectra.shape[-1]))
    correlate_with_bases(*spectra, *basis_spectra, seen)
    return invert_spectra(seen, length, tensor.shape[-1])


def _add_ridge(kernel: np.ndarray, edge: np.ndarray, ridge: float) -> tuple[np.ndarray, np.ndarray]:
    """The inner products with ridge·‖W‖² added where a basis meets itself at the same moment."""
    kernel, edge = kernel.copy(), edge.copy()
    n_components, n_lags = edge.shape[1:3]
    own = np.arange(n_components)
    weight = ridge * kernel[own, own, n_lags - 1].mean()
    kernel[own, own, n_lags - 1] += weight
    for i in range(n_lags):
        edge[own, own, i, i] += weight
    return kernel, edge
