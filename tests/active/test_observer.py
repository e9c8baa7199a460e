"""The ideal observer is Bayes, knows what its body did, and learns nothing without contact."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import softmax
from scipy.stats import norm

import feeler
from feeler.active import Arena, Observer, TouchTask, film_policy, parse_policy
from feeler.errors import InvalidInput
from feeler.objects import Common, Noise

OBJECTS = [feeler.Ball(radius=1.5), feeler.Box(half_width=3.0, half_height=3.0)]


def make_observer(**changes):
    return Observer(
        TouchTask(
            **{"features": OBJECTS, "pool": 8, "gap": (2.0, 4.0), "duration": 20.0, "seed": 5}
            | changes
        )
    )


@pytest.fixture(scope="module")
def observer():
    return make_observer()


class Proportional(Noise):
    """A noise from outside, of which a bent sensor has more."""

    def sd(self, tensors):
        return self.size * (np.abs(tensors) + 0.05)


def compute_posterior(felt, known, noise):
    """By scipy: of each known touch after every sample (sample + 1, touch)."""
    each = [norm(one, noise.sd(one)).logpdf(felt).sum(axis=1) for one in known]
    evidence = np.concatenate([np.zeros((len(known), 1)), np.cumsum(each, axis=1)], axis=1)
    return softmax(evidence.T, axis=1)


@pytest.mark.parametrize("noise", [Common(0.05), Proportional(0.5)])
def test_the_observer_is_bayes_for_a_touch_of_one_speed(noise):
    """What the observer believes after each period is the posterior of what ``feeler.touch``
    gives.
    """
    one = make_observer(pool=4, noise=noise)
    members = np.eye(2)[one.label]
    assert np.all(members.sum(axis=0) > 0)
    seen = one.run(parse_policy("fixed:0.3"), copies=2)
    touches = [replace(trial, speed=0.3, lead=trial.lead / 0.3) for trial in one.task.trials]
    angle = feeler.touch(one.task.antenna, touches, duration=21.0, timestep=0.1)["angle"].values
    known = angle[:, :, 1:].transpose(0, 2, 1)
    rng = np.random.default_rng([0, 1])
    drawn = np.concatenate([rng.standard_normal((8, 5, 56)) for _ in range(4)], axis=1)
    for episode in range(8):
        true = known[episode // 2]
        felt = true + noise.sd(true) * drawn[episode]
        expected = compute_posterior(felt, known, noise)[::5] @ members
        np.testing.assert_allclose(seen.belief[:, episode], expected, atol=1e-6)


@pytest.mark.parametrize("noise", ["relative:0.5", "relative:0.5,each=vector"])
def test_a_noise_that_is_silent_before_contact_is_weighed_too(noise):
    seen = make_observer(noise=noise).run(parse_policy("fixed:1.2"), copies=2)
    assert np.isfinite(seen.belief).all()
    assert seen.accuracy[-1] > 0.9 > seen.accuracy[0]


def test_a_noise_that_is_only_drawn_is_weighed_as_gaussian():
    class Dropout(Noise):
        def add(self, tensors, rng, n_copies=1):
            kept = rng.random((n_copies, *np.shape(tensors))) >= self.size
            return (kept * tensors).reshape(-1, *np.shape(tensors)[1:])

    seen = make_observer(noise=Dropout(0.9)).run(parse_policy("fixed:1.2"), copies=4)
    assert seen.hits[-1] == pytest.approx(seen.accuracy[-1], abs=0.15)


def test_without_contact_nothing_is_learnt(observer):
    seen = observer.run(parse_policy("fixed:0"), copies=1)
    np.testing.assert_allclose(
        seen.belief, np.broadcast_to(seen.belief[0], seen.belief.shape), atol=1e-9
    )
    assert seen.work.max() == 0
    assert seen.accuracy[0] == pytest.approx(max(np.bincount(observer.label)) / 8)


def test_what_a_body_expects_to_be_right_is_how_often_it_is(observer):
    seen = observer.run(parse_policy("fixed:1.2"), copies=40)
    assert seen.accuracy[-1] > 0.75
    assert seen.hits == pytest.approx(seen.accuracy, abs=0.05)


def test_bodies_that_have_felt_other_things_move_by_themselves(observer):
    """A steered body believes what an observer believes of that very motion: a policy of time alone
    is the check.
    """
    steered = observer.run(lambda known: 0.6 - 0.48 * known.belief[:, 0], copies=3)
    assert len(np.unique(steered.speed[1:], axis=1).T) > 1
    way = observer.period * steered.speed[1:].sum(axis=0)
    assert steered.work.min() >= 0
    assert way.max() > way.min()
    twin = int(np.flatnonzero((steered.speed == steered.speed[:, :1]).all(axis=0))[-1])
    told = iter([*steered.speed[1:, twin]])
    again = observer.run(lambda known: next(told), copies=3)
    np.testing.assert_allclose(again.belief[:, twin], steered.belief[:, twin], atol=1e-9)


def test_to_look_ahead_changes_nothing_and_standing_still_tells_nothing(observer):
    gains = []

    def watch(known):
        gains.append(known.look([0.0, 1.2], 10.0))
        return 1.2

    seen = observer.run(watch, copies=2)
    plain = observer.run(parse_policy("fixed:1.2"), copies=2)
    np.testing.assert_array_equal(seen.belief, plain.belief)
    assert np.abs(gains[0][:, 0]).max() < 1e-9
    assert np.all(gains[0][:, 1] > 0.1)
    assert np.all(gains[0] <= 1.0)


@pytest.mark.parametrize("copies", [1, 3])
def test_work_is_what_was_done_since_the_beginning(observer, copies):
    """Of each touch by itself, in an arena that does nothing else; not a sum of sums."""
    seen = observer.run(parse_policy("fixed:1.2"), copies)
    arena = Arena(observer.task, len(observer.starts))
    for lane, start in enumerate(observer.starts):
        arena.begin(lane, np.random.default_rng(0), start)
    for row in range(1, len(seen.time)):
        for _ in range(5):
            arena.step(np.tile([1.2, 0.0], (arena.n, 1)))
        np.testing.assert_allclose(seen.work[row], np.repeat(arena.work, copies), rtol=1e-12)
    assert seen.work[-1].max() > seen.work[1].max() > 0


def test_an_observer_that_was_asked_before_answers_as_a_fresh_one(observer):
    """Also with policies that remember: what greedy and learned ones felt before is gone."""
    steered = parse_policy("greedy:10")
    asked = [observer.run(steered, copies=2) for _ in range(2)]
    observer.run(parse_policy("random:0"), copies=1, duration=10.0)
    fresh = make_observer().run(parse_policy("greedy:10"), copies=2)
    for again in (*asked, observer.run(steered, copies=2)):
        for name in ("belief", "speed", "work"):
            np.testing.assert_array_equal(getattr(again, name), getattr(fresh, name))


def test_a_policy_is_told_the_time_that_is_left_of_what_was_asked_for(observer):
    told = []
    observer.run(lambda known: told.append((known.time, known.left)) or 1.2, 1, duration=15.0)
    assert told == [(0.0, 15.0), (5.0, 10.0), (10.0, 5.0)]


def test_bodies_may_feel_some_touches_only(observer):
    some = observer.run(parse_policy("fixed:1.2"), copies=20, touches=[5, 2])
    assert some.target.tolist() == [observer.label[5]] * 20 + [observer.label[2]] * 20
    whole = observer.run(parse_policy("fixed:1.2"), copies=20, touches=range(8))
    np.testing.assert_array_equal(
        whole.belief, observer.run(parse_policy("fixed:1.2"), copies=20).belief
    )


def test_a_greedy_body_learns_more_than_a_random_one(observer):
    greedy, chance = (
        observer.run(parse_policy(name), copies=4) for name in ("greedy:10", "random:3,5")
    )
    assert greedy.accuracy[2] > chance.accuracy[2]


def test_a_film_shows_what_the_observer_believed(observer):
    film = film_policy(observer, parse_policy("fixed:0.6"), touch=3)
    seen = observer.run(parse_policy("fixed:0.6"), copies=1)
    assert film["points"].shape == (20, 141, 2)
    np.testing.assert_array_equal(film["belief"][-1], seen.belief[-1, 3])
    assert np.all(film["speed"] == 0.6)


@pytest.mark.parametrize(
    ("policy", "said"),
    [
        (lambda known: "fast", "gives one speed"),
        (lambda known: np.nan, "all finite"),
        (lambda known: np.zeros(3), "each of the 8"),
    ],
)
def test_a_policy_that_gives_no_speeds_is_named(observer, policy, said):
    with pytest.raises(InvalidInput, match=said):
        observer.run(policy, copies=1)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("hover", "unknown policy 'hover'; valid: fixed"),
        (
            "fixed:fast",
            r"'fixed' takes speed as numbers, got 'fast'\. Write it as in fixed:0\.3",
        ),
        ("fast-then-slow:x", "takes fast, slow, after as numbers, got 'x'"),
        ("nowhere.py:policy", "there is no file nowhere.py"),
    ],
)
def test_what_is_no_policy_is_named(text, said):
    with pytest.raises(InvalidInput, match=said):
        parse_policy(text)


def test_a_policy_of_ones_own_comes_from_a_file(tmp_path, observer):
    path = tmp_path / "mine.py"
    path.write_text("def policy(known):\n    return 0.6\n")
    seen = observer.run(parse_policy(f"{path}:policy"), copies=1)
    np.testing.assert_array_equal(
        seen.belief, observer.run(parse_policy("fixed:0.6"), copies=1).belief
    )
    with pytest.raises(InvalidInput, match="has no function 'other'"):
        parse_policy(f"{path}:other")


@pytest.mark.parametrize("noise", [0.0])
def test_without_noise_there_is_nothing_to_observe(noise):
    with pytest.raises(InvalidInput, match="noise > 0"):
        make_observer(noise=noise)
