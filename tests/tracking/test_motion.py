"""A filmed body carries the base of a simulated antenna: its path, its turns, its gaps."""

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene
from feeler.tracking import Tracks, load_tracks, make_base_motion

TIME = np.arange(200) * 5.0


def walk(noise=0.0, turned=0.4):
    """Head and abdomen [mm] of a body that walks an arc, and the pose (frame, 3) of its head."""
    heading = turned + 0.6 * np.sin(2 * np.pi * TIME / 700)
    step = 0.05 * np.gradient(TIME)[:, None] * np.stack([np.sin(heading), np.cos(heading)], 1)
    head = np.cumsum(step, axis=0)
    head += 12.0, 30.0
    abdomen = head - 9.0 * np.stack([np.sin(heading), np.cos(heading)], 1)
    rng = np.random.default_rng(0)
    position = np.stack([head, abdomen], 1) + rng.normal(0, noise, (TIME.size, 2, 2))
    return position, np.column_stack([head, heading])


def make(position, unit="mm"):
    return Tracks(position=position, landmarks=("head", "abdomen"), interval=5.0, unit=unit)


def test_the_filmed_path_comes_back_through_px_gaps_and_noise(tmp_path):
    """From a tracker's picture (y downwards, px) with lost frames; beginning at 0 and up."""
    position, pose = walk(noise=0.02)
    table = (position * (10.0, -10.0) + (0.0, 900.0)).reshape(TIME.size, 4)
    table[[0, 60, 61, 150]] = np.nan
    header = "head_x,head_y,abdomen_x,abdomen_y"
    np.savetxt(tmp_path / "w.csv", table, "%.3f", ",", header=header, comments="")
    tracks = load_tracks(tmp_path / "w.csv", frame_rate=200).scaled(10.0)
    film = make_base_motion(tracks, origin="film")
    np.testing.assert_allclose(film.pose[:, 0], pose[1:, 0], atol=0.1)
    np.testing.assert_allclose(film.pose[:, 1], pose[1:, 1] - 90.0, atol=0.1)
    np.testing.assert_allclose(film.pose[:, 2], pose[1:, 2], atol=0.02)
    first = make_base_motion(tracks)
    assert first.time[0] == 0 and not np.any(first.pose[0])
    np.testing.assert_allclose(
        np.linalg.norm(first.pose[:, :2], axis=1),
        np.linalg.norm(film.pose[:, :2] - film.pose[0, :2], axis=1),
        atol=1e-9,
    )
    turned = make_base_motion(tracks, angle=0.3, origin="film")
    np.testing.assert_allclose(turned.pose[:, 2] - film.pose[:, 2], 0.3, atol=1e-3)
    # a stiff antenna is carried along: its tip is where head and heading say
    antenna = feeler.presets.cockroach("uniform").replace(stiffness=50.0)
    scene = Scene(antenna=antenna, base_motion=first)
    motion = run_scene(scene, Clock(duration=300.0, sample_interval=5.0, timestep=0.05))
    where = first.compute_pose(motion.time)
    np.testing.assert_allclose(motion.base, where, atol=1e-6)


@pytest.mark.parametrize(
    ("change", "options", "match"),
    [
        ("px", {}, r"these tracks are in px.*tracks\.scaled"),
        ("gap", {}, r"lost in frames 50 to 69.*max_gap=20"),
        ("", {"base": "hed"}, "no landmark 'hed'"),
        ("lost", {}, "seen together in 4 frames"),
    ],
)
def test_tracks_that_carry_no_base_say_why(change, options, match):
    position, _ = walk()
    if change == "gap":
        position[50:70, 0] = np.nan
    if change == "lost":
        position[4:, 1] = np.nan
    tracks = make(position, "px" if change == "px" else "mm")
    with pytest.raises(InvalidInput, match=match):
        make_base_motion(tracks, **options)
