"""Transfer: alignment, noisy copies, one-versus-one votes and scores obey their definitions."""

import numpy as np
import pytest
from sklearn.svm import SVC

from feeler.decoding.transfer import (
    NO_CONTACT,
    TransferClassifier,
    TransferScore,
    align,
    find_first_peak,
    score_transfer,
)
from feeler.errors import InvalidInput


def _bump(centre, n=400, width=30.0, height=10.0):
    return height * np.exp(-(((np.arange(n) - centre) / width) ** 2))


def _set(n_classes=4, noise=0.0, seed=0, n=60):
    """Random smooth tensors (class, 3, n) and labels (feature, location, speed)."""
    rng = np.random.default_rng(seed)
    tensors = np.cumsum(rng.normal(size=(n_classes, 3, n)), axis=2)
    labels = [("ball" if k % 2 else "box", 0.5 + 0.1 * (k // 2), 0.1) for k in range(n_classes)]
    return tensors + noise * rng.normal(size=tensors.shape), labels


def test_first_positive_peak_skips_ripples_and_negative_peaks():
    trace = (
        -_bump(60) + _bump(200) + _bump(300, height=20.0) + _bump(120, width=3.0, height=0.5)
    )
    assert find_first_peak(trace) == 200
    assert find_first_peak(-trace) == 60  # upside down, the first dip is a peak
    assert find_first_peak(np.zeros(100)) == -1
    assert find_first_peak(np.full(100, np.nan)) == -1
    assert find_first_peak(_bump(200, height=0.5)) == -1


def test_a_peak_that_is_too_low_is_none_however_clear_it_is():
    tip = np.zeros(50)
    tip[[10, 30]] = 0.9, 1.2
    assert find_first_peak(tip, min_deflection=1.0, prominence=0.1) == 30
    assert find_first_peak(tip, min_deflection=0.8, prominence=0.1) == 10
    assert find_first_peak(tip, min_deflection=1.2, prominence=0.1) == 30  # at least so high


def test_alignment_undoes_shifts_and_goes_on_at_rest():
    touches = [np.stack([_bump(c), 2 * _bump(c)]) for c in (120, 250, 180)]
    aligned = align(touches, [touch[0] for touch in touches], before=100, after=80)
    assert aligned.shape == (3, 2, 180)
    np.testing.assert_allclose(aligned[1], aligned[0], atol=1e-3)
    assert np.argmax(aligned[2, 0]) == 100
    wide = align(touches[:1], [touches[0][0]], before=300, after=400)
    np.testing.assert_array_equal(wide[0, 0, :180], np.full(180, touches[0][0, 0]))


@pytest.mark.parametrize("n_classes", [2, 5])
def test_votes_equal_scikit_learn_on_the_flat_copies(n_classes):
    tensors, labels = _set(n_classes)
    classifier = TransferClassifier(random_state=3).fit(tensors, labels)
    number = np.array([classifier.classes_.tolist().index(label) for label in labels]).repeat(
        10
    )
    reference = SVC(kernel="linear", decision_function_shape="ovr", break_ties=True).fit(
        classifier.copies_, number
    )
    test = _set(n_classes, noise=2.0, seed=0)[0]
    expected = reference.predict(test.reshape(n_classes, -1) / classifier.scale_)
    assert classifier.predict(test).tolist() == [classifier.classes_[k] for k in expected]
    assert len(reference.n_support_) == n_classes


def test_same_seed_same_votes_and_another_seed_others():
    tensors, labels = _set(noise=1.0)
    test = _set(noise=3.0, seed=1)[0]
    votes = [
        TransferClassifier(random_state=s).fit(tensors, labels).decide(test) for s in (0, 0, 1)
    ]
    np.testing.assert_array_equal(votes[0], votes[1])
    assert np.abs(votes[0] - votes[2]).max() > 0


def test_no_contact_is_an_answer():
    tensors, labels = _set()
    classifier = TransferClassifier().fit(tensors, labels)
    test = tensors.copy()
    test[1] = np.nan
    assert classifier.predict(test)[1] == NO_CONTACT
    assert classifier.predict_top(test, 2)[1] == [NO_CONTACT]
    score = score_transfer(classifier, test, labels)
    assert score.correct["all"] == 3
    counts = score.confusion(classifier.classes_)
    assert counts[classifier.classes_.tolist().index(labels[1]), -1] == 1 and counts.sum() == 4


def test_parts_are_scored_separately():
    tensors, labels = _set()
    classifier = TransferClassifier().fit(tensors, labels)
    claimed = [
        ("ball" if label[0] == "box" else "box", *label[1:]) for label in labels
    ]  # wrong in feature only
    score = score_transfer(classifier, tensors, claimed)
    assert score.correct["all"] == 0 and score.correct["feature"] == 0
    assert score.correct["location"] == score.correct["speed"] == score.total == 4


def share(successes, total):
    """The interval of a score."""
    score = TransferScore(correct={"all": successes}, total=total, predicted=[], true=[])
    return score.share()[1:]


@pytest.mark.parametrize(
    ("successes", "total", "low", "high"),
    [
        (5, 6, 0.4365, 0.9699),
        (0, 10, 0.0, 0.2775),
        (10, 10, 0.7225, 1.0),
        (50, 100, 0.4038, 0.5962),
    ],
)
def test_wilson_interval_known_values(successes, total, low, high):
    assert share(successes, total) == pytest.approx((low, high), abs=1e-4)


@pytest.mark.parametrize("total", range(1, 40))
def test_a_share_of_none_or_all_has_its_end_exactly(total):
    assert share(0, total)[0] == 0.0 and share(total, total)[1] == 1.0


def _fit(X, y=None, **options):
    tensors, labels = _set()
    return TransferClassifier(**options).fit(
        tensors if X is None else X, labels if y is None else y
    )


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda: _fit(np.zeros((4, 5))), "expected tensors or codes .trial, vector, time."),
        (lambda: _fit(np.full((4, 2, 5), np.nan)), "trial.s. 0.* hold NaN"),
        (lambda: _fit(None, [("a", 1, 1)] * 3), "4 tensors but 3 labels"),
        (lambda: _fit(None, [("a", 1, 1)] * 4), "Give at least two classes"),
        (lambda: _fit(None, n_copies=0), "n_copies ≥ 1"),
        (lambda: _fit(None, noise=-0.1), "noise ≥ 0"),
        (
            lambda: _fit(None).predict(np.zeros((1, 3, 7))),
            "learned tensors of 3 sensors × 60 samples",
        ),
        (
            lambda: score_transfer(_fit(None), np.zeros((1, 3, 60)), []),
            "one true label per tensor",
        ),
        (lambda: align([], []), "one tip trace per touch"),
        (lambda: align([np.zeros((2, 9))], [np.zeros(8)]), "touch 0 has shape"),
        (lambda: align([np.zeros((2, 9))], [np.zeros(9)], after=0), "after ≥ 1"),
    ],
)
def test_bad_input(act, message):
    with pytest.raises(InvalidInput, match=message):
        act()
