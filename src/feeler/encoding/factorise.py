"""One factorisation from one start: activations and bases in turn, until the loss stands."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from copy import copy
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from feeler.encoding.code import TRIALS_PER_TASK, encode
from feeler.encoding.convolution import (
    apply_gram,
    compute_activation_gram,
    compute_basis_gram,
    compute_spectra,
    correlate_with_activations,
    correlate_with_bases,
    descend,
    descend_bases,
    fourier_length,
    invert_spectra,
    multiply_activations,
    multiply_bases,
    project_activations,
    reconstruct,
)
from feeler.encoding.measures import l1_of_unit_vector
from feeler.errors import InvalidInput
from feeler.execute.workers import ThreadExecutor, hold_blas

# The tensors of a fit, made ready once for any number of starts.


class Data:
    """Tensors made ready once for any number of factorisations: their transform and their size."""

    def __init__(self, tensors: np.ndarray, n_lags: int, hidden: np.ndarray | None = None):
        self.n_trials, self.n_sensors, self.n_times = tensors.shape
        self.n_lags = n_lags
        # how many lags further a basis may be looked for, each way
        self.margin = min(n_lags // 2, self.n_times - n_lags)
        self.length = fourier_length(self.n_times, n_lags + self.margin)
        starts = range(0, self.n_trials, TRIALS_PER_TASK)
        self.blocks = [slice(start, start + TRIALS_PER_TASK) for start in starts]
        self.spectra = compute_spectra(tensors, self.length)
        self.energy = float(np.vdot(tensors, tensors))
        self.silent = ~tensors.any(axis=(1, 2))
        self.tensors, self.hidden = tensors, hidden

    def fill(self, components: np.ndarray, activations: np.ndarray) -> "Data":
        """With the entries that do not count as this model has them; itself where all count."""
        if self.hidden is None:
            return self
        filled = np.where(self.hidden, reconstruct(components, activations), self.tensors)
        data = copy(self)
        data.spectra = compute_spectra(filled, self.length)
        data.energy = float(np.vdot(filled, filled))
        return data

    def measure_error(self, components: np.ndarray, activations: np.ndarray) -> float:
        """‖V − V̂‖² over the entries that count."""
        rest = self.tensors - reconstruct(components, activations)
        if self.hidden is not None:
            rest[self.hidden] = 0
        return float(np.vdot(rest, rest))

    def see(self, basis_spectra: np.ndarray, trials: slice) -> np.ndarray:
        """A (trial, component, time): the bases (their transform) correlated with the tensors."""
        v_re, v_im = self.spectra[0, trials], self.spectra[1, trials]
        out = np.empty((2, v_re.shape[0], basis_spectra.shape[1], v_re.shape[2]))
        correlate_with_bases(v_re, v_im, basis_spectra[0], basis_spectra[1], out)
        return invert_spectra(out, self.length, self.n_times)

    def gather(
        self, activations: np.ndarray, run: Callable = map, margin: int = 0
    ) -> np.ndarray:
        """B (component, sensor, lag): the tensors correlated with activations (trial, component,
        time), over the lags −margin … n_lags + margin − 1.
        """
        parts = run(lambda block: self._gather(activations, block), self.blocks)
        signal = invert_spectra(sum(parts), self.length, self.length)
        last = self.n_lags + margin
        return np.concatenate([signal[..., self.length - margin :], signal[..., :last]], axis=2)

    def _gather(self, activations: np.ndarray, trials: slice) -> np.ndarray:
        h_re, h_im = compute_spectra(activations[trials], self.length)
        v_re, v_im = self.spectra[0, trials], self.spectra[1, trials]
        out = np.zeros((2, activations.shape[1], self.n_sensors, v_re.shape[2]))
        correlate_with_activations(v_re, v_im, h_re, h_im, out)
        return out


# Where fits begin: bases and activations drawn from a seed, or given.


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


# Bases that begin too early or too late, found by a wider look at the data.
#
# A basis that begins in the middle of a pattern is a trap: what stands before its first lag, or
# after its last one, can only come back if all its activations move together. So now and then
# each basis is fitted to a wider window of lags on the same activations, and the best stretch
# of it is kept.

_SWEEPS = 5  # over the wide bases [C]
# of what a basis explains: stretches that explain this much less than the best are as good [C]
_EQUAL = 0.01


def _slide_bases(
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


# One factorisation from one start, activations and bases in turn, until the loss stands; and
# what a batch at a time adds to one.

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
    cross : float
        Weight of the cross-orthogonality.
    n_finished : int | None
        How many starts go on past ``halfway``, those of lowest loss; None: all.
    """

    n_components: int
    n_lags: int
    sparseness: float | None
    joint: bool
    max_iter: int
    tol: float
    inner_steps: int
    cross: float = 0.0
    n_finished: int | None = None

    @property
    def halfway(self) -> int:
        """Iterations of every start: a third of the most, at least one [C]."""
        return max(self.max_iter // 3, 1)

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
            cross=model.cross_orthogonality,
            n_finished=model.n_finished,
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
    starts: Iterable[tuple[np.ndarray, np.ndarray]],
    settings: Settings,
    outer: Callable = map,
    run: Callable = map,
    on_iteration: Callable[[], None] | None = None,
) -> list[Factors]:
    """Lower ½‖V − V̂‖² from every start; the algorithm is that of :class:`ConvolutiveNMF`.

    Parameters
    ----------
    data : Data
        The tensors. Entries that do not count stand at their reconstruction, anew in each
        iteration.
    starts : iterable of tuple
        Starting bases (component, sensor, lag) and activations (trial, component, time), ≥ 0; the
        first steps make the activations fulfil the constraint.
    settings : Settings
        How to factorise.
    outer, run : Callable, default=map
        Map a function over the starts, and over blocks of trials: on one thread or several.
    on_iteration : Callable, optional
        Called after each iteration.
    """
    found = [_Fit(data, *start, settings, run, on_iteration) for start in starts]
    few = settings.n_finished is not None and settings.n_finished < len(found)
    first = settings.halfway if few else settings.max_iter
    list(outer(lambda fit: fit.go_on(first), found))
    if few:
        best = sorted(found, key=lambda fit: fit.losses[-1])[: settings.n_finished]
        list(outer(lambda fit: fit.go_on(settings.max_iter), best))
    return [fit.factors for fit in found]


