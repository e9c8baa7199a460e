"""Codes of tensors on fixed bases, each trial by itself.

So the same tensor has the same code wherever it stands in a set. The least squares behind the codes
are solved exactly, by block principal pivoting on a banded system.
"""

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np

from feeler.compiled import compiled, inlined, nested
from feeler.encoding.convolution import (
    apply_gram,
    compute_basis_gram,
    compute_spectra,
    correlate_with_bases,
    descend_activations,
    fourier_length,
    invert_spectra,
    project_activations,
    reconstruct,
)
from feeler.encoding.measures import l1_of_unit_vector
from feeler.tensors.transforms import find_scale
from feeler.validation import checked

# trials per task [C]: fixed, so that sums over trials do not depend on the number of threads
TRIALS_PER_TASK = 8
_APPROACH = 150  # steps towards the ridge code [C]: then exact pivoting ends after two or three
# steps of the code without a ridge [C]: the residual then moves by less than 1e-4 of itself
_POLISH = 300


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
    """Activations of tensors on fixed bases.

    Parameters
    ----------
    tensors : np.ndarray
        (trial, sensor, time), ≥ 0.
    components : np.ndarray
        Bases (component, sensor, lag), ≥ 0.
    code : {"ridge", "nonnegative", "sparse"}
        ``ridge`` is the h ≥ 0 with the least ½‖V − V̂‖² + ½·ridge·‖W‖²·‖h‖², where ‖W‖² is the mean
        squared length of a basis, so that ridge has no unit. It is strictly convex: there is one
        answer, which is solved exactly and moves little when the tensor does.
        ``nonnegative`` goes towards the least ‖V − V̂‖ over h ≥ 0, by 300 accelerated gradient
        steps from near the ridge code. Where bases are smooth, very different h do almost as well;
        the fixed start and number of steps make it one answer.
        ``sparse`` is the least ½‖V − V̂‖² among activations of which every row has exactly this
        sparseness, or is zero, by projected gradient from the projected, nearly solved ridge code.
        It is not convex: the fixed start makes it one answer, which need not be the best. Where
        bases are smooth, rounding of the tensors (float32, degrees for rad) alone can move its
        entries, by up to a tenth of the greatest.
    sparseness : float or None, default=0.8
        Hoyer sparseness of the sparse code, in [0, 1).
    ridge : float, default=0.1
        Weight of the ridge, without a unit.
    max_sweeps : int, default=500
        Most sweeps of the sparse code.
    tol : float, default=1e-5
        The sparse code ends when a sweep lowers the loss by less than ``tol`` times what the code
        explains.
    run : Callable, default=map
        Maps a function over blocks of trials, on one thread or several.

    Returns
    -------
    activations : np.ndarray
        (trial, component, time).
    settled : bool
        Whether the code of every trial has converged.
    """
    n_trials, _, n_times = tensors.shape
    n_components, _, n_lags = components.shape
    length = fourier_length(n_times, n_lags)
    basis_spectra = compute_spectra(components, length)
    kernel, fringe = compute_basis_gram(components)
    # ridge·‖W‖² added where a basis meets itself at the same moment
    own, centre, stiff = np.arange(n_components), n_lags + 2, kernel.copy()
    stiff[own, own, centre] += ridge * kernel[own, own, centre].mean()
    ridged = stiff, fringe
    l1 = (
        0.0
        if sparseness is None or code != "sparse"
        else l1_of_unit_vector(n_times, sparseness)
    )
    activations = np.zeros((n_trials, n_components, n_times))

    def encode_block(block: slice) -> bool:
        # each trial about 1, so that squares of very large or small ones stay numbers
        scales = [find_scale(tensor) for tensor in tensors[block]]
        rows = activations[block]
        seen = np.empty(rows.shape)
        for one, tensor, scale in zip(seen, tensors[block], scales, strict=True):
            spectra = compute_spectra(tensor[None] / scale, length)  # no neighbour rounds them
            both = np.empty((2, 1, n_components, spectra.shape[-1]))
            correlate_with_bases(*spectra, *basis_spectra, both)
            one[:] = invert_spectra(both, length, n_times)[0]
        settled = encode_rows(seen, rows)
        rows *= np.reshape(scales, (-1, 1, 1))
        return settled

    def encode_rows(seen: np.ndarray, rows: np.ndarray) -> bool:
        _polish_nonnegative(seen, *ridged, rows, _APPROACH)
        if code == "nonnegative":
            _polish_nonnegative(seen, kernel, fringe, rows, _POLISH)
            return True
        if code == "ridge":
            return _solve_nonnegative(seen, *ridged, rows) < MOST_PIVOTS
        project_activations(rows, l1, False)
        steps = np.ones(rows.shape[:2])
        return (
            descend_activations(seen, kernel, fringe, rows, steps, l1, False, max_sweeps, tol)
            < max_sweeps
        )

    blocks = [
        slice(start, start + TRIALS_PER_TASK) for start in range(0, n_trials, TRIALS_PER_TASK)
    ]
    return activations, all(list(run(encode_block, blocks)))


