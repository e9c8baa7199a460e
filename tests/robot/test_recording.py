"""Recordings: units, order and labels survive; faults are named; repair says what it did."""

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.robot.recordings import Recording, load_recording, save_recording
from feeler.robot.repair import _find_bad_channels, repair
from feeler.robot.sensors import fit_sensors


def _write(tmp_path, header, rows, notes=""):
    path = tmp_path / "r.csv"
    path.write_text(
        notes
        + ",".join(header)
        + "\n"
        + "\n".join(",".join(map(str, row)) for row in rows)
        + "\n"
    )
    return path


def _header(unit="deg", n=8, time="time_ms"):
    return [time, *(f"hinge{k}_{unit}" for k in range(1, n + 1))]


ROWS = [[t, *range(8)] for t in range(3)]


@pytest.mark.parametrize(
    ("time", "unit", "interval", "scale", "quantity"),
    [
        ("time_ms", "deg", 1.0, np.pi / 180, "angle"),
        ("Time (s)", "rad", 1000.0, 1.0, "angle"),
        ("t_us", "mrad", 1e-3, 1e-3, "angle"),
        ("time [ms]", "fF", 1.0, 1e-3, "capacitance"),
        ("time_ms", "pF", 1.0, 1.0, "capacitance"),
        ("__time", "mV", 1000.0, 1.0, "voltage"),
        ("%time", "V", 1e-6, 1e3, "voltage"),
        ("Timestamp (us)", "kohm", 1e-3, 1e3, "resistance"),
        ("millis", "counts", 1.0, 1.0, "capacitance"),
    ],
)
def test_units_are_converted_at_the_door(tmp_path, time, unit, interval, scale, quantity):
    rows = [[t, *(np.arange(8) / 4)] for t in range(3)]
    recording = load_recording(_write(tmp_path, _header(unit, time=time), rows))
    np.testing.assert_allclose(recording.time, np.arange(3) * interval)
    np.testing.assert_allclose(recording.values[:, 0], np.arange(8) / 4 * scale)
    assert recording.quantity == quantity


def test_swapped_columns_are_ordered_by_number_and_said(tmp_path):
    header = _header()
    header[2], header[3] = header[3], header[2]
    recording = load_recording(_write(tmp_path, header, ROWS))
    np.testing.assert_allclose(np.rad2deg(recording.values[:, 0]), [0, 2, 1, 3, 4, 5, 6, 7])
    assert any("order of their hinge numbers" in line for line in recording.history)


def test_notes_become_labels(tmp_path):
    notes = (
        "# source: surrogate\n# robot: A\n# feature: ball\n# size: 5 mm\n# location: 0.9\n# speed:"
        " 0.027 m/s\n"
    )
    recording = load_recording(_write(tmp_path, _header(), ROWS, notes))
    assert (recording.source, recording.robot) == ("surrogate", "A")
    assert recording.labels == {"feature": "ball", "size": 5.0, "location": 0.9, "speed": 0.027}


