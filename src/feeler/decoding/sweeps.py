"""Accuracy against noise: trained on noisy copies, tested on others and on the originals."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations, count
from typing import Annotated, Any, Literal

import numpy as np
from sklearn.base import clone

from feeler.analysis.indices import check_tensors
from feeler.decoding.classifiers import (
    READERS,
    Labels,
    PrincipalComponents,
    Reader,
    _compute_kept_variance,
    read_labels,
)
from feeler.errors import InvalidInput
from feeler.execute.threads import ThreadExecutor, count_cores, hold_blas
from feeler.objects.noise import NOISES, Noise, parse_noise
from feeler.objects.task import Nuisances
from feeler.objects.trials import Trial
from feeler.progress import Advance, show_progress
from feeler.records import Ge, Gt, Len, Record, Shown
from feeler.tensors.transforms import check_squares
from feeler.validation import Seed, checked

# Noisy copies in few coordinates, for methods that see only distances and angles.


def draw_rotated(
    coordinates: np.ndarray,
    n_entries: int,
    owner: np.ndarray,
    sd: np.ndarray,
    rng: np.random.Generator,
    n_learned: int | None = None,
) -> np.ndarray:
    """Noisy copies in far fewer coordinates, for PCA, LDA and support vector machines.

    These methods see only distances and angles.

    Isotropic noise looks the same after any rotation. Turned so that the first axes span the clean
    vectors, all that m noisy copies show outside that span is the Gram matrix of m Gaussian
    vectors, a Wishart matrix; its Bartlett factor L (chi-distributed diagonal, normal below) has
    exactly that Gram matrix in m coordinates. Of copies that are only compared with those m, the
    coordinates along them are normal and all others are of no account. So 600 copies of 21,280
    entries, of which 300 are learned, become 600 vectors of about 330, with the same joint
    distribution of all inner products that count.

    Parameters
    ----------
    coordinates
        Of the clean vectors in a basis of their span (trial, rank), from :func:`span`.
    n_entries
        Entries of a clean vector.
    owner
        Which clean vector each copy is made from (copy,).
    sd
        Noise of each copy (copy,), the same for all its entries.
    n_learned
        The first so many copies are compared with each other and with all others; the others only
        with them and with the clean vectors. None: all with all.

    Returns
    -------
    Noisy copies (copy, coordinate); the clean vectors have zeros beyond ``coordinates``.
    """
    n_copies, rank = owner.size, coordinates.shape[1]
    learned = n_copies if n_learned is None else n_learned
    rest = n_entries - rank
    noise = rng.standard_normal((n_copies, rank + min(rest, learned)), dtype=np.float32)
    noise = noise.astype(float)
    if rest >= learned:
        factor = noise[:learned, rank:]
        factor[np.triu_indices(learned, 1)] = 0
        np.fill_diagonal(factor, np.sqrt(rng.chisquare(rest - np.arange(learned))))
    noise *= sd[:, None]
    noise[:, :rank] += coordinates[owner]
    return noise


def span(clean: np.ndarray) -> np.ndarray:
    """Coordinates (trial, rank) of flat clean vectors in an orthonormal basis of their span."""
    energy, axes = np.linalg.eigh(clean @ clean.T)
    keep = energy > energy[-1] * 1e-12
    return axes[:, keep] * np.sqrt(energy[keep])


# How much to compute of accuracy against noise.

_Count = Annotated[int, Ge(1)]


class Plan(Record):
    """Ratios, repeats and copies of every noise sweep of a study.

    Attributes
    ----------
    ratios : tuple[float, ...]
        Noise ratios of the main curves.
    n_repeats : int
        Repeats of the main curves; the paper's is ten [P].
    control_repeats : int | None
        Repeats of the curves beside them: other noises and codes than the paper's, and nulls. None:
        as many.
    n_copies : int
        Noisy copies per trial [C].
    other_copies : tuple[int, ...]
        Other numbers of copies, at ``probe``.
    probe : float
        Noise ratio of everything that is computed at one ratio only.
    before_copies : int
        Copies per trial where noise is added before encoding: each has to be encoded.
    before_repeats : int
        0 leaves noise before encoding out.
    before_all : bool
        Noise before encoding for all groups and noises, or for one of each.
    n_restarts : int
        Restarts of an encoder's fit.
    null_iter : int
        Iterations of the joint fits of identical touches and of twins.
    twins : str
        Groups whose touches are fitted twice: all, the ends of each comparison, or none.
    """

    ratios: Annotated[tuple[Annotated[float, Ge(0)], ...], Len(1)]
    n_repeats: _Count
    control_repeats: _Count | None = None
    n_copies: _Count = 10
    other_copies: tuple[_Count, ...] = (3, 30)
    probe: Annotated[float, Gt(0)] = 0.2
    other_repeats: _Count = 1
    before_copies: _Count = 10
    before_repeats: Annotated[int, Ge(0)] = 1
    before_all: bool = False
    n_restarts: _Count = 3
    null_iter: _Count = 100
    twins: Literal["all", "ends", "none"] = "all"


# Accuracy against noise: learn noisy copies, then name other noisy copies and the originals.

# at noise 0 copies are identical and LDA's within-class spread is 0: this is its limit
_LEAST_RATIO = 1e-6
_RATIOS = (0.0, 0.05, 0.10, 0.15, 0.20, 0.25, 0.30)
N_COPIES = 10  # [C] not stated for LDA; 10 is the paper's number for the robot's SVM
_N_REPEATS = 10  # [P]

_Encode = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep(Shown):
    """Accuracies of one classifier on one set of codes, by noise ratio and repeat.

    Attributes
    ----------
    ratios : np.ndarray
        Noise ratios (ratio,).
    classes : np.ndarray
        Class labels, sorted (class,).
    noisy : np.ndarray
        Accuracy on noisy copies drawn apart from the training copies (ratio, repeat).
    hits : np.ndarray
        Which clean originals were classified correctly (ratio, repeat, trial).
    confusion : np.ndarray
        Counts over all repeats on noisy copies (ratio, true class, predicted class).
    kept_noisy : np.ndarray
        Share of the training copies' variance that the principal components keep (ratio, repeat).
    kept_clean : np.ndarray
        Share of the clean test originals' variance (ratio, repeat); NaN without components, both.
    """

    DRAWN = "draw_sweep"

    ratios: np.ndarray
    classes: np.ndarray
    noisy: np.ndarray
    hits: np.ndarray = field(repr=False)
    confusion: np.ndarray = field(repr=False)
    kept_noisy: np.ndarray = field(repr=False)
    kept_clean: np.ndarray = field(repr=False)

    @property
    def chance(self) -> float:
        """Accuracy of guessing one of the equally frequent classes."""
        return 1.0 / self.classes.size

    @property
    def clean(self) -> np.ndarray:
        """Accuracy on the clean originals (ratio, repeat)."""
        return self.hits.mean(axis=2)

    @property
    def recall(self) -> np.ndarray:
        """Accuracy by true class, all repeats together (ratio, class); NaN where untested."""
        total = self.confusion.sum(axis=2)
        hits = np.diagonal(self.confusion, axis1=1, axis2=2)
        return np.divide(hits, total, out=np.full(hits.shape, np.nan), where=total > 0)

    @property
    def area(self) -> np.ndarray:
        """Accuracy by true class (class,), averaged over the ratios above 0."""
        above = self.ratios > 0
        return self.recall[above if above.any() else slice(None)].mean(axis=0)

    def table(self) -> str:
        """The numbers as text, a line per ratio: mean ± 1 SD, and the variance that is kept."""
        lines = [
            "noise   on noisy copies   on clean        variance kept: of copies, of clean originals"
        ]
        for k, ratio in enumerate(self.ratios):
            noisy, clean = (
                f"{100 * a[k].mean():5.1f} ± {100 * a[k].std():4.1f} %"
                for a in (self.noisy, self.clean)
            )
            kept = "  ".join(
                f"{100 * share[k].mean():5.1f} %"
                for share in (self.kept_noisy, self.kept_clean)
            )
            lines.append(f"{100 * ratio:4.0f} %  {noisy}   {clean}  {kept}")
        return "\n".join([*lines, f"chance {100 * self.chance:.1f} %"])


@checked
def compute_sweep(
    codes: Any,
    labels: Labels,
    *,
    ratios: Sequence[float] = _RATIOS,
    n_copies: int = N_COPIES,
    n_repeats: int = _N_REPEATS,
    estimator: Any = "lda",
    noise: str | Noise = "relative",
    encode: _Encode | None = None,
    held_out: tuple[Any, Labels] | None = None,
    rotate: bool = False,
    random_state: Seed = 0,
    n_jobs: int | None = None,
    progress: Advance | None = None,
) -> Sweep:
    """Accuracy of a classifier against the noise ratio.

    Per ratio and repeat: draw ``n_copies`` noisy copies of every trial to train on and as many
    others to test on, fit a fresh clone of the reader on the training copies alone, and score it on
    the test copies and on the clean originals. Copies of the same trial stand on both sides, so
    this measures robustness to noise, not generalisation to other touches; ``held_out`` measures
    that. A reader that is told the noise (``ideal``, ``templates``) learns the originals instead of
    their copies.

    Parameters
    ----------
    codes
        Activations (trial, component, time) or tensors (trial, sensor, time).
    labels
        Class of each trial.
    ratios, noise
        How much of which noise: each ratio is the size of the noise for one point of the curve. A
        :class:`feeler.objects.Noise`, or the name of a registered one: ``relative`` is then
        relative to each vector, and ``common`` to the greatest magnitude of the codes, as in
        the paper.
    n_copies, n_repeats
        Copies per trial, repeats per ratio.
    estimator
        A :class:`Reader`, the name of one (:data:`READERS`), or any scikit-learn classifier of flat
        vectors.
    encode
        If given, noise is added *before* encoding: ``codes`` are tensors, and ``encode`` maps noisy
        tensors (trial, sensor, time) to codes.
    held_out
        Other trials ``(codes, labels)`` to test on instead of the training trials.
    rotate
        Use ``draw_rotated``: exact for readers that see only distances and angles, and noise that
        is the same over a whole trial (``Relative()`` or ``Common()``).
    random_state
        Seed; equal seeds give equal sweeps.
    n_jobs
        Threads; None: all cores, but one with ``encode``, which is called in a fixed order. Never
        changes the numbers.
    progress
        Called with what is done and how much there is; None: a bar that appears after 5 s.

    Raises
    ------
    InvalidInput
        Fewer than two classes, labels that do not match, negative noise, more components than
        training copies.

    Notes
    -----
    Paper, "Feature classification from tactile tensors".
    """
    sets = _check_sets(codes, labels, held_out)
    if isinstance(noise, str) and ":" not in noise:
        noise = NOISES[noise]().suit(each="vector", reference=None)
    noise = parse_noise(noise)
    reader = READERS[estimator]() if isinstance(estimator, str) else estimator
    told = getattr(reader, "knows_noise", False)
    if rotate and (encode is not None or told or not noise.is_even(sets[0])):
        raise InvalidInput(
            "rotate needs noise that is the same over a trial: Relative() or Common(), no encode,"
            " and a reader that is not told the noise."
        )
    classes = np.unique(sets[1])
    place = {name: number for number, name in enumerate(classes.tolist())}
    if n_repeats < 1:
        raise InvalidInput(f"n_repeats must be ≥ 1, got {n_repeats}.")
    shape = (len(ratios), n_repeats)
    noisy, kept_noisy, kept_clean = (np.full(shape, np.nan) for _ in range(3))
    hits = np.zeros((*shape, len(sets[3])), dtype=bool)
    confusion = np.zeros((n_repeats, len(ratios), classes.size, classes.size), dtype=int)
    draw = partial(_draw_rotated, _span_all(sets)) if rotate else _draw_encoded
    noises = [
        noise.replace(size=max(ratio, _LEAST_RATIO) if ratio >= 0 else ratio)
        for ratio in ratios
    ]

    def run(r: int, seed: np.random.SeedSequence) -> None:
        for k, child in enumerate(seed.spawn(len(noises))):
            rng = np.random.default_rng(child)
            train, test, originals = draw(sets, noises[k], n_copies, encode, rng)
            model = clone(reader)
            if told:
                model.set_params(noise=noises[k])
                train = (_encode(sets[0], encode), sets[1])
            model.fit(_shape(train[0], model), train[1])
            true, found = _answer(model, test, place)
            noisy[k, r] = np.mean(found == true)
            hits[k, r] = np.equal(*_answer(model, originals, place))
            named = found >= 0
            np.add.at(confusion[r, k], (true[named], found[named]), 1)
            kept_noisy[k, r], kept_clean[k, r] = _measure_kept(model, originals[0])
            advance(next(done), len(noises) * n_repeats)

    n_threads = 1 if encode is not None else min(n_jobs or count_cores(), n_repeats)
    # one repeat per thread: the matrices are too small for threads inside BLAS to pay
    seeds, done = np.random.SeedSequence(random_state).spawn(n_repeats), count(1)
    with (
        hold_blas(),
        show_progress(progress, "noise and repeats") as advance,
        ThreadExecutor(n_threads) as pool,
    ):
        list(pool.map(run, range(n_repeats), seeds))
    return Sweep(
        ratios=np.asarray(ratios, dtype=float),
        classes=classes,
        noisy=noisy,
        hits=hits,
        confusion=confusion.sum(axis=0),
        kept_noisy=kept_noisy,
        kept_clean=kept_clean,
    )


def _check_sets(
    codes, labels, held_out
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    train, labels = _check_labels(check_tensors(codes, least=1), labels)
    if not train.any():
        raise InvalidInput("all codes are 0: nothing to classify. Did any contact take place?")
    if np.unique(labels).size < 2:
        raise InvalidInput(
            f"only one class ({labels[0]!r}): nothing to discriminate. Give at least two classes."
        )
    test, test_labels = (
        (train, labels)
        if held_out is None
        else _check_labels(check_tensors(held_out[0], least=1), held_out[1])
    )
    for values in (train, test):
        check_squares(values, "codes")
    if test.shape[1:] != train.shape[1:]:
        raise InvalidInput(
            f"held-out trials have shape {test.shape[1:]}, training trials {train.shape[1:]}."
        )
    if (unknown := np.setdiff1d(test_labels, labels)).size:
        raise InvalidInput(
            f"held-out classes {', '.join(map(str, unknown))} do not occur in training."
        )
    return train, labels, test, test_labels


def _check_labels(codes: np.ndarray, labels: Labels) -> tuple[np.ndarray, np.ndarray]:
    found = read_labels(labels)
    if found.shape != (len(codes),):
        raise InvalidInput(
            f"{len(codes)} trials but labels of shape {found.shape}; give one label per trial."
        )
    return codes, found


def _draw_encoded(sets, noise, n_copies, encode, rng):
    """Training copies, test copies and clean originals, each with its labels."""
    train, labels, test, test_labels = sets
    drawn = []
    for codes, names in ((train, labels), (test, test_labels)):
        copies = noise.add(codes, rng, n_copies)
        drawn.append((_encode(copies, encode), np.tile(names, n_copies)))
    return *drawn, (_encode(test, encode), test_labels)


def _span_all(sets) -> np.ndarray:
    """Coordinates of all clean trials, those to learn first."""
    train, _, test, _ = sets
    everything = train if test is train else np.concatenate([train, test])
    return span(everything.reshape(len(everything), -1))


def _draw_rotated(coordinates, sets, noise, n_copies, encode, rng):
    """The same through ``draw_rotated``."""
    train, labels, test, test_labels = sets
    offset = 0 if test is train else len(train)
    first = np.tile(np.arange(len(train)), n_copies)
    second = offset + np.tile(np.arange(len(test)), n_copies)
    everything = train if test is train else np.concatenate([train, test])
    sd = np.broadcast_to(noise.sd(everything), (len(everything), 1, 1))[:, 0, 0]
    owner = np.concatenate([first, second])
    noisy = draw_rotated(coordinates, train[0].size, owner, sd[owner], rng, first.size)
    clean = np.zeros((len(test), noisy.shape[1]))
    clean[:, : coordinates.shape[1]] = coordinates[offset:]
    return (
        (noisy[: first.size], np.tile(labels, n_copies)),
        (noisy[first.size :], np.tile(test_labels, n_copies)),
        (clean, test_labels),
    )


def _encode(codes: np.ndarray, encode: _Encode | None) -> np.ndarray:
    return codes if encode is None else np.asarray(encode(codes))


def _shape(codes: np.ndarray, model: Any) -> np.ndarray:
    """Codes as a model takes them: tensors for readers, flat vectors for all others."""
    return codes if isinstance(model, Reader) else codes.reshape(len(codes), -1)


def _answer(model, trials, place: dict[Any, int]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of the true and of the named classes; −1 for a touch in which no contact was seen."""
    codes, labels = trials
    named = model.predict(_shape(codes, model))
    true, found = (np.array([place.get(one, -1) for one in each]) for each in (labels, named))
    return true, found


