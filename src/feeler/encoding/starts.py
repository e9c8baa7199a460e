"""Where fits begin: bases and activations drawn from a seed, or given."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from feeler.encoding.activations import apply_gram
from feeler.encoding.convolution import compute_basis_gram, compute_spectra
from feeler.encoding.data import Data
from feeler.errors import InvalidInput


def draw_starts(
    model: Any,
    tensors: np.ndarray,
    data: Data,
    components: np.ndarray | None,
    activations: np.ndarray | None,
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """The (bases, activations) that each restart of an encoder begins from; one where either is
    given.
    """
    given = components is not None or activations is not None
    for rng in make_generators(model.random_state, 1 if given else model.n_restarts):
        bases = components
        if bases is None:
            bases = start_bases(tensors, model.n_components, model.n_lags, model.init, rng)
        bases = _check_start(
            "components", bases, (model.n_components, data.n_sensors, model.n_lags)
        )
        codes = activations
        if codes is None:
            codes = _start_activations(data, bases, model.init, rng)
        shape = (data.n_trials, model.n_components, data.n_times)
        yield bases, _check_start("activations", codes, shape)


def make_generators(random_state, n: int) -> list[np.random.Generator]:
    """One generator per restart, from whatever scikit-learn or NumPy takes as a seed."""
    if isinstance(random_state, np.random.RandomState):
        random_state = random_state.randint(2**31)
    return np.random.default_rng(random_state).spawn(n)


def start_bases(
    tensors: np.ndarray, n_components: int, n_lags: int, init: str, rng: np.random.Generator
) -> np.ndarray:
    """Starting bases (component, sensor, lag).

    ``windows`` takes stretches of the tensors, drawn with the probability of their energy, and adds
    a floor of a tenth of their mean, because an entry at zero would stay there. ``random`` draws
    uniform numbers in [0, 1) and scales them to the data.
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


def _start_activations(
    data: Data, components: np.ndarray, init: str, rng: np.random.Generator
) -> np.ndarray:
    """Starting activations (trial, component, time).

    ``windows`` takes what the bases see, at the best scale; ``random`` takes uniform numbers.
    """
    shape = (data.n_trials, components.shape[0], data.n_times)
    if init == "random":
        return rng.random(shape)
    kernel, fringe = compute_basis_gram(components)
    spectra = compute_spectra(components, data.length)
    seen = np.maximum(data.see(spectra, slice(None)), 0)
    pulled = np.empty(shape[1:])
    for trial in seen:
        apply_gram(kernel, fringe, trial, pulled)
        bend = np.vdot(trial, pulled)
        trial *= np.vdot(trial, trial) / bend if bend > 0 else 0
    return seen


def _check_start(name: str, value, shape: tuple[int, ...]) -> np.ndarray:
    value = np.array(value, dtype=float)
    if value.shape != shape:
        raise InvalidInput(f"The starting {name} need the shape {shape}; got {value.shape}.")
    if not (np.isfinite(value).all() and (value >= 0).all()):
        raise InvalidInput(f"The starting {name} must be finite and non-negative.")
    return value
