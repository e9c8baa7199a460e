"""Results are planted in the place of long computations: each number that a verb prints is the
planted one, in its unit.
"""

import json
import re
from importlib.resources import files
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from calibration._fits import make_fit
from matplotlib.figure import Figure
from tensors._sets import make_set
from typer.testing import CliRunner

import feeler
from feeler import calibration, wall
from feeler.cli.app import app
from feeler.cli.choose import change_antenna
from feeler.plotting.results import plot_exploration
from feeler.presets import cockroach
from feeler.robot.classify import Answer, name_touch
from feeler.robot.description import get_example
from feeler.robot.sensors import SensorCalibration
from feeler.tensors.formats import save
from feeler.wall.distance import _fit_distance

from .test_printed import NUMBER, read, run


def plant(monkeypatch, room, **functions):
    for name, function in functions.items():
        monkeypatch.setattr(room, name, function)


def make_map(**known):
    """What a wall's map knows, of which a test looks at some."""
    names = "distance position r2 slope intercept error monotone undefined told_apart bending"
    return SimpleNamespace(**dict.fromkeys(names.split(), np.nan) | known)


def test_wall_prints_the_map_in_millimetres(monkeypatch):
    asked = {}

    def approach(antenna, posture, distances):
        asked.update(posture=posture, distances=distances)
        return SimpleNamespace(contact=np.array([1, 1, 1, 0]), inverted=np.array([1, 1, 0, 0]))

    found = make_map(
        used=np.array([1, 0, 0, 0]),
        r2=0.98765,
        slope=-1.234,
        intercept=34.567,
        error=0.4321,
        monotone=True,
        told_apart=(6.04, 19.96),
        undefined="",
        distance=np.array([11.0, 9.0, 7.0, 5.0]),
        at_base=np.zeros(4, int),
    )
    plant(monkeypatch, wall, approach=approach, map_distance=lambda sweep: found)
    said = run(
        "wall",
        "linear",
        "--near",
        5,
        "--far",
        11,
        "--steps",
        4,
        "--angle",
        40,
        "--reading",
        "total",
    )
    assert "R²   slope  intercept mm  error mm  monotone  discriminated mm" in said
    row = read(rf"linear +# +# +# +# +# +# +# +yes +{NUMBER} to {NUMBER}", said)
    assert row == pytest.approx([3, 2, 1, 0.988, -1.23, 34.57, 0.43, 6.0, 20.0])
    np.testing.assert_allclose(asked["distances"], [11, 9, 7, 5])  # mm
    assert (asked["posture"].inter_antennal_angle, asked["posture"].reading) == (40.0, "total")


def test_wall_says_what_is_undefined(monkeypatch):
    found = make_map(
        used=np.zeros(4, int),
        undefined="the peak stays at one place",
        at_base=np.array([1, 1, 0, 0]),
    )
    sweep = SimpleNamespace(contact=np.ones(4, int), inverted=np.ones(4, int))
    plant(monkeypatch, wall, approach=lambda *_: sweep, map_distance=lambda sweep: found)
    assert "undefined: the peak stays at one place (2 peaks at the base hinge)" in run(
        "wall", "uniform"
    )


