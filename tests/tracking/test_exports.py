"""Tables of other programs hold the same places as a plain table of the same film."""

import json

import h5py
import numpy as np
import pandas as pd
import pytest

from feeler.errors import InvalidInput
from feeler.tracking import load_tracks

N, NAMES = 30, ("head", "tip")
RNG = np.random.default_rng(7)
PLACES = np.round(RNG.uniform(20.0, 300.0, (N, 2, 2)), 2)
SURE = np.round(RNG.uniform(0.7, 1.0, (N, 2)), 2)


def columns(pattern, places=PLACES):
    return {
        pattern.format(name=name, axis=axis, AXIS=axis.upper(), k=k): places[:, k, a]
        for k, name in enumerate(NAMES)
        for a, axis in enumerate("xy")
    }


def write(path, table, **options):
    pd.DataFrame(table).to_csv(path, index=False, **options)
    return path


def write_long(path, **options):
    rows = [
        (n / 50.0, animal, name, *(PLACES[n, k] + shift), SURE[n, k])
        for n in range(N)
        for animal, shift in (("b1", 0.0), ("b2", 500.0))
        for k, name in enumerate(NAMES)
    ]
    names = ["time_s", "individual", "keypoint", "x", "y", "confidence"]
    table = pd.DataFrame(rows, columns=names).sample(frac=1, random_state=1)
    return write(path, table, **options)


@pytest.mark.parametrize(
    "pattern",
    ["{name}_{axis}", "{name}/{AXIS}", "{name}:{axis}", "{AXIS}#{name}", "{AXIS}_{name}"],
)
def test_names_of_columns_in_every_way_of_writing_are_the_same_landmarks(tmp_path, pattern):
    path = write(tmp_path / "t.csv", {"frame": np.arange(N)} | columns(pattern))
    found = load_tracks(path, frame_rate=50)
    assert found.landmarks == NAMES
    np.testing.assert_allclose(found.position, PLACES * [1, -1])


@pytest.mark.parametrize("pattern", ["pose{AXIS}{k}", "{axis}{k}"])
def test_numbered_places_are_landmarks_by_their_numbers(tmp_path, pattern):
    table = {"frame": np.arange(N), "X#wcentroid (cm)": 1.0} | columns(pattern)
    found = load_tracks(write(tmp_path / "t.csv", table), frame_rate=50)
    assert found.landmarks == ("0", "1")
    np.testing.assert_allclose(found.position, PLACES * [1, -1])


def test_a_centroid_in_cm_is_in_mm_and_columns_named_twice_are_read(tmp_path):
    table = pd.DataFrame(
        {"frame": np.arange(N), "X#wcentroid (cm)": PLACES[:, 0, 0], "Y#wcentroid (cm)": 2.0}
    )
    table.insert(3, "frame", np.arange(N), allow_duplicates=True)
    path = tmp_path / "trex.csv"
    table.to_csv(path, index=False)
    found = load_tracks(path, frame_rate=50)
    assert found.landmarks == ("wcentroid",) and found.unit == "mm"
    np.testing.assert_allclose(
        found.position[:, 0], np.stack([PLACES[:, 0, 0], -2 + 0 * SURE[:, 0]], 1) * 10
    )


@pytest.mark.parametrize(
    ("head", "unit", "factor"),
    [
        ("tip_x,tip_y,head_x,head_y", "px", 1),
        ("tip,,head,\nx,y,x,y", "px", 1),
        ("tip_x,tip_y,head_x,head_y\npx,px,px,px", "px", 1),
        ("tip_x,tip_y,head_x,head_y\num,um,um,um", "mm", 1e-3),
        ("tip_x (mm),tip_y (mm),head_x (mm),head_y (mm)", "mm", 1),
    ],
)
def test_headings_of_two_rows_and_units_of_places_mean_what_they_say(
    tmp_path, head, unit, factor
):
    rows = np.random.default_rng(0).uniform(1, 9, (12, 4)).round(3)
    text = "\n".join(",".join(map(str, row)) for row in rows.tolist())
    (tmp_path / "t.csv").write_text(f"{head}\n{text}\n")
    found = load_tracks(tmp_path / "t.csv", frame_rate=100)
    assert found.landmarks == ("tip", "head") and found.unit == unit
    places = rows.reshape(12, 2, 2) * factor * [1, -1]
    np.testing.assert_allclose(found.position, places)


