"""Inner products that replace reconstructions: of shifted bases with each other, of shifted
activations with each other.

Both matrices are Toeplitz up to the end of the window, so two small sums along diagonals give them
exactly.
"""

import numpy as np

from feeler.compiled import compiled


def compute_basis_gram(components: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Inner products of the bases placed at two moments of one trial.

    Parameters
    ----------
    components : (component, sensor, lag)

    Returns
    -------
    kernel : (component m, component k, 2·lag − 1). kernel[m, k, d + L − 1] = Σ_x Σ_τ W_m(x, τ)
    W_k(x, τ + d): m
        starts d after k, both fit into the window.
    edge : (component m, component k, lag, lag). edge[m, k, i, j]: m starts i samples before the
    last one, k starts j
        before it, and what runs past the window is cut off. edge[..., L − 1, :] and edge[..., :, L
        − 1] are the kernel.
    """
    n_components, n_sensors, n_lags = components.shape
    flat = components.transpose(1, 0, 2).reshape(n_sensors, n_components * n_lags)
    products = (
        (flat.T @ flat).reshape(n_components, n_lags, n_components, n_lags).transpose(0, 2, 1, 3)
    )
    edge = np.ascontiguousarray(products)
    for i in range(1, n_lags):
        edge[:, :, i, 1:] += edge[:, :, i - 1, :-1]
    edge[edge < 1e-50 * edge.max()] = (
        0  # products of fading numbers slow the processor, and change nothing
    )
    kernel = np.empty((n_components, n_components, 2 * n_lags - 1))
    # m starts d after k: with k at the last full place (j = L − 1), m stands at i = L − 1 − d
    kernel[:, :, n_lags - 1 :] = edge[:, :, ::-1, n_lags - 1]
    kernel[:, :, : n_lags - 1] = edge[:, :, n_lags - 1, : n_lags - 1]
    return kernel, edge


@compiled(fastmath={"contract"})  # fused multiply-add: half the instructions
def add_convolved(kernel, edge, padded, first, stop, out):
    """Add G·h to out (time): the kernel is that of the pair (m, k), the edge that of (k, m), its
    transpose.

    h stands in `padded` with n_lags − 1 zeros each side, and is zero outside [first, stop).
    """
    n_lags, n_times = edge.shape[0], out.size
    low, high = max(0, first - n_lags + 1), min(n_times, stop + n_lags - 1)
    target, width = out[low:high], high - low
    offset = low + 2 * (n_lags - 1)
    j = 0
    while (
        j + 4 <= kernel.size
    ):  # four lags per pass: a quarter of the loads and stores of the target
        a, b, c, d = kernel[j], kernel[j + 1], kernel[j + 2], kernel[j + 3]
        source = padded[offset - j - 3 :]
        for s in range(width):
            target[s] += a * source[s + 3] + b * source[s + 2] + c * source[s + 1] + d * source[s]
        j += 4
    while j < kernel.size:
        a, source = kernel[j], padded[offset - j :]
        for s in range(width):
            target[s] += a * source[s]
        j += 1
    # near the end both are cut: put the edge's numbers instead, along its rows, where they lie side
    # by side
    for place in range(max(first, n_times - n_lags + 1), stop):
        value = padded[place + n_lags - 1]
        if value != 0.0:
            row, whole = edge[n_times - 1 - place], n_times - place + n_lags - 2
            for i in range(n_lags - 1):
                out[n_times - 1 - i] += value * (row[i] - kernel[whole - i])


def compute_activation_gram(activations: np.ndarray, n_lags: int) -> np.ndarray:
    """C[m, τ, k, σ] = Σ_n Σ_t H_nm(t − τ) H_nk(t − σ), t running over the window: (component, lag,
    component, lag).
    """
    n_trials, n_components, _ = activations.shape
    ends = np.ascontiguousarray(activations[:, :, : -n_lags - 1 : -1]).reshape(
        n_trials, n_components * n_lags
    )
    lost = (ends.T @ ends).reshape(
        n_components, n_lags, n_components, n_lags
    )  # what each further lag pushes out
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
    """Add Σ_n Σ_u H_nk(u) H_nm(u + d) to out[m, k, d], d ≥ 0; moments without activation cost
    nothing.
    """
    n_trials, n_components, n_times = activations.shape
    n_lags = out.shape[2]
    for n in range(n_trials):
        for k in range(n_components):
            for u in range(n_times):
                value = activations[n, k, u]
                if value == 0.0:
                    continue
                reach = min(n_lags, n_times - u)
                for m in range(n_components):
                    later, target = activations[n, m, u:], out[m, k]
                    for d in range(reach):
                        target[d] += value * later[d]