_FILLS = 100  # [C] of a trial's masked entries; most settle within 20
_SETTLED = 1e-3  # [C] change of what is filled in, relative to the trial's length


def encode_masked(
    tensors: np.ndarray,
    hidden: np.ndarray | None,
    *args: Any,
    run: Callable = map,
    **options: Any,
) -> tuple[np.ndarray, bool]:
    """:func:`encode` with what ``hidden`` marks (trial, sensor, time) left out: it is filled with
    its reconstruction until that stands, which never raises the loss of the rest.
    """
    activations, settled = encode(tensors, *args, run=run, **options)
    if hidden is None:
        return activations, settled
    gaps = np.flatnonzero(hidden.any(axis=(1, 2)))

    def encode_one(n: int) -> bool:
        tensor, gap, code, settled = tensors[n], hidden[n], activations[n : n + 1], True
        length = _SETTLED * np.linalg.norm(tensor)
        for _ in range(_FILLS):
            filled = np.where(gap, reconstruct(args[0], code)[0], tensor)
            if np.linalg.norm(filled - tensor) <= length:
                break
            tensor = filled
            code, settled = encode(tensor[None], *args, **options)
        else:
            settled = False
        activations[n] = code[0]
        return settled

    return activations, all([*run(encode_one, gaps), settled])


# [C]: pivoting ends after some tens; this many would mean that rounding drives it in a circle
MOST_PIVOTS = 300


@compiled
def _solve_nonnegative(seen, kernel, fringe, activations):
    """The least ½ h·G h − A·h over h ≥ 0 for each trial, in place; G is positive definite.

    Variables run by time, then component, so that G has a band of component × lag. The equations of
    a set of active variables are solved. Those that come out negative leave the set, and those
    whose slope is negative enter it: all at once while that lowers their number, otherwise one at a
    time, which is sure to end. Returns the most pivots that any trial took.

    References
    ----------
    Portugal, Júdice & Vicente 1994, Math. Comput. 63:625; Kim & Park 2011, SIAM J. Sci. Comput.
    33:3261.
    """
    n_trials, n_components, n_times = activations.shape
    most = 0
    slope = np.empty((n_components, n_times))
    for n in range(n_trials):
        most = max(most, _pivot(seen[n], kernel, fringe, activations[n], slope))
    return most


@compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True)
def _pivot(seen, kernel, fringe, h, slope):
    """One trial of solve_nonnegative."""
    n_components, n_times = h.shape
    top = _find_top(seen)
    active = np.empty((n_components, n_times), np.bool_)
    for m in range(n_components):
        for t in range(n_times):
            h[m, t] = h[m, t] if top > 0.0 else 0.0
            active[m, t] = h[m, t] > 0.0
    if top == 0.0:
        return 0
    fewest, patience = n_components * n_times + 1, 3
    for pivot in range(MOST_PIVOTS):
        _solve_active(seen, kernel, fringe, active, h)
        apply_gram(kernel, fringe, h, slope)
        wrong, last_m, last_t = 0, 0, 0
        for t in range(n_times):
            for m in range(n_components):
                if _is_wrong(active[m, t], h[m, t], slope[m, t] - seen[m, t], top):
                    wrong, last_m, last_t = wrong + 1, m, t
        if wrong == 0:
            return pivot + 1
        if wrong < fewest:
            fewest, patience = wrong, 3
        else:
            patience -= 1
        if patience < 0:
            active[last_m, last_t] = not active[last_m, last_t]
            continue
        for t in range(n_times):
            for m in range(n_components):
                if _is_wrong(active[m, t], h[m, t], slope[m, t] - seen[m, t], top):
                    active[m, t] = not active[m, t]
    for m in range(n_components):
        for t in range(n_times):
            h[m, t] = max(h[m, t], 0.0)
    return MOST_PIVOTS


@nested
def _find_top(rows):
    """The largest entry, at least 0; NumPy's max takes seconds to compile."""
    top = 0.0
    for row in rows:
        for value in row:
            top = max(top, value)
    return top


@inlined
def _is_wrong(active, value, slope, top):
    """Whether an active variable is below zero, or an idle one would lower the loss."""
    return value < 0.0 if active else slope < -1e-10 * top


