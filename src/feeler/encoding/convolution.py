"""The convolutive model V(x, t) = Σ_m Σ_τ W_m(x, τ) H_m(t − τ), and the steps of its activations
and bases.
"""

from itertools import combinations
from typing import Annotated

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import fft
from scipy.optimize import linear_sum_assignment

from feeler.compiled import compiled, nested
from feeler.encoding.measures import project_row
from feeler.errors import InvalidInput
from feeler.validation import checked

# The convolutive model V(x, t) = Σ_m Σ_τ W_m(x, τ) H_m(t − τ) of each trial, and its products.
#
# A trial starts with nothing before it and its window ends at T: what a basis would do after T
# is not seen, and nothing of it runs into the next trial. Zero padding by L − 1 makes the
# circular correlations of the Fourier transform equal to these.
#
# Inner products of shifted bases, and of shifted activations, replace reconstructions. Both
# matrices are Toeplitz up to the end of the window, so that two small sums along diagonals give
# them exactly.

_REGISTER = 16  # numbers of single precision in the widest vector register


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


@nested(fastmath={"contract"})  # fused multiply-add: half the instructions
def _add_convolved(kernel, fringe, padded, first, stop, wide):
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


# Steps of the activations on fixed bases.
#
# They need what the bases see (A) and the bases' inner products (kernel, fringe).


@compiled
def apply_gram(kernel, fringe, activations, out):
    """out = G·activations for one trial, both (component, time)."""
    n_components, n_times = activations.shape
    wide = np.empty((n_components, n_times + kernel.shape[2]))
    _apply_wide(kernel, fringe, activations, np.zeros(n_times + 3), wide)
    for m in range(n_components):  # NumPy's copy takes seconds to compile
        for t in range(n_times):
            out[m, t] = wide[m, fringe.shape[2] + t]


@nested
def _apply_wide(kernel, fringe, activations, padded, wide):
    """The same, as :func:`.add_convolved` lays it out; ``padded`` ends with three zeros."""
    n_components, n_times = activations.shape
    wide[:] = 0.0
    for k in range(n_components):
        first, stop = _find_extent(activations[k])
        for t in range(n_times):
            padded[t] = activations[k, t]
        for m in range(n_components):
            _add_convolved(kernel[m, k], fringe[m, k], padded, first, stop, wide[m])


@nested
def _find_extent(row):
    """First entry that is not zero, and the one after the last."""
    first, stop = 0, row.size
    while first < stop and row[first] == 0.0:
        first += 1
    while stop > first and row[stop - 1] == 0.0:
        stop -= 1
    return first, stop


@compiled
def multiply_activations(seen, kernel, fringe, pull, activations, n_sweeps):
    """Multiplicative updates H ← H·A/(G H + P) of activations (trial, component, time), in place;
    P is the slope of a penalty, ≥ 0.
    """
    # what scikit-learn's NMF puts in place of a vanishing denominator
    tiny = np.finfo(np.float32).eps
    pulled = np.empty(activations.shape[1:])
    for n in range(activations.shape[0]):
        for _ in range(n_sweeps):
            apply_gram(kernel, fringe, activations[n], pulled)
            for m in range(pulled.shape[0]):
                for t in range(pulled.shape[1]):
                    below = pulled[m, t] + pull[n, m, t]
                    below = below if below != 0.0 else tiny
                    ratio = (
                        activations[n, m, t] / below
                    )  # before the product: it cannot overflow
                    activations[n, m, t] = ratio * max(seen[n, m, t], 0.0)


@compiled
def project_activations(activations, l1, joint):
    """Put activations ≥ 0 (trial, component, time) onto the sparseness constraint, in place;
    ``joint``: one constraint per component over all trials. What is 0 stays 0, unless too few
    entries are not.
    """
    n_trials, n_components, n_times = activations.shape
    together = n_trials if joint else 1
    row, projected = np.empty(together * n_times), np.empty(together * n_times)
    for first in range(0, n_trials, together):
        for m in range(n_components):
            group = activations[first : first + together, m]
            count = _take_active(group, 0.0, row)
            below = 0.0
            if count < l1 * l1:
                below = -1.0
                count = _take_active(group, below, row)
            project_row(row[:count], l1, projected[:count])
            i = 0
            for n in range(together):
                for t in range(n_times):
                    if group[n, t] > below:
                        group[n, t] = projected[i]
                        i += 1


