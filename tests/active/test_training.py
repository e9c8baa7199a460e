"""A little training already does better than chance moves."""

import numpy as np
import pytest

import feeler
from feeler.active import RecurrentDecoder, TouchTask, record_episodes
from feeler.active.training import Deciders, make_learned, measure_deciders, save_policy, train_policy
from feeler.tensors.models import read_model

pytest.importorskip("sb3_contrib")
OBJECTS = [feeler.Ball(radius=1.0), feeler.Box(half_width=4.0, half_height=4.0)]


@pytest.fixture(scope="module")
def task():
    return TouchTask(features=OBJECTS, pool=64, gap=(4.0, 6.0), locations=0.7, duration=30.0, noise=0.01)


@pytest.fixture(scope="module")
def decoder(task):
    return RecurrentDecoder(task, hidden=16).fit(record_episodes(task, 192, seed=1), passes=12)


def test_a_little_training_does_better_than_chance_moves(task, decoder, tmp_path):
    """Chance moves go back and forth and seldom reach the object: what there is to learn is to go ahead."""
    rng = np.random.default_rng(0)
    model = train_policy(task, decoder, steps=1152, lanes=32)
    _, learned = measure_deciders(task, decoder, make_learned(model), [30.0], n=64)
    _, chance = measure_deciders(task, decoder, lambda seen, begun: rng.uniform(-1, 1, len(seen)), [30.0], n=64)
    assert learned.mean() > chance.mean()
    save_policy(model, tmp_path / "policy.safetensors", {"steps": 1152})
    assert read_model(tmp_path / "policy.safetensors").kind == "RecurrentPPO"


def test_who_stands_still_earns_nothing_to_speak_of(task, decoder):
    _, still = measure_deciders(task, decoder, lambda seen, begun: np.zeros(len(seen)), [30.0], n=32)
    _, ahead = measure_deciders(task, decoder, lambda seen, begun: np.full(len(seen), 0.5), [30.0], n=32)
    assert still.mean() < 0.05 < ahead.mean()


def test_deciders_draw_by_their_seed(task, decoder):
    one, two = Deciders(task, decoder, 2, seed=3), Deciders(task, decoder, 2, seed=3)
    for _ in range(3):
        (seen, reward, _), (other, same, _) = one.step(np.ones(2)), two.step(np.ones(2))
    np.testing.assert_array_equal(seen, other)
    np.testing.assert_array_equal(reward, same)
