"""A little training already does better than chance moves; practice is the observer where speed
stays; weights move bodies.
"""

import numpy as np
import pytest

import feeler
from feeler.active import Observer, TouchTask, parse_policy
from feeler.active.contests import load_contest
from feeler.active.policies import POLICY_KIND, POLICY_VERSION, make_actor, see
from feeler.errors import InvalidInput
from feeler.tensors.formats import load_model
from studies.active import learning

Practised, practise = learning.Practised, learning.practise

OBJECTS = [feeler.Ball(radius=1.0), feeler.Box(half_width=4.0, half_height=4.0)]
DEADLINE = 30.0


@pytest.fixture(scope="module")
def practice():
    task = TouchTask(
        features=OBJECTS,
        pool=8,
        gap=(4.0, 8.0),
        locations=0.7,
        duration=DEADLINE,
        noise=0.03,
        seed=1,
    )
    return learning.Practice(task)


@pytest.fixture(scope="module")
def model(practice):
    pytest.importorskip("sb3_contrib")
    return learning.train_policy(
        [practice], [DEADLINE], steps=768, groups=8, rollout=12, rate=3e-3
    )


@pytest.mark.long
def test_a_little_training_does_better_than_chance_moves_for_the_exact_observer(
    practice, model
):
    observer, rng = Observer(practice.task, period=5.0), np.random.default_rng(0)
    learned = observer.run(learning.make_trained(model, DEADLINE), copies=4).accuracy[-1]
    chance = observer.run(
        lambda known: rng.choice(observer.menu, len(known.way)), copies=1
    ).accuracy[-1]
    assert learned > chance + 0.05


@pytest.mark.long
def test_stored_weights_do_what_the_trained_model_does(practice, model, tmp_path):
    learning.save_policy(model, tmp_path / "policy.safetensors", {"steps": 768})
    stored = load_model(
        tmp_path / "policy.safetensors", kind=POLICY_KIND, version=POLICY_VERSION
    )
    assert stored.settings["steps"] == 768
    policy, state = make_actor(stored.arrays, DEADLINE), None
    bodies = Practised(practice, DEADLINE, np.random.default_rng(0))
    while bodies.known.left > 0:
        begun = np.full(8, bodies.known.time == 0)
        action, state = model.predict(
            see(bodies.known, DEADLINE), state, begun, deterministic=True
        )
        chosen = policy(bodies.known)
        np.testing.assert_array_equal(chosen, Observer(practice.task).menu[action])
        bodies.step(chosen)


@pytest.mark.further
@pytest.mark.parametrize("seed", load_contest().learning["seeds"])
def test_the_weights_that_are_kept_steer_better_than_a_middling_speed(seed):
    comparison = load_contest(known=12)
    observer = Observer(
        comparison.make_task(feeler.presets.cockroach(), 1), period=comparison.period
    )
    learned = observer.run(parse_policy(f"learned:{seed},50"), copies=1, duration=50.0)
    assert (
        learned.accuracy[-1]
        > observer.run(parse_policy("fixed:0.3"), copies=1, duration=50.0).accuracy[-1]
    )


def test_practice_is_the_observer_where_speed_stays(practice):
    """At one speed nothing is left out but that places are rounded: what is felt is the observer's,
    and so is the accuracy.
    """
    observer = Observer(practice.task)
    row = int(np.flatnonzero(practice.speeds == 0.3)[0])
    felt = []
    seen = observer.run(
        parse_policy("fixed:0.3"), 40, watch=(0, lambda arena: felt.append(arena.felt))
    )
    place = np.rint(0.3 * np.arange(1, DEADLINE + 1) / learning.STEP).astype(int)
    np.testing.assert_allclose(
        practice.felt[row, place], np.array(felt) / practice.task.noise.size, atol=1e-5
    )
    many = np.mean(
        [practise(practice, parse_policy("fixed:0.3"), DEADLINE, seed) for seed in range(40)]
    )
    assert many == pytest.approx(seen.accuracy[-1], abs=0.04)


def test_who_stands_still_in_practice_learns_nothing(practice):
    share = max(np.bincount(practice.label)) / len(practice.label)
    assert practise(practice, parse_policy("fixed:0"), DEADLINE) == pytest.approx(share)


def test_a_policy_of_other_objects_and_seeds_never_trained_are_named(practice):
    bodies = Practised(practice, DEADLINE, np.random.default_rng(0))
    with pytest.raises(InvalidInput, match="no policy was learned with seed 99"):
        parse_policy("learned:99,50")
    arrays = {"lstm_actor.weight_ih_l0": np.zeros((4, 12), np.float32)}
    with pytest.raises(InvalidInput, match="was learned for 6 objects, the task has 2"):
        make_actor(arrays, DEADLINE)(bodies.known)
