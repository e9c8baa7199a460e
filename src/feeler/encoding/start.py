"""Where a factorisation starts."""

import numpy as np

from feeler.encoding.activations import apply_gram
from feeler.encoding.factorise import Data
from feeler.encoding.gram import compute_basis_gram


def make_generators(random_state, n: int) -> list[np.random.Generator]:
    """One generator per restart, from whatever scikit-learn allows as random_state, or a NumPy
    generator.
    """
    if isinstance(random_state, np.random.RandomState):
        random_state = random_state.randint(2**31)
    return np.random.default_rng(random_state).spawn(n)


def start_bases(
    tensors: np.ndarray, n_components: int, n_lags: int, init: str, rng: np.random.Generator
) -> np.ndarray:
    """Starting bases (component, sensor, lag).

    "windows": stretches of the tensors, drawn with the probability of their energy, over a floor of
    a tenth of their
        mean (an
    entry at zero would stay there). "random": uniform in [0, 1), scaled to the data.
    """
    n_trials, n_sensors, n_times = tensors.shape
    if init == "random":
        return rng.random((n_components, n_sensors, n_lags)) * (2 * tensors.mean())
    power = np.einsum("nxt,nxt->nt", tensors, tensors)
    total = np.cumsum(np.pad(power, ((0, 0), (1, 0))), axis=1)
    windows = np.maximum(total[:, n_lags:] - total[:, :-n_lags], 0).ravel()
    weight = windows / windows.sum() if windows.sum() > 0 else None
    chosen = rng.choice(windows.size, n_components, p=weight)
    trial, onset = np.unravel_index(chosen, (n_trials, n_times - n_lags + 1))
    bases = np.stack([tensors[n, :, t : t + n_lags] for n, t in zip(trial, onset, strict=True)])
    floor = bases.mean(axis=(1, 2), keepdims=True)
    return bases + floor * rng.uniform(0.05, 0.15, bases.shape)


def start_activations(
    data: Data, components: np.ndarray, init: str, rng: np.random.Generator
) -> np.ndarray:
    """Starting activations (trial, component, time): what the bases see at the best scale, or
    uniform numbers.
    """
    shape = (data.n_trials, components.shape[0], data.n_times)
    if init == "random":
        return rng.random(shape)
    kernel, edge = compute_basis_gram(components)
    seen = np.maximum(data.see(components, slice(None)), 0)
    pulled = np.empty(shape[1:])
    for trial in seen:
        apply_gram(kernel, edge, trial, pulled)
        bend = np.vdot(trial, pulled)
        trial *= np.vdot(trial, trial) / bend if bend > 0 else 0
    return seen
