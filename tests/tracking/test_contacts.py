"""Contacts, rhythms, sides and groups: films whose answer is known."""

import json
from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from scipy import stats
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.tracking import (
    Tracks,
    compare_groups,
    compare_sides,
    find_contacts,
    find_sweeps,
    measure_base,
    measure_clearance,
    measure_rhythm,
)
from feeler.tracking.posture import tabulate_contacts

STEP = 4.0  # ms
NAMES = ("base", "middle", "tip", "knob", "head", "abdomen")


def film(tip_x, *, bend=0.0, knob=(30.0, 0.0)):
    """An antenna from the origin to (tip_x, 0), its middle aside by ``bend``."""
    x = np.asarray(tip_x, dtype=float)
    places = np.zeros((x.size, 6, 2))
    places[:, 1, 0], places[:, 1, 1] = 0.4 * x, bend
    places[:, 2, 0] = x
    places[:, 3], places[:, 4], places[:, 5] = knob, (-1.0, 0.0), (-9.0, 0.0)
    return Tracks(position=places, landmarks=NAMES, interval=STEP, unit="mm")


X = np.array([20.0, 27.0, 28.5, 29.0, 25.0, 28.2, 20.0, 20.0, 28.1, 29.5])


@pytest.mark.parametrize(
    "target",
    [
        "knob",
        [(30.0, 0.0)],
        [(30.0, -7.0), (30.0, 7.0)],
        [(30.0, -5.0), (30.0, 5.0), (44.0, 5.0), (44.0, -5.0)],
    ],
)
def test_contacts_begin_and_end_with_the_frames_within_reach_of_any_target(target):
    found = find_contacts(film(X), ["base", "tip"], target, within=2.0)
    assert found["first_frame"].tolist() == [2, 5, 8] and found["last_frame"].tolist() == [
        3,
        5,
        9,
    ]
    assert found["on_ms"].tolist() == [8.0, 20.0, 32.0]
    assert found["duration_ms"].tolist() == [8.0, 4.0, 8.0]
    assert found["whole"].tolist() == [True, True, False] and (found["place"] == 1.0).all()
    joined = find_contacts(film(X), ["tip"], target, within=2.0, max_gap=1, min_duration=9.0)
    assert joined["duration_ms"].tolist() == [16.0]


def test_a_gap_of_the_tracker_is_no_contact_and_leaves_neighbours_open():
    tracks = film(X)
    position = tracks.position.copy()
    position[3, 2] = np.nan
    found = find_contacts(tracks.replace(position=position), ["tip"], "knob", within=2.0)
    assert found["last_frame"].tolist() == [2, 5, 9]
    assert found["whole"].tolist() == [False, True, False]


def test_the_place_is_where_the_antenna_is_nearest_even_between_landmarks():
    distance, place = measure_clearance(
        film([40.0, 30.0]), ["base", "middle", "tip"], [(10.0, 3.0), (10.0, 90.0)]
    )
    np.testing.assert_allclose(distance, 3.0, atol=0.01)
    np.testing.assert_allclose(place, [0.25, 1 / 3], atol=0.011)
    inside, _ = measure_clearance(film([6.0]), ["tip"], [(5.0, -1.0), (8.0, -1.0), (6.0, 9.0)])
    assert inside.tolist() == [0.0]


def test_contacts_turn_and_shift_with_the_world():
    turn = np.deg2rad(71.0)
    matrix = np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    shift = (9, -4)
    tracks, wall = film(X), np.array([(30.0, -7.0), (30.0, 7.0)])
    moved = tracks.replace(position=tracks.position @ matrix.T + shift)
    a = find_contacts(tracks, ["base", "tip"], wall, within=2.0)
    b = find_contacts(moved, ["base", "tip"], wall @ matrix.T + shift, within=2.0)
    np.testing.assert_allclose(a.drop(columns="whole"), b.drop(columns="whole"))


