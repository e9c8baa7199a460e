"""Which encoder data support: held-out entries, agreement of starts, significance of bases."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import combinations, count, product
from pkgutil import resolve_name
from typing import Annotated, Any

import numpy as np
import pandas as pd
from scipy.stats import skew
from sklearn.base import clone

from feeler.encoding.convolution import compute_basis_similarity, reconstruct
from feeler.encoding.factorise import make_generators, open_pool
from feeler.encoding.inputs import check_settings, check_size, check_tensors, read_tensors
from feeler.encoding.model import ConvolutiveNMF, _count_threads
from feeler.errors import InvalidInput
from feeler.progress import show_progress
from feeler.records import Ge, Gt, Lt
from feeler.validation import Count, checked

_GRID = ("n_components", "sparseness", "n_lags")
"""What is chosen, in the order in which the plainer value is preferred."""
_SPARSENESS = (0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.95)  # [C]


_STARTS = 10  # [C] of the encoder chosen


@dataclass(frozen=True)
class Selection:
    """Encoders compared on entries that they were not fitted to.

    Attributes
    ----------
    table : pd.DataFrame
        A row for each combination: ``n_components``, ``n_lags``, ``sparseness``; ``held_out``, the
        share of the squares of held-out entries that is not explained, mean over the masks, and
        ``sem`` of its difference from the lowest; ``fitted``, the same share of the entries
        fitted; ``dissimilarity`` of the starts; whether it is ``chosen``.
    encoder : ConvolutiveNMF
        The one chosen, fitted to all entries from ten starts, or as many as it asks for; of those
        that fit nearly as well as the lowest, the typical one is kept (``keep="typical"``).
    tolerance : float
        How much more of the squares than the lowest the choice may leave unexplained.
    """

    table: pd.DataFrame
    encoder: ConvolutiveNMF
    tolerance: float

    @property
    def params(self) -> dict[str, Any]:
        """The values chosen, as an encoder takes them."""
        return {name: getattr(self.encoder, name) for name in _GRID}

    def __str__(self) -> str:
        chosen, own = self.table[self.table.chosen].iloc[0], self.params
        bases = "1 basis" if own["n_components"] == 1 else f"{own['n_components']} bases"
        s = own["sparseness"]
        sparse = "no sparseness" if s is None else f"sparseness {s:g}"
        lines = f"{bases} of {own['n_lags']} samples at {sparse}"
        others = [self._compare(name, chosen) for name in _GRID]
        lines += f" leave {chosen.held_out:.1%} of held-out squares unexplained"
        lines += "".join(f"; {words}" for words in others if words)
        return lines + f". Plainest within {self.tolerance:.1%} of the lowest."

    def _compare(self, name: str, chosen: pd.Series) -> str:
        """What the values next to the chosen one leave, all else equal."""
        same = np.ones(len(self.table), dtype=bool)
        for other in _GRID:
            same &= (other == name) | (_key(self.table[other]) == _key(chosen[other]))
        rows = self.table.assign(key=_key(self.table[name]))[same].sort_values("key")
        place = int(np.flatnonzero(rows.chosen)[0])
        near = rows.iloc[[k for k in (place - 1, place + 1) if 0 <= k < len(rows)]]
        return ", ".join(
            f"{name} {'none' if row[name] is None else row[name]}"
            f" {row.held_out - chosen.held_out:+.1%}"
            for _, row in near.iterrows()
        )

    def plot(self) -> Any:
        """Held-out and fitted share left over sparseness, a line for each number of bases and of
        lags: a matplotlib Figure.
        """
        return resolve_name("feeler.plotting.results:draw_selection")(self)


def _key(values: Any) -> Any:
    """Numbers to order and compare by; no sparseness stands below all."""
    if isinstance(values, pd.Series):
        return np.array([_key(value) for value in values])
    return -1.0 if values is None else float(values)


@checked
def select_encoder(
    X: Any,
    *,
    n_components: Any = (1, 2, 3, 4, 5),
    n_lags: Any = None,
    sparseness: Any = _SPARSENESS,
    encoder: ConvolutiveNMF | None = None,
    mask: Any = None,
    held_out: Annotated[float, Gt(0), Lt(1)] = 0.1,
    n_masks: Count = 3,
    tolerance: Annotated[float, Ge(0)] = 0.003,
    refine: Annotated[int, Ge(0)] = 2,
    random_state: int | None = 0,
    n_jobs: int | None = None,
    progress: Callable | None = None,
) -> Selection:
    """The plainest encoder that predicts held-out entries as well as the best.

    Speckled cross-validation: a random tenth of all entries, anew for each mask, is left out of
    the fit, and predicted by its reconstruction. The choice among combinations whose held-out
    error lies within ``tolerance`` of the lowest, or within one standard error of it if this is
    more, has the fewest bases, then the sparsest activations, then the shortest bases.

    Sparsest, because less sparse activations can nearly always explain the same entries with bases
    that are too short; the sparsest that costs nothing is the one with whole patterns.

    Parameters
    ----------
    X : np.ndarray, np.ma.MaskedArray or xr.DataArray
        Tensors (trial, sensor, time), ≥ 0.
    n_components, n_lags, sparseness : number or sequence
        Values to compare; every combination is fitted. ``n_lags=None`` is the encoder's.
    encoder : ConvolutiveNMF, optional
        All other parameters.
    mask : np.ndarray of bool, optional
        Entries that count for nothing, neither in fits nor held out.
    held_out : float, default=0.1
        Share of the entries that each mask leaves out.
    n_masks : int, default=3
        Masks.
    tolerance : float, default=0.003
        Share of the squares that a plainer encoder may leave unexplained more [C].
    refine : int, default=2
        How often the sparseness half-way to the next sparser value is tried too.
    random_state : int, default=0
        Seed of the masks and starts.
    n_jobs : int, optional
        Fits at a time, on threads.
    progress : Callable, optional
        Called with the number of fits done and their number, at most.

    Returns
    -------
    Selection

    References
    ----------
    Wold 1978, Technometrics 20:397; Owen & Perry 2009, Ann. Appl. Stat. 3:564 (held-out entries).
    """
    tensors, hidden = read_tensors(X, mask)
    base = ConvolutiveNMF() if encoder is None else encoder
    n_lags = base.n_lags if n_lags is None else n_lags
    lists = [_list(n_components), _list(sparseness), _list(n_lags)]
    grid = list(dict.fromkeys(product(*lists)))

    def build(values: tuple) -> ConvolutiveNMF:
        how = dict(zip(_GRID, values, strict=True)) | {"random_state": random_state}
        return clone(base).set_params(**how, n_jobs=1, warn=False)

    for values in grid:
        check_settings(build(values))
        check_size(tensors, values[0], values[2])
    counted = np.ones(tensors.shape, dtype=bool) if hidden is None else ~hidden
    rng = np.random.default_rng(random_state)
    masks = [counted & (rng.random(tensors.shape) < held_out) for _ in range(n_masks)]
    finer = refine if sum(value is not None for value in lists[1]) > 1 else 0
    most, done = (len(grid) + finer) * n_masks, count(1)
    found: dict[tuple, list[tuple[float, float, float]]] = {}
    with show_progress(progress, "fits") as advance, open_pool(_count_threads(n_jobs)) as run:

        def judge(task: tuple[tuple, np.ndarray]) -> tuple[float, float, float]:
            result = _judge(build(task[0]), tensors, counted, task[1])
            advance(next(done), most)
            return result

        def add(new: list[tuple]) -> None:
            results = list(run(judge, product(new, masks)))
            for k, values in enumerate(new):
                found[values] = results[k * n_masks : (k + 1) * n_masks]

        add(grid)
        for _ in range(finer):
            n, best, lags = _choose(found, tolerance)
            sparser = [s for k, s, t in found if (k, t) == (n, lags) and _key(s) > _key(best)]
            if best is None or not sparser:
                break
            add([(n, round((best + min(sparser)) / 2, 4), lags)])
    chosen = _choose(found, tolerance)
    model = build(chosen).set_params(n_jobs=n_jobs, warn=base.warn, keep="typical")
    model.set_params(n_restarts=max(_STARTS, base.n_restarts))
    return Selection(_tabulate(found, chosen), model.fit(X, mask=mask), tolerance)


def _list(values: Any) -> list:
    several = list(values) if isinstance(values, Sequence | np.ndarray) else [values]
    if not several:
        raise InvalidInput("n_components, n_lags and sparseness each need one value at least.")
    return several


def _judge(
    model: ConvolutiveNMF, tensors: np.ndarray, counted: np.ndarray, left_out: np.ndarray
) -> tuple[float, float, float]:
    """Shares left of held-out and of fitted squares, and the dissimilarity of the starts."""
    model.fit(tensors, mask=~counted | left_out)
    rest = (tensors - reconstruct(model.components_, model.activations_)) ** 2
    shares = [
        rest[entries].sum() / max((tensors[entries] ** 2).sum(), np.finfo(float).tiny)
        for entries in (left_out, counted & ~left_out)
    ]
    return shares[0], shares[1], compute_dissimilarity(list(model.restart_components_))


def _choose(found: dict[tuple, list], tolerance: float) -> tuple:
    errors = {values: np.array([one[0] for one in rows]) for values, rows in found.items()}
    lowest = errors[min(errors, key=lambda values: errors[values].mean())]
    good = [
        values
        for values, own in errors.items()
        if (own - lowest).mean() <= max(tolerance, _sem(own - lowest))
    ]
    return min(good, key=lambda values: (values[0], -_key(values[1]), values[2]))


def _sem(values: np.ndarray) -> float:
    return float(values.std(ddof=1) / np.sqrt(len(values))) if len(values) > 1 else 0.0


def _tabulate(found: dict[tuple, list], chosen: tuple) -> pd.DataFrame:
    columns = {values: np.array(rows) for values, rows in found.items()}
    lowest = min(columns.values(), key=lambda rows: rows[:, 0].mean())[:, 0]
    order = sorted(found, key=lambda values: (values[0], values[2], _key(values[1])))
    values = {name: [one[k] for one in order] for k, name in enumerate(_GRID)}
    table = pd.DataFrame(
        {
            **{name: pd.Series(several, dtype=object) for name, several in values.items()},
            "held_out": [columns[values][:, 0].mean() for values in order],
            "sem": [_sem(columns[values][:, 0] - lowest) for values in order],
            "fitted": [columns[values][:, 1].mean() for values in order],
            "dissimilarity": [columns[values][:, 2].mean() for values in order],
            "chosen": [values == chosen for values in order],
        }
    )
    return table.astype({"n_components": int, "n_lags": int})


_Bases = Annotated[np.ndarray, "component sensor lag"]


@checked
def compute_dissimilarity(restarts: list[_Bases]) -> float:
    """How much the bases of several fits differ: 1 − half the mean, over both sets of a pair, of
    each basis's cosine with the most similar one of the other set; 0 for the same, NaN for one fit.

    Parameters
    ----------
    restarts : list of np.ndarray
        Bases (component, sensor, lag) of each fit; their numbers may differ. A shift within the
        lags does not count.

    References
    ----------
    Wu et al. 2016, PNAS 113:4290 (diss); Mackevicius et al. 2019, eLife 8:e38471.
    """
    found = []
    for first, second in combinations(restarts, 2):
        cosines = compute_basis_similarity(first, second)
        found.append(1 - 0.5 * (cosines.max(axis=1).mean() + cosines.max(axis=0).mean()))
    return float(np.mean(found)) if found else float("nan")


def compute_significance(
    components: np.ndarray,
    X: Any,
    *,
    n_null: int = 1000,
    random_state: int | np.random.Generator | None = 0,
) -> np.ndarray:
    """Probability (component,) that bases without timing would be met as clearly in held-out data.

    Each basis is correlated with the data from every moment on; a pattern that recurs gives few
    large values, so that their skewness is high. In the null bases every sensor's row is shifted
    round by lags of its own. The value is the share of n_null bases, itself among them, that are at
    least as skewed; with M bases compare it with 0.05/M.

    Parameters
    ----------
    components : np.ndarray
        Bases (component, sensor, lag), learned on other data.
    X : np.ndarray or xr.DataArray
        Held-out tensors (trial, sensor, time), ≥ 0.
    n_null : int, default=1000
        Null bases for each basis; for 0.05/M they must be more than 20 M.
    random_state : int or np.random.Generator, optional
        Seed of the shifts.

    References
    ----------
    Mackevicius et al. 2019, eLife 8:e38471, appendix "Testing the significance of each factor on
    held-out data".
    """
    tensors, hidden = read_tensors(X)
    components = np.asarray(components, dtype=float)
    if components.ndim != 3 or n_null < 1:
        raise InvalidInput(
            "compute_significance needs bases (component, sensor, lag) and n_null of at least 1;"
            f" got the shape {components.shape} and {n_null!r}."
        )
    if hidden is not None:
        raise InvalidInput("Held-out tensors must be complete; leave masked trials out.")
    check_tensors(tensors, components)
    rng = make_generators(random_state, 1)[0]
    n_lags = components.shape[2]
    windows = tensors.shape[2] - n_lags + 1
    found = []
    for basis in components:
        turns = rng.integers(n_lags, size=(n_null, len(basis), 1))
        turns[0] = 0  # the basis itself
        lags = (np.arange(n_lags) + turns) % n_lags
        null = np.take_along_axis(np.broadcast_to(basis, (n_null, *basis.shape)), lags, axis=2)
        seen = np.zeros((n_null, len(tensors), windows))
        for lag in range(n_lags):
            seen += np.einsum(
                "bx,nxt->bnt", null[:, :, lag], tensors[:, :, lag : lag + windows]
            )
        skewness = skew(seen.reshape(n_null, -1), axis=1) if basis.any() else np.zeros(n_null)
        found.append(np.mean(skewness >= skewness[0] - 1e-12))
    return np.array(found)
