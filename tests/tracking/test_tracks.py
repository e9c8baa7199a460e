"""Reading tracks: conventions of DLTdv and generic tables lead to the same motion."""

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Scene
from feeler.tracking import (
    LANDMARKS,
    Tracks,
    compute_antenna_angle,
    load_tracks,
    make_base_motion,
    make_synthetic_tracks,
)
from tests.tracking.dltdv import save_dltdv


def _write_pose(path, points, header, y_sign, offset):
    cells = ",".join(f"{x + offset},{y_sign * y + offset}" for x, y in points)
    path.write_text(f"{header}\n" + f"{cells}\n" * 3)
    return path


# abdomen behind head on the y axis; left antenna 30° to the left, right antenna 45° to the right
POSE = [
    (100 - 50 * np.sin(np.pi / 6), 300 + 50 * np.cos(np.pi / 6)),
    (150.0, 350.0),
    (100.0, 300.0),
    (100.0, 100.0),
]
DLTDV = ",".join(f"pt{i}_cam1_{a}" for i in (1, 2, 3, 4) for a in "XY")
GENERIC = ",".join(f"{name}_{a}" for name in LANDMARKS for a in "xy")


@pytest.mark.parametrize(
    ("header", "origin", "sign", "offset"),
    [
        (DLTDV, "top-left", -1, 1),
        (DLTDV, "bottom-left", 1, 1),
        (GENERIC, "top-left", -1, 0),
        (GENERIC, "bottom-left", 1, 0),
    ],
)
def test_every_convention_gives_the_same_angles(tmp_path, header, origin, sign, offset):
    path = _write_pose(tmp_path / "t.csv", POSE, header, sign, offset)
    tracks = load_tracks(path, frame_rate=30, origin=origin)
    np.testing.assert_allclose(tracks.of("head")[0], POSE[2], atol=1e-9)
    np.testing.assert_allclose(
        compute_antenna_angle(tracks)[:, 0], np.deg2rad([30, 45]), atol=1e-9
    )


def test_wrong_origin_flips_the_sides(tmp_path):
    path = _write_pose(tmp_path / "t.csv", POSE, DLTDV, -1, 1)
    tracks = load_tracks(path, frame_rate=30, origin="bottom-left")
    np.testing.assert_allclose(
        compute_antenna_angle(tracks)[:, 0], -np.deg2rad([30, 45]), atol=1e-9
    )


def test_second_camera_and_own_names(tmp_path):
    header = "pt1_cam1_X,pt1_cam1_Y,pt1_cam2_X,pt1_cam2_Y"
    (tmp_path / "t.csv").write_text(f"{header}\n1,2,3,4\n")
    tracks = load_tracks(
        tmp_path / "t.csv", frame_rate=100, camera=2, landmarks=("nose",), origin="bottom-left"
    )
    np.testing.assert_array_equal(tracks.of("nose"), [[2.0, 3.0]])
    assert tracks.interval == 10.0


def test_round_trip_of_synthetic_tracks_keeps_the_label(tmp_path):
    tracks = make_synthetic_tracks(np.random.default_rng(1), gap_share=0.1, duration=2000.0)
    save_dltdv(tracks, tmp_path / "t_xypts.csv")
    again = load_tracks(tmp_path / "t_xypts.csv", frame_rate=30)
    np.testing.assert_allclose(again.position, tracks.position, atol=6e-4)
    assert again.source == "synthetic"
    assert again.landmarks == LANDMARKS


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("a,b\n1,2\n", {}, "no landmark columns among a, b"),
        ("head_x,tail_y\n1,2\n", {}, "no column head_Y"),
        ("pt1_cam1_X,pt2_cam1_Y\n1,2\n", {}, "no column pt1_cam1_Y"),
        ("pt1_cam1_X,pt1_cam1_Y\n1,2\n", {"camera": 3}, "no column of camera 3"),
        (
            "pt1_cam1_X,pt1_cam1_Y\n1,2\n",
            {"landmarks": ("a", "b")},
            "1 points, landmarks names 2",
        ),
        ("head_x,head_y\n1,2\n", {"landmarks": ("nose",)}, "no column nose_X"),
        (
            "head_x,head_y\n1,2\n",
            {"origin": "middle"},
            "origin must be one of top-left, bottom-left",
        ),
        ("head_x,head_y\n1,2\n", {"frame_rate": 0}, "frame_rate must be > 0"),
        ("head_x,head_y\n1,2\n", {"frame_rate": float("nan")}, "frame_rate must be finite"),
    ],
)
def test_bad_track_files(tmp_path, text, options, message):
    (tmp_path / "t.csv").write_text(text)
    with pytest.raises(InvalidInput, match=message):
        load_tracks(tmp_path / "t.csv", **{"frame_rate": 30, **options})


@pytest.mark.parametrize(
    ("position", "message"),
    [
        (np.zeros((5, 2)), "must be"),
        (np.zeros((5, 2, 2)), "must be"),
        (np.zeros((5, 1, 4)), "must be"),
        (np.full((5, 1, 2), np.inf), "finite"),
    ],
)
def test_bad_positions(position, message):
    with pytest.raises(InvalidInput, match=message):
        Tracks(position=position, landmarks=("head",), interval=10.0)


def test_missing_landmark_lists_names():
    tracks = Tracks(position=np.zeros((5, 1, 2)), landmarks=("nose",), interval=10.0)
    with pytest.raises(InvalidInput, match="no landmark 'head'; the tracks hold nose"):
        compute_antenna_angle(tracks)
    with pytest.raises(InvalidInput, match="interval must be > 0"):
        Tracks(position=np.zeros((5, 1, 2)), landmarks=("nose",), interval=0.0)


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
