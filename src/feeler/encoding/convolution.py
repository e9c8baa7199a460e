"""The convolutive model V(x, t) = Σ_m Σ_τ W_m(x, τ) H_m(t − τ) of each trial, and its products.

A trial starts with nothing before it and its window ends at T: what a basis would do after T is not
seen, and nothing of it runs into the next trial. Zero padding by L − 1 makes the circular
correlations of the Fourier transform equal to these.

Inner products of shifted bases, and of shifted activations, replace reconstructions. Both matrices
are Toeplitz up to the end of the window, so that two small sums along diagonals give them exactly.
"""

from typing import Annotated

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft

from feeler.compiled import compiled, lean
from feeler.errors import InvalidInput
from feeler.records.checked import checked

_REGISTER = 8  # numbers of double precision in the widest vector register


@checked
def reconstruct(
    components: Annotated[np.ndarray, "component sensor lag"],
    activations: Annotated[np.ndarray, "trial component time"],
) -> np.ndarray:
    """Tensors from bases and activations.

    Parameters
    ----------
    components : np.ndarray
        Bases (component, sensor, lag).
    activations : np.ndarray
        (trial, component, time).

    Returns
    -------
    np.ndarray
        (trial, sensor, time), in the unit of the activations times that of the bases.

    References
    ----------
    Smaragdis 2004, ICA 2004, LNCS 3195:494.
    """
    n_trials, n_components, n_times = activations.shape
    n_bases, n_sensors, n_lags = components.shape
    if n_bases != n_components:
        raise InvalidInput(
            f"activations are of {n_components} components, the bases are {n_bases}."
        )
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
        spectra[0, start : start + 8] = transform.real
        spectra[1, start : start + 8] = transform.imag
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


def compute_basis_gram(components: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inner products of the bases placed at two moments of one trial.

    Parameters
    ----------
    components : np.ndarray
        Bases (component, sensor, lag).

    Returns
    -------
    kernel : np.ndarray
        (component m, component k, 2·lag + 5 or more). kernel[m, k, d + L + 2] = Σ_x Σ_τ W_m(x, τ)
        W_k(x, τ + d), where m starts d samples after k and both fit into the window; three zeros
        stand before them, so that four lags can be read at once, and three or more behind, so that
        a whole number of vector registers is read.
    fringe : np.ndarray
        (component m, component k, lag − 1, lag − 1). What has to be added near the end, where what
        runs past the window is cut off: fringe[m, k, j, r], where k starts j samples before the
        last one, and m starts with sample r of the last L − 1.
    """
    n_components, n_sensors, n_lags = components.shape
    flat = components.transpose(1, 0, 2).reshape(n_sensors, n_components * n_lags)
    products = (
        (flat.T @ flat)
        .reshape(n_components, n_lags, n_components, n_lags)
        .transpose(0, 2, 1, 3)
    )
    edge = np.ascontiguousarray(products)
    for i in range(1, n_lags):
        edge[:, :, i, 1:] += edge[:, :, i - 1, :-1]
    # products of fading numbers slow the processor, and change nothing
    edge[edge < 1e-50 * edge.max()] = 0
    kernel = np.zeros(
        (n_components, n_components, 3 + _REGISTER * -(-(2 * n_lags + 2) // _REGISTER))
    )
    # m starts d after k: with k at the last full place (j = L − 1), m stands at i = L − 1 − d
    kernel[:, :, n_lags + 2 : 2 * n_lags + 2] = edge[:, :, ::-1, n_lags - 1]
    kernel[:, :, 3 : n_lags + 2] = edge[:, :, n_lags - 1, : n_lags - 1]
    fringe = np.ascontiguousarray(edge[:, :, -2::-1, :-1].swapaxes(2, 3))
    if n_lags > 1:
        fringe -= sliding_window_view(kernel[:, :, 4 : 2 * n_lags + 1], n_lags - 1, axis=2)
    return kernel, fringe


@lean(fastmath={"contract"})  # fused multiply-add: half the instructions
def add_convolved(kernel, fringe, padded, first, stop, wide):
    """Add G·h to wide, with the kernel and the fringe of one pair of components.

    h stands in `padded` with three zeros after its end, and is zero outside [first, stop). Moments
    without activation cost nothing; the others go four at a time, for a quarter of the loads and
    stores of the target. `wide` begins L − 1 moments before the window and holds the kernel's size
    more than the window, so that no end has to be looked out for.
    """
    reach, n_times, width = fringe.shape[0], padded.size - 3, kernel.size - 3
    moment = first
    while moment < stop:
        a, b, c, d = padded[moment], padded[moment + 1], padded[moment + 2], padded[moment + 3]
        if a == 0.0:
            moment += 1
            continue
        target = wide[moment : moment + width]
        for s in range(width):
            target[s] += (
                a * kernel[s + 3] + b * kernel[s + 2] + c * kernel[s + 1] + d * kernel[s]
            )
        moment += 4
    for place in range(max(first, n_times - reach), stop):  # bases that the window's end cuts
        value = padded[place]
        if value != 0.0:
            target, source = wide[n_times : n_times + reach], fringe[n_times - 1 - place]
            for s in range(reach):
                target[s] += value * source[s]


def compute_activation_gram(activations: np.ndarray, n_lags: int) -> np.ndarray:
    """C[m, τ, k, σ] = Σ_n Σ_t H_nm(t − τ) H_nk(t − σ) over the window (component, lag, …)."""
    n_trials, n_components, _ = activations.shape
    ends = np.ascontiguousarray(activations[:, :, : -n_lags - 1 : -1]).reshape(
        n_trials, n_components * n_lags
    )
    # what each further lag pushes out
    lost = (ends.T @ ends).reshape(n_components, n_lags, n_components, n_lags)
    lagged = np.zeros((n_components, n_components, n_lags))
    _correlate_lags(np.ascontiguousarray(activations), lagged)
    gram = np.empty_like(lost)
    gram[:, 0, :, :] = lagged
    gram[:, :, :, 0] = lagged.transpose(1, 2, 0)
    for lag in range(1, n_lags):
        gram[:, lag, :, 1:] = gram[:, lag - 1, :, :-1] - lost[:, lag - 1, :, :-1]
    return np.maximum(gram, 0, out=gram)  # rounding may leave −1e-16


@compiled
def _correlate_lags(activations, out):
    """Add Σ_n Σ_u H_nk(u) H_nm(u + d) to out[m, k, d], d ≥ 0."""
    n_trials, n_components, n_times = activations.shape
    n_lags = out.shape[2]
    for n in range(n_trials):
        for k in range(n_components):
            for u in range(n_times):
                value = activations[n, k, u]
                if value == 0.0:  # moments without activation cost nothing
                    continue
                reach = min(n_lags, n_times - u)
                for m in range(n_components):
                    later, target = activations[n, m, u:], out[m, k]
                    for d in range(reach):
                        target[d] += value * later[d]
