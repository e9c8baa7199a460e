"""Steps of the activations on fixed bases.

They need what the bases see (A) and the bases' inner products (kernel, fringe).
"""

import numpy as np

from feeler.compiled import compiled, lean
from feeler.encoding.convolution import add_convolved
from feeler.encoding.sparseness import project_row


@compiled
def apply_gram(kernel, fringe, activations, out):
    """out = G·activations for one trial, both (component, time)."""
    n_components, n_times = activations.shape
    wide = np.empty((n_components, n_times + kernel.shape[2]))
    _apply_wide(kernel, fringe, activations, np.zeros(n_times + 3), wide)
    out[:] = wide[:, fringe.shape[2] : fringe.shape[2] + n_times]


@lean
def _apply_wide(kernel, fringe, activations, padded, wide):
    """The same, as :func:`.add_convolved` lays it out; ``padded`` ends with three zeros."""
    n_components, n_times = activations.shape
    wide[:] = 0.0
    for k in range(n_components):
        first, stop = _find_extent(activations[k])
        for t in range(n_times):
            padded[t] = activations[k, t]
        for m in range(n_components):
            add_convolved(kernel[m, k], fringe[m, k], padded, first, stop, wide[m])


@lean
def _find_extent(row):
    """First entry that is not zero, and the one after the last."""
    first, stop = 0, row.size
    while first < stop and row[first] == 0.0:
        first += 1
    while stop > first and row[stop - 1] == 0.0:
        stop -= 1
    return first, stop


@compiled
def multiply_activations(seen, kernel, fringe, activations, n_sweeps):
    """Multiplicative updates H ← H·A/(G H) of activations (trial, component, time), in place."""
    # what scikit-learn's NMF puts in place of a vanishing denominator
    tiny = np.finfo(np.float32).eps
    pulled = np.empty(activations.shape[1:])
    for n in range(activations.shape[0]):
        for _ in range(n_sweeps):
            apply_gram(kernel, fringe, activations[n], pulled)
            for m in range(pulled.shape[0]):
                for t in range(pulled.shape[1]):
                    below = pulled[m, t] if pulled[m, t] != 0.0 else tiny
                    ratio = (
                        activations[n, m, t] / below
                    )  # before the product: it cannot overflow
                    activations[n, m, t] = ratio * max(seen[n, m, t], 0.0)


@compiled
def project_activations(activations, l1, joint):
    """Put activations (trial, component, time) onto the sparseness constraint, in place; ``joint``:
    one constraint per component over all trials.
    """
    n_trials, n_components, n_times = activations.shape
    together = n_trials if joint else 1
    row, projected = np.empty((together, n_times)), np.empty((together, n_times))
    for first in range(0, n_trials, together):
        for m in range(n_components):
            row[:] = activations[first : first + together, m]
            project_row(row.ravel(), l1, projected.ravel())
            activations[first : first + together, m] = projected


@compiled
def descend_activations(seen, kernel, fringe, activations, steps, l1, joint, n_sweeps, tol):
    """Projected-gradient sweeps under the sparseness constraint, in place.

    Activations are (trial, component, time). With ``joint`` there is one constraint per component
    over all trials given, otherwise one per component and trial. ``steps`` (trial, component) are
    the step sizes in units of the step that cannot fail; they are kept between calls. A trial ends
    early once a sweep lowers its loss by less than ``tol`` times what the bases explain. Returns
    the most sweeps that any trial took.
    """
    safe = np.empty(kernel.shape[0])
    for m in range(safe.size):
        # Gershgorin: no eigenvalue of a Toeplitz matrix lies above
        bound = np.abs(kernel[m, m]).sum()
        safe[m] = 1.0 / bound if bound > 0.0 else 0.0
    if joint:
        return _descend_group(
            seen, kernel, fringe, activations, steps[0], safe, l1, n_sweeps, tol
        )
    most = 0
    for n in range(activations.shape[0]):
        sweeps = _descend_group(
            seen[n : n + 1],
            kernel,
            fringe,
            activations[n : n + 1],
            steps[n],
            safe,
            l1,
            n_sweeps,
            tol,
        )
        most = max(most, sweeps)
    return most


@compiled
def _descend_group(seen, kernel, fringe, activations, steps, safe, l1, n_sweeps, tol):
    """Sweeps over the components of trials that share one constraint per component."""
    n_trials, n_components, n_times = activations.shape
    row, projected = np.empty(n_trials * n_times), np.empty(n_trials * n_times)
    change = np.zeros((n_trials, n_times + 3))
    pulled = np.empty((n_trials, n_components, n_times + kernel.shape[2]))
    pull = np.empty((n_trials, n_times + kernel.shape[2]))
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


@compiled
def _descend_row(
    m, seen, kernel, fringe, activations, pulled, steps, safe, l1, row, projected, change, pull
):
    """One step of component m, halved until the loss falls; returns the fall.

    The next step begins longer.
    """
    while True:
        _step_down(m, fringe.shape[2], seen, activations, pulled, steps[m] * safe, row)
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


@lean
def _step_down(m, reach, seen, activations, pulled, step, row):
    """Row m of all trials (trial × time), a step down the gradient."""
    n_trials, _, n_times = activations.shape
    for n in range(n_trials):
        a, b, c = activations[n, m], pulled[n, m, reach : reach + n_times], seen[n, m]
        target = row[n * n_times : (n + 1) * n_times]
        for t in range(n_times):
            target[t] = a[t] - step * (b[t] - c[t])


@lean(fastmath={"reassoc", "contract"})  # sums in vector registers
def _measure_fall(m, seen, kernel, fringe, activations, pulled, projected, change, pull):
    """How far the loss falls if row m becomes ``projected``; the change, and G times it."""
    n_trials, _, n_times = activations.shape
    reach = fringe.shape[0]
    total = 0.0
    for n in range(n_trials):
        old, new = activations[n, m], projected[n * n_times : (n + 1) * n_times]
        delta = change[n, :n_times]
        for t in range(n_times):
            delta[t] = new[t] - old[t]
        pull[n] = 0.0
        first, stop = _find_extent(delta)
        add_convolved(kernel, fringe, change[n], first, stop, pull[n])
        before, after = pulled[n, m, reach : reach + n_times], pull[n, reach : reach + n_times]
        wanted = seen[n, m]
        for t in range(first, stop):
            total -= delta[t] * (before[t] - wanted[t] + 0.5 * after[t])
    return total


@lean
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
                add_convolved(kernel[k, m], fringe[k, m], change[n], first, stop, pulled[n, k])
