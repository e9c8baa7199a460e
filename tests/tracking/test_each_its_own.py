"""Of several animals, landmarks, cameras and sides each keeps what is its own, and what is said of
a tracker's file has its numbers.
"""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.tracking import (
    Tracks,
    compute_antenna_angle,
    load_tracks,
    measure_posture,
    tracks,
)
from feeler.tracking.trackers import Found

NAMES = ("nose", "left_tip", "elbow")


def make_found(axes=2, n=4, **more):
    """Places that say which frame, landmark and axis they are of."""
    frame, landmark, axis = np.meshgrid(
        np.arange(n), np.arange(3), np.arange(axes), indexing="ij"
    )
    position = 100.0 * frame + 10.0 * landmark + axis + 1.0
    return Found(
        names=NAMES, position=position, **{"frame_rate": 250.0, "software": "x"} | more
    )


@pytest.fixture
def read(monkeypatch):
    """``load_tracks`` of what a tracker's file holds."""

    def load(found, **how):
        asked = []
        monkeypatch.setattr(
            tracks, "_read_tracker", lambda path, individual: asked.append(individual) or found
        )
        loaded = load_tracks("folder/film.h5", **how)
        assert asked == [how.get("individual")]
        return loaded

    return load


@pytest.mark.parametrize(("origin", "sign"), [("top-left", -1.0), ("bottom-left", 1.0)])
def test_the_first_pixel_is_taken_from_every_axis_and_y_is_turned_in_pictures_alone(
    read, origin, sign
):
    flat = read(make_found(), origin=origin, first_pixel=1.5, individual="b")
    np.testing.assert_array_equal(
        flat.position, (make_found().position - 1.5) * np.array([1.0, sign])
    )
    for plane, axes in (("xz", [0, 2]), ("yz", [1, 2]), ("space", [0, 1, 2])):
        seen = read(make_found(axes=3), origin=origin, first_pixel=0.5, plane=plane)
        wanted = make_found(axes=3).position[:, :, axes] - 0.5
        np.testing.assert_array_equal(seen.position, wanted)
    assert flat.interval == 4.0 and flat.time.tolist() == [0.0, 4.0, 8.0, 12.0]


def test_landmarks_that_are_chosen_keep_their_own_places_and_doubts(read):
    """A frame as sure as was asked for counts; one that was not seen is not doubted too."""
    likelihood = np.array([[0.9, 0.7, 0.2], [0.9, 0.6, 0.95], [0.1, 0.5, 0.3], [0.9, 0.9, 0.3]])
    found = make_found(likelihood=likelihood)
    found.position[3, 2] = np.nan
    loaded = read(
        found, landmarks=("elbow", "left_tip"), min_likelihood=0.6, origin="bottom-left"
    )
    assert loaded.landmarks == ("elbow", "left_tip")
    assert loaded.doubted == {"elbow": 2, "left_tip": 1}
    seen = np.isfinite(loaded.position).all(axis=2)
    assert seen.tolist() == [[False, True], [True, True], [False, False], [False, True]]
    np.testing.assert_array_equal(loaded.of("elbow")[1], found.position[1, 2])
    named = read(make_found(software="sleap-anipose"), landmarks=("a", "b", "c"))
    assert named.landmarks == ("a", "b", "c")
    with pytest.raises(
        InvalidInput, match="no landmark 'tail'; the tracks hold nose, left_tip"
    ):
        read(make_found(), landmarks=("elbow", "tail"))


@pytest.mark.parametrize(
    ("rate", "given", "interval"), [(250.0, None, 4.0), (250.0, 400.0, 2.5), (2.5, None, 400.0)]
)
def test_a_film_has_the_rate_that_was_given_or_else_its_own(read, rate, given, interval):
    assert read(make_found(frame_rate=rate), frame_rate=given).interval == pytest.approx(
        interval
    )


@pytest.mark.parametrize(
    ("found", "match"),
    [
        ({"frame_rate": 2.0}, r"film\.h5 claims 2 frames/s, which no film"),
        ({"frame_rate": None}, r"film\.h5 does not say how many frames a second"),
        ({"notes": {"clock": "3 gaps"}}, r"film\.h5 has no even clock: 3 gaps"),
    ],
)
def test_a_rate_that_cannot_be_is_asked_for_by_the_file_s_name(read, found, match):
    with pytest.raises(InvalidInput, match=match):
        read(make_found(**found))


