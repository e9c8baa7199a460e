"""Active touch with an antenna in space: the same words, and a constant speed is a touch."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import feeler
from feeler.active import FollowTask, Observer, TouchTask
from feeler.active.environment import TouchVectorEnv
from feeler.active.policies import parse_policy
from feeler.errors import InvalidInput
from feeler.tensors.transforms import stack_planes
from tests.active.test_environment import OBJECTS, make_action

pytestmark = pytest.mark.long

FLAT = feeler.Antenna(
    segment_length=np.full(8, 4.0), segment_mass=2e-4, radius=0.3, stiffness=0.3, damping=2.0
)
REST = np.stack([np.zeros(8), np.full(8, 0.02)])
ANTENNA = FLAT.unflatten().replace(rest_angle=REST)


@pytest.mark.parametrize(
    ("azimuth", "way"), [(0.0, (1.0, 0.0)), (90.0, (0.0, 1.0)), ((-60.0, 60.0), None)]
)
def test_the_body_goes_towards_what_stands_around_it(azimuth, way):
    """Against the object's way, across the antenna, towards x or z as the azimuth says."""
    task = make_task(azimuth=azimuth, approach=90.0, antenna=FLAT.unflatten())
    for k, trial in enumerate(task.trials):
        x, y, z = task.make_start(k).direction
        across = np.radians(trial.azimuth)
        expected = (np.cos(across), np.sin(across)) if way is None else way
        np.testing.assert_allclose((-x, -z), expected, atol=1e-12)
        assert y == pytest.approx(0.0, abs=1e-12)
    assert ("azimuth" in task.to_plain()) == (azimuth != 0.0)


OTHERS = (("Touch", False), ("Touch", True), ("Localise", True))


def make_task(**changes):
    fields = {"antenna": ANTENNA, "features": OBJECTS, "pool": 6, "duration": 25.0}
    return TouchTask(**fields | changes)


@pytest.mark.parametrize(
    ("name", "plain"),
    [("Localise", False), *(pytest.param(*other, marks=pytest.mark.long) for other in OTHERS)],
)
def test_gymnasium_finds_nothing_wrong(name, plain):
    fields = {"antenna": ANTENNA, "pool": 6, "render_mode": "rgb_array"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that spaces are in mm and not in [-1, 1]
        made = gymnasium.make(f"feeler/{name}-v0", plain=plain, **fields)
        check_env(made.unwrapped)


def test_a_constant_speed_is_a_touch():
    task, speed, n = make_task(noise=0.0, gap=(4.0, 8.0)), 0.5, 4
    envs = TouchVectorEnv(task, n)
    envs.reset(seed=5)
    met = [start.scene.label for start in envs.arena.starts]
    trials = [next(trial for trial in task.trials if trial.label == label) for label in met]
    felt = [envs.step(make_action(n, speed))[0]["angle"][:, -1] for _ in range(24)]
    touches = [trial.replace(speed=speed, lead=trial.lead / speed) for trial in trials]
    tensors = feeler.touch(ANTENNA, touches, duration=25.0, timestep=task.timestep)
    found = np.stack(felt, axis=2)
    assert found.shape == (4, 16, 24) and np.ptp(found[:, 8:]) > 1e-4
    np.testing.assert_allclose(found, stack_planes(tensors["angle"])[:, :, 1:], atol=1e-9)


def test_a_body_that_turns_has_the_heading_that_it_is_told():
    envs = TouchVectorEnv(make_task(gap=(8.0, 8.0)), 2)
    envs.reset(seed=1)
    for _ in range(5):
        observation = envs.step(make_action(2, 0.0, turn=0.02))[0]
    np.testing.assert_allclose(observation["base"][:, 1], 0.1)
    np.testing.assert_allclose(envs.arena.state.base[:, 5], -0.1, atol=1e-12)


def test_bringing_it_to_its_speed_costs_what_it_costs_in_the_plane():
    works = []
    for antenna in (FLAT, FLAT.unflatten()):
        envs = TouchVectorEnv(make_task(antenna=antenna, gap=(8.0, 8.0)), 1)
        envs.reset(seed=1)
        works.append(envs.step(make_action(1, 0.4, turn=0.01))[4]["work"][0])
    assert works[0] > 0 and works[1] == pytest.approx(works[0], rel=1e-6)


def test_an_observer_knows_touches_in_space():
    found = Observer(make_task()).run(parse_policy("fixed:0.6"), copies=4, duration=20.0)
    assert found.accuracy[-1] > found.accuracy[0]


def test_a_wall_is_followed_in_the_plane_and_says_so():
    with pytest.raises(InvalidInput, match=r"following a wall works in the plane.*flatten"):
        FollowTask(antenna=ANTENNA)
