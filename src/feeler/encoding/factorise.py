"""One factorisation from one start: activations and bases in turn, until the loss stands."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from feeler.encoding.activations import apply_gram, descend_activations, multiply_activations
from feeler.encoding.bases import multiply_bases
from feeler.encoding.code import TRIALS_PER_TASK, encode
from feeler.encoding.convolution import (
    compute_activation_gram,
    compute_basis_gram,
    compute_spectra,
    correlate_with_activations,
    correlate_with_bases,
    fourier_length,
    invert_spectra,
)
from feeler.encoding.sparseness import l1_of_unit_vector, project_row
from feeler.execute.threads import ThreadExecutor, hold_blas


@dataclass(frozen=True, kw_only=True)
class Settings:
    """How to factorise.

    Attributes
    ----------
    n_lags : int
        Samples that a basis lasts.
    sparseness : float | None
        Hoyer sparseness of the activations; None: no constraint, multiplicative updates.
    joint : bool
        One constraint per component over all trials, rather than one per component and trial.
    max_iter : int
        Most iterations.
    tol : float
        Stop when ten iterations lower the loss by less than ten times this fraction of it.
    inner_steps : int
        Steps of the activations, and then of the bases, per iteration.
    """

    n_components: int
    n_lags: int
    sparseness: float | None
    joint: bool
    max_iter: int
    tol: float
    inner_steps: int


@dataclass(frozen=True, kw_only=True)
class Factors:
    """What a factorisation found.

    Attributes
    ----------
    components : np.ndarray
        (component, sensor, lag)
    activations : np.ndarray
        (trial, component, time)
    losses : np.ndarray
        ½‖V − V̂‖² before the first iteration and after each.
    """

    components: np.ndarray
    activations: np.ndarray
    losses: np.ndarray
    converged: bool


class Data:
    """Tensors made ready once for any number of factorisations: their transform and their size."""

    def __init__(self, tensors: np.ndarray, n_lags: int):
        self.n_trials, self.n_sensors, self.n_times = tensors.shape
        self.n_lags = n_lags
        self.length = fourier_length(self.n_times, n_lags)
        self.spectra = compute_spectra(tensors, self.length)
        self.energy = float(np.vdot(tensors, tensors))
        self.silent = ~tensors.any(axis=(1, 2))

    def see(self, components: np.ndarray, trials: slice) -> np.ndarray:
        """A (trial, component, time): the bases correlated with the tensors."""
        basis_spectra = compute_spectra(components, self.length)
        return self._see(basis_spectra, trials)

    def _see(self, basis_spectra: np.ndarray, trials: slice) -> np.ndarray:
        v_re, v_im = self.spectra[0, trials], self.spectra[1, trials]
        out = np.empty((2, v_re.shape[0], basis_spectra.shape[1], v_re.shape[2]))
        correlate_with_bases(v_re, v_im, basis_spectra[0], basis_spectra[1], out)
        return invert_spectra(out, self.length, self.n_times)

    def gather(self, activations: np.ndarray, trials: slice) -> np.ndarray:
        """Transform of B (component, sensor, lag): tensors correlated with activations."""
        h_re, h_im = compute_spectra(activations[trials], self.length)
        v_re, v_im = self.spectra[0, trials], self.spectra[1, trials]
        out = np.zeros((2, activations.shape[1], self.n_sensors, v_re.shape[2]))
        correlate_with_activations(v_re, v_im, h_re, h_im, out)
        return out


def factorise(
    data: Data,
    components: np.ndarray,
    activations: np.ndarray,
    settings: Settings,
    run: Callable = map,
    on_iteration: Callable[[int, float], None] | None = None,
) -> Factors:
    """Lower ½‖V − V̂‖² from one start; the algorithm is that of :class:`ConvolutiveNMF`.

    Parameters
    ----------
    data : Data
        The tensors.
    components : np.ndarray
        Starting bases (component, sensor, lag), ≥ 0.
    activations : np.ndarray
        Starting activations (trial, component, time), ≥ 0; the first steps make them fulfil the
        constraint.
    settings : Settings
        How to factorise.
    run : Callable, default=map
        Maps a function over blocks of trials, on one thread or several.
    on_iteration : Callable, optional
        Called with the iteration and the relative residual ‖V − V̂‖/‖V‖ after it.
    """
    components, activations = components.copy(), activations.copy()
    activations[data.silent] = 0  # a start from random numbers would leave traces there
    blocks = [
        slice(start, start + TRIALS_PER_TASK) for start in range(0, data.n_trials, TRIALS_PER_TASK)
    ]
    groups = 1 if settings.joint else data.n_trials
    steps = np.ones((groups, settings.n_components))
    if settings.sparseness is not None:
        _project_activations(activations, settings.sparseness, settings.joint)
    losses, converged = [], False
    for iteration in range(settings.max_iter):
        _update_activations(data, components, activations, steps, settings, blocks, run)
        components, loss = _update_bases(data, components, activations, settings, blocks, run)
        losses.append(loss)
        if on_iteration is not None:
            on_iteration(iteration, np.sqrt(2 * loss / data.energy) if data.energy else 0.0)
        if _has_converged(losses, settings.tol, data.energy):
            converged = True
            break
    return Factors(
        components=components, activations=activations, losses=np.array(losses), converged=converged
    )


def _project_activations(activations: np.ndarray, sparseness: float, joint: bool) -> None:
    """Put activations (trial, component, time) onto the constraint, in place."""
    n_trials, n_components, n_times = activations.shape
    rows = activations.transpose(1, 0, 2).reshape(n_components * (1 if joint else n_trials), -1)
    projected = np.empty_like(rows)
    for row, target in zip(rows, projected, strict=True):
        project_row(row, l1_of_unit_vector(row.size, sparseness), target)
    activations[:] = projected.reshape(n_components, n_trials, n_times).transpose(1, 0, 2)


def _has_converged(losses: list[float], tol: float, energy: float) -> bool:
    """Ten iterations together count, so that one slow step does not end the fit."""
    if losses[-1] <= 1e-14 * energy:
        return True
    # a residual of a hundredth: below it, noise-free data would go on for ever
    scale = max(losses[-1], 0.5e-4 * energy)
    return len(losses) > 10 and losses[-11] - losses[-1] <= 10 * tol * scale


def _update_activations(data, components, activations, steps, settings, blocks, run) -> None:
    """New activations in place, block by block."""
    spectra = compute_spectra(components, data.length)
    kernel, fringe = compute_basis_gram(components)
    joint = settings.joint and settings.sparseness is not None
    size = data.n_times * (data.n_trials if joint else 1)
    l1 = 0.0 if settings.sparseness is None else l1_of_unit_vector(size, settings.sparseness)

    def update(block: slice) -> None:
        seen = data._see(spectra, block)
        if settings.sparseness is None:
            multiply_activations(seen, kernel, fringe, activations[block], settings.inner_steps)
        else:
            row = steps if joint else steps[block]
            descend_activations(
                seen, kernel, fringe, activations[block], row, l1, joint, settings.inner_steps, 0.0
            )

    list(run(update, [slice(None)] if joint else blocks))


def _update_bases(data, components, activations, settings, blocks, run) -> tuple[np.ndarray, float]:
    """New bases, and the loss they leave."""
    spectra = np.zeros((2, settings.n_components, data.n_sensors, data.length // 2 + 1))
    for part in run(lambda block: data.gather(activations, block), blocks):
        spectra += part
    seen = invert_spectra(spectra, data.length, data.n_lags)
    gram = compute_activation_gram(activations, data.n_lags)
    components, shared, square = multiply_bases(components, seen, gram, settings.inner_steps)
    return components, max(0.5 * data.energy - shared + 0.5 * square, 0.0)


@contextmanager
def open_pool(n_jobs: int) -> Iterator[Callable]:
    """What maps over blocks of trials on ``n_jobs`` threads.

    The compiled parts release the interpreter's lock. The products of small matrices in between
    stay on one thread, because there several threads only wait for each other.
    """
    with hold_blas(), ThreadExecutor(n_jobs) as pool:
        yield pool.map


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


def start_activations(
    data: Data, components: np.ndarray, init: str, rng: np.random.Generator
) -> np.ndarray:
    """Starting activations (trial, component, time).

    ``windows`` takes what the bases see, at the best scale; ``random`` takes uniform numbers.
    """
    shape = (data.n_trials, components.shape[0], data.n_times)
    if init == "random":
        return rng.random(shape)
    kernel, fringe = compute_basis_gram(components)
    seen = np.maximum(data.see(components, slice(None)), 0)
    pulled = np.empty(shape[1:])
    for trial in seen:
        apply_gram(kernel, fringe, trial, pulled)
        bend = np.vdot(trial, pulled)
        trial *= np.vdot(trial, trial) / bend if bend > 0 else 0
    return seen


def learn_batch(
    tensors: np.ndarray,
    components: np.ndarray,
    sums: tuple[np.ndarray | float, np.ndarray | float],
    settings: Settings,
    forget: float,
    run: Callable = map,
) -> tuple[np.ndarray, tuple[np.ndarray, np.ndarray]]:
    """Code a batch on the old bases, add it to the sums over earlier batches, update the bases.

    Parameters
    ----------
    tensors : np.ndarray
        The batch (trial, sensor, time).
    components : np.ndarray
        The old bases (component, sensor, lag).
    sums : tuple of two np.ndarray
        Data correlated with activations (component, sensor, lag), and activations correlated with
        each other (component, lag, component, lag); both 0 at first.
    forget : float
        What earlier batches count beside this one.

    Returns
    -------
    components : np.ndarray
        The new bases (component, sensor, lag).
    sums : tuple of two np.ndarray

    References
    ----------
    Mairal, Bach, Ponce & Sapiro 2010, J. Mach. Learn. Res. 11:19 (online dictionary learning from
    such sums).
    """
    code = "nonnegative" if settings.sparseness is None else "sparse"
    activations, _ = encode(
        tensors, components, code, sparseness=settings.sparseness, max_sweeps=20, tol=1e-3, run=run
    )
    data = Data(tensors, settings.n_lags)
    blocks = [
        slice(start, start + TRIALS_PER_TASK) for start in range(0, data.n_trials, TRIALS_PER_TASK)
    ]
    spectra = sum(run(lambda block: data.gather(activations, block), blocks))
    seen = forget * sums[0] + invert_spectra(spectra, data.length, settings.n_lags)
    gram = forget * sums[1] + compute_activation_gram(activations, settings.n_lags)
    return multiply_bases(components, seen, gram, settings.inner_steps)[0], (seen, gram)
