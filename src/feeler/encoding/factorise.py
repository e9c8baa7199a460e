"""One factorisation from one start, activations and bases in turn, until the loss stands; and what
a batch at a time adds to one.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from feeler.encoding.activations import (
    descend_activations,
    multiply_activations,
    project_activations,
)
from feeler.encoding.bases import descend_bases, multiply_bases
from feeler.encoding.code import encode
from feeler.encoding.convolution import (
    compute_activation_gram,
    compute_basis_gram,
    compute_spectra,
)
from feeler.encoding.data import Data
from feeler.encoding.slide import slide_bases
from feeler.encoding.sparseness import l1_of_unit_vector
from feeler.execute.threads import ThreadExecutor, hold_blas

# iterations after which bases are looked for at other lags, and how many decide [C]
_SLIDES, _TRIAL = (5, 10, 20, 40), 5
# a trial is given up early where its second iteration leaves more than this of its lag [C]
_HOPELESS = 0.5
_FIRST_WEIGHT = 0.5  # of the last iteration's change, on top of which the next one begins [C]


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

    @classmethod
    def of(cls, model: Any) -> "Settings":
        """Those of an encoder."""
        return cls(
            n_components=model.n_components,
            n_lags=model.n_lags,
            sparseness=model.sparseness,
            joint=model.constraint == "all",
            max_iter=model.max_iter,
            tol=model.tol,
            inner_steps=model.inner_steps or (1 if model.sparseness is None else 10),
        )


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


@dataclass(frozen=True, kw_only=True)
class _State:
    """Where a fit stands.

    Attributes
    ----------
    steps : np.ndarray
        (1 or trial, component): step sizes of the activations, in units of the one that cannot
        fail.
    loss : float
        ½‖V − V̂‖².
    """

    components: np.ndarray
    activations: np.ndarray
    steps: np.ndarray
    loss: float


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
    begun, losses, converged = _begin(data, components, activations, settings), [], False
    for state in _walk(data, begun, settings, run):
        losses.append(state.loss)
        if on_iteration is not None:
            relative = np.sqrt(2 * state.loss / data.energy) if data.energy else 0.0
            on_iteration(len(losses) - 1, relative)
        if converged := _has_converged(losses, settings.tol, data.energy):
            break
        if len(losses) == settings.max_iter:
            break
    return Factors(
        components=state.components,
        activations=state.activations,
        losses=np.array(losses),
        converged=converged,
    )


def _begin(data, components, activations, settings) -> _State:
    activations = activations.copy()
    activations[data.silent] = 0  # a start from random numbers would leave traces there
    _constrain(activations, settings)
    groups = 1 if settings.joint else data.n_trials
    return _State(
        components=components.copy(),
        activations=activations,
        steps=np.ones((groups, settings.n_components)),
        loss=np.inf,
    )


def _walk(data: Data, state: _State, settings: Settings, run: Callable) -> Iterator[_State]:
    """The state after each iteration, without end.

    Under a sparseness each iteration begins a little further along the last one's change, a little
    further each time. Where this raises the loss, the iteration counts for nothing, and the next
    begins where the last one ended (Ang & Gillis 2019).
    """
    before, weight, most, count = None, _FIRST_WEIGHT, 1.0, 0
    while True:
        if settings.sparseness is not None and count in _SLIDES:
            path = _try_slide(data, state, settings, run)
            yield from path
            state, before, weight = (path or [state])[-1], None, _FIRST_WEIGHT
        start = state if before is None else _extrapolate(before, state, weight, settings)
        new = _iterate(data, start, settings, run)
        if new.loss > state.loss and before is not None:
            before, most, weight = None, weight, weight / 1.5
        else:
            before = (
                state if settings.sparseness is not None and np.isfinite(state.loss) else None
            )
            state, most = new, min(1.0, 1.01 * most)
            weight = min(most, 1.05 * weight)
        count += 1
        yield state


def _extrapolate(before: _State, state: _State, weight: float, settings: Settings) -> _State:
    components = state.components + weight * (state.components - before.components)
    activations = state.activations + weight * (state.activations - before.activations)
    activations = np.maximum(activations, 0)
    _constrain(activations, settings)
    return replace(state, components=np.maximum(components, 0), activations=activations)


def _try_slide(data, state, settings, run) -> list[_State]:
    """A few iterations with the bases where they are and, if it ends lower, the end of as many with
    the bases where ``slide_bases`` puts them; none where there is nowhere to go. Where the second
    iteration shows that those elsewhere will not catch up, they are left.
    """
    moved = slide_bases(data, state.components, state.activations, run)
    if moved is None:
        return []
    components, activations = moved
    _constrain(activations, settings)
    there = replace(
        state, components=components, activations=activations, steps=np.ones_like(state.steps)
    )
    stay, lag = [state], []
    for _ in range(_TRIAL):
        stay.append(_iterate(data, stay[-1], settings, run))
        there = _iterate(data, there, settings, run)
        lag.append(there.loss - stay[-1].loss)
        if len(lag) == 2 and lag[1] > max(_HOPELESS * lag[0], 0.0):
            return stay[1:]
    return [*stay[1:-1], min(stay[-1], there, key=lambda end: end.loss)]


def _iterate(data: Data, state: _State, settings: Settings, run: Callable) -> _State:
    """New activations, block by block, then new bases."""
    activations, steps = state.activations.copy(), state.steps.copy()
    spectra = compute_spectra(state.components, data.length)
    kernel, fringe = compute_basis_gram(state.components)
    joint = settings.joint and settings.sparseness is not None
    l1 = _find_l1(activations, settings)

    def update(block: slice) -> None:
        seen, rows = data.see(spectra, block), activations[block]
        if settings.sparseness is None:
            multiply_activations(seen, kernel, fringe, rows, settings.inner_steps)
            return
        own = steps if joint else steps[block]
        descend_activations(
            seen, kernel, fringe, rows, own, l1, joint, settings.inner_steps, 0.0
        )

    list(run(update, [slice(None)] if joint else data.blocks))
    seen = data.gather(activations, run)
    gram = compute_activation_gram(activations, data.n_lags)
    components, shared, square = improve_bases(state.components, seen, gram, settings)
    loss = max(0.5 * data.energy - shared + 0.5 * square, 0.0)
    return _State(components=components, activations=activations, steps=steps, loss=loss)


def improve_bases(
    components, seen, gram, settings: Settings
) -> tuple[np.ndarray, float, float]:
    """New bases for what the data and the activations give: multiplied where there is no
    sparseness, otherwise entry by entry.
    """
    improve = multiply_bases if settings.sparseness is None else descend_bases
    return improve(components, seen, gram, settings.inner_steps)


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
        tensors,
        components,
        code,
        sparseness=settings.sparseness,
        max_sweeps=20,
        tol=1e-3,
        run=run,
    )
    data = Data(tensors, settings.n_lags)
    seen = forget * sums[0] + data.gather(activations, run)
    gram = forget * sums[1] + compute_activation_gram(activations, settings.n_lags)
    return improve_bases(components, seen, gram, settings)[0], (seen, gram)


def _constrain(activations: np.ndarray, settings: Settings) -> None:
    """Put activations (trial, component, time) onto the constraint, in place."""
    if settings.sparseness is not None:
        project_activations(activations, _find_l1(activations, settings), settings.joint)


def _find_l1(activations: np.ndarray, settings: Settings) -> float:
    """‖h‖₁/‖h‖₂ of what shares one constraint."""
    if settings.sparseness is None:
        return 0.0
    n_trials, _, n_times = activations.shape
    return l1_of_unit_vector(n_times * (n_trials if settings.joint else 1), settings.sparseness)


def _has_converged(losses: list[float], tol: float, energy: float) -> bool:
    """Ten iterations together count, so that one slow step does not end the fit."""
    if losses[-1] <= 1e-14 * energy:
        return True
    # a residual of a hundredth: below it, noise-free data would go on for ever
    scale = max(losses[-1], 0.5e-4 * energy)
    return len(losses) > 10 and losses[-11] - losses[-1] <= 10 * tol * scale


@contextmanager
def open_pool(n_jobs: int) -> Iterator[Callable]:
    """What maps over blocks of trials on ``n_jobs`` threads.

    The compiled parts release the interpreter's lock. The products of small matrices in between
    stay on one thread, because there several threads only wait for each other.
    """
    with hold_blas(), ThreadExecutor(n_jobs) as pool:
        yield pool.map
