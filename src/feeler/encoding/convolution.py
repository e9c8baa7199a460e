"""The convolutive model V(x, t) = Σ_m Σ_τ W_m(x, τ) H_m(t − τ), forwards and as correlations, per
trial.

A trial starts with nothing before it and its window ends at T: what a basis would do after T is not
seen, and nothing of it runs into the next trial. Zero padding by L − 1 makes the circular
correlations of the Fourier transform equal to these.
"""

from typing import Annotated

import numpy as np
from scipy import fft

from feeler.checked import checked
from feeler.compiled import compiled


@checked
def reconstruct(
    components: Annotated[np.ndarray, "component sensor lag"],
    activations: Annotated[np.ndarray, "trial component time"],
) -> np.ndarray:
    """Tensors from bases and activations.

    Parameters
    ----------
    components : (component, sensor, lag)
    activations : (trial, component, time)

    Returns
    -------
    (trial, sensor, time), in the units of the activations times those of the bases.

    References
    ----------
    Smaragdis 2004, ICA 2004, LNCS 3195:494.
    """
    n_trials, _, n_times = activations.shape
    _, n_sensors, n_lags = components.shape
    by_lag = np.ascontiguousarray(components.transpose(2, 1, 0))  # (lag, sensor, component)
    tensors = np.zeros((n_trials, n_sensors, n_times))
    for trial, code in zip(tensors, activations, strict=True):
        for lag in range(min(n_lags, n_times)):
            trial[:, lag:] += by_lag[lag] @ code[:, : n_times - lag]
    return tensors


def fourier_length(n_times: int, n_lags: int) -> int:
    """A quick transform length that keeps circular correlations from wrapping round."""
    return fft.next_fast_len(n_times + n_lags - 1, real=True)


def compute_spectra(tensors: np.ndarray, length: int) -> np.ndarray:
    """Fourier transform over the last axis, real and imaginary part apart: (2, ..., frequency)."""
    spectra = np.empty((2, *tensors.shape[:-1], length // 2 + 1))
    for start in range(0, len(tensors), 8):  # a few at a time: no second copy of all
        transform = fft.rfft(tensors[start : start + 8], length)
        spectra[0, start : start + 8], spectra[1, start : start + 8] = (
            transform.real,
            transform.imag,
        )
    return spectra


def invert_spectra(spectra: np.ndarray, length: int, keep: int) -> np.ndarray:
    """The first `keep` samples of the signals whose transforms these are."""
    transform = np.empty(spectra.shape[1:], dtype=complex)
    transform.real, transform.imag = spectra
    return np.ascontiguousarray(fft.irfft(transform, length, overwrite_x=True)[..., :keep])


@compiled(fastmath={"contract"})
def correlate_with_bases(v_re, v_im, w_re, w_im, out):
    """Transform of A_m(s) = Σ_x Σ_τ W_m(x, τ) V(x, s + τ): what each basis sees in each trial."""
    n_trials, n_sensors, n_frequencies = v_re.shape
    for n in range(n_trials):
        for m in range(w_re.shape[0]):
            re, im = out[0, n, m], out[1, n, m]
            re[:] = 0.0
            im[:] = 0.0
            for x in range(n_sensors):
                a, b, c, d = v_re[n, x], v_im[n, x], w_re[m, x], w_im[m, x]
                for f in range(n_frequencies):
                    re[f] += a[f] * c[f] + b[f] * d[f]
                    im[f] += b[f] * c[f] - a[f] * d[f]


@compiled(fastmath={"contract"})
def correlate_with_activations(v_re, v_im, h_re, h_im, out):
    """Add to `out` the transform of B_m(x, τ) = Σ_n Σ_t H_nm(t − τ) V_n(x, t)."""
    n_trials, n_sensors, n_frequencies = v_re.shape
    for n in range(n_trials):
        for x in range(n_sensors):
            a, b = v_re[n, x], v_im[n, x]
            for m in range(h_re.shape[1]):
                c, d, re, im = h_re[n, m], h_im[n, m], out[0, m, x], out[1, m, x]
                for f in range(n_frequencies):
                    re[f] += a[f] * c[f] + b[f] * d[f]
                    im[f] += b[f] * c[f] - a[f] * d[f]