@pytest.mark.parametrize(
    ("head", "words"),
    [
        ("tip_x,tip_y,tip_x,tip_y", "two columns are called 'tip_x', with other numbers"),
        ("tip_x (mm),tip_y (mm),a_x (cm),a_y (cm)", "places are in cm, mm; give all in px"),
        ("tip_x (inch),tip_y (inch),a,b", "places are in inch"),
    ],
)
def test_places_that_two_columns_or_units_claim_are_refused(tmp_path, head, words):
    (tmp_path / "t.csv").write_text(head + "\n1,2,3,4" * 12 + "\n")
    with pytest.raises(InvalidInput, match=words):
        load_tracks(tmp_path / "t.csv", frame_rate=100)


@pytest.mark.parametrize("options", [{}, {"sep": ";", "decimal": ","}])
def test_a_long_table_in_any_order_is_one_animal_at_a_time(tmp_path, options):
    path = write_long(tmp_path / "long.csv", **options)
    with pytest.raises(InvalidInput, match="choose one of b"):
        load_tracks(path)
    for animal, shift in (("b1", 0.0), ("b2", 500.0)):
        found = load_tracks(path, individual=animal)
        order = [found.landmarks.index(name) for name in NAMES]
        np.testing.assert_allclose(found.position[:, order], (PLACES + shift) * [1, -1])
        np.testing.assert_allclose(found.likelihood[:, order], SURE)
        assert found.interval == pytest.approx(20.0) and "b2" in found.notes["animals"]


def test_a_long_table_with_a_landmark_twice_in_a_frame_is_refused(tmp_path):
    table = {"frame": [0, 0], "keypoint": ["tip", "tip"], "x": [1, 2], "y": [3, 4]}
    with pytest.raises(InvalidInput, match="tip is there twice at frame 0"):
        load_tracks(write(tmp_path / "t.csv", table), frame_rate=9)


def test_units_and_clocks_of_a_long_table_are_those_of_its_headings(tmp_path):
    rows = [
        (n, n / 50.0, name, *PLACES[n, k], SURE[n, k])
        for n in range(N)
        for k, name in enumerate(NAMES)
    ]
    for heads in (
        ("frame", "time_s", "bodypart", "x_mm", "y_mm", "Conf"),
        ("row", "Time (s)", "Node", "X [mm]", "Y [mm]", "probability"),
    ):
        path = write(tmp_path / "t.csv", pd.DataFrame(rows, columns=heads))
        found = load_tracks(path)
        assert found.landmarks == NAMES and found.unit == "mm"
        assert found.interval == pytest.approx(20.0)
        np.testing.assert_allclose(found.position, PLACES * [1, -1])
        np.testing.assert_allclose(found.likelihood, SURE)


def test_percent_and_shares_of_the_picture_are_refused(tmp_path):
    table = {"frame": np.arange(N)} | columns("{name}_{axis}")
    sure = {f"{name}_Likelihood": 100 * SURE[:, k] for k, name in enumerate(NAMES)}
    path = write(tmp_path / "t.csv", table | sure)
    with pytest.raises(InvalidInput, match=r"go up to .*Divide them by 100"):
        load_tracks(path, frame_rate=50)
    assert load_tracks(path, frame_rate=50, min_likelihood=0).n_frames == N
    shares = pd.DataFrame(table) / [1, *[2e3] * 4]
    with pytest.raises(InvalidInput, match="between 0 and 1, as shares of a picture's width"):
        load_tracks(write(tmp_path / "s.csv", shares), frame_rate=50)
    metres = shares.rename(
        columns=lambda name: name.replace("_x", "_x_m").replace("_y", "_y_m")
    )
    assert load_tracks(write(tmp_path / "m.csv", metres), frame_rate=50).unit == "mm"