@pytest.mark.parametrize(
    ("header", "rows", "notes", "message"),
    [
        (
            _header(n=7),
            [r[:8] for r in ROWS],
            "",
            "7 channels where 8 were expected .missing 8",
        ),
        (
            [_header()[0], *_header()[2:]],
            [[*r[:1], *r[2:]] for r in ROWS],
            "",
            "7 channels where 8 were expected .missing 1",
        ),
        ([*_header(), "hinge9_deg"], [[*r, 1] for r in ROWS], "", "not expected 9"),
        ([*_header()[:8], "ch7_deg"], ROWS, "", "missing 8; twice 7"),
        (_header()[1:], [r[1:] for r in ROWS], "", "no time column"),
        (_header(time="time"), ROWS, "", "has no time unit; valid: ms, s, us"),
        ([*_header()[:8], "hinge8_rad"], ROWS, "", "mixed units .deg, rad"),
        ([*_header()[:8], "hinge8"], ROWS, "", "mixed units .deg, no unit"),
        (
            ["time_ms", *(f"c{k}" for k in range(1, 9))],
            ROWS,
            "",
            "unit of the channels is None; valid: rad",
        ),
        (_header(), [ROWS[1], ROWS[0]], "", "line 3: time runs backwards, from 1 to 0 ms"),
        (_header(), [["", *range(8)], ROWS[1]], "", "line 2: no time given"),
        (_header(), ROWS[:1], "", "at least 2 samples; got"),
        (
            _header(),
            ROWS,
            "# source: cockroach\n",
            "unknown source 'cockroach'; valid: robot, surrogate",
        ),
        (_header(), ROWS, "# speed: fast\n", "note 'speed' must be a number, got 'fast'"),
        (_header(), [[0, *"abcdefgh"], [1, *"abcdefgh"]], "", "'hinge1_deg' holds text .'a'."),
        (
            _header(time="Timestamp"),
            [["12:30:01", *range(8)]] * 2,
            "",
            "'Timestamp' holds text",
        ),
        (_header(), [["12:30:01", *range(8)]] * 2, "", "'time_ms' holds text .'12:30:01'."),
        (_header("furlong"), ROWS, "", "0 channels .* columns are time_ms, hinge1_furlong"),
    ],
)
def test_faults_are_named(tmp_path, header, rows, notes, message):
    with pytest.raises(InvalidInput, match=message):
        load_recording(_write(tmp_path, header, rows, notes))


def test_a_time_column_swapped_with_a_channel_is_caught(tmp_path):
    rows = [[np.sin(t), t, *range(7)] for t in range(20)]
    with pytest.raises(InvalidInput, match="swapped with a channel"):
        load_recording(_write(tmp_path, _header(), rows))


def test_a_time_unit_may_be_given_by_hand_or_stand_in_a_note(tmp_path):
    path = _write(tmp_path, _header(time="time"), ROWS)
    np.testing.assert_allclose(load_recording(path, time_unit="s").time, [0.0, 1000.0, 2000.0])
    np.testing.assert_allclose(
        load_recording(_write(tmp_path, _header(time="time"), ROWS, "# time unit: us\n")).time,
        [0, 1e-3, 2e-3],
    )


def test_unit_given_by_hand_must_agree_with_the_header(tmp_path):
    path = _write(tmp_path, ["time_ms", *(f"c{k}" for k in range(1, 9))], ROWS)
    assert load_recording(path, unit="pF").quantity == "capacitance"
    with pytest.raises(InvalidInput, match="header says deg, unit='rad' was given"):
        load_recording(_write(tmp_path, _header(), ROWS), unit="rad")


def _wave(interval=1.0, n=400, seed=0):
    time = np.arange(n) * interval
    return Recording(time=time, values=np.stack([np.sin(time / 40 + k) for k in range(8)]))


def test_round_trip(tmp_path):
    recording = Recording(
        time=np.arange(5.0),
        values=np.random.default_rng(0).normal(size=(8, 5)),
        quantity="capacitance",
        robot="A",
        source="surrogate",
        labels={"feature": "box", "speed": 0.27},
    )
    save_recording(recording, tmp_path / "r.csv", digits=15)
    again = load_recording(tmp_path / "r.csv")
    np.testing.assert_allclose(again.values, recording.values, rtol=1e-13)
    assert (again.robot, again.source, again.labels) == ("A", "surrogate", recording.labels)


def test_jitter_drops_and_offset_time_are_mended_and_said():
    rng = np.random.default_rng(1)
    wave = _wave()
    keep = rng.random(400) > 0.05
    keep[[0, -1]] = True
    time = (1000 + wave.time + rng.uniform(-0.2, 0.2, 400))[keep]
    values = np.stack([np.sin((time - 1000) / 40 + k) for k in range(8)])
    fixed = repair(Recording(time=time, values=values))
    assert fixed.time[0] == 0 and np.allclose(np.diff(fixed.time), 1)
    expected = np.stack([np.sin((fixed.time + time[0] - 1000) / 40 + k) for k in range(8)])
    np.testing.assert_allclose(fixed.values, expected, atol=2e-3)
    assert f"{int((~keep).sum())} samples dropped" in fixed.history[-1]


