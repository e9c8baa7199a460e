"""Accuracy against noise: trained on noisy copies, tested on others and on the originals."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations, count
from typing import Annotated, Any, Literal

import numpy as np
from scipy.linalg.blas import ssymm, ssyrk
from sklearn.base import clone

from feeler.analysis.indices import check_tensors
from feeler.decoding.classifiers import (
    CLASSIFIERS,
    Classifier,
    Labels,
    PrincipalComponents,
    check_counts,
    check_labels,
    fit_lda,
    make_lda,
    project,
    read_labels,
    share_kept,
)
from feeler.errors import InvalidInput, OutOfMemory
from feeler.execute.workers import ThreadExecutor, count_cores, find_free_memory, hold_blas
from feeler.objects.noise import NOISES, Noise, parse_noise
from feeler.objects.task import Nuisances
from feeler.objects.trials import Trial
from feeler.progress import Advance, show_progress
from feeler.records import Ge, Gt, Len, Record, Shown
from feeler.tensors.transforms import check_squares
from feeler.validation import Count, Seed, checked

# Noisy copies in few coordinates, for methods that see only distances and angles.

_COPY = 16  # bytes for each number of a copy: as drawn, added to the tensor, centred
_MOST_BYTES = 2**30  # of copies that are drawn whole
_POWERS = 8  # of the covariance, to find its longest axes by
_MORE_AXES = 10  # beside those asked for
_BLOCK = 2**23  # numbers of copies that are drawn at a time where they are not


def draw_rotated(
    rank: int,
    n_entries: int,
    n_copies: int,
    rng: np.random.Generator,
    n_learned: int,
) -> np.ndarray:
    """Isotropic noise of sd 1 in far fewer coordinates, for PCA, LDA and support vector machines.

    These methods see only distances and angles.

    Isotropic noise looks the same after any rotation. Turned so that the first axes span the clean
    vectors, all that m noisy copies show outside that span is the Gram matrix of m Gaussian
    vectors, a Wishart matrix; its Bartlett factor L (chi-distributed diagonal, normal below) has
    exactly that Gram matrix in m coordinates. Of copies that are only compared with those m, the
    coordinates along them are normal and all others are of no account. So 600 copies of 21,280
    entries, of which 300 are learned, become 600 vectors of about 330, with the same joint
    distribution of all inner products that count, also after each is multiplied by its own sd.

    Parameters
    ----------
    rank
        Of the clean vectors, whose coordinates (trial, rank) :func:`span` gives.
    n_entries
        Entries of a clean vector.
    n_learned
        The first so many copies are compared with each other and with all others; the others only
        with them and with the clean vectors.

    Returns
    -------
    Noise (copy, coordinate); the clean vectors have zeros beyond their rank.
    """
    rest = n_entries - rank
    noise = rng.standard_normal((n_copies, rank + min(rest, n_learned)), dtype=np.float32)
    if rest >= n_learned:
        factor = noise[:n_learned, rank:]
        factor[np.triu_indices(n_learned, 1)] = 0
        np.fill_diagonal(factor, np.sqrt(rng.chisquare(rest - np.arange(n_learned))))
    return noise


def project_streamed(
    clean: Sequence[np.ndarray],
    sd: Sequence[np.ndarray],
    sizes: Sequence[float],
    n_copies: int,
    n_components: int,
    seed: Any,
) -> Iterator[tuple[list[np.ndarray], tuple[float, float]]]:
    """What :func:`feeler.decoding.classifiers.project` gives of noisy copies that are drawn block
    by block, in single precision, and never held.

    PCA needs only the covariance of all copies. Its one part that is not a product of few rows is
    that of the noise with itself, which is summed once for all sizes.

    Parameters
    ----------
    clean
        Tensors (trial, sensor, time) to learn, less their mean, and those to test, less the same.
    sd
        Of the noise of size 1 of both, broadcastable to them.
    sizes
        By what the noise is multiplied, in turn.
    seed
        Of all copies.
    """
    train, test = (one.reshape(len(one), -1) for one in clean)
    n_entries, n_rows = train.shape[1], n_copies * len(train)
    square, summed = np.zeros((n_entries, n_entries), np.float32, order="F"), train.copy()

    def draw(which: int, rng: np.random.Generator) -> Iterator[tuple[slice, np.ndarray]]:
        step = 1 + _BLOCK // (n_copies * n_entries)
        level = np.broadcast_to(sd[which], clean[which].shape)
        for trials in (slice(a, a + step) for a in range(0, len(level), step)):
            noise = rng.standard_normal((n_copies, *level[trials].shape), dtype=np.float32)
            noise *= level[trials]
            yield trials, noise.reshape(n_copies, -1, n_entries)

    for trials, noise in draw(0, np.random.default_rng(seed)):
        summed[trials] = noise.sum(axis=0)
        square = ssyrk(1, noise.reshape(-1, n_entries).T, beta=1, c=square, overwrite_c=True)
    mean = summed.sum(axis=0) / n_rows

    def multiply(axes: np.ndarray, size: np.float32) -> np.ndarray:
        seen, shaken = train @ axes, size * (summed @ axes)
        alone = ssymm(1, square, axes) - n_rows * np.outer(mean, mean @ axes)
        return train.T @ (n_copies * seen + shaken) + size * (summed.T @ seen + size * alone)

    k, rng = min(n_components, n_rows - 1, n_entries - 1), np.random.default_rng(seed)
    start = np.random.default_rng(0).standard_normal((n_entries, k + _MORE_AXES), np.float32)
    for size in np.asarray(sizes, np.float32):
        basis = multiply(start, size)
        for _ in range(_POWERS):
            more = multiply(basis[:, -k - _MORE_AXES :], size)
            basis = np.linalg.qr(np.concatenate([basis, more], axis=1))[0]
        energy, turn = np.linalg.eigh(basis.T @ multiply(basis, size))
        kept = np.flatnonzero(energy > np.finfo(np.float32).eps * energy[-1])[-k:]
        axes, rng, sets = basis @ turn[:, kept], np.random.default_rng(seed), []
        for which, flat in enumerate((train, test)):
            originals = (flat @ axes - size * (mean @ axes)).astype(float)
            sets.append(np.tile(originals, (n_copies, 1, 1)))
            for trials, noise in draw(which, rng):
                sets[which][:, trials] += size * (noise @ axes)
        alone = np.trace(square) - n_rows * np.vdot(mean, mean)
        total = n_copies * np.vdot(train, train) + 2 * size * np.vdot(train, summed)
        shares = float(energy[kept].sum() / (total + size**2 * alone)), share_kept(test, axes.T)
        yield [*(np.concatenate(one) for one in sets), originals], shares


def span(clean: np.ndarray) -> np.ndarray:
    """Coordinates (trial, rank) of flat clean vectors in an orthonormal basis of their span."""
    energy, axes = np.linalg.eigh(clean @ clean.T)
    keep = energy > energy[-1] * 1e-12
    return axes[:, keep] * np.sqrt(energy[keep])


# How much to compute of accuracy against noise.


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
    null_restarts : int
        Restarts of the joint fits of identical touches and of twins.
    null_iter : int
        Their iterations.
    twins : str
        Groups whose touches are fitted twice: all, the ends of each comparison, or none.
    """

    ratios: Annotated[tuple[Annotated[float, Ge(0)], ...], Len(1)]
    n_repeats: Count
    control_repeats: Count | None = None
    n_copies: Count = 10
    other_copies: tuple[Count, ...] = (3, 30)
    probe: Annotated[float, Gt(0)] = 0.2
    other_repeats: Count = 1
    before_copies: Count = 10
    before_repeats: Annotated[int, Ge(0)] = 1
    before_all: bool = False
    null_restarts: Count = 3
    null_iter: Count = 100
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
    ratios: Annotated[Sequence[float], Len(1)] = _RATIOS,
    n_copies: Count = N_COPIES,
    n_repeats: Count = _N_REPEATS,
    estimator: Any = "lda",
    noise: str | Noise = "relative",
    encode: _Encode | None = None,
    held_out: tuple[Any, Labels] | None = None,
    rotate: bool | None = None,
    random_state: Seed = 0,
    n_jobs: int | None = None,
    progress: Advance | None = None,
) -> Sweep:
    """Accuracy of a classifier against the noise ratio.

    Per repeat: draw ``n_copies`` noisy copies of every trial to train on and as many others to test
    on. Per ratio, which scales the noise of the repeat: fit a fresh clone of the classifier on the
    training copies alone, and score it on the test copies and on the clean originals. Copies of the
    same trial stand on both sides, so this measures robustness to noise, not generalisation to
    other touches; ``held_out`` measures that. A classifier that is told the noise (``ideal``,
    ``templates``) learns the originals instead of their copies.

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
        A :class:`Classifier`, the name of one (:data:`CLASSIFIERS`), or any scikit-learn classifier
        of flat vectors.
    encode
        If given, noise is added *before* encoding: ``codes`` are tensors, and ``encode`` maps noisy
        tensors (trial, sensor, time) to codes.
    held_out
        Other trials ``(codes, labels)`` to test on instead of the training trials.
    rotate
        Use ``draw_rotated``: exact for classifiers that see only distances and angles, and noise
        that is the same over a whole trial (``Relative()`` or ``Common()``). None: with such noise
        for pipelines that begin with principal components.
    random_state
        Seed; equal seeds give equal sweeps.
    n_jobs
        Threads; None: all cores, but one with ``encode``, which is called in a fixed order, and
        where copies are too many to be held. Never changes the numbers.
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
    classifier = CLASSIFIERS[estimator]() if isinstance(estimator, str) else estimator
    told = getattr(classifier, "knows_noise", False)
    even = encode is None and not told and noise.is_even(sets[0])
    if rotate and not even:
        raise InvalidInput(
            "rotate needs noise that is the same over a trial: Relative() or Common(), no encode,"
            " and a classifier that is not told the noise."
        )
    rotate = even and _begins_with_components(classifier) if rotate is None else rotate
    classes = np.unique(sets[1])
    place = {name: number for number, name in enumerate(classes.tolist())}
    own, true = (np.array([place[name] for name in sets[k].tolist()]) for k in (1, 3))
    noises = [
        noise.replace(size=max(ratio, _LEAST_RATIO) if ratio >= 0 else ratio)
        for ratio in ratios
    ]
    copies = _Copies(sets[0], sets[2], n_copies, rotate)
    begins, lda = _begins_with_components(classifier), make_lda()[-1]
    is_lda = (  # what make_lda gives, with any number of components
        begins
        and len(classifier) == 2
        and type(classifier[1]) is type(lda)
        and classifier[1].get_params() == lda.get_params()
    )
    many = begins and encode is None and noise.is_gaussian and copies.are_many
    draw: Any = partial(copies.project, classifier[0].n_components) if many else copies.draw

    def ask(noise: Noise, drawn: Any) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
        kept = np.nan, np.nan
        if encode is not None:
            drawn = [_encode(codes, encode) for codes in drawn]
        if begins:
            drawn, kept = drawn if many else project(drawn, classifier[0].n_components)
        if is_lda:
            classify = fit_lda(drawn[0], np.tile(own, n_copies))
            return classify(drawn[1]), classify(drawn[2]), kept
        model = clone(classifier[1:] if begins else classifier)
        if told:
            model.set_params(noise=noise)
            model.fit(sets[0] if encode is None else _encode(sets[0], encode), sets[1])
        else:
            model.fit(_shape(drawn[0], model), np.tile(sets[1], n_copies))
        found, right = (
            np.array([place.get(one, -1) for one in model.predict(_shape(codes, model))])
            for codes in drawn[1:]
        )
        return found, right, kept

    def run(seed: np.random.SeedSequence) -> list[tuple]:
        answers = []
        for one, drawn in zip(noises, draw(noises, seed), strict=True):
            answers.append(ask(one, drawn))
            advance(next(done), len(noises) * n_repeats)
        return answers

    n_threads = 1 if encode is not None or many else min(n_jobs or count_cores(), n_repeats)
    # one repeat per thread: the matrices are too small for threads inside BLAS to pay
    seeds, done = np.random.SeedSequence(random_state).spawn(n_repeats), count(1)
    with (
        nullcontext() if many else hold_blas(),
        show_progress(progress, "noise and repeats") as advance,
        ThreadExecutor(n_threads) as pool,
    ):
        answers = [zip(*repeat, strict=True) for repeat in pool.map(run, seeds)]
    found, right, kept = (np.array(one).swapaxes(0, 1) for one in zip(*answers, strict=True))
    asked = np.tile(true, n_copies)
    confusion = np.zeros((len(ratios), classes.size, classes.size), np.int32)
    for counts, named in zip(confusion, found, strict=True):
        every = np.broadcast_to(asked, named.shape)[named >= 0]
        np.add.at(counts, (every, named[named >= 0]), 1)
    return Sweep(
        ratios=np.asarray(ratios, dtype=float),
        classes=classes,
        noisy=(found == asked).mean(axis=2),
        hits=right == true,
        confusion=confusion,
        kept_noisy=kept[..., 0],
        kept_clean=kept[..., 1],
    )


def _check_sets(
    codes, labels, held_out
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    train = check_tensors(codes, least=1)
    labels = check_labels(codes, labels)
    if not train.any():
        raise InvalidInput("all codes are 0: nothing to classify. Did any contact take place?")
    test, test_labels = train, labels
    if held_out is not None:
        test, test_labels = check_tensors(held_out[0], least=1), read_labels(held_out[1])
        check_counts(*held_out)
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


class _Copies:
    """Noisy copies of trials to learn and of trials to test, drawn apart, and the clean tests."""

    def __init__(
        self, train: np.ndarray, test: np.ndarray, n_copies: int, rotate: bool
    ) -> None:
        self._given, self._n_copies, self._rotate = (train, test), n_copies, rotate
        self._clean, self._n_drawn = self._given, n_copies * (len(train) + len(test))
        every = train if test is train else np.concatenate([train, test])
        n_entries, n_most = train[0].size, len(every) + n_copies * len(train)
        self._n_bytes = (
            _COPY * self._n_drawn * (min(n_entries, n_most) if rotate else n_entries)
        )
        self.are_many = self._n_bytes > max(_MOST_BYTES, 4 * n_entries**2)
        if rotate and not self.are_many:
            turned = span(every.reshape(len(every), -1))
            self._clean = turned[: len(train)], turned[-len(test) :]

    def draw(self, noises: Sequence[Noise], seed: Any) -> Iterator[tuple[np.ndarray, ...]]:
        """Training copies, test copies and clean tests for each noise, from one draw: what differs
        between them is how strong it is. Rotated ones are flat.
        """
        if not noises[0].is_gaussian:
            for noise in noises:
                rng = np.random.default_rng(seed)
                train, test = (noise.add(one, rng, self._n_copies) for one in self._given)
                yield train, test, self._given[1]
            return
        rng, clean = np.random.default_rng(seed), self._clean
        n_drawn, n_learned = self._n_drawn, self._n_copies * len(clean[0])
        if self._n_bytes > find_free_memory():
            raise OutOfMemory(
                f"{n_drawn:,} noisy copies need {self._n_bytes / 2**30:.3g} GiB, which is more than"
                " there is. A classifier that begins with principal components, as 'lda' does,"
                " needs no copies at once; or give fewer touches or n_copies."
            )
        if self._rotate:
            rank, n_entries = clean[0].shape[1], self._given[0][0].size
            drawn = draw_rotated(rank, n_entries, n_drawn, rng, n_learned)
            more = ((0, 0), (0, drawn.shape[1] - rank))
            clean = np.pad(clean[0], more), np.pad(clean[1], more)
        else:
            drawn = rng.standard_normal((n_drawn, *clean[0].shape[1:]), dtype=np.float32)
        parts = np.split(drawn, [n_learned])
        for noise in noises:
            yield *map(self._add, parts, clean, self._given, [noise] * 2), clean[1]

    def project(
        self, n_components: int, noises: Sequence[Noise], seed: Any
    ) -> Iterator[tuple[list[np.ndarray], tuple[float, float]]]:
        """Copies of each noise in principal components, where they are too many to draw."""
        (train, test), n_copies, unit = self._given, self._n_copies, noises[-1]
        clean = [np.subtract(train, train.mean(axis=0), dtype=np.float32)]
        clean += (
            clean
            if test is train
            else [np.subtract(test, train.mean(axis=0), dtype=np.float32)]
        )
        level = unit.sd(train) / unit.size
        same = all(np.allclose(one.sd(train), one.size * level, atol=0) for one in noises)
        for several in [noises] if same else [[one] for one in noises]:
            sd = [several[-1].sd(one) / several[-1].size for one in self._given]
            sizes = [one.size for one in several]
            yield from project_streamed(clean, sd, sizes, n_copies, n_components, seed)

    def _add(
        self, drawn: np.ndarray, clean: np.ndarray, given: np.ndarray, noise: Noise
    ) -> np.ndarray:
        sd = noise.sd(given)
        each = drawn.reshape(self._n_copies, *clean.shape)
        copies = np.multiply(each, sd[..., 0] if self._rotate else sd, dtype=float)
        copies += clean
        return copies.reshape(drawn.shape)


def _encode(tensors: np.ndarray, encode: _Encode) -> np.ndarray:
    codes = np.asarray(encode(tensors))
    check_counts(tensors, codes, "codes from encode")
    return codes


def _shape(codes: np.ndarray, model: Any) -> np.ndarray:
    """Codes as a model takes them: tensors for classifiers, flat vectors for all others."""
    return codes if isinstance(model, Classifier) else codes.reshape(len(codes), -1)


def _begins_with_components(classifier: Any) -> bool:
    """Whether a pipeline begins with principal components, and so sees inner products alone."""
    return hasattr(classifier, "steps") and isinstance(classifier[0], PrincipalComponents)


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
    array, named = check_tensors(codes, least=1), read_labels(labels)
    check_counts(codes, labels)
    check_counts(codes, groups, "groups")
    return {
        name: compute_sweep(
            array[train], named[train], held_out=(array[test], named[test]), **options
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
    check_counts(trials, named)
    rng = np.random.default_rng(random_state)
    jittered = Nuisances.only(location=location, speed=speed).jitter(trials, rng, n_each)
    return compute_sweep(
        codes,
        labels,
        held_out=(simulate(jittered), np.tile(named, n_each)),
        random_state=random_state,
        **options,
    )


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
    return Confused(
        correct=float(np.trace(share)),
        wrong=wrong,
        accuracy={name: float(share[~differ[name]].sum()) for name in names},
    )
