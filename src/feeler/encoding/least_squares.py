"""Non-negative least squares on shifted bases, solved exactly: block principal pivoting on a banded
system.
"""

import numpy as np

from feeler.compiled import compiled
from feeler.encoding.activations import apply_gram

# [C]: pivoting ends after some tens; this many would mean that rounding drives it in a circle
MOST_PIVOTS = 300


@compiled
def solve_nonnegative(seen, kernel, edge, activations):
    """The least ½ h·G h − A·h over h ≥ 0 for each trial, G positive definite; activations are
    overwritten.

    Variables run by time, then component, so G has a band of component × lag. The equations of a
    set of active ones are solved; those that come out negative leave, those whose slope is negative
    enter; all at once while that lowers their number, else one at a time, which ends for certain.
    Returns the most pivots that any trial took.

    References
    ----------
    Portugal, Júdice & Vicente 1994, Math. Comput. 63:625; Kim & Park 2011, SIAM J. Sci. Comput.
    33:3261.
    """
    n_trials, n_components, n_times = activations.shape
    most = 0
    slope = np.empty((n_components, n_times))
    for n in range(n_trials):
        most = max(most, _pivot(seen[n], kernel, edge, activations[n], slope))
    return most


@compiled
def _pivot(seen, kernel, edge, h, slope):
    """One trial of solve_nonnegative."""
    n_components, n_times = h.shape
    top = max(seen.max(), 0.0)
    if top == 0.0:
        h[:] = 0.0
        return 0
    active = h > 0.0
    fewest, patience = n_components * n_times + 1, 3
    for pivot in range(MOST_PIVOTS):
        _solve_active(seen, kernel, edge, active, h)
        apply_gram(kernel, edge, h, slope)
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
    np.maximum(h, 0.0, h)
    return MOST_PIVOTS


@compiled(inline="always")
def _is_wrong(active, value, slope, top):
    """An active variable below zero, or an idle one that would lower the loss; rounding does not
    count.
    """
    return value < 0.0 if active else slope < -1e-10 * top


@compiled
def _solve_active(seen, kernel, edge, active, h):
    """Solve G h = A for the active variables; the others become 0."""
    n_components, n_times = h.shape
    n_lags = edge.shape[2]
    count = active.sum()
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
                kernel, edge, component[i], time[i], component[j], time[j], n_times
            )
    _solve_banded(factor, first, value)
    h[:] = 0.0
    for i in range(count):
        h[component[i], time[i]] = value[i]


@compiled(inline="always")
def _look_up(kernel, edge, m, s, k, place, n_times):
    """⟨basis m at s, basis k at place⟩, place ≤ s."""
    n_lags = edge.shape[2]
    if place <= n_times - n_lags:
        return kernel[m, k, s - place + n_lags - 1]
    return edge[m, k, n_times - 1 - s, n_times - 1 - place]


@compiled(fastmath={"reassoc", "contract"})  # sums in vector registers
def _solve_banded(factor, first, value):
    """Cholesky in place and both substitutions; row i of the lower half begins at column first[i]."""
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
def polish_nonnegative(seen, kernel, edge, activations, n_steps):
    """Lower ½ h·G h − A·h over h ≥ 0 by n_steps of accelerated projected gradient, from these
    activations, in place.

    For a G that is all but singular, where the least is reached by many h. The momentum starts
    again whenever it points uphill (O'Donoghue & Candès 2015, Found. Comput. Math. 15:715).
    """
    n_trials, n_components, n_times = activations.shape
    bound = 0.0
    for m in range(n_components):  # Gershgorin, blockwise: no eigenvalue of G lies above
        bound = max(bound, np.abs(kernel[m]).sum())
    if bound == 0.0:
        return
    slope, ahead = np.empty((n_components, n_times)), np.empty((n_components, n_times))
    for n in range(n_trials):
        h, momentum = activations[n], 1.0
        nothing = 1e-14 * max(
            h.max(), 0.0
        )  # below rounding; fading numbers would slow the processor
        ahead[:] = h
        for _ in range(n_steps):
            apply_gram(kernel, edge, ahead, slope)
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
