"""The sweep: limits, honesty, determinism, refusals."""

from typing import ClassVar

import numpy as np
import pytest
from sklearn.base import BaseEstimator, ClassifierMixin
from sklearn.decomposition import PCA
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis
from sklearn.neighbors import KNeighborsClassifier
from sklearn.pipeline import make_pipeline

from feeler.decoding import (
    PrincipalComponents,
    Relative,
    compute_jittered,
    compute_left_out,
    compute_sweep,
    make_lda,
    make_null,
    sweeps,
)
from feeler.decoding.classifiers import make_svm
from feeler.decoding.curves import PeakEncoder
from feeler.errors import InvalidInput, OutOfMemory
from feeler.objects.shapes import Ball
from feeler.objects.trials import Trial

FEW = {"n_copies": 4, "n_repeats": 3}


def make_bumps(places=(20, 30, 40, 50, 60, 70), width=5.0, n_sensors=3):
    """Distinct, smooth activations: a bump at another time in each trial."""
    time = np.arange(100)
    bumps = np.exp(-0.5 * ((time - np.array(places)[:, None]) / width) ** 2)
    return np.repeat(bumps[:, None], n_sensors, axis=1)


@pytest.mark.parametrize("estimator", [make_lda(12), make_svm(12), KNeighborsClassifier(3)])
def test_distinct_codes_are_told_apart_without_noise(estimator):
    sweep = compute_sweep(
        make_bumps(), list("abcdef"), ratios=(0.0,), estimator=estimator, **FEW
    )
    assert (sweep.noisy == 1).all() and (sweep.clean == 1).all()


def test_copies_that_do_not_fit_into_memory_are_refused_before_they_are_drawn(monkeypatch):
    monkeypatch.setattr(sweeps, "find_free_memory", lambda: 16 * 2 * 6 * 8 * 300 - 1)
    how = {"ratios": (0.1,), **FEW, "n_copies": 8}
    with pytest.raises(OutOfMemory, match=r"96 noisy copies need .* GiB.*principal components"):
        compute_sweep(make_bumps(), list("abcdef"), estimator=KNeighborsClassifier(3), **how)
    monkeypatch.setattr(sweeps, "_MOST_BYTES", 1)
    for estimator in (make_lda(12), make_svm(12)):
        for noise in ("common", "relative"):
            compute_sweep(make_bumps(), list("abcdef"), estimator=estimator, noise=noise, **how)


@pytest.mark.further
@pytest.mark.parametrize("noise", ["relative", "relative:0.1,each=tensor", "mixed:0.1"])
def test_copies_drawn_in_blocks_give_what_the_same_copies_give_drawn_whole(monkeypatch, noise):
    rng = np.random.default_rng(0)
    tensors = (rng.random((12, 4, 20)) + 6 * rng.random((4, 20))) * rng.random((12, 4, 1))
    tensors[:, 2] = 0  # a silent sensor
    labels = np.arange(12) % 6
    held_out = tensors[:5] * 1.1, labels[:5]
    how = {"ratios": (0.1, 0.3, 1.0), "rotate": False, "noise": noise, "held_out": held_out}
    whole = compute_sweep(tensors, labels, **how)
    monkeypatch.setattr(sweeps, "_MOST_BYTES", 1)
    same = compute_sweep(tensors, labels, **how)
    monkeypatch.setattr(sweeps, "_BLOCK", 1)
    blocks = compute_sweep(tensors, labels, **how)
    for name in ("noisy", "clean", "kept_noisy", "kept_clean"):
        one, two, other = (getattr(sweep, name) for sweep in (whole, same, blocks))
        np.testing.assert_allclose(two, one, atol=1e-6, err_msg=name)
        np.testing.assert_allclose(other.mean(1), one.mean(1), atol=0.1, err_msg=name)


def test_accuracy_falls_to_chance_as_noise_grows():
    sweep = compute_sweep(
        make_bumps(),
        np.arange(6),
        ratios=(0.1, 2.0, 1000.0),
        estimator=make_lda(12),
        n_repeats=10,
    )
    noisy = sweep.noisy.mean(axis=1)
    assert noisy[0] > noisy[1] > noisy[2]
    assert noisy[2] == pytest.approx(sweep.chance, abs=0.05)


@pytest.mark.parametrize("rotate", [False, True])
def test_the_null_of_identical_codes_stays_at_chance(rotate):
    null = make_null(make_bumps())
    sweep = compute_sweep(
        null,
        np.arange(6),
        ratios=(0.2,),
        noise=Relative(each="tensor"),
        rotate=rotate,
        n_repeats=25,
    )
    np.testing.assert_allclose(sweep.noisy.mean(axis=1), 1 / 6, atol=0.04)
    np.testing.assert_allclose(sweep.clean, 1 / 6)