def test_contact_is_seen_from_bending():
    rng = np.random.default_rng(3)
    bend = 0.02 * rng.standard_normal(60)
    bend[20:27] += 6.0
    found = find_contacts(film(np.full(60, 40.0), bend=bend), ["base", "middle", "tip"])
    assert found.loc[found["duration_ms"].idxmax(), ["first_frame", "last_frame"]].tolist() == [
        20,
        26,
    ]
    assert found["place"].max() == pytest.approx(0.4, abs=0.02)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"target": "knob"}, "needs within="),
        ({"target": [(1.0, 2.0, 3.0)], "within": 1.0}, "one for a point, two for a wall"),
        ({"target": "nob", "within": 1.0}, "no landmark 'nob'"),
    ],
)
def test_a_contact_that_cannot_be_measured_is_refused(options, words):
    with pytest.raises(InvalidInput, match=words):
        find_contacts(film(X), ["tip"], **options)


TIME = np.arange(700) * STEP


def sweep(degrees, hertz, late=0.0, offset=20.0):
    wave = offset + degrees * np.cos(2e-3 * np.pi * hertz * (TIME - late))
    return find_sweeps(np.deg2rad(wave), STEP)


def test_the_rhythm_of_a_cosine_is_its_amplitude_frequency_offset_and_phase():
    wave = np.deg2rad(20.0 + 13.0 * np.cos(2e-3 * np.pi * 6.3 * TIME + 0.7))
    found = measure_rhythm(wave, STEP, 5.5e-3)  # the frequency need not be known well
    assert found.frequency * 1e3 == pytest.approx(6.3, rel=0.01)
    assert np.rad2deg(found.mean_amplitude) == pytest.approx(13.0, rel=0.02)
    seen = np.isfinite(found.phase)
    expected = 2e-3 * np.pi * 6.3 * TIME + 0.7
    off = np.angle(np.exp(1j * (found.phase - expected)))[seen]
    assert np.abs(off[50:-50]).max() < 0.06
    assert np.nanmedian(np.rad2deg(found.offset)) == pytest.approx(20.0, abs=0.2)
    with pytest.raises(InvalidInput, match="needs more than"):
        measure_rhythm(wave, STEP, 0.1)


@pytest.mark.parametrize("late", [0.0, 20.0, -36.0])
def test_the_right_antenna_s_delay_is_lag_phase_and_locking(late):
    left, right = sweep(15.0, 5.0), sweep(9.0, 5.0, late)
    found = compare_sides(left, right, STEP)
    assert found.lag == pytest.approx(late, abs=STEP) and found.best_correlation > 0.999
    assert found.phase == pytest.approx(2e-3 * np.pi * 5.0 * late, abs=0.02)
    assert found.correlation == pytest.approx(np.cos(found.phase), abs=0.02)
    assert found.locking == pytest.approx(1.0, abs=1e-3)
    mirrored = compare_sides(right, left, STEP)
    assert mirrored.phase == pytest.approx(-found.phase, abs=1e-6)


def test_antennae_of_other_frequencies_are_not_locked():
    found = compare_sides(sweep(15.0, 5.0), sweep(15.0, 6.1), STEP)
    assert found.locking < 0.3


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_circle_s_curvature_and_tangent_are_those_at_its_base(side):
    """Whiskers on either side of a body along +y, that leave the head at 70° from behind and bend
    forward.
    """
    radius, arc = 25.0, np.array([0.0, 2.0, 5.0])
    heading = np.deg2rad(-20.0)  # from the x axis: 70° from the backward axis
    angle = heading + arc / radius
    x = radius * (np.sin(angle) - np.sin(heading))
    y = radius * (np.cos(heading) - np.cos(angle))
    places = np.zeros((1, 5, 2))
    places[0, :3] = np.stack([side * x, y], axis=1)
    places[0, 4] = (0.0, -10.0)
    tracks = Tracks(
        position=places, landmarks=("b", "m", "t", "head", "abdomen"), interval=1.0, unit="mm"
    )
    found = measure_base(tracks, ["b", "m", "t"])
    assert found["angle_deg"].item() == pytest.approx(70.0, abs=1e-6)
    assert found["curvature"].item() == pytest.approx(1 / radius, rel=1e-9)