@pytest.mark.parametrize("interval", [0.5, 2.0, 5.0])
def test_another_sampling_rate_is_resampled_and_said(interval):
    fixed = repair(_wave(interval))
    expected = np.stack([np.sin(fixed.time / 40 + k) for k in range(8)])
    np.testing.assert_allclose(fixed.values, expected, atol=3e-3)
    assert "resampled to 1 ms" in fixed.history[-1]


BACK = np.where(np.arange(400) < 40, 0.0, -1.3)


@pytest.mark.parametrize(
    ("time", "options", "words"),
    [
        (np.arange(400.0), {"gaps": "mend"}, "gaps must be one of refuse, .*'mend'"),
        (
            np.arange(400.0),
            {"bad_channels": "mend"},
            "bad_channels must be one of refuse, .*'me",
        ),
        (np.arange(400.0) + BACK, {}, "time runs backwards after sample 39"),
        (np.arange(400.0) + 30 * BACK, {}, "time runs backwards after sample 39"),
        (
            25 * np.arange(400.0),
            {},
            "hinge 1 is recorded every 25 ms, more slowly than every 10 ms.* gaps='bridge'",
        ),
        (np.fmin(np.arange(400.0), 398), {}, "1 samples share .* before, the first at 398 ms"),
        (1e13 * np.arange(400.0), {"gaps": "bridge"}, "Is the time unit right"),
    ],
)
def test_times_and_ways_that_cannot_be_repaired_are_refused(time, options, words):
    with pytest.raises(InvalidInput, match=words):
        repair(Recording(time=time, values=_wave().values), **options)


def test_long_gaps_refused_bridged_or_kept():
    wave = _wave()
    values = wave.values.copy()
    values[2, 100:150] = np.nan
    holed = Recording(time=wave.time, values=values)
    with pytest.raises(
        InvalidInput, match="hinge 3 has 1 gaps longer than 10 ms, the longest 51 ms"
    ):
        repair(holed)
    kept = repair(holed, gaps="keep")
    np.testing.assert_array_equal(np.isnan(kept.values[2]), np.isnan(values[2]))
    bridged = repair(holed, gaps="bridge")
    np.testing.assert_allclose(
        np.diff(bridged.values[2, 99:151], 2), 0, atol=1e-9
    )  # a straight line
    assert any("hinge 3: 1 gaps over 10 ms, bridged" in line for line in bridged.history)
    assert any("hinge 3: 50 missing values" in line for line in bridged.history)


@pytest.mark.parametrize("gone", [slice(0, 40), slice(-40, None)])
def test_a_channel_that_starts_late_or_ends_early_has_a_gap_too(gone):
    wave = _wave()
    values = wave.values.copy()
    values[1, gone] = np.nan
    late = Recording(time=wave.time, values=values)
    with pytest.raises(
        InvalidInput, match="hinge 2 has 1 gaps longer than 10 ms, the longest 40 ms"
    ):
        repair(late)
    kept = repair(late, gaps="keep")
    np.testing.assert_array_equal(np.isnan(kept.values), np.isnan(values))


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        (lambda v: np.full_like(v, np.nan), "empty"),
        (lambda v: np.full_like(v, 0.3), "dead"),
        (lambda v: np.minimum(v, 0.8), "saturated"),
        (lambda v: np.maximum(v, -0.8), "saturated"),
    ],
)
def test_bad_channels_are_named_and_never_used_in_silence(fault, words):
    wave = _wave()
    values = wave.values.copy()
    values[4] = fault(values[4])
    faulty = Recording(time=wave.time, values=values)
    assert list(_find_bad_channels(faulty)) == [5]
    with pytest.raises(InvalidInput, match=f"hinge 5 is {words}"):
        repair(faulty)
    fixed = repair(faulty, bad_channels="missing")
    assert (
        np.isnan(fixed.values[4]).all()
        and np.isfinite(np.delete(fixed.values, 4, axis=0)).all()
    )


