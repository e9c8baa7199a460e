"""Sensor calibration: planted lines come back, their quality is measured, and nothing is
extrapolated in silence.
"""

import json

import numpy as np
import pytest

from feeler.errors import InvalidInput
from feeler.robot.sensors import (
    fit_sensors,
    load_calibration,
    load_calibration_table,
    save_calibration,
)

DEGREE = np.pi / 180
SLOPE = np.array([0.20, -0.15, 0.30])  # rad/pF
OFFSET = np.array([-1.0, 0.9, 0.1])


def _bench(noise=0.0, repeats=20, seed=0, drift=0.0):
    """Readings of three hinges at known angles, noise [rad] as an angle, drift [rad/ms]."""
    rng = np.random.default_rng(seed)
    levels = np.linspace(-20, 20, 9) * DEGREE
    hinge, angle = (
        v.ravel() for v in np.meshgrid([1, 2, 3], np.repeat(levels, repeats), indexing="ij")
    )
    time = rng.permutation(hinge.size) * 10.0
    seen = angle + noise * rng.standard_normal(angle.size) + drift * time
    k = hinge.astype(int) - 1
    return hinge, angle, (seen - OFFSET[k]) / SLOPE[k], time


def test_a_reading_may_lie_beyond_the_range_by_a_fiftieth_of_it():
    """Calibrated from 0 to 64 pF; 64/50 pF are exact neither way, so a hair on either side."""
    angle = np.linspace(0.0, 0.5, 9)
    fit = fit_sensors(np.ones(9, int), angle, 128 * angle)
    for end, out in ((0.0, -1.0), (64.0, 1.0)):
        assert np.isfinite(fit.apply(np.array([[end + out * 1.27999]]))).all()
        with pytest.raises(InvalidInput, match="outside the calibrated range"):
            fit.apply(np.array([[end + out * 1.28001]]))


def test_nothing_is_extrapolated_in_silence():
    fit = fit_sensors(*_bench()[:3], robot="A")
    angle = np.tile([0.0, 30 * DEGREE], (3, 1))
    reading = (angle - OFFSET[:, None]) / SLOPE[:, None]
    with pytest.raises(InvalidInput, match="3 readings lie outside the calibrated range"):
        fit.apply(reading)
    np.testing.assert_allclose(fit.apply(reading, outside="extend"), angle, atol=1e-10)
    np.testing.assert_allclose(
        fit.apply(reading, outside="clip")[:, 1], 20 * DEGREE, atol=1e-10
    )
    np.testing.assert_array_equal(np.isnan(fit.apply(reading, outside="missing")), angle > 0.1)
    with pytest.raises(InvalidInput, match="valid: refuse, clip, missing, extend"):
        fit.apply(reading, outside="guess")
    with pytest.raises(InvalidInput, match="belongs to robot 'A', the recording to 'B'"):
        fit.apply(reading, robot="B")
    with pytest.raises(InvalidInput, match="for 3 hinges"):
        fit.apply(reading[:2])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda h, a, c: (h[:-1], a, c), "lists of one length"),
        (
            lambda h, a, c: (h + 1, a, c),
            "numbered 1, 2, … from the base.* without a hole, got 2, 3, 4",
        ),
        (lambda h, a, c: (h[:0], a[:0], c[:0]), "without a hole, got none"),
        (
            lambda h, a, c: (1.0 + np.arange(257), np.ones(257), np.ones(257)),
            "at most 256 hinges, got readings of 257",
        ),
        (
            lambda h, a, c: (h, np.where(h == 2, 0.1, a), c),
            "hinge 2 has 180 readings at 1 angles",
        ),
        (lambda h, a, c: (h, a, np.where(h == 3, 7.0, c)), "hinge 3 reads 7 to 7, .*dead"),
        (lambda h, a, c: (h, a, np.where(h == 3, np.nan, c)), "must be complete"),
    ],
)
def test_bad_tables(change, message):
    with pytest.raises(InvalidInput, match=message):
        fit_sensors(*change(*_bench()[:3]))


def test_table_file_units_and_name(tmp_path):
    hinge, angle, capacitance, _ = _bench()
    rows = zip(hinge, np.rad2deg(angle), 1e3 * capacitance, strict=True)
    text = "# robot: A\nhinge,angle_deg,capacitance_fF\n" + "\n".join(
        f"{h:g},{a!r},{c!r}" for h, a, c in rows
    )
    (tmp_path / "t.csv").write_text(text.replace("np.float64(", "").replace(")", ""))
    fit = load_calibration_table(tmp_path / "t.csv")
    np.testing.assert_allclose(fit.slope, SLOPE, rtol=1e-9)
    assert (fit.robot, fit.unit) == ("A", "pF")
    (tmp_path / "t.csv").write_text("hinge,angle,capacitance_pF\n1,2,3\n")
    with pytest.raises(
        InvalidInput,
        match="'angle' does not say its unit",
    ):
        load_calibration_table(tmp_path / "t.csv")


