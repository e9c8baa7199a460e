"""Clouds: probabilities as sure as they are right, and touches unlike all that were learned."""

import numpy as np
import pytest
from scripts import load_script

from feeler.decoding.observers import StudentTClassifier, _NoveltyDetector
from feeler.decoding.streams import OnlineNoveltyDetector, StreamDecoder
from feeler.errors import InvalidInput, ModelValidityWarning

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
    with pytest.raises(
        InvalidInput, match=r"clouds need|at least two classes|4 tensors but 3 labels|NaN"
    ):
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


LABELS_WATCH = [("ball", 0.5), ("ball", 0.9), ("box", 0.5), ("box", 0.9)]
SENSORS, WINDOW = 3, 220


def bend(depth, rate, rng, late=0):
    """A touch (sensor, time): rest, then each sensor bends by its share; robots differ in gain."""
    time = np.maximum(np.arange(WINDOW + 60) - 30.0 - late, 0.0)
    shape = depth * (1 - np.exp(-time * rate))
    gain = np.exp(0.1 * rng.normal(size=(SENSORS, 1)))
    noise = 0.002 * rng.normal(size=(SENSORS, time.size))
    return gain * np.array([[1.0], [0.7], [0.4]]) * shape + noise


def draw_watch(robots, seed, wrong=False):
    """Touches, labels and robots; ``wrong``: deeper and quicker than any that is known."""
    rng = np.random.default_rng(seed)
    ways = [(0.2, 0.02), (0.3, 0.02), (0.2, 0.06), (0.3, 0.06)]
    made = []
    for k in range(robots):
        for label, (depth, rate) in zip(LABELS_WATCH, ways, strict=True):
            more = (
                (depth * rng.uniform(2, 4), rate * rng.uniform(2, 4))
                if wrong
                else (depth, rate)
            )
            made.append((bend(*more, rng), label, k))
    return tuple(map(list, zip(*made, strict=True)))


@pytest.fixture(scope="module")
def decoder():
    touches, labels, robots = draw_watch(20, 1)
    others, names, _ = draw_watch(10, 2, wrong=True)
    made = StreamDecoder(window=WINDOW).fit(touches, labels)
    return made.watch(touches, labels, robots, (others, [name[1:] for name in names]))


def ever_strange(decoder, touches):
    return [any(state.strange for state in decoder.replay(touch)) for touch in touches]


@pytest.mark.long
def test_known_touches_are_rarely_called_strange_at_any_moment(decoder):
    assert np.mean(ever_strange(decoder, draw_watch(100, 3)[0])) < 0.10


def test_strangers_are_called_so_before_they_are_over(decoder):
    for touch in draw_watch(10, 4, wrong=True)[0]:
        states = decoder.replay(touch)
        first = next(state.since_contact for state in states if state.strange)
        early = [state.strange for state in states if state.since_contact < 49]
        assert first < 120 and (not any(early) or np.abs(touch).max() > decoder.reach_)


def test_before_the_first_moment_and_without_a_watch_nothing_is_said(decoder):
    touches, labels, _ = draw_watch(3, 5)
    for state in decoder.replay(touches[0]):
        assert np.isnan(state.strangeness) == (state.since_contact < 49)
    plain = StreamDecoder(window=WINDOW).fit(touches, labels)
    assert np.isnan([state.strangeness for state in plain.replay(touches[0])]).all()


@pytest.mark.parametrize("watched", [True, False])
def test_degrees_taken_for_radians_are_like_no_touch_that_was_learned(decoder, watched):
    touches, labels, _ = draw_watch(3, 5)
    used = decoder if watched else StreamDecoder(window=WINDOW).fit(touches, labels)
    with pytest.warns(ModelValidityWarning, match="are they in rad") as said:
        states = used.replay(np.rad2deg(touches[0]))
    assert len(said) == 1
    assert states[-1].strange and states[-1].state != "decided"
    assert not any(state.strange for state in used.replay(touches[0]))
    stream = used.start()
    with pytest.warns(ModelValidityWarning):
        for sample in np.rad2deg(touches[0]).T:
            stream.update(sample)
    stream.reset()  # nothing of it is left for the next touch
    assert not any(stream.update(sample).strange for sample in touches[0].T)


def test_missing_samples_are_bridged_and_a_dead_channel_is_left_out(decoder):
    """Samples lost around a moment: the moment is asked about with the next sample."""
    touch = draw_watch(1, 6)[0][0]
    time = np.arange(touch.shape[1], dtype=float)
    kept = np.ones(time.size, dtype=bool)
    kept[75:90] = False
    whole = decoder.replay(touch)[-1].strangeness
    lost = decoder.replay(touch[:, kept], time[kept])
    assert lost[-1].strangeness == pytest.approx(whole, rel=0.5)
    assert next(state for state in lost if state.since_contact >= 49).strangeness < 1
    touch[2] = np.nan
    assert decoder.replay(touch)[-1].strangeness == pytest.approx(whole, rel=0.7)


def test_a_new_contact_begins_without_the_last_ones_word(decoder):
    stream = decoder.start()
    for sample in draw_watch(1, 7, wrong=True)[0][0].T:
        state = stream.update(sample)
    assert state.strange
    stream.reset()
    assert np.isnan(stream.update(np.zeros(SENSORS)).strangeness)


def test_a_watch_needs_touches_as_long_as_its_first_moment():
    with pytest.raises(InvalidInput, match="touches of 50 samples after contact, got 30"):
        OnlineNoveltyDetector().fit(
            np.zeros((8, SENSORS, 60)), LABELS_WATCH * 2, [0] * 4 + [1] * 4, most=30
        )


def test_strangers_that_were_shown_are_found_where_distance_alone_is_blind():
    """Robots differ most along one direction, strangers along another, by less than that."""
    rng = np.random.default_rng(0)
    along = rng.normal(size=(2, SENSORS, 40)) / 10

    def make(n, robot, strange):
        sizes = np.stack([robot * rng.normal(size=n), strange * rng.normal(size=n)], axis=1)
        return np.einsum("nk,kst->nst", sizes, along) + 0.05 * rng.normal(size=(n, SENSORS, 40))

    known = np.concatenate([make(100, 3.0, 0.0), make(100, 3.0, 0.0) + 5.0])
    labels = [("ball", 1.0)] * 100 + [("box", 1.0)] * 100
    others, fresh = make(100, 3.0, 0.25), make(200, 3.0, 0.25)
    groups = np.tile(np.arange(100), 2)
    blind = StudentTClassifier(step=4).fit(known, labels, groups)
    shown = StudentTClassifier(step=4).fit(known, labels, groups, (others, [1.0] * 100))
    share = [np.mean(one.measure_strangeness(fresh) > 1) for one in (blind, shown)]
    assert share[1] > share[0] + 0.1
    again = np.mean(shown.measure_strangeness(make(300, 3.0, 0.0)) > 1)
    assert again < 0.12
    assert np.nanmean(shown.held_out_ > 1) == pytest.approx(0.05, abs=0.01)