@nested
def _take_active(group, below, row):
    """Write the entries above ``below`` one after the other into row; how many they are."""
    count = 0
    for n in range(group.shape[0]):
        for t in range(group.shape[1]):
            if group[n, t] > below:
                row[count] = group[n, t]
                count += 1
    return count


# [C] entries of one constraint, of which single precision still takes the sums
_SINGLE = 100_000


def descend(
    seen: np.ndarray,
    kernel: np.ndarray,
    fringe: np.ndarray,
    activations: np.ndarray,
    steps: np.ndarray,
    l1: float,
    joint: bool,
    n_sweeps: int,
    tol: float = 0.0,
) -> int:
    """:func:`descend_activations` in single precision, which takes half the time, where a
    constraint's sums are short enough, and then exactly onto the constraint. Units in which the
    largest numbers are 1 keep the others in range.
    """
    short = activations.shape[2] * (len(activations) if joint else 1) <= _SINGLE
    height = np.abs(seen).max(axis=None if joint else (1, 2), keepdims=True)
    unit = np.where(height > 0, height, 1.0)
    top = kernel.max() or 1.0
    numbers = [
        np.ascontiguousarray(values, np.float32 if short else float)
        for values in (seen / unit, kernel / top, fringe / top, activations * (top / unit))
    ]
    sweeps = descend_activations(*numbers, steps, l1, joint, n_sweeps, tol)
    activations[:] = numbers[3] * (unit / top)
    project_activations(activations, l1, joint)
    return sweeps


@compiled
def descend_activations(seen, kernel, fringe, activations, steps, l1, joint, n_sweeps, tol):
    """Projected-gradient sweeps under the sparseness constraint, in place.

    Activations are (trial, component, time). With ``joint`` there is one constraint per component
    over all trials given, otherwise one per component and trial. ``steps`` (trial, component) are
    the step sizes in units of the step that cannot fail; they are kept between calls. A trial ends
    early once a sweep lowers its loss by less than ``tol`` times what the bases explain. Numbers
    are in the precision of what is given. Returns the most sweeps that any trial took.
    """
    safe = np.empty(kernel.shape[0])
    for m in range(safe.size):
        # Gershgorin: no eigenvalue of a Toeplitz matrix lies above
        bound = 0.0
        for value in kernel[m, m]:
            bound += abs(value)
        safe[m] = 1.0 / bound if bound > 0.0 else 0.0
    most, size = 0, activations.shape[0] if joint else 1  # trials that share a constraint
    for n in range(0, activations.shape[0], size):
        group = slice(n, n + size)
        sweeps = _descend_group(
            seen[group],
            kernel,
            fringe,
            activations[group],
            steps[n],
            safe,
            l1,
            n_sweeps,
            tol,
        )
        most = max(most, sweeps)
    return most


@compiled(inline="always")  # compiled once, not at each level
def _descend_group(seen, kernel, fringe, activations, steps, safe, l1, n_sweeps, tol):
    """Sweeps over the components of trials that share one constraint per component."""
    n_trials, n_components, n_times = activations.shape
    number = kernel.dtype
    row, projected = np.empty(n_trials * n_times, number), np.empty(n_trials * n_times, number)
    change = np.zeros((n_trials, n_times + 3), number)
    pulled = np.empty((n_trials, n_components, n_times + kernel.shape[2]), number)
    pull = np.empty((n_trials, n_times + kernel.shape[2]), number)
    for n in range(n_trials):
        _apply_wide(kernel, fringe, activations[n], change[n], pulled[n])
    for sweep in range(n_sweeps):
        gained, explained = 0.0, 0.0
        for m in range(n_components):
            if safe[m] > 0.0:
                gained += _descend_row(
                    m,
                    seen,
                    kernel,
                    fringe,
                    activations,
                    pulled,
                    steps,
                    safe[m],
                    l1,
                    row,
                    projected,
                    change,
                    pull,
                )
            if tol > 0.0:
                for n in range(n_trials):
                    for t in range(n_times):
                        explained += seen[n, m, t] * activations[n, m, t]
        if gained <= tol * explained:
            return sweep + 1
    return n_sweeps