def test_the_middle_of_bonsai_s_rectangle_is_the_place(tmp_path):
    table = {
        f"Item1.RegionOfInterest.{one}": value
        for one, value in (
            ("X", 10.0 + SURE[:, 0]),
            ("Y", 20.0),
            ("Width", 6.0),
            ("Height", 4.0),
        )
    }
    found = load_tracks(write(tmp_path / "b.csv", table), frame_rate=50)
    np.testing.assert_allclose(found.position[:, 0, 0], 13.0 + SURE[:, 0])
    assert (found.position[:, 0, 1] == -22.0).all() and "middles" in found.notes["rectangles"]


def test_motive_s_rigid_bodies_are_in_mm_with_the_frame_rate_of_its_head(tmp_path):
    lines = [
        "Format Version,1.23,Take Name,walk,Capture Frame Rate,120.000000,Length Units,Meters",
        "",
        ",,Rigid Body,Rigid Body,Rigid Body,Marker,Marker,Marker,Marker",
        ",,Name".replace(",,Name", ",Name,A,A,A,m1,m1,m1,m1"),
        ",,id,id,id,id,id,id,id",
        ",,Rotation,Rotation,Rotation,Position,Position,Position,Mean Marker Error",
        "Frame,Time (Seconds),X,Y,Z,X,Y,Z,",
        *(f"{n},{n / 120:.6f},0,0,0,{0.001 * n},0.5,{-0.002 * n},0.1" for n in range(5)),
    ]
    path = tmp_path / "m.csv"
    path.write_text("\n".join(lines) + "\n")
    found = load_tracks(path, plane="space")
    assert found.landmarks == ("m1",) and found.unit == "mm"
    assert found.interval == pytest.approx(1e3 / 120)
    np.testing.assert_allclose(found.position[3, 0], [3.0, 500.0, -6.0])


def test_fictrac_s_path_and_heading_are_two_landmarks(tmp_path):
    rows = np.zeros((N, 25))
    rows[:, 0], rows[:, 21] = np.arange(N), 5.0 * np.arange(N)
    rows[:, 14], rows[:, 15], rows[:, 16] = 0.1 * np.arange(N), 0.3, 0.5
    path = tmp_path / "f.dat"
    np.savetxt(path, rows, delimiter=", ")
    found = load_tracks(path, origin="bottom-left")
    assert found.landmarks == ("body", "ahead") and found.interval == pytest.approx(5.0)
    np.testing.assert_allclose(found.of("body")[:, 0], rows[:, 14])
    ahead = found.of("ahead") - found.of("body")
    np.testing.assert_allclose(np.arctan2(ahead[:, 1], ahead[:, 0]), 0.5)


def test_idtracker_s_trajectories_are_animals_with_one_place(tmp_path):
    with h5py.File(tmp_path / "i.h5", "w") as file:
        file["trajectories"] = PLACES
        file.attrs["frames_per_second"] = 25
    found = load_tracks(tmp_path / "i.h5", individual="2")
    np.testing.assert_allclose(found.of("body"), PLACES[:, 1] * [1, -1])
    assert found.interval == pytest.approx(40.0)


