"""Bases that begin too early or too late, found by a wider look at the data.

A basis that begins in the middle of a pattern is a trap: what stands before its first lag, or after
its last one, can only come back if all its activations move together. So now and then each basis is
fitted to a wider window of lags on the same activations, and the best stretch of it is kept.
"""

from collections.abc import Callable

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from feeler.encoding.bases import descend_bases
from feeler.encoding.convolution import compute_activation_gram
from feeler.encoding.data import Data

_SWEEPS = 5  # over the wide bases [C]
# of what a basis explains: stretches that explain this much less than the best are as good [C]
_EQUAL = 0.01


def slide_bases(
    data: Data, components: np.ndarray, activations: np.ndarray, run: Callable = map
) -> tuple[np.ndarray, np.ndarray] | None:
    """Bases that begin where their patterns do, and activations moved the other way.

    Of the stretches of lags that explain nearly as much as the best one, the last is taken: an
    activation cannot stand before the window, so that a basis that begins with silence misses the
    patterns with which a window begins.

    Returns
    -------
    tuple or None
        Bases (component, sensor, lag) and activations (trial, component, time), as copies; None
        where every basis stays.
    """
    if data.margin == 0:
        return None
    windows = _choose_windows(data, components, activations, run)
    moves = [first - data.margin for first, _ in windows]
    if not any(moves):
        return None
    bases, moved = components.copy(), activations.copy()
    for m, ((_, basis), move) in enumerate(zip(windows, moves, strict=True)):
        if move:
            bases[m], moved[:, m] = basis, _move(activations[:, m], move)
    return bases, moved


def _choose_windows(data, components, activations, run) -> list[tuple[int, np.ndarray]]:
    """For each component the first lag to keep of the wide window, and the basis (sensor, lag)."""
    n_components, n_sensors, n_lags = components.shape
    margin, width = data.margin, data.n_lags + 2 * data.margin
    seen = data.gather(activations, run, margin)
    later = np.pad(activations, ((0, 0), (0, 0), (0, margin)))  # lags count from −margin
    gram = compute_activation_gram(later, width)
    wide = np.full((n_components, n_sensors, width), 1e-2 * components.mean())
    wide[:, :, margin : margin + n_lags] = components
    wide, _, _ = descend_bases(
        wide, seen, gram, _SWEEPS
    )  # together: none takes what others explain
    windows = []
    for m in range(n_components):
        others = sum(wide[k] @ gram[k, :, m] for k in range(n_components) if k != m)
        windows.append(_cut(wide[m], seen[m] - others, gram[m, :, m], n_lags))
    return windows


def _cut(wide, target, square, n_lags) -> tuple[int, np.ndarray]:
    """The last of the stretches of lags that explain almost as much as the best one."""
    shared = sliding_window_view((wide * target).sum(axis=0), n_lags).sum(axis=1)
    overlap = (wide.T @ wide) * square
    bent = [overlap[k : k + n_lags, k : k + n_lags].sum() for k in range(len(shared))]
    explained = shared - 0.5 * np.array(bent)
    best = explained.max()
    first = int(np.flatnonzero(explained >= best - _EQUAL * abs(best)).max())
    return first, wide[:, first : first + n_lags]


def _move(rows: np.ndarray, move: int) -> np.ndarray:
    """Rows (trial, time) later by ``move`` samples; what leaves the window is lost."""
    moved = np.zeros_like(rows)
    if move > 0:
        moved[:, move:] = rows[:, :-move]
    else:
        moved[:, :move] = rows[:, -move:]
    return moved
