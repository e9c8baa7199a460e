"""Off-the-shelf learners take the plain form as it is."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from feeler.active.environment import TASKS, TouchVectorEnv, _make_env
from feeler.errors import InvalidInput, ModelValidityWarning

PLAIN = [
    pytest.param(name, marks=pytest.mark.long if "Wall" in name else ())
    for name in sorted(TASKS)
]


@pytest.mark.further
@pytest.mark.parametrize("name", PLAIN)
def test_a_box_goes_in_and_a_flat_box_comes_out(name):
    env = gymnasium.make(name, repeat=3)
    assert isinstance(env.action_space, gymnasium.spaces.Box) and env.action_space.shape[0] > 2
    assert env.observation_space.shape == (env.reset(seed=0)[0].size,)
    check_env(_make_env(name), skip_render_check=True)


def test_one_action_is_held_for_its_milliseconds_and_rewards_add_up():
    """The same touch, by hand in steps of 1 ms."""
    plain = _make_env("feeler/Touch-v0", repeat=4, span=2.0)
    bare = _make_env("feeler/Touch-v0", plain=False)
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


def test_lanes_are_the_single_environments_through_their_ends():
    """Each begins anew with the step after its end, which a body may choose; bit for bit."""
    fields = {"duration": 24.0, "decide": True, "repeat": 5, "pool": 8}
    lanes = gymnasium.make_vec("feeler/Touch-v0", num_envs=3, **fields)
    assert isinstance(lanes.unwrapped, TouchVectorEnv)
    alone = [_make_env("feeler/Touch-v0", **fields) for _ in range(3)]
    seen, _ = lanes.reset(seed=11)
    own = [env.reset(seed=11 + k)[0] for k, env in enumerate(alone)]
    np.testing.assert_array_equal(seen, own)
    ended, rng, ends = [False] * 3, np.random.default_rng(0), 0
    for _ in range(12):
        action = rng.uniform(-1, 1, lanes.action_space.shape)
        action[:, -1] -= 0.6  # decides now and then
        seen, reward, terminated, truncated, info = lanes.step(action)
        for k, env in enumerate(alone):
            if ended[k]:
                found = (env.reset()[0], 0.0, False, False)
            else:
                *found, told = env.step(action[k])
                assert told["prediction"]["loss"] == info["prediction"]["loss"][k]
            np.testing.assert_array_equal(seen[k], found[0])
            assert (reward[k], terminated[k], truncated[k]) == (*found[1:],)
            ended[k] = found[2] or found[3]
            ends += ended[k]
    assert ends >= 4
    with pytest.raises(InvalidInput, match=r"numbers .* \(3, 9\), got \(3, 2\)"):
        lanes.step(np.zeros((3, 2)))


def test_contacts_beyond_the_model_are_named_in_info_and_warned_of_once():
    gentle = {"max_speed": 0.6, "max_turn": 0.01}
    counts = []
    for fields in ({}, gentle):
        envs = gymnasium.make_vec("feeler/Touch-v0", num_envs=32, pool=64, **fields)
        envs.reset(seed=0)
        rng, invalid = np.random.default_rng(0), 0
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            for _ in range(20):
                info = envs.step(rng.uniform(-1, 1, (32, 8)))[-1]
                invalid = max(invalid, int((~info["valid"]).sum()))
        counts.append((invalid, [w.category for w in told]))
    assert counts[0][0] > 1 and counts[0][1] == [ModelValidityWarning]
    assert counts[1] == (0, [])


@pytest.mark.long
def test_stable_baselines3_takes_the_lanes():
    pytest.importorskip("stable_baselines3")
    from stable_baselines3 import PPO
    from stable_baselines3.common.vec_env import VecMonitor, VecNormalize

    from feeler.active.sb3 import TouchVecEnv

    fields = {"duration": 30.0, "pool": 8}
    envs = TouchVecEnv("feeler/Touch-v0", 3, **fields)
    envs.seed(5)
    alone = _make_env("feeler/Touch-v0", **fields)
    first = envs.reset()
    np.testing.assert_array_equal(first[1], alone.reset(seed=6)[0])
    action = np.full((3, 8), 0.25, np.float32)
    for _ in range(3):
        seen, reward, done, infos = envs.step(action)
        last, own, _, cut, _ = alone.step(action[1])
        assert reward[1] == np.float32(own) and done[1] == cut
    assert done.all() and infos[1]["TimeLimit.truncated"]
    np.testing.assert_array_equal(infos[1]["terminal_observation"], last)
    np.testing.assert_array_equal(seen[1], alone.reset()[0])
    model = PPO(
        "MlpPolicy", VecNormalize(VecMonitor(envs)), n_steps=8, batch_size=24, n_epochs=1
    )
    model.learn(24)
    assert np.isfinite(model.predict(seen)[0]).all()