def test_follow_prints_milliseconds_and_millimetres(monkeypatch):
    asked = {}

    def follow(antenna, course, **options):
        asked.update(options, course=course)
        straight = _fit_distance(
            np.arange(5.0), np.arange(5.0), np.ones(5, bool), np.zeros(5, bool), resolution=0.1
        )
        return wall.Run(
            time=np.array([0.0, 61.7, 123.4]),
            body=np.zeros((3, 3)),
            distance=np.array([12.0, 9.0, 11.0]),
            estimate=np.array([np.nan, 9.5, 11.5]),
            target=10.0,
            collided=False,
            map=straight,
        )

    plant(monkeypatch, wall, follow=follow)
    words = ("follow", "--turn", -20, "--speed", 0.3, "--target", 10, "--friction", 0.2)
    said = run(*words)
    numbers = read(
        r"passed after # ms; tracking error # mm, nearest # mm, estimate off by # mm \(map R² #\)",
        said,
    )
    assert numbers == pytest.approx(
        [123, np.sqrt((2**2 + 1 + 1) / 3), 9.0, 0.5, 1.0], abs=0.006
    )
    assert (asked["speed"], asked["controller"].target, asked["posture"].friction) == (
        0.3,
        10.0,
        0.2,
    )  # m/s = mm/ms
    assert asked["course"].turns == (-20.0,)
    assert "did not count" not in said and "did not count" in run(*words, "--oracle")
    known = json.loads(run(*words, "--json"))
    assert known.pop("collided") is False
    units = known.pop("units")
    assert [
        known[name] for name in ("duration", "error", "nearest", "estimate_error", "r2")
    ] == (pytest.approx([123.4, *numbers[1:]], abs=0.006))
    lengths = ("error", "nearest", "estimate_error")
    assert {units[name] for name in lengths} == {"mm"} and units["duration"] == "ms"


def test_calibrate_prints_each_quantity_with_the_unit_of_its_target(monkeypatch):
    def fit(problem, *_, **__):
        measured = SimpleNamespace(
            names=tuple("abcd"),
            values=np.array([0.01812, 0.5123, 0.234, 0.567]),
            overdamped=False,
        )
        p = np.array([37.78, -0.0827, 25.24, -0.0533])
        assert problem.hinges.names == ("p1", "p2", "p3", "p4")
        return calibration.Fit(
            names=problem.hinges.names,
            p=p,
            error=0.0671,
            symmetric_accuracy=0.0035,
            measured=measured,
            minima=(),
        )

    plant(monkeypatch, calibration, fit=fit)
    said = run("calibrate")
    assert read("p1 = # N·mm/rad", said) == [37.78]
    assert read(r"frequency +# kHz, target # \[D\]", said) == [0.01812, 0.0175]
    assert read(r"damping_ratio +#, target # \[D\]", said) == [0.5123, 0.54]
    assert read(r"ratio_71 +#, target # \[D\]", said) == [0.234, 0.22]
    assert read("error #, median symmetric accuracy #", said) == [0.0671, 0.0035]


def test_calibrate_prints_each_animal_and_the_interval(monkeypatch):
    result = make_fit()
    plant(monkeypatch, calibration, fit_traces=lambda *_, **__: result)
    said = run("calibrate", "--data", "synthetic_step")
    assert read("one +# +# +#\n", said) == [1.1, 0.9, 0.02]
    assert read("two +# +# +#\n", said) == [1.3, 0.7, 0.04]
    assert read(r"p1 = # +\(95 %: # to #; spread between animals\)", said) == [1.2, 1.05, 1.35]
    assert read(r"p2 = # +\(95 %: # to #; ", said) == [0.8, 0.65, 0.95]


def test_a_sensor_report_is_in_degrees_and_degrees_a_minute():
    numbers = dict.fromkeys(("offset", "low", "high"), np.zeros(1))
    report = SensorCalibration(
        slope=np.array([np.pi / 90]),
        residual=np.array([np.pi / 360]),
        cross_validated=np.array([np.pi / 300]),
        resolution=np.array([np.pi / 600]),
        drift=np.array([np.pi / 180 / 60_000]),
        r_squared=np.array([0.987]),
        **numbers,
    ).report()
    assert report.splitlines()[0].split()[-2:] == ["drift", "°/min"]
    assert [float(word) for word in report.splitlines()[1].split()] == pytest.approx(
        [1, 2.0, 0.987, 0.5, 0.6, 0.3, 1.0], abs=6e-4
    )


