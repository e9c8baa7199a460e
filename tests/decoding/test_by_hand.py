"""Small cases worked out by hand: contact noticed, answers in time, what a null explains, accuracy
by class.
"""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import log_softmax

from feeler.decoding.classifiers import PrincipalComponents
from feeler.decoding.streams import OnsetFinder, StreamDecoder
from feeler.decoding.sweeps import Sweep
from feeler.decoding.transfer import TEMPERATURES, TransferClassifier, align, score_transfer
from feeler.errors import InvalidInput


def make_sweep(noisy, ratios=(0.1, 0.2), n_classes=4, confusion=None):
    noisy = np.asarray(noisy, dtype=float)
    rest = dict.fromkeys(("kept_noisy", "kept_clean"), noisy)
    rest["hits"] = np.ones((*noisy.shape, n_classes), dtype=bool)
    confusion = (
        np.zeros((len(ratios), n_classes, n_classes))
        if confusion is None
        else np.asarray(confusion)
    )
    return Sweep(
        ratios=np.array(ratios),
        classes=np.arange(n_classes),
        noisy=noisy,
        confusion=confusion,
        **rest,
    )


def test_contact_is_noticed_at_the_last_of_so_many_samples_beyond_the_level():
    """The level is the mean of what was seen at rest; a sample at the threshold itself is still
    rest.
    """
    finder = OnsetFinder(onset=1.0, confirm=3, n_sensors=2)
    seen = [
        [5.0, 2.0],
        [5.5, 2.0],
        [6.0, 2.0],
        [8.0, 2.0],
        [5.5, 2.0],
        [5.5, 4.0],
        [5.5, 0.0],
        [5.5, 0.0],
    ]
    noticed = [finder.see(np.array(sample)) for sample in seen]
    assert noticed == [False] * 7 + [True]
    assert finder.level == pytest.approx(
        [(5.0 + 5.5 + 6.0 + 5.5) / 4, 2.0]
    )  # 8.0 was beyond it


def test_a_sensor_that_is_missing_is_left_out_and_comes_in_later():
    finder = OnsetFinder(onset=1.0, confirm=1, n_sensors=2)
    assert not finder.see(np.array([1.0, np.nan]))
    assert not finder.see(np.array([1.0, 9.0]))  # its first value is its level
    assert finder.see(np.array([np.nan, 10.5]))
    assert finder.level == pytest.approx([1.0, 9.0])


def test_the_level_of_long_rest_forgets_what_was_300_samples_ago():
    finder = OnsetFinder(onset=10.0, confirm=1, n_sensors=1)
    for _ in range(1000):
        finder.see(np.zeros(1))
    for _ in range(300):
        finder.see(np.ones(1))
    assert finder.level[0] == pytest.approx(1 - (1 - 1 / 300) ** 300)


def test_accuracy_by_class_counts_rows_and_leaves_out_ratio_0():
    confusion = np.zeros((3, 2, 2))
    confusion[0] = [[9, 0], [0, 9]]
    confusion[1] = [[6, 2], [1, 3]]
    confusion[2] = [[2, 6], [4, 0]]
    sweep = make_sweep(
        np.zeros((3, 1)), ratios=(0.0, 0.1, 0.2), n_classes=2, confusion=confusion
    )
    np.testing.assert_allclose(sweep.recall, [[1, 1], [0.75, 0.75], [0.25, 0]])
    np.testing.assert_allclose(sweep.area, [0.5, 0.375])
    assert sweep.chance == 0.5
    only = make_sweep(np.zeros((1, 1)), ratios=(0.0,), n_classes=2, confusion=confusion[:1])
    np.testing.assert_allclose(only.area, [1, 1])
    confusion[1, 1] = 0
    np.testing.assert_array_equal(
        np.isnan(sweep.recall), [[False, False], [False, True], [False, False]]
    )


