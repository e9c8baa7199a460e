"""Environments: a constant speed is a touch, seeds and lanes change no bit, and what does not fit
is named.
"""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import feeler
from feeler.active import Arena, FollowTask, LocaliseTask, TouchTask
from feeler.active.environment import TASKS, TouchEnv, TouchVectorEnv
from feeler.errors import InvalidInput

OBJECTS = [feeler.Ball(radius=1.5), feeler.Box(half_width=3.0, half_height=3.0)]


NAMES = [
    pytest.param(name, marks=pytest.mark.long if "Wall" in name else ())
    for name in sorted(TASKS)
]


def make_task(**changes):
    return TouchTask(**{"features": OBJECTS, "pool": 16, "duration": 30.0} | changes)


def make_action(n, speed, turn=0.0, outputs=2):
    return {"action": np.tile([speed, turn], (n, 1)), "prediction": np.zeros((n, outputs))}


@pytest.mark.further
@pytest.mark.parametrize("name", NAMES)
def test_gymnasium_finds_nothing_wrong(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that spaces are in mm and not in [-1, 1]
        check_env(gymnasium.make(name, plain=False, render_mode="rgb_array").unwrapped)


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=[pytest.mark.long] * ("FollowWall" in name)) for name in TASKS
    ],  # a minute of compiling
)
def test_gymnasium_makes_lanes(name):
    envs = gymnasium.make_vec(name, num_envs=3, plain=False)
    envs.reset(seed=1)
    observation, reward, *_ = envs.step(envs.action_space.sample())
    assert observation["angle"].shape == (3, 5, 56)
    assert np.all(reward <= 0)


def test_a_constant_speed_is_a_touch_bit_for_bit():
    task, speed, n = make_task(noise=0.0, gap=(4.0, 8.0)), 0.5, 4
    envs = TouchVectorEnv(task, n)
    envs.reset(seed=5)
    met = [start.scene.label for start in envs.arena.starts]
    trials = [next(trial for trial in task.trials if trial.label == label) for label in met]
    felt = [envs.step(make_action(n, speed))[0]["angle"][:, -1] for _ in range(29)]
    touches = [
        feeler.Trial(
            feature=t.feature,
            location=t.location,
            speed=speed,
            lead=t.lead / speed,
            approach=t.approach,
            friction=t.friction,
        )
        for t in trials
    ]
    tensors = feeler.touch(task.antenna, touches, duration=30.0, timestep=task.timestep)
    assert np.abs(felt).max() > 0.01
    np.testing.assert_array_equal(np.stack(felt, axis=2), tensors["angle"].values[:, :, 1:])


def test_without_contact_nothing_is_known():
    """What is felt before contact does not depend on the object, so that no prediction of it can be
    rewarded.
    """
    task = make_task(gap=6.0, approach=90.0)
    columns = task.trials.columns["feature"]
    felt = []
    for feature in (0, 1):
        envs = TouchEnv(task)
        envs.reset(seed=3, options={"touch": int(np.flatnonzero(columns == feature)[0])})
        for _ in range(9):
            observation, reward, _, _, info = envs.step(
                {"action": (0.6, 0.01), "prediction": np.zeros(2)}
            )
            assert not info["touching"]
            assert reward == pytest.approx(-np.log(2))
        felt.append(observation)
    for name in felt[0]:
        np.testing.assert_array_equal(felt[0][name], felt[1][name])


def test_a_body_that_speeds_up_does_so_within_its_limit():
    one = TouchEnv(make_task(gap=8.0, acceleration=0.1))
    one.reset(seed=0)
    speeds = [
        one.step({"action": (v, 0.0), "prediction": np.zeros(2)})[0]["base"][2]
        for v in (0.5, 1.0, 1.0, -1.0)
    ]
    np.testing.assert_allclose(speeds, [0.5, 0.6, 0.7, 0.6])


def test_turning_moves_the_body_on_an_arc():
    one = TouchEnv(make_task(gap=8.0, noise=0.0))
    one.reset(seed=0)
    start = one.lanes.arena.starts[0]
    for _ in range(5):
        observation, *_ = one.step({"action": (0.4, 0.02), "prediction": np.zeros(2)})
    base = one.lanes.arena.state.base[0]
    assert observation["base"][:2] == pytest.approx([2.0, 0.1])
    straight = 2.0 * np.array(start.direction)
    assert 0 < np.linalg.norm(base[:2] - straight) < 0.2
    assert base[2] == pytest.approx(0.1)


def test_time_and_work_are_charged():
    one = TouchEnv(make_task(gap=2.0, time_cost=0.5, work_cost=2.0))
    one.reset(seed=0)
    total = 0.0
    for _ in range(20):
        _, reward, _, _, info = one.step({"action": (1.0, 0.0), "prediction": np.zeros(2)})
        total += info["base_reward"]
        assert reward == pytest.approx(info["base_reward"] - info["prediction"]["loss"])
    assert info["work"] > 0
    assert total == pytest.approx(-0.5 * 20 - 2.0 * info["work"])


def test_work_is_never_gained():
    """What an antenna that is slowed down gives back is at most what bringing it to its speed
    took.
    """
    arena = Arena(make_task(gap=8.0, noise=0.0, acceleration=2.0), 2)
    for lane in (0, 1):
        arena.begin(lane, np.random.default_rng(lane))
    works = []
    for k in range(30):
        arena.step(np.array([[0.8, 0.0], [0.8, 0.02]]) if k < 6 else np.zeros((2, 2)))
        works.append(arena.work.copy())
    energy = 0.5e3 * arena.task.antenna.segment_mass.sum() * 0.8**2
    assert works[5][0] == pytest.approx(energy, rel=1e-9)
    assert np.min(works) >= 0


