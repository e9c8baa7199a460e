"""Accuracy against noise: trained on noisy copies, tested on others and on the originals."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import combinations, count
from threading import Lock
from typing import Annotated, Any, Literal

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh
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
from feeler.execute.processes import find_free_memory
from feeler.execute.threads import ThreadExecutor, count_cores, hold_blas
from feeler.objects.noise import NOISES, Noise, parse_noise
from feeler.objects.task import Nuisances
from feeler.objects.trials import Trial
from feeler.progress import Advance, show_progress
from feeler.records import Ge, Gt, Len, Record, Shown
from feeler.tensors.transforms import check_squares
from feeler.validation import Seed, checked

# Noisy copies in few coordinates, for methods that see only distances and angles.

_PARALLEL = 1e-10  # relative length below which a vector holds nothing new
_MORE = 256  # products for which memory is taken at once
_UNSEEN_TOL = 1e-6  # of the components of copies that are not drawn
_COPY = 16  # bytes for each number of a copy: as drawn, added to the tensor, centred
_MOST_COPIES = 2000  # to learn, that are drawn: beyond, their Gram matrix costs more


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


class UnseenNoise:
    """A matrix of standard normals (row, column) of which only products with vectors are drawn.

    A product with a new direction is normal too, but for its parts along what products from the
    other side have shown already. So it has exactly the distribution of products with one matrix,
    which is never held: a few hundred of them say what PCA finds in it.
    """

    def __init__(self, n_rows: int, n_columns: int, rng: np.random.Generator) -> None:
        self._rng, lengths = rng, (n_columns, n_rows)
        # orthonormal directions that were asked for, and their products, from either side
        self._known = [
            [np.zeros((0, a)), np.zeros((0, b))] for a, b in (lengths, lengths[::-1])
        ]
        self._counts = [0, 0]

    def multiply(self, vector: np.ndarray, transposed: bool = False) -> np.ndarray:
        """The matrix, or its transpose, times a vector."""
        (asked, found), n = self._known[transposed], self._counts[transposed]
        others, shown = (a[: self._counts[not transposed]] for a in self._known[not transposed])
        share = asked[:n] @ vector
        rest = vector - share @ asked[:n]
        again = asked[:n] @ rest
        rest, share = rest - again @ asked[:n], share + again
        norm = np.linalg.norm(rest)
        if norm <= _PARALLEL * np.linalg.norm(vector):
            return share @ found[:n]
        if n == len(asked):
            asked, found = self._known[transposed] = [
                np.concatenate([a, np.empty((_MORE, a.shape[1]))]) for a in (asked, found)
            ]
        asked[n] = rest / norm
        fresh = self._rng.standard_normal(found.shape[1])
        found[n] = fresh + (shown @ asked[n] - others @ fresh) @ others
        self._counts[transposed] += 1
        return share @ found[:n] + norm * found[n]


def project_unseen(
    clean: Sequence[np.ndarray],
    sd: Sequence[np.ndarray],
    n_copies: int,
    n_entries: int,
    n_components: int,
    rng: np.random.Generator,
) -> tuple[list[np.ndarray], tuple[float, float]]:
    """What :func:`feeler.decoding.classifiers.project` gives of noisy copies that are never drawn
    whole.

    Parameters
    ----------
    clean
        Coordinates (trial, rank), from :func:`span`, of the trials to learn and of those to test.
    sd
        Of the noise of each of these trials (trial,).
    """
    (train, test), n_rows = clean, n_copies * len(clean[0])
    rank, each = train.shape[1], np.tile(sd[0], n_copies)
    noise = UnseenNoise(n_rows, n_entries, rng)

    def multiply(vector: np.ndarray) -> np.ndarray:
        return np.tile(train @ vector[:rank], n_copies) + each * noise.multiply(vector)

    def square(vector: np.ndarray) -> np.ndarray:
        column = multiply(np.ravel(vector))
        column -= column.mean()
        found = noise.multiply(each * column, transposed=True)
        found[:rank] += train.T @ column.reshape(n_copies, -1).sum(axis=0)
        return found

    k = min(n_components, n_rows - 1, n_entries - 1)
    operator = LinearOperator((n_entries, n_entries), matvec=square, dtype=float)
    start = rng.standard_normal(n_entries)
    energy, axes = eigsh(operator, k, ncv=3 * k, tol=_UNSEEN_TOL, v0=start)
    axes = axes[:, energy > _UNSEEN_TOL**2 * energy.max()]
    learned = np.stack([multiply(axis) for axis in axes.T], axis=1)
    mean = learned.mean(axis=0)
    originals = test @ axes[:rank] - mean
    drawn = rng.standard_normal((n_copies, *originals.shape)) * sd[1][:, None]
    apart = train - train.mean(axis=0)
    # of the noise its expectation, from which 10⁹ numbers differ by less than 10⁻⁴
    total = n_copies * (np.vdot(apart, apart) + n_entries * np.vdot(sd[0], sd[0]))
    shares = float(energy.sum() / total), share_kept(test, axes[:rank].T)
    return [learned - mean, (originals + drawn).reshape(-1, len(mean)), originals], shares


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
    null_restarts : int
        Restarts of the joint fits of identical touches and of twins.
    null_iter : int
        Their iterations.
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
    null_restarts: _Count = 3
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
    classifier = CLASSIFIERS[estimator]() if isinstance(estimator, str) else estimator
    told = getattr(classifier, "knows_noise", False)
    even = encode is None and not told and noise.is_even(sets[0])
    if rotate and not even:
        raise InvalidInput(
            "rotate needs noise that is the same over a trial: Relative() or Common(), no encode,"
            " and a classifier that is not told the noise."
        )
    if n_repeats < 1:
        raise InvalidInput(f"n_repeats must be ≥ 1, got {n_repeats}.")
    rotate = even and _begins_with_components(classifier) if rotate is None else rotate
    classes = np.unique(sets[1])
    place = {name: number for number, name in enumerate(classes.tolist())}
    own, true = (np.array([place[name] for name in sets[k].tolist()]) for k in (1, 3))
    shape = (len(ratios), n_repeats)
    noisy, kept_noisy, kept_clean = (np.full(shape, np.nan) for _ in range(3))
    hits = np.zeros((*shape, true.size), dtype=bool)
    confusion, lock = np.zeros((len(ratios), classes.size, classes.size), np.int32), Lock()
    noises = [
        noise.replace(size=max(ratio, _LEAST_RATIO) if ratio >= 0 else ratio)
        for ratio in ratios
    ]
    copies = _Copies(sets[0], sets[2], n_copies, rotate)
    n_components = 0 if encode else _find_lda(classifier)
    many = n_components and rotate and n_copies * len(sets[0]) > _MOST_COPIES
    draw: Any = partial(copies.project, n_components) if many else copies.draw

    def ask(noise: Noise, drawn: Any) -> tuple[np.ndarray, np.ndarray, tuple[float, float]]:
        if n_components:
            projected, kept = drawn if many else project(drawn, n_components)
            classify = fit_lda(projected[0], np.tile(own, n_copies))
            return classify(projected[1]), classify(projected[2]), kept
        model = clone(classifier)
        train, test, originals = (_encode(codes, encode) for codes in drawn)
        if told:
            model.set_params(noise=noise)
            model.fit(_encode(sets[0], encode), sets[1])
        else:
            model.fit(_shape(train, model), np.tile(sets[1], n_copies))
        found, right = (
            np.array([place.get(one, -1) for one in model.predict(_shape(codes, model))])
            for codes in (test, originals)
        )
        return found, right, _measure_kept(model, originals)

    def run(r: int, seed: np.random.SeedSequence) -> None:
        for k, drawn in enumerate(draw(noises, seed)):
            found, right, kept = ask(noises[k], drawn)
            asked = np.tile(true, n_copies)
            noisy[k, r], hits[k, r] = np.mean(found == asked), right == true
            named = found >= 0
            with lock:
                np.add.at(confusion[k], (asked[named], found[named]), 1)
            kept_noisy[k, r], kept_clean[k, r] = kept
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
        confusion=confusion,
        kept_noisy=kept_noisy,
        kept_clean=kept_clean,
    )


def _check_sets(
    codes, labels, held_out
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    train, labels = check_tensors(codes, least=1), read_labels(labels)
    check_labels(train, labels)
    if not train.any():
        raise InvalidInput("all codes are 0: nothing to classify. Did any contact take place?")
    test, test_labels = train, labels
    if held_out is not None:
        test, test_labels = check_tensors(held_out[0], least=1), read_labels(held_out[1])
        check_counts(test, test_labels)
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
        self._clean = self._given
        if rotate:
            every = train if test is train else np.concatenate([train, test])
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
        lengths = [self._n_copies * len(one) for one in clean]
        bytes_needed = _COPY * sum(lengths) * clean[0][0].size
        if bytes_needed > find_free_memory():
            raise OutOfMemory(
                f"{sum(lengths):,} noisy copies need {bytes_needed / 2**30:.3g} GiB, which is more"
                " than there is. Noise that is equally strong over each touch (noise='common') is"
                " not drawn whole; or give fewer touches or n_copies."
            )
        if self._rotate:
            rank, n_entries = clean[0].shape[1], self._given[0][0].size
            drawn = draw_rotated(rank, n_entries, sum(lengths), rng, lengths[0])
            more = ((0, 0), (0, drawn.shape[1] - rank))
            clean = np.pad(clean[0], more), np.pad(clean[1], more)
        else:
            drawn = rng.standard_normal((sum(lengths), *clean[0].shape[1:]), dtype=np.float32)
        parts = np.split(drawn, lengths[:1])
        for noise in noises:
            yield *map(self._add, parts, clean, self._given, [noise] * 2), clean[1]

    def project(
        self, n_components: int, noises: Sequence[Noise], seed: Any
    ) -> Iterator[tuple[list[np.ndarray], tuple[float, float]]]:
        """Rotated copies of each noise in principal components, where they are too many to draw."""
        rng, n_entries = np.random.default_rng(seed), self._given[0][0].size
        for noise in noises:
            sd = [np.broadcast_to(noise.sd(a).ravel(), len(a)) for a in self._given]
            yield project_unseen(self._clean, sd, self._n_copies, n_entries, n_components, rng)

    def _add(
        self, drawn: np.ndarray, clean: np.ndarray, given: np.ndarray, noise: Noise
    ) -> np.ndarray:
        sd = noise.sd(given)
        each = drawn.reshape(self._n_copies, *clean.shape)
        copies = np.multiply(each, sd[..., 0] if self._rotate else sd, dtype=float)
        copies += clean
        return copies.reshape(drawn.shape)


def _encode(codes: np.ndarray, encode: _Encode | None) -> np.ndarray:
    return codes if encode is None else np.asarray(encode(codes))


def _shape(codes: np.ndarray, model: Any) -> np.ndarray:
    """Codes as a model takes them: tensors for classifiers, flat vectors for all others."""
    return codes if isinstance(model, Classifier) else codes.reshape(len(codes), -1)


def _begins_with_components(classifier: Any) -> bool:
    """Whether a pipeline begins with principal components, and so sees inner products alone."""
    return hasattr(classifier, "steps") and isinstance(classifier[0], PrincipalComponents)


def _find_lda(classifier: Any) -> int:
    """The number of components if the classifier is what ``make_lda`` gives, else 0."""
    plain = _begins_with_components(classifier) and len(classifier) == 2
    lda = make_lda()[-1]
    same = (
        plain
        and type(classifier[1]) is type(lda)
        and classifier[1].get_params() == lda.get_params()
    )
    return classifier[0].n_components if same else 0


def _measure_kept(model: Any, originals: np.ndarray) -> tuple[float, float]:
    """Variance kept by the pipeline's principal components, if it begins with them."""
    if not _begins_with_components(model):
        return np.nan, np.nan
    first, flat = model[0], originals.reshape(len(originals), -1)
    return float(first.explained_variance_ratio_.sum()), share_kept(flat, first.components_)


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
    check_counts(codes, labels)
    check_counts(codes, groups, "groups")
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
    check_counts(trials, named)
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