def test_an_answer_is_in_per_cent_and_metres_per_second():
    said = str(
        Answer(
            label=("ball", 0.7, 0.135),
            probability=0.834,
            runner_up=("box", 0.6, 0.27),
            runner_up_probability=0.1,
            truth={"feature": "ball", "speed": 0.27},
            known=True,
        )
    )
    assert said.startswith(
        "ball at 0.7 of the length, 0.135 m/s (83%); then box at 0.6 of the length, 0.27 m/s (10%)"
    )
    assert said.endswith("the notes say feature ball, speed 0.27: WRONG: speed")
    assert name_touch(("no contact", np.nan, np.nan)) == "no contact"


def test_info_prints_sizes_extremes_and_units(tmp_path):
    tensors = make_set()
    save(tensors, tmp_path / "set.nc")
    said = run("info", tmp_path / "set.nc")
    assert "trial 8, sensor 5, time 40, axis 2" in said
    low, high = read(r"angle +\(trial, sensor, time\) \[rad\] # … #", said)
    assert (low, high) == pytest.approx(
        (float(tensors.angle.min()), float(tensors.angle.max())), rel=5e-3
    )
    assert read(r"time +# … # \(40 values\) \[ms\]", said) == [0.0, 39.0]


def test_info_prints_an_antenna_in_millimetres_milligrams_and_newton_millimetres(tmp_path):
    run("antenna", tmp_path / "a.toml")
    said, antenna = run("info", tmp_path / "a.toml"), cockroach()
    assert read("segments +#, # mm, # mg", said) == pytest.approx(
        [140, 42.0, 2.00922], rel=1e-5
    )
    assert read(r"stiffness +# \(base\) … # \(tip\) N·mm/rad", said) == pytest.approx(
        antenna.stiffness[[0, -1]], rel=1e-5
    )
    assert read(r"damping +# \(base\) … # \(tip\) N·mm·ms/rad", said) == pytest.approx(
        antenna.damping[[0, -1]], rel=1e-5
    )
    assert read("sensors +#", said) == [56]


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ("stiffness=2", "stiffness"),
        ("damping=2", "damping"),
        ("cockroach.mass=2", "segment_mass"),
        ("length=2", "segment_length"),
        ("radius=2", "radius"),
    ],
)
def test_set_scales_one_quantity_alone(change, field):
    antenna = cockroach()
    changed = change_antenna(antenna, [change])
    for name in ("stiffness", "damping", "segment_mass", "segment_length", "radius"):
        np.testing.assert_allclose(
            getattr(changed, name), getattr(antenna, name) * (2.0 if name == field else 1.0)
        )


def test_tracks_json_and_table_are_in_degrees_per_second(tmp_path):
    path = files("feeler.tracking") / "data" / "synthetic_tracks_xypts.csv"
    result = CliRunner().invoke(
        app,
        ["tracks", str(path), "--frame-rate", "30", "--json", "--out", str(tmp_path)],
        catch_exceptions=False,
    )
    found = json.loads(result.stdout)
    tracks = feeler.tracking.load_tracks(path, frame_rate=30)
    expected = feeler.tracking.measure_exploration([tracks])
    per_second = 1e3 * 180 / np.pi
    assert (
        found["mean"] == pytest.approx(per_second * expected.mean)
        and found["units"]["mean"] == "deg/s"
    )
    assert found["lateral_speed"] is found["length"] is None
    assert found["units"]["lateral_speed"] == "m/s"
    assert found["trials"][0]["mean_peak"] == pytest.approx(per_second * expected.mean_peak[0])
    assert found["trials"][0]["error"] == pytest.approx(per_second * expected.error[0])
    page = re.sub("<[^>]+>", " ", (tmp_path / "tracks.html").read_text(encoding="utf-8"))
    cell = r"\s+# ± # \(#\)"
    said = read(
        rf"left \[°/s\] \(peaks\)\s+right \[°/s\] \(peaks\).*?\.csv{cell}{cell}",
        " ".join(page.split()),
    )
    one = found["trials"][0]
    assert said[:3] == pytest.approx(
        [one[name][0] for name in ("mean_peak", "error", "n_peaks")], rel=0.06
    )
    assert said[3:] == pytest.approx(
        [one[name][1] for name in ("mean_peak", "error", "n_peaks")], rel=0.06
    )
    table = np.genfromtxt(
        tmp_path / "tracks.csv", delimiter=",", names=True, dtype=None, encoding="utf-8"
    )
    left = table[table["side"] == "left"]
    sweeps = expected.sweeps[0][0]
    np.testing.assert_allclose(left["time_ms"], tracks.time, rtol=1e-5)
    np.testing.assert_allclose(
        left["angle_deg"], np.rad2deg(sweeps.angle), rtol=1e-4, atol=1e-4
    )
    np.testing.assert_allclose(
        left["speed_deg_per_s"], per_second * sweeps.speed, rtol=1e-4, atol=1e-3
    )