@compiled(no_cpython_wrapper=True, no_cfunc_wrapper=True)
def _solve_active(seen, kernel, fringe, active, h):
    """Solve G h = A for the active variables; the others become 0."""
    n_components, n_times = h.shape
    n_lags = fringe.shape[2] + 1
    count = 0
    for m in range(n_components):
        for t in range(n_times):
            h[m, t] = 0.0
            count += active[m, t]
    component, time = np.empty(count, np.int64), np.empty(count, np.int64)
    value = np.empty(count)
    i = 0
    for t in range(n_times):
        for m in range(n_components):
            if active[m, t]:
                component[i], time[i], value[i] = m, t, seen[m, t]
                i += 1
    factor = np.empty((count, n_components * n_lags))
    first = np.empty(count, np.int64)
    start = 0
    for i in range(count):
        while time[start] <= time[i] - n_lags:
            start += 1
        first[i] = start
        for j in range(start, i + 1):
            factor[i, j - start] = _look_up(
                kernel, fringe, component[i], time[i], component[j], time[j], n_times
            )
    _solve_banded(factor, first, value)
    for i in range(count):
        h[component[i], time[i]] = value[i]


@inlined
def _look_up(kernel, fringe, m, s, k, place, n_times):
    """⟨basis m at s, basis k at place⟩, place ≤ s."""
    n_lags = fringe.shape[2] + 1
    whole = kernel[m, k, s - place + n_lags + 2]
    if place <= n_times - n_lags:
        return whole
    return whole + fringe[m, k, n_times - 1 - place, s - n_times + n_lags - 1]


@nested(fastmath={"reassoc", "contract"})  # sums in vector registers
def _solve_banded(factor, first, value):
    """Cholesky in place, both substitutions; row i of the lower half begins at first[i]."""
    for i in range(value.size):
        row, begin = factor[i], first[i]
        for j in range(begin, i):
            other, low = factor[j], max(begin, first[j])
            a, b = row[low - begin : j - begin], other[low - first[j] : j - first[j]]
            total = 0.0
            for k in range(a.size):
                total += a[k] * b[k]
            row[j - begin] = (row[j - begin] - total) / other[j - first[j]]
        a = row[: i - begin]
        total, known = 0.0, 0.0
        for k in range(a.size):
            total += a[k] * a[k]
            known += a[k] * value[begin + k]
        row[i - begin] = np.sqrt(max(row[i - begin] - total, 1e-14 * row[i - begin]))
        value[i] = (value[i] - known) / row[i - begin]
    for i in range(value.size - 1, -1, -1):
        row, begin = factor[i], first[i]
        value[i] /= row[i - begin]
        for k in range(i - begin):
            value[begin + k] -= row[k] * value[i]


@compiled
def _polish_nonnegative(seen, kernel, fringe, activations, n_steps):
    """Lower ½ h·G h − A·h over h ≥ 0 by steps of accelerated projected gradient, in place.

    For a G that is all but singular, where the least is reached by many h. The momentum starts
    again whenever it points uphill (O'Donoghue & Candès 2015, Found. Comput. Math. 15:715).
    """
    n_trials, n_components, n_times = activations.shape
    bound = 0.0
    for m in range(n_components):  # Gershgorin, blockwise: no eigenvalue of G lies above
        total = 0.0
        for row in kernel[m]:
            for value in row:
                total += abs(value)
        bound = max(bound, total)
    if bound == 0.0:
        return
    slope, ahead = np.empty((n_components, n_times)), np.empty((n_components, n_times))
    for n in range(n_trials):
        h, momentum = activations[n], 1.0
        # below rounding; fading numbers would slow the processor
        nothing = 1e-14 * _find_top(h)
        for m in range(n_components):  # NumPy's copy takes seconds to compile
            for t in range(n_times):
                ahead[m, t] = h[m, t]
        for _ in range(n_steps):
            apply_gram(kernel, fringe, ahead, slope)
            following = 0.5 * (1.0 + np.sqrt(1.0 + 4.0 * momentum * momentum))
            uphill = 0.0
            for m in range(n_components):
                for t in range(n_times):
                    down = slope[m, t] - seen[n, m, t]
                    moved = max(ahead[m, t] - down / bound, 0.0)
                    uphill += (ahead[m, t] - moved) * (moved - h[m, t])
                    slope[m, t] = moved
            weight = (momentum - 1.0) / following if uphill <= 0.0 else 0.0
            momentum = following if uphill <= 0.0 else 1.0
            for m in range(n_components):
                for t in range(n_times):
                    moved = slope[m, t] if slope[m, t] > nothing else 0.0
                    ahead[m, t] = moved + weight * (moved - h[m, t])
                    h[m, t] = moved