def test_a_quiet_quantised_channel_is_not_called_saturated():
    rng = np.random.default_rng(2)
    values = np.round(
        rng.normal(0, 0.4, (8, 2000))
    )  # three levels, long runs at the extremes are noise
    assert _find_bad_channels(Recording(time=np.arange(2000.0), values=values)) == {}


def test_a_channel_with_hysteresis_is_not_called_saturated():
    from feeler.robot.surrogate import play

    time = np.arange(2000.0)
    swing = np.sin(time / 40) * np.exp(-time / 800)
    values = play(
        np.stack([swing * (1 + 0.1 * k) for k in range(8)]), 0.1
    )  # rests about 30 ms at each turn
    assert _find_bad_channels(Recording(time=time, values=values)) == {}


def test_calibration_of_another_robot_is_refused():
    levels = np.tile(np.linspace(-1, 1, 5), 8)
    fit = fit_sensors(np.repeat(np.arange(1, 9), 5), levels, 10 + levels, robot="A")
    recording = Recording(
        time=np.arange(3.0), values=np.full((8, 3), 10.5), quantity="capacitance", robot="B"
    )
    with pytest.raises(InvalidInput, match="belongs to robot 'A', the recording to 'B'"):
        recording.to_angles(fit)
    angles = Recording(
        time=np.arange(3.0), values=np.full((8, 3), 10.5), quantity="capacitance"
    ).to_angles(fit)
    np.testing.assert_allclose(angles.values, 0.5)
    with pytest.raises(InvalidInput, match="already holds angles"):
        angles.to_angles(fit)


def test_a_european_table_with_remarks_and_temperature_is_read_and_says_what_it_left_out(
    tmp_path,
):
    path = tmp_path / "bench.csv"
    path.write_text(
        "Messung 12;Labor B\nZeit war kurz\n\n"
        "Time;ADC0;ADC1;Temperature;remark\n(s);(mV);(mV);(°C);\n"
        "0,000;12,5;-3;21,5;begin\n0,001;12,75;-3,5;21,5;\n0,002;13;-4;21,6;touched, hard\n"
    )
    recording = load_recording(path, n_channels=2)
    np.testing.assert_allclose(recording.time, [0, 1, 2], atol=1e-12)
    np.testing.assert_array_equal(recording.values, [[12.5, 12.75, 13], [-3, -3.5, -4]])
    assert (recording.quantity, recording.unit) == ("voltage", "mV")
    said = " ".join(recording.history)
    assert "decimal commas" in said and "hinge 1 is number 0" in said
    assert "left out, being no channels: Temperature (°C), remark (text)" in said
    save_recording(recording, tmp_path / "again.csv")
    again = load_recording(tmp_path / "again.csv", n_channels=2)
    assert (again.unit, again.values.tolist()) == ("mV", recording.values.tolist())


def test_a_calibration_of_other_units_is_refused():
    levels = np.linspace(-1, 1, 5)
    lines = fit_sensors(np.ones(5), levels, 100 + levels, unit="mV")
    counts = Recording(
        time=np.arange(3.0),
        values=np.full((1, 3), 100.5),
        quantity="capacitance",
        unit="counts",
    )
    with pytest.raises(InvalidInput, match="readings in mV, the recording is in counts"):
        counts.to_angles(lines)
    with pytest.raises(InvalidInput, match="unit of capacitance is pF, counts, got 'mV'"):
        counts.replace(unit="mV")
    millivolts = counts.replace(quantity="voltage", unit="")
    np.testing.assert_allclose(millivolts.to_angles(lines).values, 0.5)


@pytest.mark.parametrize("missing", [1, 20, 300])
def test_the_interval_said_is_that_of_neighbours_however_long_the_gaps(missing):
    """Samples every 2 ms, of which one stretch in the middle is missing."""
    time = 2.0 * np.delete(np.arange(60 + missing), np.arange(30, 30 + missing))
    values = np.random.default_rng(0).normal(0, 0.1, (2, 60))
    fixed = repair(Recording(time=time, values=values), interval=2.0, gaps="keep")
    said = f"recorded every 2 ms (jitter sd 0 ms), {missing} samples dropped; time base evened"
    assert said in fixed.history


