"""Filmed motions of known speed come back, whatever the frame rate, the rhythm and the faults of
the track; what cannot be mended is named.
"""

import json
import re
import warnings
from datetime import UTC, datetime

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.cli.app import app
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.tracking import LANDMARKS, Tracks, load_tracks, measure_exploration, save_poses

SWING, LENGTH = np.deg2rad(20.0), 150.0  # rad, px


FILMS = ((2, 100, 0.0), (8, 100, 1.0), (8, 500, 2.5))


def film(
    frequency, frame_rate, *, seed=0, noise=0.3, offset=45.0, n_cycles=8, turn=0.0, swing=20.0
):
    """Both tips swing by ``swing`` [°] about ``offset``, at ``frequency`` [Hz], in a picture
    that is turned by ``turn`` [rad]; positions, y upwards.
    """
    rng = np.random.default_rng(seed)
    time = np.arange(int(max(4.0, n_cycles / frequency) * frame_rate)) / frame_rate
    position = np.full((time.size, 4, 2), [200.0, 300.0])
    position[:, 3, 1] -= 100.0
    for side, outward in ((0, -1.0), (1, 1.0)):
        phase = rng.uniform(0, 2 * np.pi)
        angle = np.deg2rad(offset) + np.deg2rad(swing) * np.sin(
            2 * np.pi * frequency * time + phase
        )
        out = np.stack([outward * np.sin(angle), np.cos(angle)], axis=1)
        position[:, side] += LENGTH * out
    position = position @ np.array(
        [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    )
    return position + rng.normal(0, noise, position.shape)


def make(position, frame_rate):
    return Tracks(position=position, landmarks=LANDMARKS, interval=1e3 / frame_rate)


def speeds(position, frame_rate, frequency, **how):
    """Mean peak speed of each side, in parts of the true one."""
    found = measure_exploration([make(position, frame_rate)], **how)
    return found.mean_peak[0] / (SWING * 2e-3 * np.pi * frequency), found


@pytest.mark.parametrize(
    ("frequency", "frame_rate"),
    [
        (0.5, 30),
        pytest.param(0.5, 500, marks=pytest.mark.long),
        (2, 50),
        (2, 500),
        (8, 50),
        (8, 100),
        (8, 500),
        (12, 100),
        (20, 500),
    ],
)
def test_a_swing_has_its_speed_at_every_rhythm_and_frame_rate(frequency, frame_rate):
    for noise in (0.0, 0.3, 1.0):
        ratio, found = speeds(film(frequency, frame_rate, noise=noise), frame_rate, frequency)
        np.testing.assert_allclose(ratio, 1.0, atol=0.05)
        assert all(side.cutoff > frequency * 1e-3 for side in found.sweeps[0])
        assert not found.remarks[0] and not found.left_out[0]


def test_a_low_pass_that_takes_the_motion_away_says_so():
    """Two passes of second order at 6 Hz leave 1/(1 + (8/6)⁴) of 8 Hz."""
    position = film(8, 500)
    with pytest.warns(ModelValidityWarning, match="may be off") as warned:
        ratio, _ = speeds(position, 500, 8, cutoff="paper")
    assert re.search(
        "takes away 7.% of the speed of left_tip.* at 8 Hz", warned[0].message.details
    )
    np.testing.assert_allclose(ratio, 1 / (1 + (8 / 6) ** 4), rtol=0.03)
    with warnings.catch_warnings():
        warnings.simplefilter("error", ModelValidityWarning)
        speeds(film(0.5, 30), 30, 0.5, cutoff="paper")
        speeds(position, 500, 8, cutoff=60e-3)
    with pytest.raises(InvalidInput, match=r"must be auto .*, paper .* or a number, got 'low'"):
        speeds(position, 500, 8, cutoff="low")


def test_a_film_that_is_too_slow_for_the_motion_says_so():
    with pytest.warns(ModelValidityWarning, match="may be off") as warned:
        speeds(film(20, 50), 50, 20)
    assert re.search(
        r"20 Hz, which the track shows in 2\.5 frames a cycle", warned[0].message.details
    )


def test_speeds_of_a_film_that_lost_half_of_its_frames_are_doubted():
    position = film(20, 200)
    position[np.random.default_rng(0).random(len(position)) < 0.5, :2] = np.nan
    with pytest.warns(ModelValidityWarning, match="may be off") as warned:
        speeds(position, 200, 20)
    assert re.search(
        "frames of left_tip are bridged: .*up to 15 % off", warned[0].message.details
    )


def lose_body(position):
    position[::15, 3] = np.nan
    position[100:140, 3] = np.nan
    position[7::15, 2] = np.nan


def lose_tips(position):
    position[::13, 0] = position[5::17, 1] = np.nan
    position[60:63, 0] = np.nan


def exchange(position):
    for start in (40, 90, 150):
        position[start : start + 4, [0, 1]] = position[start : start + 4, [1, 0]]


def turn_round(position):
    position[50:53, [2, 3]] = position[50:53, [3, 2]]


def jump(position):
    position[33, 0] = [900.0, 900.0]
    position[80, 1] = 0.6 * position[80, 1] + 0.4 * position[80, 2]
    position[120:123, 3] = 3 * position[120, 3] - 2 * position[120, 2]


def hold_tip(position):
    position[100:160, 0] = position[100, 0]


def repeat_tip(position):
    for start in range(30, 200, 37):
        position[start : start + 7, 1] = position[start, 1]


def interpolate_tip(position):
    share = np.linspace(0, 1, 60)[:, None]
    position[100:160, 0] = (1 - share) * position[100, 0] + share * position[159, 0]


def hold_head(position):
    position[60:90, 2] = position[60, 2]


def follow_the_other(position):
    position[100:250, 0] = position[100:250, 1] + 0.1


def repeat_frames(position):
    position[4::5] = position[3:-1:5][: len(position[4::5])]


HELD = ("left_tip repeated or interpolated",)


@pytest.mark.parametrize(
    ("spoil", "named"),
    [
        (lose_body, ()),
        (lose_tips, ()),
        (exchange, ("left_tip and right_tip exchanged",)),
        (turn_round, ("head and abdomen exchanged",)),
        (jump, ("left_tip too far from its base", "right_tip jumps", "abdomen jumps")),
        (hold_tip, HELD),
        (interpolate_tip, HELD),
        (repeat_tip, ("right_tip repeated or interpolated",)),
        (hold_head, ("head repeated or interpolated",)),
        (repeat_frames, ("frames that repeat the one before",)),
    ],
)
@pytest.mark.parametrize(("frequency", "frame_rate", "turn"), FILMS)
def test_faults_of_the_track_change_the_speed_little_and_are_named(
    spoil, named, frequency, frame_rate, turn
):
    position = film(frequency, frame_rate, n_cycles=16, turn=turn)
    spoil(position)
    ratio, found = speeds(position, frame_rate, frequency)
    np.testing.assert_allclose(ratio, 1.0, atol=0.05)
    assert set(found.left_out[0]) == set(named)
    assert np.all(found.error / found.mean_peak < 0.09)
    seen = 1 - sum(found.left_out[0].get(name, 0) for name in named) / len(position)
    assert np.all(found.n_peaks >= 0.8 * seen * 2 * frequency * len(position) / frame_rate)


@pytest.mark.parametrize(
    ("frequency", "frame_rate", "turn"), [*FILMS, (3, 30, 2.0), (10, 100, 4)]
)
@pytest.mark.parametrize("offset", [-5.0, pytest.param(8.0, marks=pytest.mark.long), 18.0])
def test_tips_that_cross_are_not_exchanged_and_tips_that_jump_are(
    frequency, frame_rate, turn, offset
):
    position = film(frequency, frame_rate, n_cycles=16, turn=turn, offset=offset, swing=60.0)
    ratio, found = speeds(position, frame_rate, frequency)
    np.testing.assert_allclose(ratio, 3.0, rtol=0.05)
    assert not found.left_out[0]
    if frame_rate < 20 * frequency:  # tips as fast as that are anywhere in the next frame
        return
    apart = np.linalg.norm(position[:, 0] - position[:, 1], axis=1)
    first, last = np.flatnonzero(apart > 0.6 * LENGTH)[
        [3, -3]
    ]  # far from a place where they cross
    stop = first + int(np.flatnonzero(apart[first + 5 : last] > 0.6 * LENGTH)[0]) + 5
    position[first:stop, [0, 1]] = position[first:stop, [1, 0]]
    ratio, found = speeds(position, frame_rate, frequency)
    assert found.left_out[0] == {"left_tip and right_tip exchanged": stop - first}
    np.testing.assert_allclose(ratio, 3.0, rtol=0.05)


def hold_longest(position):
    position[20:, 0] = position[20, 0]


def leave_head_behind(position):
    position[:, 2] = position[0, 2]


def stick(position):
    noise = np.random.default_rng(4).normal(0, 0.3, (225, 2))
    position[88:313, 0] = position[88, 0] + noise  # on something in the picture


def stick_where_it_is(position):
    position += np.linspace(0, 100, len(position))[:, None, None]  # the animal walks on
    noise = np.random.default_rng(4).normal(0, 0.3, (300, 2))
    position[-300:, 0] = position[-301, 0] + noise


def repeat_every_frame(position):
    position[1::2] = position[0:-1:2][: len(position[1::2])]


@pytest.mark.parametrize(
    ("spoil", "words"),
    [
        (
            hold_longest,
            "left_tip stands still or moves on a straight line in 9.% of the frames",
        ),
        (leave_head_behind, "head stands still or moves on a straight line in 100% of"),
        (stick, "left_tip jumps and stays where it is then"),
        (stick_where_it_is, "left_tip stays on one place in 75% of the film while head moves"),
        (repeat_every_frame, "50% of the frames repeat the one before"),
    ],
)
@pytest.mark.parametrize("turn", [0.0, 2.6])
def test_faults_that_cannot_be_mended_are_asked_about(spoil, words, turn):
    position = film(2, 100, turn=turn)
    spoil(position)
    with pytest.warns(ModelValidityWarning, match="may be off") as warned:
        speeds(position, 100, 2)
    assert re.search(words, warned[0].message.details)


@pytest.mark.parametrize("turn", [0.0, 2.6])
def test_where_both_tips_are_on_one_antenna_neither_counts(turn):
    position = film(2, 100, turn=turn)
    follow_the_other(position)
    ratio, found = speeds(position, 100, 2)
    np.testing.assert_allclose(ratio, 1.0, atol=0.06)
    assert found.left_out[0]["left_tip and right_tip on one place"] > 130
    assert np.isnan(found.mean)


def test_a_held_animal_and_rounded_coordinates_are_measured_as_they_are():
    position = film(2, 100)
    position[:, 2:] = position[0, 2:]
    for decimals in (0, 1, 6):
        ratio, found = speeds(position.round(decimals), 100, 2)
        np.testing.assert_allclose(ratio, 1.0, atol=0.05)
        assert not found.left_out[0] and not found.remarks[0]
    position[88:163, 0] = position[88, 0]  # which then jumps: known even in whole pixels
    assert set(speeds(position.round(), 100, 2)[1].left_out[0]) == set(HELD)


def test_names_that_contradict_the_geometry_are_asked_about():
    tracks = make(film(2, 100), 100)
    with pytest.warns(ModelValidityWarning, match="may be off") as warned:
        measure_exploration([tracks], landmarks={"head": "abdomen", "abdomen": "head"})
    assert re.search(
        "point backwards in .* are abdomen and head exchanged", warned[0].message.details
    )
    with pytest.warns(ModelValidityWarning, match="may be off") as warned:
        measure_exploration([tracks], landmarks={"tips": ("right_tip", "left_tip")})
    assert re.search(
        "right_tip lies on the right and left_tip on the left", warned[0].message.details
    )


def test_one_peak_has_no_error_and_much_missing_no_mean():
    position = film(0.5, 50, noise=0.0)
    few = measure_exploration([make(position[:60], 50)])
    assert (few.n_peaks == 1).any() and np.isnan(few.error[few.n_peaks < 2]).all()
    position[300:500, 0] = np.nan
    lost = measure_exploration([make(position, 50)])
    assert np.isnan(lost.mean) and np.isfinite(lost.mean_peak).all()
    position[:, 3] = np.nan
    position[::50, 3] = 1.0
    with pytest.raises(InvalidInput, match=r"no sweep .* have no angle.*: abdomen 784"):
        measure_exploration([make(position, 50)], outliers="keep", max_gap=0)


def write(path, position, time=None, likelihood=None, name="time_s"):
    """A table as trackers write it, y downwards."""
    columns = {} if time is None else {name: time}
    for k, landmark in enumerate(LANDMARKS):
        columns |= {
            f"{landmark}_x": position[:, k, 0],
            f"{landmark}_y": 600 - position[:, k, 1],
        }
        if likelihood is not None:
            columns[f"{landmark}_likelihood"] = likelihood[:, k]
    np.savetxt(
        path, np.stack([*columns.values()], axis=1), "%.10g", ",", header=",".join(columns),
        comments="",
    )  # fmt: skip
    return path


@pytest.mark.parametrize(
    ("name", "scale"),
    [
        ("time_s", 1.0),
        ("time_ms", 1e3),
        ("Time (ms)", 1e3),
        ("timestamp [s]", 1.0),
        ("time", 1.0),
        ("seconds", 1.0),
        ("elapsed_time_ms", 1e3),
    ],
)
def test_the_times_of_a_table_are_its_clock(tmp_path, name, scale):
    position = film(2, 100)
    time = np.arange(len(position)) / 100
    path = write(tmp_path / "t.csv", position, time * scale + 3, name=name)
    assert load_tracks(path).interval == pytest.approx(10.0)
    assert load_tracks(path, frame_rate=100).interval == 10.0
    with pytest.raises(InvalidInput, match=f"frame_rate=30 contradicts column '{name[:4]}"):
        load_tracks(path, frame_rate=30)
    kept = np.delete(np.arange(len(position)), [5, 6, 50])
    path = write(tmp_path / "less.csv", position[kept], time[kept] * scale, name=name)
    found = load_tracks(path)
    assert found.n_frames == len(position) and found.interval == pytest.approx(10.0)
    assert np.flatnonzero(np.isnan(found.of("head")[:, 0])).tolist() == [5, 6, 50]
    assert found.notes["left out"].startswith("3 of")


def test_times_that_are_rounded_to_milliseconds_are_even_and_others_are_not(tmp_path):
    position = film(2, 30)
    time = np.arange(len(position)) / 30
    rounded = load_tracks(write(tmp_path / "t.csv", position, np.round(time, 3)))
    assert rounded.n_frames == len(position)
    assert rounded.interval == pytest.approx(1e3 / 30, rel=1e-3)
    uneven = time + 0.4 / 30 * (np.arange(len(time)) % 3)
    with pytest.raises(
        InvalidInput, match=r"has no even clock: its frames are .* apart in column"
    ):
        load_tracks(write(tmp_path / "u.csv", position, uneven))


@pytest.mark.parametrize("lost", [(2, 3), (1, 2), 0.3])
def test_a_camera_that_loses_many_frames_shows_the_same_sweeps(tmp_path, lost):
    position = film(1.5, 200, n_cycles=12)
    frame = np.arange(len(position))
    kept = np.random.default_rng(0).random(len(position)) > 0.3
    if lost != 0.3:
        kept = frame % lost[1] < lost[1] - 1
    whole = make(position, 200)
    found = load_tracks(write(tmp_path / "t.csv", position[kept], frame[kept] / 200))
    assert found.interval == pytest.approx(5.0 if lost != (1, 2) else 10.0)
    one, other = (measure_exploration([tracks]) for tracks in (whole, found))
    np.testing.assert_allclose(other.mean_peak, one.mean_peak, rtol=0.05)
    np.testing.assert_allclose(other.n_peaks, one.n_peaks, atol=1)


def test_a_film_whose_rate_changes_or_whose_clock_is_coarse_is_refused(tmp_path):
    time = np.concatenate([np.arange(150) / 30, 5 + np.arange(150) / 24])
    position = film(2, 75)[:300]
    with pytest.raises(InvalidInput, match="even clock: it runs at 24 to 30 frames/s"):
        load_tracks(write(tmp_path / "phone.csv", position, time))
    time = np.round(np.arange(len(position)) / 0.65)
    with pytest.raises(InvalidInput, match="whole ms, too coarse for frames 1 or 2 ms apart"):
        load_tracks(write(tmp_path / "ms.csv", position, time, name="time_ms"))


def test_animals_below_one_another_are_not_one_film(tmp_path):
    one, two = film(2, 100, seed=1), film(3, 100, seed=2)
    both, time = np.concatenate([one, two]), np.arange(len(one) + len(two)) / 100
    again = np.concatenate([time[: len(one)], time[: len(two)]])
    path = write(tmp_path / "both.csv", both, again)
    with pytest.raises(InvalidInput, match=r"time_s falls from .* to 0\. Are these several"):
        load_tracks(path, frame_rate=100)
    lines = path.read_text().splitlines()
    owners = ["animal", *["c1"] * len(one), *["c2"] * len(two)]
    for name in ("below", "beside"):
        rows = [f"{owner},{line}" for owner, line in zip(owners, lines, strict=True)]
        if name == "beside":
            rows[1:] = np.array(rows[1:])[np.argsort(again, kind="stable")].tolist()
        (tmp_path / f"{name}.csv").write_text("\n".join(rows))
        with pytest.raises(InvalidInput, match="choose one of c1, c2"):
            load_tracks(tmp_path / f"{name}.csv")
        found = load_tracks(tmp_path / f"{name}.csv", individual="c2")
        alone = load_tracks(write(tmp_path / "two.csv", two, time[: len(two)]))
        np.testing.assert_array_equal(found.position, alone.position)


def test_frame_numbers_that_jump_are_gaps(tmp_path):
    position = film(2, 100)
    kept = np.delete(np.arange(len(position)), np.arange(3, len(position), 10))
    path = write(tmp_path / "t.csv", position[kept], kept, name="frame")
    found = load_tracks(path, frame_rate=100)
    assert found.n_frames >= len(position) - 1
    ratio = measure_exploration([found]).mean_peak / (SWING * 2e-3 * np.pi * 2)
    np.testing.assert_allclose(ratio, 1.0, atol=0.05)


def test_every_third_frame_of_a_film_is_a_film_of_a_third_of_its_rate(tmp_path):
    position = film(3, 300)
    few, frame = position[::3], np.arange(len(position))[::3]
    twice = load_tracks(write(tmp_path / "d.csv", few.repeat(2, axis=0)), frame_rate=200)
    np.testing.assert_array_equal((twice.interval, twice.n_frames), (10.0, len(few)))
    found = load_tracks(write(tmp_path / "t.csv", few, frame, name="frame"), frame_rate=300)
    assert (found.interval, found.n_frames) == (10.0, len(few))
    assert found.notes["tracked"] == "one in 3 frames of the film"
    alone = load_tracks(write(tmp_path / "a.csv", few), frame_rate=100)
    np.testing.assert_array_equal(found.position, alone.position)


@pytest.mark.parametrize("rate", [100, 200, 500])
def test_stray_places_are_left_out_and_so_many_that_some_remain_are_told(rate):
    clean, rng = film(4, rate), np.random.default_rng(rate)
    known = measure_exploration([make(clean, rate)]).mean_peak
    for share in (0.02, 0.05, 0.1, 0.2):
        position, wrong = clean.copy(), rng.random(len(clean)) < share
        position[wrong, 1] += rng.normal(0, 80, (wrong.sum(), 2))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", ModelValidityWarning)
            found = measure_exploration([make(position, rate)])
        told = any("Do not trust its peak speeds" in words for words in found.remarks[0])
        assert told or share < 0.2
        assert not (told and share < 0.03)
        assert told or found.mean_peak == pytest.approx(known, rel=0.1)


@pytest.mark.parametrize("mark", [0, -1, 9999])
def test_marks_of_lost_points_are_no_places_but_a_landmark_at_the_origin_is(tmp_path, mark):
    position = film(2, 100)
    clean = measure_exploration([make(position, 100)]).mean
    position[20:23, 0] = position[70:72, 1] = [mark, 600.0 - mark]
    found = load_tracks(write(tmp_path / "t.csv", position), frame_rate=100)
    assert (
        found.notes[f"({mark}, {mark})"]
        == "counts as not seen, frames: left_tip 3, right_tip 2"
    )
    assert measure_exploration([found]).mean == pytest.approx(clean, rel=0.01)
    still = film(2, 100) - [200.0, -300.0]  # head at the file's origin
    still[:, 2] = [0.0, 600.0]
    assert "(0, 0)" not in load_tracks(write(tmp_path / "s.csv", still), frame_rate=100).notes


def run(*words):
    said = CliRunner().invoke(app, ["tracks", *map(str, words)])
    assert said.exit_code == 0, said.output + str(said.exception)
    return said.output


def test_an_nwb_file_gives_the_same_number_again_and_keeps_what_the_tracker_gave(tmp_path):
    position = film(2, 100)
    likelihood = np.random.default_rng(1).uniform(0.2, 1.0, position.shape[:2])
    path = write(tmp_path / "t.csv", position, likelihood=likelihood)
    out = tmp_path / "out"
    how = ("--min-likelihood", 0.3, "--max-gap", 7, "--cutoff", 9.5)
    start = datetime(2026, 5, 1, tzinfo=UTC).isoformat()
    run(path, "--frame-rate", 100, *how, "--out", out, "--session-start", start)
    found = json.loads((out / "tracks.json").read_text())
    again = json.loads(run(out / "tracks.nwb", "--json"))
    assert again["trials"][0]["mean_peak"] == pytest.approx(found["trials"][0]["mean_peak"])
    assert again["trials"][0]["doubted"] == found["trials"][0]["doubted"] != {}
    whole = load_tracks(out / "tracks.nwb", min_likelihood=0)
    np.testing.assert_allclose(whole.position * [1, -1], position * [1, -1] + [0, 600])
    np.testing.assert_allclose(whole.likelihood, likelihood, rtol=1e-6)
    for settings in (found["settings"], whole.settings):
        assert (settings["min_likelihood"], settings["max_gap"]) == (0.3, 7)
        assert settings["cutoff"] == 9.5 and settings["tips"] == ["left_tip", "right_tip"]
        assert settings["feeler"]
    table = np.genfromtxt(
        out / "tracks.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    assert set(table["cutoff_hz"]) == {9.5} and set(table["frame_rate"]) == {100}
    assert set(table["min_likelihood"]) == {0.3} and set(table["max_gap"]) == {7}
    page = (out / "tracks.html").read_text(encoding="utf-8")
    assert "How it was measured" in page and "9.5" in page and "min_likelihood" in page


def test_tracks_without_a_likelihood_get_none_in_nwb(tmp_path):
    tracks = make(film(2, 100), 100)
    save_poses([tracks], tmp_path / "a.nwb", session_start=datetime.now(UTC), identifier="x")
    assert load_tracks(tmp_path / "a.nwb").likelihood is None
