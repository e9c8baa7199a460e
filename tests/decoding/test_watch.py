"""Online novelty detection: early word of what is unlike all that was learned."""

import numpy as np
import pytest

from feeler.decoding.observers import StudentTClassifier
from feeler.decoding.streams import OnlineNoveltyDetector, StreamDecoder
from feeler.errors import InvalidInput

LABELS = [("ball", 0.5), ("ball", 0.9), ("box", 0.5), ("box", 0.9)]
SENSORS, WINDOW = 3, 220


def bend(depth, rate, rng, late=0):
    """A touch (sensor, time): rest, then each sensor bends by its share; robots differ in gain."""
    time = np.maximum(np.arange(WINDOW + 60) - 30.0 - late, 0.0)
    shape = depth * (1 - np.exp(-time * rate))
    gain = np.exp(0.1 * rng.normal(size=(SENSORS, 1)))
    noise = 0.002 * rng.normal(size=(SENSORS, time.size))
    return gain * np.array([[1.0], [0.7], [0.4]]) * shape + noise


def draw(robots, seed, wrong=False):
    """Touches, labels and robots; ``wrong``: deeper and quicker than any that is known."""
    rng = np.random.default_rng(seed)
    ways = [(0.2, 0.02), (0.3, 0.02), (0.2, 0.06), (0.3, 0.06)]
    made = []
    for k in range(robots):
        for label, (depth, rate) in zip(LABELS, ways, strict=True):
            more = (
                (depth * rng.uniform(2, 4), rate * rng.uniform(2, 4))
                if wrong
                else (depth, rate)
            )
            made.append((bend(*more, rng), label, k))
    return tuple(map(list, zip(*made, strict=True)))


@pytest.fixture(scope="module")
def decoder():
    touches, labels, robots = draw(20, 1)
    others, names, _ = draw(10, 2, wrong=True)
    made = StreamDecoder(window=WINDOW).fit(touches, labels)
    return made.watch(touches, labels, robots, (others, [name[1:] for name in names]))


def ever_strange(decoder, touches):
    return [any(state.strange for state in decoder.replay(touch)) for touch in touches]


@pytest.mark.long
def test_known_touches_are_rarely_called_strange_at_any_moment(decoder):
    assert np.mean(ever_strange(decoder, draw(100, 3)[0])) < 0.10


def test_strangers_are_called_so_before_they_are_over(decoder):
    for touch in draw(10, 4, wrong=True)[0]:
        states = decoder.replay(touch)
        first = next(state.since_contact for state in states if state.strange)
        assert first < 120 and not any(
            state.strange for state in states if state.since_contact < 49
        )


def test_before_the_first_moment_and_without_a_watch_nothing_is_said(decoder):
    touches, labels, _ = draw(3, 5)
    for state in decoder.replay(touches[0]):
        assert np.isnan(state.strangeness) == (state.since_contact < 49)
    plain = StreamDecoder(window=WINDOW).fit(touches, labels)
    assert np.isnan([state.strangeness for state in plain.replay(touches[0])]).all()


def test_missing_samples_are_bridged_and_a_dead_channel_is_left_out(decoder):
    """Samples lost around a moment: the moment is asked about with the next sample."""
    touch = draw(1, 6)[0][0]
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
    for sample in draw(1, 7, wrong=True)[0][0].T:
        state = stream.update(sample)
    assert state.strange
    stream.reset()
    assert np.isnan(stream.update(np.zeros(SENSORS)).strangeness)


def test_a_watch_needs_touches_as_long_as_its_first_moment():
    with pytest.raises(InvalidInput, match="touches of 50 samples after contact, got 30"):
        OnlineNoveltyDetector().fit(
            np.zeros((8, SENSORS, 60)), LABELS * 2, [0] * 4 + [1] * 4, most=30
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