def test_the_short_way_of_lda_names_what_scikit_learns_does_on_the_same_draws():
    """Uneven classes and noise, held-out trials, noise from none to much."""
    codes = np.concatenate([make_bumps(width=9.0), make_bumps((22, 33, 44), 3.0)])
    codes *= np.random.default_rng(0).uniform(0.5, 2, (9, 3, 1))
    labels, kept = np.array([*"abcdef", *"abc"]), slice(None, None, 2)
    options = {"ratios": (0.0, 0.3, 1.0, 3.0), "held_out": (codes[kept], labels[kept]), **FEW}
    steps = PrincipalComponents(12), LinearDiscriminantAnalysis(tol=1.00001e-4)
    ours, theirs = (
        compute_sweep(codes, labels, estimator=one, **options)
        for one in (make_lda(12), make_pipeline(*steps))
    )
    assert 0.3 < ours.noisy.min() < 0.9
    for name in ("noisy", "hits", "confusion"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), name)
    for name in ("kept_noisy", "kept_clean"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), rtol=1e-9)


def test_threads_do_not_change_the_numbers():
    options = {"ratios": (1.5,), "estimator": make_lda(12), **FEW}
    a, b = (compute_sweep(make_bumps(), np.arange(6), n_jobs=n, **options) for n in (1, 3))
    np.testing.assert_array_equal(a.noisy, b.noisy)
    np.testing.assert_array_equal(a.confusion, b.confusion)


def test_equal_seeds_give_equal_sweeps_and_others_do_not():
    options = {"ratios": (1.5,), "estimator": make_lda(12), **FEW}
    a, b, c = (
        compute_sweep(make_bumps(), np.arange(6), random_state=s, **options) for s in (1, 1, 2)
    )
    np.testing.assert_array_equal(a.confusion, b.confusion)
    assert (a.confusion != c.confusion).any()


class Memory(ClassifierMixin, BaseEstimator):
    """Remembers what it was fitted on and notes how much of what it is asked was in it: a leak from
    train to test.
    """

    leaks: ClassVar[list[bool]] = []

    def fit(self, X, y):
        self.seen_ = {row.tobytes() for row in X}
        self.classes_ = np.unique(y)
        return self

    def predict(self, X):
        self.leaks.append(any(row.tobytes() in self.seen_ for row in X))
        return np.repeat(self.classes_[0], len(X))


def test_no_test_copy_was_seen_in_training():
    Memory.leaks.clear()
    compute_sweep(make_bumps(), np.arange(6), ratios=(0.1,), estimator=Memory(), **FEW)
    assert (
        Memory.leaks == [False] * 2 * FEW["n_repeats"]
    )  # noisy copies, and the clean originals


def test_confusion_counts_every_test_copy_and_gives_the_accuracy():
    sweep = compute_sweep(
        make_bumps(), np.arange(6), ratios=(0.5, 3.0), estimator=make_lda(12), **FEW
    )
    np.testing.assert_array_equal(sweep.confusion.sum(axis=(1, 2)), 6 * 4 * 3)
    np.testing.assert_allclose(np.nanmean(sweep.recall, axis=1), sweep.noisy.mean(axis=1))
    assert "variance kept" in sweep.table() and "chance 16.7 %" in sweep.table()


def test_noise_before_encoding_reaches_the_encoder():
    tensors = make_bumps(n_sensors=5)
    seen = []

    def total(noisy):
        seen.append(len(noisy))
        return noisy.sum(axis=1, keepdims=True)

    sweep = compute_sweep(
        tensors, np.arange(6), ratios=(0.1,), encode=total, estimator=make_lda(12), **FEW
    )
    assert seen == [24, 24, 6] * 3 and sweep.noisy.mean() == 1


@pytest.mark.parametrize("n_trials", [40, 120])  # of the second, by Lanczos' method
def test_variance_kept_agrees_with_scikit_learn(n_trials):
    X = np.random.default_rng(0).normal(size=(n_trials, 190))
    for rows in (X, X.T):
        ours, theirs = PrincipalComponents(7).fit(rows), PCA(7, svd_solver="full").fit(rows)
        np.testing.assert_allclose(
            ours.explained_variance_ratio_, theirs.explained_variance_ratio_, rtol=1e-9
        )
        np.testing.assert_allclose(
            np.abs(ours.transform(rows)), np.abs(theirs.transform(rows)), atol=1e-9
        )


@pytest.mark.parametrize("rotate", [False, True])
@pytest.mark.parametrize(("components", "share"), [(1, 9 / 14), (2, 13 / 14), (3, 1.0)])
def test_variance_kept_is_that_of_the_longest_axes(rotate, components, share):
    """Six codes at ± 3, 2, 1 on three axes have variances as 9 : 4 : 1."""
    codes = np.kron(np.diag([3.0, 2.0, 1.0]), [[1.0], [-1.0]])[:, :, None]
    sweep = compute_sweep(
        codes,
        np.arange(6),
        ratios=(1e-7,),
        noise=Relative(each="tensor"),
        estimator=make_lda(components),
        rotate=rotate,
        **FEW,
    )
    np.testing.assert_allclose([sweep.kept_noisy, sweep.kept_clean], share, rtol=1e-5)