def test_an_animal_counts_once_however_many_films_it_has():
    values = [1.0, 3.0, 5.0, 6.0, 9.0, 10.0, 14.0, np.nan]
    animals = ["a", "a", "b", "c", "d", "e", "f", "a"]
    groups = ["control"] * 4 + ["treated"] * 3 + ["control"]
    found = compare_groups(values, animals, groups)
    control, treated = np.array([2.0, 5.0, 6.0]), np.array([9.0, 10.0, 14.0])
    assert found.table["n"].tolist() == [3, 3]
    assert found.table["mean"].tolist() == pytest.approx([control.mean(), treated.mean()])
    assert found.p == pytest.approx(stats.ttest_ind(control, treated, equal_var=False).pvalue)
    half = stats.t.ppf(0.975, 2) * stats.sem(treated)
    assert found.table.loc[1, "high"] == pytest.approx(treated.mean() + half)
    assert found.difference[0] == pytest.approx(control.mean() - treated.mean())
    order = np.random.default_rng(0).permutation(8)
    again = compare_groups(*(list(np.array(one)[order]) for one in (values, animals, groups)))
    assert again.p == pytest.approx(found.p)


def test_groups_that_cannot_be_tested_have_means_and_no_test():
    found = compare_groups([1.0, 2.0], ["a", "b"], ["x", "y"])
    assert found.test == "" and np.isnan(found.p) and found.table["low"].isna().all()
    assert compare_groups([1.0, 2, 4, 5, 3, 9], list("abcdef"), list("xxyyzz")).test.startswith(
        "Alex"
    )
    with pytest.raises(InvalidInput, match="'a' is in the groups x, y"):
        compare_groups([1.0, 2.0], ["a", "a"], ["x", "y"])


def test_a_still_antenna_has_no_phase_and_no_correlation():
    still = replace(sweep(15.0, 5.0), angle=np.zeros(700))
    found = compare_sides(still, sweep(15.0, 5.0), STEP)
    assert np.isnan(found.correlation)


def run(*words):
    said = CliRunner().invoke(app, ["tracks", *map(str, words)])
    assert said.exit_code == 0, said.output + str(said.exception)
    return said.output


def write_walk(path, late=20.0):
    """Two antennae of 120 px that swing by 15° about 40° at 5 Hz, 200 frames/s, y downwards."""
    time = np.arange(400) * 5.0
    rows = {"frame": np.arange(400)}
    for side, sign, delay in (("left", -1.0, 0.0), ("right", 1.0, late)):
        angle = np.deg2rad(40.0 + 15.0 * np.sin(2e-3 * np.pi * 5.0 * (time - delay)))
        rows[f"{side}_tip_x"] = 300.0 + sign * 120.0 * np.sin(angle)
        rows[f"{side}_tip_y"] = 300.0 - 120.0 * np.cos(angle)
    rows |= {"head_x": 300.0, "head_y": 300.0, "abdomen_x": 300.0, "abdomen_y": 420.0}
    pd.DataFrame(rows).to_csv(path, index=False)
    return path


def test_the_command_counts_contacts_with_a_wall_as_the_film_shows_it(tmp_path):
    """The right tip is beyond x = 390 where sin(angle) > 3/4, in half of its swing or so."""
    walk = write_walk(tmp_path / "walk.csv")
    wall = ("--contact", "394,100,394,400", "--within", 4)
    said = run(walk, "--frame-rate", 200, *wall, "--out", tmp_path / "o")
    table, frames = (
        pd.read_csv(tmp_path / "o" / f"{name}.csv") for name in ("contacts", "tracks")
    )
    assert set(table["side"]) == {"right"} and len(table) == 10
    limit = np.degrees(np.arcsin(0.75))
    right = frames[frames["side"] == "right"]
    beyond = np.abs(right["tip_x"] - 300.0) / 120.0 > 0.75
    assert (right["contact"].astype(bool) == beyond).all() and limit > 40.0
    assert (right["tip_y"] < 0).all() and set(right["unit"]) == {"px"}
    found = json.loads((tmp_path / "o" / "tracks.json").read_text())["trials"][0]["rhythm"]
    assert found["left against right"]["phase"] == pytest.approx(36.0, abs=1.0)
    assert found["left"]["amplitude"] == pytest.approx(15.0, rel=0.03)
    assert "10 contact(s)" in said
    mm = run(walk, "--frame-rate", 200, *wall[:3], 0.5, "--scale", 8, "--json")
    assert [one["first_frame"] for one in json.loads(mm)["trials"][0]["contacts"]] == table[
        "first_frame"
    ].tolist()


