"""Base motion: a path is smooth, its mirror image is one, and plain data makes it again."""

import copy

import numpy as np
import pytest

from feeler import Ball, BaseMotion, Trial
from feeler.errors import InvalidInput

TIME = np.linspace(0, 100, 23)
POSE = np.stack(
    [0.1 * TIME + np.sin(TIME / 9), np.cos(TIME / 7), 0.3 + 0.2 * np.sin(TIME / 11)], axis=1
)
MOTIONS = [BaseMotion(velocity=(0.1, -0.2), turn=0.003), BaseMotion(time=TIME, pose=POSE)]
FOUR = [0, 1, 2, 3]


def test_a_path_goes_through_its_poses():
    np.testing.assert_allclose(MOTIONS[1].compute_pose(TIME), POSE, atol=1e-12)
    with pytest.raises(InvalidInput, match="path ends at 100 ms, but 101 ms are asked for"):
        MOTIONS[1].compute_pose(np.array([101.0]))


def test_a_path_has_no_jump_in_its_acceleration():
    time, step = np.linspace(1, 99, 4001), 0.02
    pose = [MOTIONS[1].compute_pose(time + shift) for shift in (-step, 0.0, step)]
    acceleration = (pose[0] - 2 * pose[1] + pose[2]) / step**2
    assert np.abs(np.diff(acceleration, axis=0)).max() < 1e-3


@pytest.mark.parametrize("motion", MOTIONS)
def test_the_mirror_image_moves_the_other_way_across(motion):
    np.testing.assert_allclose(
        motion.mirror().compute_pose(TIME), motion.compute_pose(TIME) * [-1, 1, -1], atol=1e-12
    )
    assert motion.mirror().mirror() == motion


@pytest.mark.parametrize("motion", MOTIONS)
def test_plain_data_and_copies_give_the_motion_back(motion):
    motion.compute_pose(np.array([3.0]))
    assert BaseMotion(**motion.to_plain()) == motion == copy.deepcopy(motion)
    trial = Trial(feature=Ball(radius=1), location=0.5, speed=0.3, base=motion, name="it")
    assert Trial(**trial.to_plain()) == trial
    assert hash(Trial(**trial.to_plain())) == hash(trial)
    assert Trial(**trial.to_plain() | {"side": "right"}).base_motion == motion.mirror()


def test_no_motion_is_none():
    assert (
        Trial(feature=Ball(radius=1), location=0.5, speed=0.3, base=BaseMotion()).base is None
    )


@pytest.mark.parametrize(
    ("fields", "match"),
    [
        ({"velocity": (np.nan, 0)}, "velocity must be 2 numbers"),
        ({"velocity": 3}, "velocity must be 2 numbers"),
        ({"turn": "x"}, "turn must be a number or 3 numbers, got 'x'"),
        ({"time": [0, 1, 1, 2], "pose": np.zeros((4, 3))}, "must rise from 0 ms"),
        ({"time": [0], "pose": [[0, 0, 0]]}, "at least four samples"),
        ({"time": FOUR, "pose": [[0, 0, 0]]}, "at least four samples"),
        ({"time": FOUR, "pose": "path"}, "must be an array of numbers"),
        ({"time": FOUR, "pose": np.full((4, 3), np.inf)}, "must be finite"),
        ({"time": FOUR, "pose": np.zeros((4, 3)), "turn": 0.1}, "not both"),
    ],
)
def test_what_is_no_motion_is_refused(fields, match):
    with pytest.raises(InvalidInput, match=match):
        BaseMotion(**fields)


@pytest.mark.parametrize("base", [3, {"speed": 1}, "walk"])
def test_a_trial_refuses_what_is_no_base_motion(base):
    with pytest.raises(InvalidInput, match=r"[Bb]ase"):
        Trial(feature=Ball(radius=1), location=0.5, speed=0.3, base=base)
