"""Learning from one batch at a time: two sums over past batches are kept, of a size that does not
grow.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from feeler.encoding.bases import multiply_bases
from feeler.encoding.code import encode
from feeler.encoding.convolution import invert_spectra
from feeler.encoding.factorise import BLOCK, Data, Settings
from feeler.encoding.gram import compute_activation_gram


@dataclass
class OnlineSums:
    """Discounted sums over the batches seen."""

    seen: np.ndarray | float = 0.0
    """Data correlated with activations, (component, sensor, lag)."""
    gram: np.ndarray | float = 0.0
    """Activations correlated with each other, (component, lag, component, lag)."""


def learn_batch(
    tensors: np.ndarray,
    components: np.ndarray,
    sums: OnlineSums,
    settings: Settings,
    forget: float,
    run: Callable = map,
) -> np.ndarray:
    """New bases (component, sensor, lag) after a batch (trial, sensor, time): code it on the old
    ones, add to the sums, update.

    References
    ----------
    Mairal, Bach, Ponce & Sapiro 2010, J. Mach. Learn. Res. 11:19 (online dictionary learning from
    such sums).
    """
    code = "nonnegative" if settings.sparseness is None else "sparse"
    activations, _ = encode(
        tensors, components, code, sparseness=settings.sparseness, max_sweeps=20, tol=1e-3, run=run
    )
    data = Data(tensors, settings.n_lags)
    blocks = [slice(start, start + BLOCK) for start in range(0, data.n_trials, BLOCK)]
    spectra = sum(run(lambda block: data.gather(activations, block), blocks))
    sums.seen = forget * sums.seen + invert_spectra(spectra, data.length, settings.n_lags)
    sums.gram = forget * sums.gram + compute_activation_gram(activations, settings.n_lags)
    return multiply_bases(components, sums.seen, sums.gram, settings.inner_steps)[0]