def test_channels_may_be_numbered_as_their_hinges_are(tmp_path):
    """A robot with sensors on hinges 2, 5 and 9 whose file says so, in any order."""
    header = ["time_ms", "hinge9_deg", "hinge2_deg", "hinge5_deg"]
    path = _write(tmp_path, header, [[t, 9, 2, 5] for t in range(3)])
    found = load_recording(path, n_channels=3, hinges=(2, 5, 9))
    np.testing.assert_allclose(np.rad2deg(found.values[:, 0]), [2, 5, 9])
    with pytest.raises(InvalidInput, match=r"missing 1, 3; not expected 5, 9"):
        load_recording(path, n_channels=3, hinges=(2, 5, 8))
    plain = _write(tmp_path, _header(n=3), [[t, 1, 2, 3] for t in range(3)])
    found = load_recording(plain, n_channels=3, hinges=(2, 5, 9))
    np.testing.assert_allclose(np.rad2deg(found.values[:, 0]), [1, 2, 3])


@pytest.mark.parametrize(
    ("unit", "most", "said"), [("rad", 56.0, "56 rad"), ("deg", -181.0, "181 deg")]
)
def test_no_hinge_turns_by_more_than_half_a_turn(tmp_path, unit, most, said):
    path = _write(tmp_path, _header(unit, n=2), [[0, 0.1, 0.2], [1, "", most], [2, 0.1, 0.2]])
    with pytest.raises(InvalidInput, match=rf"a hinge turns by {said}, more than half a turn"):
        load_recording(path, n_channels=2)
    nearly = _write(tmp_path, _header(n=2), [[0, 179, 0], [1, -179, 0]])
    turned = np.rad2deg(load_recording(nearly, n_channels=2).values[0])
    np.testing.assert_allclose(turned, [179, -179])


def test_absent_channels_that_may_be_hinges_or_sensors_are_refused(tmp_path):
    """With sensors on hinges 2, 3, 4 and 6, columns 2 and 3 may be the first or the middle two."""
    path, how = (
        tmp_path / "r.csv",
        {"n_channels": 4, "hinges": (2, 3, 4, 6), "bad_channels": "missing"},
    )
    for names, there in (((2, 3), None), ((2, 6), [0, 3]), ((1, 3), [0, 2]), ((4, 3), None)):
        columns = ",".join(f"hinge{n}_deg" for n in names)
        path.write_text(f"time_ms,{columns}\n0,1,2\n1,3,4\n")
        if there is None:
            with pytest.raises(InvalidInput, match="numbers of hinges or of sensors"):
                load_recording(path, **how)
            continue
        found = load_recording(path, **how)
        assert np.flatnonzero(np.isfinite(found.values).all(axis=1)).tolist() == there


def test_noise_alone_is_named_where_a_hinge_further_out_moves():
    rng, time = np.random.default_rng(4), np.arange(600.0)
    noise = 0.002 * rng.normal(size=(4, 600))
    wave = np.array([1, 0, 1, 0])[:, None] * 0.2 * np.sin(time / 40)
    said = repair(Recording(time=time, values=noise + wave)).history[-1]
    assert said == "hinge 2: noise alone, while hinge 3 moves: broken?"
    still = repair(Recording(time=time, values=noise)).history
    assert not any("noise" in line for line in still)


def test_holes_of_all_channels_are_said_once_and_no_usable_channel_is_refused():
    time = np.delete(np.arange(600.0), slice(100, 150))
    recording = Recording(time=time, values=np.sin(time / 40) * np.ones((3, 1)))
    gaps = [line for line in repair(recording, gaps="bridge").history if "gaps" in line]
    assert gaps == ["hinge 1, 2, 3: 1 gaps over 10 ms, bridged"]
    dead = recording.replace(values=np.ones((3, time.size)))
    with pytest.raises(InvalidInput, match="no channel is usable: hinge 1 is dead"):
        repair(dead, bad_channels="missing")