def test_a_film_cut_from_the_middle_says_its_first_frame_and_each_animal_has_its_own(tmp_path):
    head = "track,frame_idx,nose.x,nose.y,nose.score,tip.x,tip.y,tip.score"
    rows = [
        ("b", 12, 1), ("a", 11, 2), ("b", 10, 3), ("a", 13, 4), ("b", 13, 5), ("a", 12, 6),
    ]  # fmt: skip
    lines = [f"{t},{f},{k}.0,{k}.1,0.9,{k}.2,{k}.3,0.8" for t, f, k in rows]
    (tmp_path / "s.csv").write_text("\n".join([head, *lines]))
    how = {"frame_rate": 50, "origin": "bottom-left"}
    for animal, first, kept in (("b", 10, [3, np.nan, 1, 5]), ("a", 11, [2, 6, 4])):
        loaded = load_tracks(tmp_path / "s.csv", individual=animal, **how)
        assert loaded.notes["first frame"] == f"{first} of the film"
        np.testing.assert_allclose(loaded.of("tip")[:, 0], np.array(kept) + 0.2)
        np.testing.assert_allclose(loaded.of("nose")[:, 1], np.array(kept) + 0.1)
    with pytest.raises(InvalidInput, match=r"s\.csv has no individual 'c'; choose one of b, a"):
        load_tracks(tmp_path / "s.csv", individual="c", **how)


def test_each_antenna_hangs_on_its_own_base_and_one_that_is_left_out_has_no_angle():
    names = ("left_tip", "right_tip", "head", "abdomen", "lb", "rb")
    places = [[-5.0, 16.0], [9.0, 12.0], [0.0, 10.0], [0.0, 0.0], [-2.0, 12.0], [3.0, 11.0]]
    walk = Tracks(position=np.array([places] * 2), landmarks=names, interval=10.0)
    left, right = compute_antenna_angle(walk, bases=("lb", "rb"))[:, 0]
    assert left == pytest.approx(np.arctan2(3, 4)) and right == pytest.approx(np.arctan2(6, 1))
    one = compute_antenna_angle(walk, tips=("", "right_tip"), bases=("", "rb"))
    assert np.isnan(one[0]).all() and one[1, 0] == pytest.approx(right)


def test_a_posture_has_its_own_joints_pieces_and_units():
    names = ("base", "near", "far", "tip")
    places = np.array([[1.0, 2.0], [3.0, 2.0], [3.0, 5.0], [8.0, 5.0]])
    walk = Tracks(position=np.array([places, places + 1]), landmarks=names, interval=10.0)
    found = measure_posture(walk.scaled(2.0), names)
    assert found["joint"].values.tolist() == ["near", "far"]
    assert found["point"].values.tolist() == [*names]
    np.testing.assert_allclose(found["piece_length"], [1.0, 1.5, 2.5])
    np.testing.assert_allclose(found["heading"][1], [0.0, np.pi / 2, 0.0])
    np.testing.assert_allclose(found["bend"][0], [np.pi / 2, -np.pi / 2])
    np.testing.assert_allclose(found["curvature"][0], [np.pi / 2 / 1.25, -np.pi / 2 / 2.0])
    np.testing.assert_allclose(found["position"][1], (places - places[0]) / 2.0)
    units = [found[name].attrs["units"] for name in ("position", "bend", "curvature", "time")]
    assert units == ["mm", "rad", "1/mm", "ms"]
    back = measure_posture(walk, names[::-1])
    np.testing.assert_allclose(back["bend"][0], [np.pi / 2, -np.pi / 2])
    with pytest.raises(InvalidInput, match=r"at least 3 different landmarks .* got base, tip"):
        measure_posture(walk, ("base", "tip"))


def test_one_frame_that_stretches_a_piece_bends_no_other_frame():
    """Lengths are medians over frames, so that curvature is the bend over what pieces are long."""
    pieces = np.array([[2.0, 0.0], [0.0, 3.0]])
    places = np.concatenate([np.zeros((1, 2)), np.cumsum(pieces, axis=0)])
    position = np.stack([places] * 4 + [9 * places])
    walk = Tracks(position=position, landmarks=NAMES, interval=10.0)
    found = measure_posture(walk, NAMES)
    np.testing.assert_allclose(found["piece_length"], [2.0, 3.0])
    np.testing.assert_allclose(found["curvature"], (np.pi / 2) / 2.5)
