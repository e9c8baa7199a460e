"""Learning from a batch of tensors at a time."""

from collections.abc import Callable

import numpy as np

from feeler.encoding.code import encode
from feeler.encoding.convolution import compute_activation_gram
from feeler.encoding.data import Data
from feeler.encoding.factorise import Settings, improve_bases


def learn_batch(
    tensors: np.ndarray,
    components: np.ndarray,
    sums: tuple[np.ndarray | float, np.ndarray | float],
    settings: Settings,
    forget: float,
    run: Callable = map,
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Code a batch on the old bases, add it to the sums over earlier batches, update the bases.

    Parameters
    ----------
    tensors : np.ndarray
        The batch (trial, sensor, time).
    components : np.ndarray
        The old bases (component, sensor, lag).
    sums : tuple of two np.ndarray
        Data correlated with activations (component, sensor, lag), and activations correlated with
        each other (component, lag, component, lag); both 0 at first.
    forget : float
        What earlier batches count beside this one.

    Returns
    -------
    components : np.ndarray
        The new bases (component, sensor, lag).
    sums : tuple of two np.ndarray

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
    seen = forget * sums[0] + data.gather(activations, run)
    gram = forget * sums[1] + compute_activation_gram(activations, settings.n_lags)
    return improve_bases(components, seen, gram, settings)[0], (seen, gram)