def test_the_picture_of_tracks_is_in_degrees_over_seconds():
    path = files("feeler.tracking") / "data" / "synthetic_tracks_xypts.csv"
    tracks = feeler.tracking.load_tracks(path, frame_rate=30)
    result = feeler.tracking.measure_exploration([tracks])
    plot_exploration(result, figure := Figure(), [path.name])
    angle, speed = figure.axes
    assert (angle.get_xlabel(), angle.get_ylabel()) == ("time [s]", "angle [°]")
    assert (speed.get_xlabel(), speed.get_ylabel()) == ("time [s]", "|speed| [°/s]")
    for k, sweeps in enumerate(result.sweeps[0]):
        np.testing.assert_allclose(
            angle.lines[k].get_data(), [tracks.time / 1e3, sweeps.angle * 180 / np.pi]
        )
        fast, peaks = speed.lines[2 * k : 2 * k + 2]
        np.testing.assert_allclose(
            fast.get_data(), [tracks.time / 1e3, np.abs(sweeps.speed) * 180e3 / np.pi]
        )
        np.testing.assert_allclose(
            peaks.get_data(), [sweeps.peak_time / 1e3, sweeps.peak_speed * 180e3 / np.pi]
        )


def test_tracks_prints_a_posture_in_degrees(tmp_path, monkeypatch):
    bend = xr.DataArray(
        np.deg2rad([[10.0, -30.0], [20.0, 5.0], [np.nan, 15.0]]),
        dims=("time", "joint"),
        coords={"joint": ["p1", "p2"]},
    )
    posture = xr.Dataset({"bend": bend, "piece_length": ("piece", [3.0, 4.5])})
    posture["position"] = xr.DataArray(np.zeros(3), dims="time", attrs={"units": "mm"})
    monkeypatch.setattr(feeler.tracking, "measure_posture", lambda *_: posture)
    monkeypatch.setattr(
        feeler.tracking,
        "load_tracks",
        lambda *_, **__: SimpleNamespace(
            n_frames=3, landmarks=["base"], settings={}, min_likelihood=0.6
        ),
    )
    said = run("tracks", tmp_path / "x.csv", "--points", "base,p1,p2,tip")
    assert "x.csv: 7.5 mm long, 2 of 3 frames whole; largest bend p1 20.0°, p2 30.0°" in said


def test_the_page_of_a_fit_says_its_factors_and_its_error(tmp_path):
    run("robot", "fit", get_example("release"), "--out", tmp_path)
    found = json.loads((tmp_path / "robot.json").read_text())
    page = (tmp_path / "robot.html").read_text(encoding="utf-8")
    p1, p2, error = read("p1 = #, p2 = # ms, error #", page)
    assert (p1, p2) == pytest.approx(
        (found["stiffness_factor"], found["damping_factor"]), abs=6e-5
    )
    assert error == pytest.approx(found["error"], rel=0.05)
    words = " ".join(re.sub("<[^>]+>", " ", page).split())
    head = r"damped frequency \[Hz\] damping ratio a damped cosine explains"
    row = read(rf"{head} recording # # #% model", words)
    ringing = found["recording"]
    expected = [
        1e3 * ringing["frequency"],
        ringing["damping_ratio"],
        100 * ringing["r_squared"],
    ]
    assert row == pytest.approx(expected, rel=1e-3)
