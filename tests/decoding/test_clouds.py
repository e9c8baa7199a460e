"""Clouds: probabilities as sure as they are right, and touches unlike all that were learned."""

import numpy as np
import pytest
from scripts import load_script

from feeler.decoding.observers import StudentTClassifier, _NoveltyDetector
from feeler.errors import InvalidInput

reliability = load_script("benchmarks", "reliability")

LABELS = [("ball", 0.5, 0.1), ("ball", 0.9, 0.1), ("box", 0.5, 0.3), ("box", 0.9, 0.3)]
MEANS = np.random.default_rng(0).normal(0, 1, (4, 3, 40))


def draw(n, spread, seed):
    """Touches of ``n`` robots (robot · class): each class's mean, and what differs by robot."""
    rng = np.random.default_rng(seed)
    each = MEANS[None] + spread * rng.normal(size=(n, 4, 3, 40)).cumsum(axis=3) / 5
    return each.reshape(-1, 3, 40), LABELS * n, np.repeat(np.arange(n), 4)


@pytest.fixture(scope="module")
def classifier():
    return StudentTClassifier(step=4).fit(*draw(24, 1.6, 1))


def test_answers_are_as_sure_as_they_are_right_on_robots_held_out():
    classifier = StudentTClassifier(step=4).fit(*draw(24, 5.0, 1))
    values, labels, _ = draw(250, 5.0, 2)
    chance = classifier.predict_proba(values)
    np.testing.assert_allclose(chance.sum(axis=1), 1)
    best = chance.argmax(axis=1)
    right = np.array(
        [classifier.classes_[k] == true for k, true in zip(best, labels, strict=True)]
    )
    assert 0.5 < right.mean() < 0.98  # neither trivial nor hopeless
    assert reliability.measure_calibration(chance.max(axis=1), right)[0] <= 0.05
    assert chance.max(axis=1)[right].mean() > chance.max(axis=1)[~right].mean() + 0.1


def test_strangers_are_called_so_and_known_touches_rarely(classifier):
    values, _, _ = draw(250, 1.6, 3)
    assert np.mean(classifier.measure_strangeness(values) > 1) < 0.10
    rng = np.random.default_rng(4)
    noise = rng.normal(0, 3.0, (100, 3, 40))
    drift = rng.normal(0, 1.5, (100, 3, 40)).cumsum(axis=2)
    other = np.random.default_rng(9).normal(0, 3.0, (1, 3, 40)).repeat(100, axis=0)
    other += 0.1 * rng.normal(size=other.shape)
    for strangers in (noise, drift, other):
        assert np.mean(classifier.measure_strangeness(strangers) > 1) >= 0.95


def test_temperature_and_limit_come_from_groups_held_out():
    """Copies in one group teach nothing about another robot; split as single touches they would."""
    values, labels, groups = draw(8, 1.6, 5)
    copies = [np.repeat(item, 3, axis=0) for item in (values, np.array(labels, object), groups)]
    names = [tuple(label) for label in copies[1]]
    honest = StudentTClassifier(step=4).fit(copies[0], names, copies[2])
    fooled = StudentTClassifier(step=4).fit(copies[0], names)
    assert honest.limit_ > 2 * fooled.limit_


def test_a_touch_cut_short_is_read_by_clouds_of_its_length(classifier):
    values, labels, groups = draw(24, 1.6, 1)
    short = StudentTClassifier(step=4).fit(values[:, :, :20], labels, groups)
    fresh, _, _ = draw(5, 1.6, 6)
    asked = classifier.predict_proba(fresh, 20)
    np.testing.assert_allclose(asked, short.predict_proba(fresh[:, :, :20]), rtol=1e-9)
    changed = fresh.copy()
    changed[:, :, 20:] = 7.0
    np.testing.assert_array_equal(asked, classifier.predict_proba(changed, 20))


def test_no_contact_stays_unknown(classifier):
    silent = np.full((1, 3, 40), np.nan)
    assert np.isnan(classifier.predict_proba(silent)).all()
    assert np.isnan(classifier.measure_strangeness(silent)).all()


@pytest.mark.parametrize(
    ("values", "labels", "groups"),
    [
        (MEANS, LABELS[:3], None),
        (np.full((4, 3, 40), np.nan), LABELS, None),
        (MEANS, LABELS, [0, 0, 0, 0]),
        (MEANS, LABELS[:1] * 4, [0, 1, 2, 3]),
    ],
)
def test_what_makes_no_clouds_is_refused(values, labels, groups):
    with pytest.raises(InvalidInput, match=r"clouds need|at least two classes"):
        StudentTClassifier().fit(values, labels, groups)


def test_the_calibration_error_is_that_of_a_slow_count():
    rng = np.random.default_rng(0)
    said = rng.random(500)
    right = rng.random(500) < said**2
    slow = 0.0
    for k in range(10):
        inside = [i for i in range(500) if k / 10 <= said[i] < (k + 1) / 10]
        slow += abs(sum(right[i] for i in inside) - sum(said[i] for i in inside)) / 500
    assert reliability.measure_calibration(said, right)[0] == pytest.approx(slow)


def test_what_strangers_differ_by_is_not_underestimated_where_kinds_are_many():
    """Each kind's mean takes one degree of freedom: of two of a kind, half."""
    kinds = [kind for kind in range(300) for _ in range(2)]
    places = (
        np.random.default_rng(5).normal(0.0, 3.0, (600, 2)) + 50.0 * np.array(kinds)[:, None]
    )
    assert _NoveltyDetector(places, kinds)._spread.mean() == pytest.approx(9.0, rel=0.1)