def _measure_kept(model: Any, originals: np.ndarray) -> tuple[float, float]:
    """Variance kept by the pipeline's principal components, if it begins with them."""
    first = model[0] if hasattr(model, "steps") else None
    if not isinstance(first, PrincipalComponents):
        return np.nan, np.nan
    return float(first.explained_variance_ratio_.sum()), _compute_kept_variance(
        first, originals.reshape(len(originals), -1)
    )


# Harder splits than copies of the same tensor: unseen sizes, shifted places, other speeds.


@checked
def iterate_left_out(groups: Labels) -> Iterator[tuple[Any, np.ndarray, np.ndarray]]:
    """Each group's name with the trials outside it (train) and inside it (test)."""
    group = read_labels(groups, "groups")
    names = np.unique(group)
    if names.size < 2:
        raise InvalidInput(
            f"all trials belong to one group ({names[0]!r}); leaving it out leaves nothing to"
            " train on."
        )
    for name in names:
        yield name, np.flatnonzero(group != name), np.flatnonzero(group == name)


@checked
def compute_left_out(
    codes: Any, labels: Labels, groups: Labels, **options: Any
) -> dict[Any, Sweep]:
    """One sweep per group, which is tested after training on the others.

    So a size or a place can be tested that was never touched before.

    Parameters
    ----------
    codes, labels
        As in ``compute_sweep``; labels must not contain what ``groups`` leaves out (feature and
        location when sizes are left out).
    groups
        Group of each trial, e.g. the object's size.
    **options
        Of ``compute_sweep``.
    """
    codes, named = check_tensors(codes, least=1), read_labels(labels)
    if len(labels) != len(codes) or len(groups) != len(codes):
        raise InvalidInput(
            f"{len(codes)} trials, {len(labels)} labels, {len(groups)} groups; they must match."
        )
    return {
        name: compute_sweep(
            codes[train], named[train], held_out=(codes[test], named[test]), **options
        )
        for name, train, test in iterate_left_out(groups)
    }