def write_fixed(file, key, values):
    """As pandas writes a frame in fixed form, whose layout PyTables is not needed for."""
    group = file.create_group(key)
    group.attrs.update({"axis0_nlevels": 3, "nblocks": 1, "pandas_type": "frame"})
    levels = (
        np.array([b"sc"]),
        np.array([b"head", b"tip"]),
        np.array([b"likelihood", b"x", b"y"]),
    )
    codes = (np.zeros(6), np.repeat([0, 1], 3), np.tile([1, 2, 0], 2))
    order = np.array([3, 4, 5, 0, 1, 2])  # a block keeps an order of its own
    for k, (level, code) in enumerate(zip(levels, codes, strict=True)):
        group[f"axis0_level{k}"] = group[f"block0_items_level{k}"] = level
        group[f"axis0_label{k}"] = code.astype(np.int8)
        group[f"block0_items_label{k}"] = code[order].astype(np.int8)
    group["axis1"], group["block0_values"] = np.arange(N), values[:, order]


def test_pandas_fixed_form_is_read_and_of_several_datasets_the_taken_one_is_said(tmp_path):
    values = np.hstack([np.column_stack([PLACES[:, k], SURE[:, k]]) for k in (0, 1)])
    with h5py.File(tmp_path / "two.h5", "w") as file:
        write_fixed(file, "cleaned", values)
        write_fixed(file, "later", values + 5.0)
    found = load_tracks(tmp_path / "two.h5", frame_rate=50)
    np.testing.assert_allclose(found.position, PLACES * [1, -1])
    np.testing.assert_allclose(found.likelihood, SURE)
    assert found.notes["dataset"] == "cleaned taken; the file also holds later"


def test_a_sleap_project_gives_predictions_of_each_track_and_labels_where_a_person_set_them(
    tmp_path,
):
    point = [("x", "f8"), ("y", "f8"), ("visible", "?"), ("complete", "?")]
    instance = [
        ("instance_type", "u1"),
        ("track", "i4"),
        ("point_id_start", "u8"),
        ("point_id_end", "u8"),
    ]
    frame = [
        ("video", "u4"),
        ("frame_idx", "u8"),
        ("instance_id_start", "u8"),
        ("instance_id_end", "u8"),
    ]
    with h5py.File(tmp_path / "p.slp", "w") as file:
        about = {
            "skeletons": [{"nodes": [{"id": 1}, {"id": 0}]}],
            "nodes": [{"name": "tip"}, {"name": "head"}],
        }
        file.create_group("metadata").attrs.update(
            {"format_id": 1.2, "json": json.dumps(about)}
        )
        file["tracks_json"] = np.array([b'[0,"f"]', b'[0,"m"]'])
        file["frames"] = np.array([(0, 4, 0, 2), (0, 6, 2, 4)], dtype=frame)
        file["instances"] = np.array(
            [(1, 0, 0, 2), (1, 1, 2, 4), (1, 0, 4, 6), (0, 0, 0, 2)], dtype=instance
        )
        file["pred_points"] = np.array(
            [(10 * k, 10 * k + 1, k != 3, True, 0.8) for k in range(6)],
            dtype=[*point, ("score", "f8")],
        )
        file["points"] = np.array([(7.0, 8.0, True, True), (9.0, 9.5, True, True)], dtype=point)
    found = load_tracks(tmp_path / "p.slp", frame_rate=9, individual="f")
    assert found.landmarks == ("head", "tip") and found.n_frames == 3
    np.testing.assert_allclose(found.position[0], [(0.0, -1.0), (10.0, -11.0)])
    assert np.isnan(found.position[1]).all()
    np.testing.assert_allclose(found.position[2], [(7.0, -8.0), (9.0, -9.5)])  # a person's
    other = load_tracks(tmp_path / "p.slp", frame_rate=9, individual="m")
    assert np.isnan(other.of("tip")).all() and other.of("head")[0].tolist() == [20.0, -21.0]


def test_a_robot_s_topics_are_no_landmarks(tmp_path):
    path = write(tmp_path / "r.csv", {"__time": np.arange(9.0), "/cmd/x": 1.0, "/cmd/y": 2.0})
    with pytest.raises(InvalidInput, match="no landmark columns"):
        load_tracks(path, frame_rate=10)
