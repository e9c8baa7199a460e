"""Reading tracks: conventions of DLTdv and generic tables lead to the same motion."""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.tracking import (
    LANDMARKS,
    Tracks,
    compute_antenna_angle,
    load_tracks,
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