@checked
def compute_jittered(
    codes: Any,
    labels: Labels,
    trials: Sequence[Trial],
    simulate: Callable[[list[Any]], Any],
    *,
    location: float = 0.0,
    speed: float = 0.0,
    n_each: int = 1,
    random_state: Seed = 0,
    **options: Any,
) -> Sweep:
    """A sweep trained on nominal trials and tested on jittered ones of the same labels.

    Parameters
    ----------
    codes, labels, trials
        The nominal trials' codes, classes and descriptions, in the same order.
    simulate
        Turns a list of trials into codes in the same order and form as ``codes`` (engine, window,
        scaling, encoder: whatever made ``codes``).
    location, speed
        Half-widths of a uniform shift, as a fraction of the antenna's length, and of a uniform
        change of speed, as a share of it [C]; 0.02 of the length is a fifth of the grid's step.
    n_each
        Jittered trials per trial.
    **options
        Of ``compute_sweep``.
    """
    named = read_labels(labels)
    if len(trials) != len(named):
        raise InvalidInput(
            f"{len(trials)} trials but {len(named)} labels; give one label per trial."
        )
    rng = np.random.default_rng(random_state)
    jittered = Nuisances.only(location=location, speed=speed).jitter(trials, rng, n_each)
    held_out = (simulate(jittered), np.tile(named, n_each))
    return compute_sweep(codes, labels, held_out=held_out, random_state=random_state, **options)