@compiled(inline="always")
def _descend_row(
    m, seen, kernel, fringe, activations, pulled, steps, safe, l1, row, projected, change, pull
):
    """One step of component m, halved until the loss falls; returns the fall.

    The next step begins longer.
    """
    while True:
        step = kernel.dtype.type(steps[m] * safe)
        _step_down(m, fringe.shape[2], seen, activations, pulled, step, row)
        project_row(row, l1, projected)
        fall = _measure_fall(
            m, seen, kernel[m, m], fringe[m, m], activations, pulled, projected, change, pull
        )
        if fall > 0.0:
            break
        if steps[m] <= 1.0:  # the step that cannot fail: nothing left but rounding
            steps[m] = 1.0
            return 0.0
        steps[m] = max(0.5 * steps[m], 1.0)
    steps[m] *= 1.2
    _accept(m, kernel, fringe, activations, pulled, projected, change, pull)
    return fall


@nested
def _step_down(m, reach, seen, activations, pulled, step, row):
    """Row m of all trials (trial × time), a step down the gradient."""
    n_trials, _, n_times = activations.shape
    for n in range(n_trials):
        a, b, c = activations[n, m], pulled[n, m, reach : reach + n_times], seen[n, m]
        target = row[n * n_times : (n + 1) * n_times]
        for t in range(n_times):
            target[t] = a[t] - step * (b[t] - c[t])


@nested(fastmath={"reassoc", "contract"})  # sums in vector registers
def _measure_fall(m, seen, kernel, fringe, activations, pulled, projected, change, pull):
    """How far the loss falls if row m becomes ``projected``; the change, and G times it."""
    n_trials, _, n_times = activations.shape
    reach = fringe.shape[0]
    total, half = kernel.dtype.type(0), kernel.dtype.type(0.5)
    for n in range(n_trials):
        old, new = activations[n, m], projected[n * n_times : (n + 1) * n_times]
        delta = change[n, :n_times]
        for t in range(n_times):
            delta[t] = new[t] - old[t]
        pull[n] = 0.0
        first, stop = _find_extent(delta)
        _add_convolved(kernel, fringe, change[n], first, stop, pull[n])
        before, after = pulled[n, m, reach : reach + n_times], pull[n, reach : reach + n_times]
        wanted = seen[n, m]
        for t in range(first, stop):
            total -= delta[t] * (before[t] - wanted[t] + half * after[t])
    return total


@nested
def _accept(m, kernel, fringe, activations, pulled, projected, change, pull):
    """Row m becomes ``projected``, and G times the activations follows."""
    n_trials, n_components, n_times = activations.shape
    for n in range(n_trials):
        first, stop = _find_extent(change[n, :n_times])
        old, new = activations[n, m], projected[n * n_times : (n + 1) * n_times]
        for t in range(n_times):
            old[t] = new[t]
        target, source = pulled[n, m], pull[n]
        for t in range(first, stop + kernel.shape[2] - 3):
            target[t] += source[t]
        for k in range(n_components):
            if k != m:
                _add_convolved(kernel[k, m], fringe[k, m], change[n], first, stop, pulled[n, k])


# The bases: their multiplicative updates, their order and scale, and how alike two sets are.

Bases = Annotated[np.ndarray, "component sensor lag"]
_Others = Annotated[
    np.ndarray, "partner sensor shift"
]  # as many sensors, but other bases and lags
# scikit-learn's NMF puts it in place of a vanishing denominator
_TINY = float(np.finfo(np.float32).eps)