def test_leaving_out_a_size_tests_on_that_size_only():
    codes = np.concatenate([make_bumps(), 3 * make_bumps()])
    labels, sizes = np.tile(np.arange(6), 2), np.repeat([1.5, 3.0], 6)
    sweeps = compute_left_out(
        codes, labels, sizes, ratios=(0.05,), estimator=make_lda(12), **FEW
    )
    assert list(sweeps) == [1.5, 3.0]
    codes[6:] = codes[:6][
        ::-1
    ]  # the large ones now look like other small ones: unseen sizes are all wrong
    wrong = compute_left_out(
        codes, labels, sizes, ratios=(0.05,), estimator=make_lda(12), **FEW
    )
    assert (
        sweeps[3.0].clean.mean() > 0.9
        and wrong[3.0].clean.mean() == 0
        and wrong[1.5].clean.mean() == 0
    )


def make_trials():
    return [
        Trial(feature=Ball(radius=1.5), location=place, speed=0.06) for place in (0.2, 0.5, 0.8)
    ]


def jitter(**by):
    return compute_jittered(BUMPS, np.arange(6), make_trials() * 2, simulate_bumps, **by)


def simulate_bumps(trials):
    return make_bumps(places=[100 * trial.location for trial in trials])


@pytest.mark.parametrize(("jitter", "right"), [(0.01, True), (0.9, False)])
def test_jittered_touches_are_recognised_while_the_jitter_is_small(jitter, right):
    trials = make_trials()
    sweep = compute_jittered(
        simulate_bumps(trials), list("abc"), trials, simulate_bumps,
        location=min(jitter, 0.19), n_each=5, ratios=(0.05,), estimator=make_lda(9), **FEW,
    )  # fmt: skip
    assert (sweep.clean.mean() > 0.95) == right


def test_peak_baseline_finds_the_peak():
    tensors = np.zeros((2, 10, 20))
    tensors[0, 3, 4], tensors[1, 9, 19] = 1, 1
    peaks = PeakEncoder()(tensors)[:, :, 0]
    assert np.abs(peaks - [[3.5 / 10, 4.5 / 20], [9.5 / 10, 19.5 / 20]]).max() <= 0.05
    assert np.abs(peaks - [[3.5 / 10, 4.5 / 20], [9.5 / 10, 19.5 / 20]]).max() > 0


BUMPS = make_bumps()


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: compute_sweep(BUMPS, ["a"] * 6), "only one class"),
        (lambda: compute_sweep(BUMPS, np.arange(5)), "6 tensors but 5 labels; give one"),
        (
            lambda: compute_sweep(BUMPS, np.arange(6), ratios=(-0.1,)),
            "Relative.size must be ≥ 0",
        ),
        (lambda: compute_sweep(BUMPS[0], np.arange(6)), r"\(trial, vector, time\), got shape"),
        (lambda: compute_sweep([BUMPS[0], BUMPS[0, :, :9]], [0, 1]), "do not form one array"),
        (lambda: compute_sweep(BUMPS * np.nan, np.arange(6)), "NaN"),
        (lambda: compute_sweep(BUMPS, np.arange(6), rotate=True), "rotate needs"),
        (
            lambda: compute_sweep(BUMPS, np.arange(6), held_out=(BUMPS, np.arange(1, 7))),
            "held-out classes 6",
        ),
        (
            lambda: compute_sweep(BUMPS, np.arange(6), held_out=(BUMPS[:, :1], np.arange(6))),
            "held-out trials have",
        ),
        (lambda: compute_sweep(BUMPS, np.arange(6), ratios=()), "ratios must be 1 or more"),
        (
            lambda: compute_sweep(BUMPS, np.arange(6), estimator=make_lda(0)),
            "n_components must be at least 1; got 0",
        ),
        (
            lambda: compute_sweep(BUMPS, np.arange(6), encode=lambda t: t[:5], n_copies=2),
            "12 tensors but 5 codes from encode",
        ),
        (lambda: compute_left_out(BUMPS, np.arange(6), [1] * 6), "belong to one group"),
        (lambda: jitter(location=-1), "location must be finite and ≥ 0"),
        (lambda: jitter(location=1.0), "location must be < 1"),
        (lambda: jitter(speed=1.0), "speed must be < 1"),
    ],
)
def test_bad_input_is_refused(call, message):
    with pytest.raises(InvalidInput, match=message):
        call()