def test_a_sheet_makes_groups_of_animals_and_lacking_columns_are_named(tmp_path):
    walks = [write_walk(tmp_path / f"w{k}.csv") for k in range(4)]
    sheet = tmp_path / "sheet.csv"
    sheet.write_text("file;animal;group\nw0.csv;a;x\nw1.csv;a;x\nw2.csv;b;x\nw3.csv;c;y\n")
    said = run(*walks, "--frame-rate", 200, "--sheet", sheet)
    assert "x:" in said and "2 animal(s)" in said and "two groups of two animals" in said
    sheet.write_text("file,who\nw0.csv,a\n")
    refused = CliRunner().invoke(app, ["tracks", *map(str, walks), "--sheet", str(sheet)])
    assert "no column 'group'" in str(refused.exception)


def test_a_film_with_too_few_frames_counts_in_no_mean_nor_group(tmp_path):
    walks = [write_walk(tmp_path / f"w{k}.csv", late=20.0 * k) for k in range(3)]
    holes = pd.read_csv(walks[2])
    holes.loc[100:240, ["left_tip_x", "left_tip_y"]] = np.nan
    holes.to_csv(walks[2], index=False)
    sheet = tmp_path / "sheet.csv"
    sheet.write_text("file,group\nw0.csv,x\nw1.csv,x\nw2.csv,x\n")
    asked = (*walks, "--frame-rate", 200, "--sheet", sheet)
    assert "lack too many frames for a mean: w2.csv" in run(*asked)
    found = json.loads(run(*asked, "--json"))
    assert found["mean"] is None and found["groups"]["left_out"] == ["w2.csv"]
    assert [row["n"] for row in found["groups"]["table"]] == [2]


def test_a_wall_is_where_the_file_has_it_whatever_it_calls_the_first_pixel(tmp_path):
    """DLTdv counts pixels from 1: the same film and wall, each in its own file's numbers."""
    walk = pd.read_csv(write_walk(tmp_path / "walk.csv"))
    marks = ("left_tip", "right_tip", "head", "abdomen")
    columns = [f"{name}_{axis}" for name in marks for axis in "xy"]
    own = (walk[columns] + 1).set_axis(
        [f"pt{k}_cam1_{axis}" for k in (1, 2, 3, 4) for axis in "XY"], axis=1
    )
    own.to_csv(tmp_path / "xypts.csv", index=False)
    found = [
        json.loads(
            run(
                tmp_path / name, "--frame-rate", 200, "--contact", wall, "--within", 4, "--json"
            )
        )
        for name, wall in (("walk.csv", "394,100,394,400"), ("xypts.csv", "395,101,395,401"))
    ]
    first, second = ([c["first_frame"] for c in one["trials"][0]["contacts"]] for one in found)
    assert len(first) == 10 and first == second


def test_a_posture_leaves_out_places_that_cannot_be_and_says_so(tmp_path):
    walk = pd.read_csv(write_walk(tmp_path / "walk.csv"))
    walk.loc[50, "left_tip_y"] += 200.0
    walk.to_csv(tmp_path / "jump.csv", index=False)
    asked = ("--frame-rate", 200, "--points", "abdomen,head,left_tip", "--json")
    whole, jump, kept = (
        json.loads(run(tmp_path / name, *asked, *more))[0]
        for name, *more in (("walk.csv",), ("jump.csv",), ("jump.csv", "--outliers", "keep"))
    )
    assert jump["largest_bend"] == pytest.approx(whole["largest_bend"])
    assert jump["whole"] == 399 and jump["left_out"] == {"left_tip jumps": 1}
    assert kept["largest_bend"] != pytest.approx(whole["largest_bend"], rel=0.05)
    assert not (kept["left_out"] or whole["left_out"])


def test_a_contact_of_a_signal_bridges_a_flicker_and_may_last_to_the_end():
    force = np.zeros(100)
    force[10:20] = force[25:30] = force[80:] = 1.0
    place = np.where(force > 0, 0.5, np.nan)
    found = tabulate_contacts(force, 0.5, place, 2.0, max_gap=5)
    assert found["on_ms"].tolist() == [20, 160] and found["off_ms"].tolist() == [60, 200]
    assert found["whole"].tolist() == [True, False] and set(found["place"]) == {0.5}
    assert tabulate_contacts(0 * force, 0.5, place, 2.0).empty