def multiply_bases(
    components: np.ndarray,
    seen: np.ndarray,
    gram: np.ndarray,
    n_sweeps: int,
    pull: np.ndarray | float = 0.0,
) -> tuple[np.ndarray, float, float]:
    """Multiplicative updates W ← W·B/(W C + P), of which none raises the loss (Lee & Seung 2001).

    Parameters
    ----------
    components : np.ndarray
        Bases W (component, sensor, lag).
    seen : np.ndarray
        B, the data correlated with the activations (component, sensor, lag).
    gram : np.ndarray
        C, the activations correlated with each other (component, lag, component, lag).
    n_sweeps : int
        Number of updates.
    pull : np.ndarray or 0
        P, the slope of a penalty (component, sensor, lag), ≥ 0.

    Returns
    -------
    components : np.ndarray
        The new bases.
    shared, square : float
        ⟨B, W⟩ and ⟨W, W C⟩, of which the loss ½‖V‖² − ⟨B, W⟩ + ½⟨W, W C⟩ consists.
    """
    n_components, n_sensors, n_lags = components.shape
    size = n_components * n_lags
    flat = components.transpose(1, 0, 2).reshape(n_sensors, size)
    # the Fourier transform leaves −1e-16
    target = np.maximum(seen, 0).transpose(1, 0, 2).reshape(n_sensors, size)
    square = gram.reshape(size, size)
    pulled = flat @ square
    slope = np.broadcast_to(pull, components.shape).transpose(1, 0, 2).reshape(n_sensors, size)
    for _ in range(n_sweeps):
        below = pulled + slope
        flat = flat / np.where(below == 0, _TINY, below) * target  # this order: no overflow
        # numbers that fade for ever end up slowing the processor
        flat[flat < 1e-50 * flat.max()] = 0
        pulled = flat @ square
    bases = np.ascontiguousarray(
        flat.reshape(n_sensors, n_components, n_lags).transpose(1, 0, 2)
    )
    return bases, float(np.vdot(target, flat)), float(np.vdot(flat, pulled))


def descend_bases(
    components: np.ndarray, seen: np.ndarray, gram: np.ndarray, n_sweeps: int
) -> tuple[np.ndarray, float, float]:
    """Each entry of the bases in turn to where the loss is lowest, the others held.

    An entry that was zero can come back, which no multiplication can do. Parameters and returns are
    those of :func:`multiply_bases`.

    References
    ----------
    Cichocki & Phan 2009, IEICE Trans. Fundam. E92-A:708 (HALS).
    """
    n_components, n_sensors, n_lags = components.shape
    size = n_components * n_lags
    flat = components.transpose(1, 0, 2).reshape(n_sensors, size)
    target = seen.transpose(1, 0, 2).reshape(n_sensors, size)
    square = gram.reshape(size, size)
    flat = np.ascontiguousarray(flat)
    _descend_entries(flat, np.ascontiguousarray(target), square, n_sweeps)
    bases = np.ascontiguousarray(
        flat.reshape(n_sensors, n_components, n_lags).transpose(1, 0, 2)
    )
    return bases, float(np.vdot(target, flat)), float(np.vdot(flat, flat @ square))


@compiled(fastmath={"reassoc", "contract"})  # sums in vector registers
def _descend_entries(rows, target, square, n_sweeps):
    """Lower ½ w·C w − b·w for each row w ≥ 0 and b of ``target``, entry by entry, in place."""
    for n in range(rows.shape[0]):
        row, wanted = rows[n], target[n]
        for _ in range(n_sweeps):
            for i in range(row.size):
                if square[i, i] > 0.0:
                    pulled = 0.0
                    for j in range(row.size):
                        pulled += square[i, j] * row[j]
                    row[i] = max(row[i] + (wanted[i] - pulled) / square[i, i], 0.0)


@checked
def locate_components(components: Bases) -> np.ndarray:
    """Where along the antenna each basis acts.

    Parameters
    ----------
    components : np.ndarray
        Bases (component, sensor, lag).

    Returns
    -------
    np.ndarray
        Centre of mass over sensors (component,), 0 at the first sensor and 1 at the last; 1 for a
        basis of zeros.
    """
    profile = components.sum(axis=2)
    mass = profile.sum(axis=1)
    place = np.linspace(0, 1, components.shape[1])
    return np.where(mass > 0, profile @ place / np.where(mass > 0, mass, 1), 1.0)


