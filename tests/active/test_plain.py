"""Off-the-shelf learners take the plain form as it is."""

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from feeler.active.environment import TASKS, make_env

PLAIN = [
    pytest.param(name.replace("/", "/Plain"), marks=pytest.mark.long if "Wall" in name else ())
    for name in sorted(TASKS)
]


@pytest.mark.further
@pytest.mark.parametrize("name", PLAIN)
def test_a_box_goes_in_and_a_flat_box_comes_out(name):
    env = gymnasium.make(name, repeat=3)
    assert isinstance(env.action_space, gymnasium.spaces.Box) and env.action_space.shape[0] > 2
    assert env.observation_space.shape == (env.reset(seed=0)[0].size,)
    check_env(make_env(name.replace("Plain", ""), plain=True), skip_render_check=True)


def test_one_action_is_held_for_its_milliseconds_and_rewards_add_up():
    """The same touch, by hand in steps of 1 ms."""
    plain = make_env("feeler/Touch-v0", plain=True, repeat=4, span=2.0)
    bare = make_env("feeler/Touch-v0")
    task = bare.unwrapped.task
    seen, _ = plain.reset(seed=3)
    told, _ = bare.reset(seed=3)
    np.testing.assert_allclose(
        seen, gymnasium.spaces.flatten(bare.observation_space, told), 1e-6
    )
    share = np.linspace(-0.5, 0.9, 2 + task.n_outputs)
    seen, reward, *_ = plain.step(share)
    action = share[:2] * [task.max_speed, task.max_turn]
    total = 0.0
    for _ in range(4):
        told, one, *_ = bare.step({"action": action, "prediction": 2.0 * share[2:]})
        total += one
    assert reward == pytest.approx(total, rel=1e-9)
    np.testing.assert_allclose(
        seen, gymnasium.spaces.flatten(bare.observation_space, told), 1e-5
    )


@pytest.mark.parametrize("name", PLAIN)
def test_the_wrappers_of_cleanrls_script_fit(name):
    """As ppo_continuous_action.py stacks them."""
    env = gymnasium.make(name)
    env = gymnasium.wrappers.FlattenObservation(env)
    env = gymnasium.wrappers.RecordEpisodeStatistics(env)
    env = gymnasium.wrappers.ClipAction(env)
    env = gymnasium.wrappers.NormalizeObservation(env)
    env = gymnasium.wrappers.TransformObservation(
        env, lambda seen: np.clip(seen, -10, 10), env.observation_space
    )
    env = gymnasium.wrappers.NormalizeReward(env, gamma=0.99)
    env.reset(seed=1)
    seen, reward, *_ = env.step(3.0 * np.ones(env.action_space.shape))
    assert np.isfinite(seen).all() and np.isfinite(reward)


@pytest.mark.long
def test_stable_baselines3_trains_on_it_as_it_is():
    ppo = pytest.importorskip("stable_baselines3").PPO
    env = gymnasium.make("feeler/PlainTouch-v0")
    model = ppo("MlpPolicy", env, n_steps=32, batch_size=32, n_epochs=1, seed=0, device="cpu")
    model.learn(32)
    action, _ = model.predict(env.reset(seed=0)[0])
    assert env.action_space.contains(action)