def test_who_decides_ends_the_episode():
    one = TouchEnv(make_task(), decide=True)
    one.reset(seed=0)
    action = {"action": (0.5, 0.0), "prediction": np.zeros(2)}
    assert not one.step(action | {"decide": 0})[2]
    assert one.step(action | {"decide": 1})[2]
    with pytest.raises(InvalidInput, match="the episode has ended"):
        one.step(action | {"decide": 0})


def test_to_know_the_place_costs_nothing_and_its_mean_costs_one():
    task = LocaliseTask(features=OBJECTS, pool=64)
    place = task.trials.columns["location"]
    known, mean = place[:, None], np.full((64, 1), place.mean())
    assert task.compute_loss(known, place).max() == 0
    assert task.compute_loss(mean, place).mean() == pytest.approx(1)


@pytest.mark.long
def test_a_body_that_runs_into_the_wall_has_come_to_its_end():
    one = TouchEnv(FollowTask())
    _, info = one.reset(seed=2)
    start = info["prediction"]["target"]
    for _ in range(200):
        _, reward, terminated, truncated, info = one.step(
            {"action": (0.4, 0.02), "prediction": [start]}
        )
        assert reward <= 0
        if terminated or truncated:
            break
    assert terminated
    assert info["prediction"]["target"] < 1.0 < start


@pytest.mark.parametrize(
    ("action", "said"),
    [
        (
            make_action(2, 1.0) | {"action": np.array([[0.3, 0.0], [9.0, 0.0]])},
            "action of lane 1 is outside the space",
        ),
        (make_action(2, np.nan), "action of lane 0 is outside"),
        (make_action(3, 0.3), r"\(2, 2\); got|finite numbers \(2, 2\)"),
        (
            make_action(2, 0.3, outputs=5),
            r"a prediction is finite numbers \(2, 2\), got \(2, 5\)",
        ),
        (make_action(2, 0.3) | {"prediction": np.array([[0, 0], [0, np.inf]])}, "in lane 1"),
        ({"action": np.zeros((2, 2))}, "an action has the keys action, prediction"),
    ],
)
def test_an_action_outside_the_space_is_named_and_nothing_moves(action, said):
    envs, same = TouchVectorEnv(make_task(), 2), TouchVectorEnv(make_task(), 2)
    for some in (envs, same):
        some.reset(seed=4)
    with pytest.raises(InvalidInput, match=said):
        envs.step(action)
    for _ in range(2):
        after, expected = envs.step(make_action(2, 0.3))[0], same.step(make_action(2, 0.3))[0]
    np.testing.assert_array_equal(after["angle"], expected["angle"])


def test_a_lane_that_diverges_is_truncated_and_says_why():
    task = make_task(gap=2.0)
    envs, same = TouchVectorEnv(task, 2), TouchVectorEnv(task, 2)
    for some in (envs, same):
        some.reset(seed=4)
        some.step(make_action(2, 0.5))
    stepper, lane = envs.arena.simulations._find(1)
    stepper.tables.work[0, :, lane] = np.nan
    after, _, _, truncated, info = envs.step(make_action(2, 0.5))
    assert list(truncated) == [False, True]
    assert "diverged" in info["failed"][1]
    assert np.isfinite(after["angle"]).all()
    np.testing.assert_array_equal(
        after["angle"][0], same.step(make_action(2, 0.5))[0]["angle"][0]
    )
    assert "failed" not in envs.step(make_action(2, 0.5))[-1]


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: TouchTask(features=[]), "there is nothing to touch"),
        (lambda: FollowTask(courses=[]), "there is no wall to follow"),
        (lambda: TouchTask(noise=-1.0), "Common.size must be ≥ 0"),
        (lambda: TouchTask(duration=0.0), "TouchTask.duration must be > 0 ms"),
        (lambda: TouchTask("ball"), "TouchTask.antenna must be an Antenna"),
        (lambda: gymnasium.make("feeler/Touch-v0", colour="red"), "has no .colour."),
        (lambda: TouchEnv(make_task(), render_mode="human"), "render_mode is 'rgb_array'"),
        (lambda: TouchVectorEnv(make_task(), 1).step({}), r"call reset\(\) before"),
    ],
)
def test_what_makes_no_environment_is_named(make, said):
    with pytest.raises(InvalidInput, match=said):
        make()


def test_antennas_are_drawn_too():
    antennas = feeler.sample_antennas(4, stiffness=feeler.LogRange(0.5, 2.0), seed=1)
    task = make_task(antenna=antennas)
    found = {task.make_start(k).scene.antenna.stiffness[0] for k in range(8)}
    assert len(found) == 4


@pytest.mark.parametrize("ended", [False, True])
def test_an_episode_pays_for_its_own_work_alone(ended):
    """The same episode twice, after another one that was left or came to its end: the same
    rewards.
    """
    task = make_task(gap=2.0, work_cost=2.0, duration=12.0)
    used, rewards = TouchVectorEnv(task, 2), []
    used.reset(seed=3)
    for _ in range(12 if ended else 5):
        used.step(make_action(2, 0.9))
    for envs in (used, TouchVectorEnv(task, 2)):
        envs.reset(seed=7)
        steps = [envs.step(make_action(2, 0.6)) for _ in range(6)]
        rewards.append([step[1] for step in steps])
        spent = [step[-1]["work"] for step in steps]
        paid = [step[-1]["base_reward"] for step in steps]
        np.testing.assert_allclose(np.sum(paid, axis=0), -2.0 * spent[-1], rtol=1e-12)
    np.testing.assert_array_equal(*rewards)