def canonicalise(
    components: np.ndarray, activations: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Order the components from base to tip and give each basis unit length.

    The activations take over the lengths, so that the reconstruction stays the same.
    """
    order, length = _find_canon(components)
    moved = np.ascontiguousarray(activations[:, order] * length[:, None])
    return components[order] / length[:, None, None], moved


def canonicalise_sums(
    components: np.ndarray, seen: np.ndarray, gram: np.ndarray
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """The same with the sums over activations that :func:`.learn_batch` goes on from: the data
    correlated with them (component, sensor, lag), and with each other (component, lag, component,
    lag).
    """
    order, length = _find_canon(components)
    seen = seen[order] * length[:, None, None]
    gram = gram[order][:, :, order] * length[:, None, None, None] * length[:, None]
    return components[order] / length[:, None, None], (seen, gram)


def _find_canon(components: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Order from base to tip, and the length of each basis in that order; 1 for one of zeros."""
    order = np.argsort(locate_components(components), kind="stable")
    length = np.sqrt((components[order] ** 2).sum(axis=(1, 2)))
    return order, np.where(length > 0, length, 1.0)


@checked
def compute_basis_similarity(
    first: Bases, second: _Others, *, shift: bool = True
) -> np.ndarray:
    """Greatest cosine over all shifts between each basis of one set and each of another.

    Parameters
    ----------
    first, second : np.ndarray
        Bases (component, sensor, lag); the numbers of components and lags may differ.
    shift : bool, default=True
        False: the cosine at the lags where both stand.

    Returns
    -------
    np.ndarray
        (component of first, component of second), in [0, 1]: 1 for the same basis, however it is
        scaled or, with ``shift``, shifted within the lags.
    """
    length = first.shape[2] + second.shape[2]
    spectra = [np.fft.rfft(_to_unit(bases), length) for bases in (first, second)]
    overlap = np.einsum("asf,bsf->abf", spectra[0], spectra[1].conj())
    cosines = np.fft.irfft(overlap, length)
    return np.clip(cosines.max(axis=2) if shift else cosines[:, :, 0], 0, 1)


@checked
def match_components(
    first: Bases, second: _Others, *, shift: bool = True
) -> tuple[np.ndarray, np.ndarray]:
    """Pair the bases of two sets so that their similarities have the greatest sum.

    Parameters
    ----------
    first, second : np.ndarray
        Bases (component, sensor, lag).
    shift : bool, default=True
        Whether a basis counts as the same where it is shifted within the lags.

    Returns
    -------
    order : np.ndarray
        For each basis of ``first``, the number of its partner in ``second``.
    similarity : np.ndarray
        The cosine of each pair, see :func:`compute_basis_similarity`.
    """
    similarity = compute_basis_similarity(first, second, shift=shift)
    if not np.isfinite(similarity).all():
        raise InvalidInput(
            "bases with NaN, or with numbers that are too large, have no partners."
        )
    rows, order = linear_sum_assignment(-similarity)
    return order, similarity[rows, order]


@checked
def compute_stability(restarts: list[Bases], *, shift: bool = True) -> float:
    """How alike the bases of several restarts are.

    Random non-negative bases already score far above 0, so compare scores between numbers of
    components rather than read one by itself.

    Parameters
    ----------
    restarts : list of np.ndarray
        Bases (component, sensor, lag) of each restart.
    shift : bool, default=True
        Whether a basis counts as the same where it is shifted within the lags. A basis that begins
        in the middle of its pattern then looks like one that holds all of it, so compare both.

    Returns
    -------
    float
        Mean cosine of matched bases over all pairs of restarts, in [0, 1]; NaN for one restart.
    """
    pairs = [
        match_components(first, second, shift=shift)[1].mean()
        for first, second in combinations(restarts, 2)
    ]
    return float(np.mean(pairs)) if pairs else float("nan")


def _to_unit(components: np.ndarray) -> np.ndarray:
    length = np.sqrt((components**2).sum(axis=(1, 2), keepdims=True))
    return components / np.where(length > 0, length, 1)