@pytest.mark.parametrize("frequency", [3.0, 3.02, 4.3, 6.9])
def test_opposite_sides_agree_best_half_a_period_later(frequency):
    left, right = sweep(15.0, frequency), sweep(15.0, frequency, 500.0 / frequency)
    found = compare_sides(left, right, STEP)
    assert abs(found.lag) == pytest.approx(500.0 / frequency, abs=STEP)
    assert found.correlation < -0.95 < 0.99 < found.best_correlation


def test_a_place_that_is_left_out_as_an_error_touches_nothing(tmp_path):
    """Five jumps onto the far wall, of which the speeds know, are no contacts; kept, they are."""
    walk = pd.read_csv(write_walk(tmp_path / "walk.csv"))
    walk.loc[20::80, ["left_tip_x", "left_tip_y"]] = (299.0, 90.0)
    walk.to_csv(tmp_path / "jumps.csv", index=False)
    asked = ("--frame-rate", 200, "--contact", "0,85,600,85", "--within", 9, "--json")
    for more, n in (((), 0), (("--outliers", "keep"), 5)):
        trial = json.loads(run(tmp_path / "jumps.csv", *asked, *more))["trials"][0]
        assert len(trial["contacts"]) == n and bool(trial["left_out"]) == (n == 0)


def test_a_wall_is_where_the_chosen_plane_has_it(tmp_path):
    """In a chosen plane the second axis points upwards, for the wall as for the tracks."""
    walk = pd.read_csv(write_walk(tmp_path / "walk.csv"))
    for name in ("left_tip", "right_tip", "head", "abdomen"):
        walk[f"{name}_z"], walk[f"{name}_y"] = 0.0, -walk[f"{name}_y"]
    walk.to_csv(tmp_path / "space.csv", index=False)
    asked = ("--frame-rate", 200, "--within", 4, "--json")
    flat = run(tmp_path / "walk.csv", *asked, "--contact", "394,100,394,400")
    up = run(tmp_path / "space.csv", *asked, "--contact", "394,-100,394,-400", "--plane", "xy")
    one, other = (json.loads(said)["trials"][0]["contacts"] for said in (flat, up))
    names = ("side", "first_frame", "last_frame")
    assert one and [[c[n] for n in names] for c in one] == [
        [c[n] for n in names] for c in other
    ]


@pytest.mark.long
def test_films_of_one_name_in_several_folders_stay_apart(tmp_path):
    """Each has its own rows, file and animal; a sheet that cannot say which is refused."""
    walks = []
    for k, name in enumerate(("a", "b")):
        (tmp_path / name).mkdir()
        walks.append(write_walk(tmp_path / name / "walk.csv", late=40.0 * k))
    sheet, asked = tmp_path / "sheet.csv", ("--frame-rate", 200, "--json")
    sheet.write_text("file,animal,group\na/walk.csv,A, x\nb/walk.csv,B,x \n")
    run(*walks, *asked, "--sheet", sheet, "--out", tmp_path / "o")
    found = json.loads((tmp_path / "o" / "tracks.json").read_text())
    assert [row["animal"] for row in found["groups"]["animals"]] == ["A", "B"]
    assert [row["n"] for row in found["groups"]["table"]] == [2]
    table = pd.read_csv(tmp_path / "o" / "tracks.csv")
    assert table.groupby(["trial", "side"]).size().to_dict() == dict.fromkeys(
        [(f"{a}/walk.csv", side) for a in "ab" for side in ("left", "right")], 400
    )
    points = ("--points", "abdomen,head,left_tip", "--out", tmp_path / "p")
    run(*walks, *asked[:2], *points)
    assert len(list((tmp_path / "p").glob("*.posture.nc"))) == 2
    for text, films, words in (
        ("walk.csv,A,x\n", walks, "which row is that of"),
        ("a/walk.csv,A,x\nb/walk.csv,,x\n", walks, "no animal and group for .*b/walk.csv"),
        ("a/walk.csv,A,x\n", [walks[0]] * 2, "is given twice"),
    ):
        sheet.write_text("file,animal,group\n" + text)
        words_given = ["tracks", *map(str, films), *map(str, asked), "--sheet", str(sheet)]
        with pytest.raises(InvalidInput, match=words):
            CliRunner().invoke(app, words_given, catch_exceptions=False)
