"""The tensors of a fit, made ready once for any number of starts."""

from collections.abc import Callable

import numpy as np

from feeler.encoding.code import TRIALS_PER_TASK
from feeler.encoding.convolution import (
    compute_spectra,
    correlate_with_activations,
    correlate_with_bases,
    fourier_length,
    invert_spectra,
)


class Data:
    """Tensors made ready once for any number of factorisations: their transform and their size."""

    def __init__(self, tensors: np.ndarray, n_lags: int):
        self.n_trials, self.n_sensors, self.n_times = tensors.shape
        self.n_lags = n_lags
        # how many lags further a basis may be looked for, each way
        self.margin = min(n_lags // 2, self.n_times - n_lags)
        self.length = fourier_length(self.n_times, n_lags + self.margin)
        starts = range(0, self.n_trials, TRIALS_PER_TASK)
        self.blocks = [slice(start, start + TRIALS_PER_TASK) for start in starts]
        self.spectra = compute_spectra(tensors, self.length)
        self.energy = float(np.vdot(tensors, tensors))
        self.silent = ~tensors.any(axis=(1, 2))

    def see(self, basis_spectra: np.ndarray, trials: slice) -> np.ndarray:
        """A (trial, component, time): the bases (their transform) correlated with the tensors."""
        v_re, v_im = self.spectra[0, trials], self.spectra[1, trials]
        out = np.empty((2, v_re.shape[0], basis_spectra.shape[1], v_re.shape[2]))
        correlate_with_bases(v_re, v_im, basis_spectra[0], basis_spectra[1], out)
        return invert_spectra(out, self.length, self.n_times)

    def gather(
        self, activations: np.ndarray, run: Callable = map, margin: int = 0
    ) -> np.ndarray:
        """B (component, sensor, lag): the tensors correlated with activations (trial, component,
        time), over the lags −margin … n_lags + margin − 1.
        """
        parts = run(lambda block: self._gather(activations, block), self.blocks)
        signal = invert_spectra(sum(parts), self.length, self.length)
        last = self.n_lags + margin
        return np.concatenate([signal[..., self.length - margin :], signal[..., :last]], axis=2)

    def _gather(self, activations: np.ndarray, trials: slice) -> np.ndarray:
        h_re, h_im = compute_spectra(activations[trials], self.length)
        v_re, v_im = self.spectra[0, trials], self.spectra[1, trials]
        out = np.zeros((2, activations.shape[1], self.n_sensors, v_re.shape[2]))
        correlate_with_activations(v_re, v_im, h_re, h_im, out)
        return out
