"""Accuracy against noise: learn noisy copies, then name other noisy copies and the originals."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import count
from typing import Annotated, Any

import numpy as np
from sklearn.base import clone

from feeler.decoding.components import PrincipalComponents, compute_kept_variance
from feeler.decoding.labels import Labels, read_labels
from feeler.decoding.noise import draw_rotated, span
from feeler.decoding.reader import READERS, Reader
from feeler.dispersion.index import check_tensors
from feeler.errors import InvalidInput
from feeler.execute.threads import ThreadExecutor, count_cores, hold_blas
from feeler.progress import Advance, show_progress
from feeler.records.checked import checked
from feeler.records.shown import Shown
from feeler.task.noise import NOISES, Noise, parse_noise
from feeler.tensors.scaling import check_squares

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
        Which clean originals were named right (ratio, repeat, trial).
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
    random_state: Annotated[int, "≥ 0"] = 0,
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
        :class:`feeler.task.Noise`, or the name of a registered one: ``relative`` is then relative
        to each vector, and ``common`` to the greatest magnitude of the codes, as in the paper.
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
            f"only one class ({labels[0]!r}): nothing to tell apart. Give at least two classes."
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
    return float(first.explained_variance_ratio_.sum()), compute_kept_variance(
        first, originals.reshape(len(originals), -1)
    )