# What is confused with what: feature, size or location.


@dataclass(frozen=True, kw_only=True)
class Confused:
    """Shares of all test trials, by which attributes the predicted class has wrong.

    Attributes
    ----------
    correct : float
        Nothing wrong.
    wrong : dict[tuple[str, ...], float]
        ``wrong[("size",)]`` is the share in which only the size is wrong, and so on.
    accuracy : dict[str, float]
        accuracy["location"] is the share in which the location is right, whatever else is wrong.
    """

    correct: float
    wrong: dict[tuple[str, ...], float]
    accuracy: dict[str, float]

    def describe(self) -> str:
        """One line of words, greatest share first."""
        parts = sorted(
            ((share, key) for key, share in self.wrong.items() if share > 0), reverse=True
        )
        words = ", ".join(f"{' and '.join(key)} {100 * share:.1f} %" for share, key in parts)
        return f"right {100 * self.correct:.1f} %; wrong in {words}" if words else "all right"


@checked
def explain_confusion(
    confusion: Annotated[np.ndarray, "answer class"], attributes: Mapping[str, Labels]
) -> Confused:
    """Split a confusion matrix by the attributes of its classes.

    Parameters
    ----------
    confusion
        Counts (true class, predicted class).
    attributes
        Attribute values per class, e.g. ``{"feature": [...], "size": [...], "location": [...]}``.
    """
    confusion = np.asarray(confusion, dtype=float)
    n = len(confusion)
    if confusion.shape != (n, n) or confusion.sum() <= 0:
        raise InvalidInput(
            "expected a square matrix of counts with at least one trial, got shape"
            f" {confusion.shape}."
        )
    for name, values in attributes.items():
        if len(values) != n:
            raise InvalidInput(f"attribute {name!r} has {len(values)} values for {n} classes.")
    share = confusion / confusion.sum()
    differ = {
        name: np.not_equal.outer(v, v)
        for name, v in ((k, np.asarray(v)) for k, v in attributes.items())
    }
    names = tuple(attributes)
    wrong = {}
    for size in range(1, len(names) + 1):
        for key in combinations(names, size):
            mask = np.logical_and.reduce([differ[name] == (name in key) for name in names])
            wrong[key] = float(share[mask].sum())
    accuracy = {name: float(share[~differ[name]].sum()) for name in names}
    return Confused(correct=float(np.trace(share)), wrong=wrong, accuracy=accuracy)