def test_a_file_of_more_than_a_mebibyte_is_no_calibration(tmp_path):
    path = tmp_path / "c.json"
    save_calibration(fit_sensors(*_bench()[:3]), path)
    text = path.read_text()
    path.write_text(text + " " * (2**20 - len(text.encode())))
    assert load_calibration(path).slope.size == 3
    path.write_text(path.read_text() + " ")
    with pytest.raises(InvalidInput, match="over the limit of 1,048,576"):
        load_calibration(path)


def test_saved_and_loaded_is_the_same(tmp_path):
    fit = fit_sensors(*_bench(noise=0.01)[:3], robot="A")
    save_calibration(fit, tmp_path / "c.json")
    again = load_calibration(tmp_path / "c.json")
    for name in (
        "slope",
        "offset",
        "low",
        "high",
        "residual",
        "resolution",
        "drift",
        "r_squared",
    ):
        np.testing.assert_array_equal(getattr(again, name), getattr(fit, name))
    assert again.robot == "A"
    content = json.loads((tmp_path / "c.json").read_text())
    assert (
        content.pop("version") == 2
    )  # files of version 1, which had lines alone, stay readable
    old = {k: v for k, v in content.items() if k not in ("curve", "straight", "hysteresis")}
    (tmp_path / "old.json").write_text(json.dumps({"version": 1, **old}))
    np.testing.assert_array_equal(load_calibration(tmp_path / "old.json").slope, fit.slope)
    with pytest.raises(InvalidInput, match="2 readings at 2 angles; a line needs 3 at 2"):
        fit_sensors(np.ones(2, int), np.array([0.0, 0.1]), np.array([1.0, 2.0]))
    one = fit_sensors(
        np.ones(3, int), np.array([0.0, 0.1, 0.2]), np.array([1.0, 2.0, 3.0])
    )  # of a single hinge
    save_calibration(one, tmp_path / "one.json")
    assert load_calibration(tmp_path / "one.json").slope == one.slope


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "other"}, "is no sensor calibration"),
        ({"version": 99}, "has version 99"),
        ({"slope": [1.0]}, "one number per hinge in each list, .* got lists of 1, 3"),
        ({"slope": [None, 1, 1]}, "slope must be finite, got nan in hinge 1"),
        ({"slope": ["1", 1, 1]}, "slope must be an array of numbers"),
        ({"slope": [10**400, 1, 1]}, "slope must be an array of numbers"),
        ({"low": [9e9, 0, 0]}, "low > high"),
    ],
)
def test_damaged_files(tmp_path, change, message):
    path = tmp_path / "c.json"
    save_calibration(fit_sensors(*_bench()[:3]), path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(InvalidInput, match=message):
        load_calibration(path)


def _make_bench(bend, hysteresis=0.0, noise=0.002, seed=0):
    """Four sweeps, up and down by turns, of two hinges whose reading bends."""
    rng, up = np.random.default_rng(seed), np.linspace(-0.7, 0.7, 15)
    angle = np.tile(np.concatenate([up, up[::-1]]), 4)
    way = np.tile(np.repeat([1.0, -1.0], 15), 4)
    hinge, angle = np.repeat([1, 2], angle.size), np.tile(angle, 2)
    seen = angle - hysteresis / 2 * np.tile(way, 2)
    return hinge, angle, 5 + hinge * bend(seen) + noise * rng.normal(size=angle.size)


@pytest.mark.parametrize(
    ("bend", "curves"),
    [
        (lambda x: x, {"line"}),
        (np.sin, {"cubic", "spline"}),
        (lambda x: x + 0.3 * x**2, {"quadratic", "cubic", "spline"}),
        (lambda x: -np.sinh(3 * x), {"cubic", "spline"}),
    ],
)
def test_the_curve_that_predicts_unseen_angles_is_chosen(bend, curves):
    """Of a bent characteristic no bend is left, of a straight one the line is kept."""
    table = _make_bench(bend)
    fit = fit_sensors(*table, curve="auto")
    assert fit.curve in curves
    test = np.linspace(-0.65, 0.65, 41)
    found = fit.apply(5 + np.outer([1, 2], bend(test)))
    line = fit_sensors(*table)
    assert np.abs(found - test).max() < (0.004 if fit.curve == "line" else 0.02)
    np.testing.assert_allclose(fit.straight, line.residual)
    assert (line.curve, line.readings) == ("line", None)
    np.testing.assert_array_equal(fit.slope, line.slope)
    if fit.curve != "line":
        assert (fit.cross_validated < 0.9 * line.cross_validated).all()
        assert (
            np.diff(
                fit.apply(
                    np.tile(np.linspace(fit.low[0], fit.high[0], 99), (2, 1)), outside="extend"
                )[0]
            )
            * np.sign(bend(1.0))
            > 0
        ).all()
        assert "a straight line leaves" in fit.explain()[0] and "is used" in fit.explain()[0]


def test_a_curve_goes_on_straight_beyond_its_range_and_survives_its_file(tmp_path):
    fit = fit_sensors(*_make_bench(np.sin), curve="cubic")
    step = np.array([[0.01], [0.01]])
    ends = fit.high[:, None] + step * np.arange(4)
    slopes = np.diff(fit.apply(ends, outside="extend"), axis=1)
    np.testing.assert_allclose(slopes, slopes[:, :1].repeat(3, axis=1), rtol=1e-9)
    save_calibration(fit, tmp_path / "c.json")
    loaded = load_calibration(tmp_path / "c.json")
    np.testing.assert_array_equal(
        loaded.apply(ends, outside="extend"), fit.apply(ends, outside="extend")
    )
    assert loaded.curve == "cubic" and "/pF" in loaded.report()
    with pytest.raises(InvalidInput, match=r"cubic curve needs readings at 5 angles, got 4"):
        angle = np.tile(np.arange(4) / 4, 2)
        fit_sensors(np.ones(8, int), angle, 5 + angle, curve="cubic")


def test_hysteresis_is_measured_named_and_kept_out_of_the_repeatability():
    """The reading lags by 0.03 rad either way, so the same reading is 0.03 more on the way up."""
    fit = fit_sensors(*_make_bench(lambda x: x, hysteresis=0.03))
    np.testing.assert_allclose(fit.hysteresis, 0.03, atol=0.004)
    assert any("hysteresis" in line for line in fit.explain())
    free = fit_sensors(*_make_bench(lambda x: x))
    assert not any("hysteresis" in line for line in free.explain())
    one_way = fit_sensors(np.ones(9, int), np.arange(9) / 9, np.arange(9) * 1.0)
    assert np.isnan(one_way.hysteresis).all()


def test_drift_is_the_trend_of_the_residuals():
    hinge, angle, capacitance, time = _bench(noise=0.01 * DEGREE, drift=1e-6)
    fit = fit_sensors(hinge, angle, capacitance, time=time)
    np.testing.assert_allclose(
        fit.drift, -1e-6, rtol=0.05
    )  # known angle minus an angle that reads ever higher
    assert np.isnan(fit_sensors(hinge, angle, capacitance).drift).all()


def test_apply_inverts_the_readings_within_the_range():
    fit = fit_sensors(*_bench()[:3])
    angle = np.tile(np.linspace(-19, 19, 50) * DEGREE, (3, 1))
    np.testing.assert_allclose(
        fit.apply((angle - OFFSET[:, None]) / SLOPE[:, None]), angle, atol=1e-10
    )


def test_a_saturated_or_deaf_sensor_is_refused_by_its_hinge_and_one_bad_one_bends_no_other():
    angle = np.tile(np.radians(np.arange(-60, 61, 10)), 2)
    bent, noise = 900 - 400 * angle + 60 * angle**2, np.random.default_rng(1).normal(size=26)
    hinge = np.repeat([1, 2], 26)
    clipped = np.minimum(bent, 1000)
    with pytest.raises(
        InvalidInput, match=r"hinge 2 reads 1000 at all angles .*-20°: saturated"
    ):
        fit_sensors(hinge, np.tile(angle, 2), np.r_[bent, clipped])
    with pytest.raises(InvalidInput, match=r"hinge 2 .* hardly follows its angle .*dead"):
        fit_sensors(hinge, np.tile(angle, 2), np.r_[bent, 100 + noise])
    rough = 900 - 400 * angle + 150 * noise
    hinge, several = np.repeat([1, 2, 3], 26), np.tile(angle, 3)
    fit = fit_sensors(hinge, several, np.r_[bent, rough, bent], curve="auto")
    assert fit.curve != "line" and fit.residual[0] < fit.straight[0] / 3


def test_a_bend_that_no_line_follows_is_no_hysteresis():
    """One angle more on the way up, at which the line is far off."""
    angle = np.radians([*range(-60, 61, 10), *range(50, -60, -10)])
    fit = fit_sensors(np.ones(angle.size, int), angle, angle + 0.3 * angle**2)
    assert abs(fit.hysteresis[0]) < 1e-9 < fit.residual[0]


@pytest.mark.parametrize(
    "heading", ["Hinge;Angle (deg);Field (uT)", "sensor;angle_deg;field_µT"]
)
def test_a_bench_table_of_magnetic_fields_is_read(tmp_path, heading):
    rows = [f"{n};{a};{250 + 100 * n * a}" for n in (1, 2) for a in (-10, 0, 10)]
    (tmp_path / "bench.csv").write_text("\n".join([heading, *rows]))
    fit = load_calibration_table(tmp_path / "bench.csv")
    assert fit.unit == "mT"
    np.testing.assert_allclose(1 / fit.slope, [0.1 * 180 / np.pi, 0.2 * 180 / np.pi])