@pytest.mark.parametrize(("since", "known"), [(-1, False), (0, True), (5, True)])
def test_a_touch_is_decided_from_its_first_sample_of_contact_on(monkeypatch, since, known):
    decoder = StreamDecoder()
    decoder.classes_, decoder.n_sensors_ = ["a", "b"], 2
    state = SimpleNamespace(since_contact=since, posterior=np.array([0.25, 0.75]))
    monkeypatch.setattr(StreamDecoder, "replay", lambda *_: [state])
    np.testing.assert_array_equal(
        decoder.decide([np.zeros((2, 9))]), [[0.25, 0.75] if known else [np.nan, np.nan]]
    )


def test_tensors_of_nothing_but_zeros_are_not_divided_by_zero():
    found = TransferClassifier().fit(np.zeros((2, 2, 30)), [("a", 0.5, 0.1), ("b", 0.5, 0.1)])
    assert found.scale_ == 1.0 and np.isfinite(found.copies_).all()


def test_a_tempered_classifier_has_the_temperature_of_the_greatest_likelihood():
    rng = np.random.default_rng(1)
    tensors = np.cumsum(rng.normal(size=(3, 2, 30)), axis=2)
    labels = [("a", 0.5, 0.1), ("b", 0.5, 0.1), ("b", 0.6, 0.1)]
    classifier = TransferClassifier(random_state=2).fit(tensors, labels)
    test = np.repeat(tensors, 4, axis=0) + 2.0 * rng.normal(size=(12, 2, 30))
    true = [label for label in labels for _ in range(4)]
    votes, number = classifier.decide(test), np.repeat([0, 1, 2], 4)
    found = classifier.temper(test, true).temperature_

    def score(t):
        return log_softmax(votes / t, axis=1)[np.arange(12), number].mean()

    assert score(found) == max(score(t) for t in TEMPERATURES)
    silent, strange = (
        np.full((1, 2, 30), np.nan),
        (
            "c",
            0.5,
            0.1,
        ),
    )  # of no contact, and of no class: left out
    more = classifier.temper(
        np.concatenate([test, silent, test[:1]]), [*true, labels[0], strange]
    )
    assert more.temperature_ == found
    for wrong in (true[:-1], [strange] * len(true)):
        with pytest.raises(InvalidInput, match="temper needs touches with contact"):
            classifier.temper(test, wrong)
    expected = np.exp(votes / found) / np.exp(votes / found).sum(axis=1, keepdims=True)
    np.testing.assert_allclose(classifier.predict_proba(test), expected)
    scored = score_transfer(classifier, test, true)
    best = np.argsort(-votes, axis=1)
    assert (
        scored.correct["all"]
        == (best[:, 0] == number).sum()
        == round(12 * classifier.score(test, true))
    )
    assert scored.correct["top2"] == (best[:, :2] == number[:, None]).any(axis=1).sum()
    assert scored.share("top2")[0] == pytest.approx(scored.correct["top2"] / 12)


@pytest.mark.parametrize("touch", [np.ones((3, 9)), np.ones(9), np.ones((2, 8))])
def test_a_touch_of_another_shape_than_the_first_is_named(touch):
    with pytest.raises(InvalidInput, match="touch 1 has shape"):
        align([np.ones((2, 9)), touch], [np.ones(9)] * 2)


@pytest.mark.parametrize("n_entries", [11, 300])
@pytest.mark.parametrize("repeats", [1, 3])
def test_what_rounding_leaves_is_no_component(n_entries, repeats):
    """Five trials span four directions about their mean, however often each is repeated."""
    trials = np.repeat(np.random.default_rng(3).normal(size=(5, n_entries)), repeats, axis=0)
    found = PrincipalComponents(5).fit(trials)
    assert found.components_.shape == (4, n_entries)
    assert found.explained_variance_ratio_.sum() == pytest.approx(1)
    flat = PrincipalComponents(2).fit(np.ones((4, n_entries)))
    np.testing.assert_array_equal(flat.transform(np.ones((3, n_entries))), np.zeros((3, 1)))