class _Fit:
    """A fit from one start, which can stop and go on."""

    def __init__(self, data, components, activations, settings, run, on_iteration):
        begun = _begin(data, components, activations, settings)
        self._states = _walk(data, begun, settings, run)
        self._state, self._converged, self.losses = begun, False, []
        self._tol, self._energy, self._tell = settings.tol, data.energy, on_iteration

    def go_on(self, most: int) -> None:
        """Until it converges, or ``most`` iterations are done in all."""
        while len(self.losses) < most and not self._converged:
            self._state = next(self._states)
            self.losses.append(self._state.loss)
            if self._tell is not None:
                self._tell()
            self._converged = _has_converged(self.losses, self._tol, self._energy)

    @property
    def factors(self) -> Factors:
        """What was found by now."""
        return Factors(
            components=self._state.components,
            activations=self._state.activations,
            losses=np.array(self.losses),
            converged=self._converged,
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
    begins where the last one ended (Ang & Gillis 2019). After a few of them a fit with the bases
    where ``_slide_bases`` puts them goes on beside this one, and in its place if it then is ahead;
    it is left where its second iteration shows that it will not catch up.
    """
    before, weight, most, count = None, _FIRST_WEIGHT, 1.0, 0
    there, lag = None, list[float]()
    while True:
        if settings.sparseness is not None and count in _SLIDES:
            there, lag = _slide(data, state, settings, run), []
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
        if there is not None:
            there = _iterate(data, there, settings, run)
            lag.append(there.loss - state.loss)
            if len(lag) == _TRIAL and lag[-1] < 0:
                state, before, weight = there, None, _FIRST_WEIGHT
            hopeless = len(lag) == 2 and lag[1] > max(_HOPELESS * lag[0], 0.0)
            there = None if hopeless or len(lag) == _TRIAL else there
        count += 1
        yield state


def _extrapolate(before: _State, state: _State, weight: float, settings: Settings) -> _State:
    components = state.components + weight * (state.components - before.components)
    activations = state.activations + weight * (state.activations - before.activations)
    activations = np.maximum(activations, 0)
    _constrain(activations, settings)
    return replace(state, components=np.maximum(components, 0), activations=activations)


def _slide(data: Data, state: _State, settings: Settings, run: Callable) -> _State | None:
    """The state with its bases where ``_slide_bases`` puts them; None where they are there."""
    filled = data.fill(state.components, state.activations)
    moved = _slide_bases(filled, state.components, state.activations, run)
    if moved is None:
        return None
    _constrain(moved[1], settings)
    return replace(
        state, components=moved[0], activations=moved[1], steps=np.ones_like(state.steps)
    )


def _iterate(data: Data, state: _State, settings: Settings, run: Callable) -> _State:
    """New activations, block by block, then new bases. The penalty is of the entries that count:
    one of what is filled in would change with it, and could rise.
    """
    known, data = data, data.fill(state.components, state.activations)
    activations, steps = state.activations.copy(), state.steps.copy()
    spectra = compute_spectra(state.components, data.length)
    kernel, fringe = compute_basis_gram(state.components)
    joint = settings.joint and settings.sparseness is not None
    l1 = _find_l1(activations, settings)

    def update(block: slice) -> None:
        seen, rows = data.see(spectra, block), activations[block]
        pull = np.zeros_like(seen)
        if settings.cross:
            pull = _cross(_smooth(known.see(spectra, block), settings.n_lags), settings.cross)
        if settings.sparseness is None:
            multiply_activations(seen, kernel, fringe, pull, rows, settings.inner_steps)
            return
        own = steps if joint else steps[block]
        seen -= pull
        descend(seen, kernel, fringe, rows, own, l1, joint, settings.inner_steps)

    list(run(update, [slice(None)] if joint else data.blocks))
    seen = data.gather(activations, run)
    gram = compute_activation_gram(activations, data.n_lags)
    pull = 0.0
    if settings.cross:
        smooth = known.gather(_smooth(activations, settings.n_lags), run)
        pull = _cross(smooth[None], settings.cross)[0]
    components, shared, square = _improve_bases(state.components, seen, gram, settings, pull)
    loss = max(0.5 * data.energy - shared + 0.5 * square, 0.0)
    return _State(components=components, activations=activations, steps=steps, loss=loss)


def _smooth(rows: np.ndarray, n_lags: int) -> np.ndarray:
    """Rows (trial, component, time) summed over all moments less than ``n_lags`` away."""
    n_times, moments = rows.shape[2], np.arange(rows.shape[2])
    sums = np.pad(np.cumsum(rows, axis=2), ((0, 0), (0, 0), (1, 0)))
    first, last = np.maximum(moments - n_lags + 1, 0), np.minimum(moments + n_lags, n_times)
    return sums[:, :, last] - sums[:, :, first]


def _cross(values: np.ndarray, weight: float) -> np.ndarray:
    """For each component (second axis) the weighted sum over the others."""
    return weight * np.maximum(values.sum(axis=1, keepdims=True) - values, 0)


def _improve_bases(
    components, seen, gram, settings: Settings, pull: np.ndarray | float = 0.0
) -> tuple[np.ndarray, float, float]:
    """New bases for what the data and the activations give: multiplied where there is no
    sparseness, otherwise entry by entry. ``pull`` is the slope of a penalty on them.
    """
    if settings.sparseness is not None:
        return descend_bases(components, seen - pull, gram, settings.inner_steps)
    bases, shared, square = multiply_bases(components, seen, gram, settings.inner_steps, pull)
    return bases, shared - float(np.sum(pull * bases)), square


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
    return _improve_bases(components, seen, gram, settings)[0], (seen, gram)


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
