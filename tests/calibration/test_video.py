"""A video's traces: held, let go between two frames, in pixels from anywhere, at one or more
points.
"""

import json

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from feeler.antenna.files import load_antenna, save_antenna
from feeler.calibration import Protocol, Traces, fit_traces, load_traces, make_hinges
from feeler.calibration.traces import find_release, find_rest
from feeler.errors import InvalidInput
from tests.cli._command import run

from .small_antenna import make_small

QUICK = Protocol(timestep=0.05)
PLANTED = (1.3, 0.8, -0.6, 0.4)
LATE = 0.4  # of a frame, between the last held frame and the release


def film(places, p, family="tilt", noise=0.05, frames=(40, 110), seed=0):
    """Pixels (point, frame) of an antenna that is let go after ``frames[0]`` frames of a camera
    with 1000 per second.
    """
    hinges = make_hinges(family, make_small())
    (outcome,) = Protocol(timestep=0.05, step_duration=frames[1] + 2.0).simulate_steps(
        [hinges.build(np.array(p))], places
    )
    moved = CubicSpline(*outcome, axis=1)(
        np.maximum(np.arange(-frames[0], frames[1]) - LATE, 0.0)
    )
    return 300 + 40 * moved + noise * np.random.default_rng(seed).standard_normal(moved.shape)


def write(path, names, pixels):
    lines = [
        f"{k + 500}," + ",".join(f"{value:.6f}" for value in row)
        for k, row in enumerate(pixels.T)
    ]
    path.write_text("\n".join(["frame," + ",".join(names), *lines]))
    return path


@pytest.mark.long
def test_the_whole_posture_gives_a_planted_profile_back(tmp_path):
    file = write(
        tmp_path / "video.csv", ("a@0.5", "a", "a@0.8"), film((0.5, 1.0, 0.8), PLANTED)
    )
    traces = load_traces(file, frame_rate=1000, release="found")
    assert (
        traces.found
        and traces.animals == ("a",)
        and abs(traces.displacement[:, -1]).max() < 0.5
    )
    done = []
    result = fit_traces(
        traces,
        make_small(),
        protocol=QUICK,
        progress=lambda k, n: done.append((k, n)),
    )
    assert result.names == ("stiffness", "damping", "stiffness_tilt", "damping_tilt")
    assert np.all(result.low < PLANTED) and np.all(result.high > PLANTED) and done == [(1, 1)]
    assert result.residual["a: release"] < 0.02 and np.abs(result.p - PLANTED).max() < 0.05
    true = make_hinges("tilt", make_small()).build(np.array(PLANTED))
    np.testing.assert_allclose(result.antenna.stiffness, true.stiffness, rtol=0.05)
    assert (
        result.directions.condition > 1
        and "The data determine" in result.directions.describe("data")
    )


def test_animals_let_go_at_different_frames_are_cut_to_the_shortest(tmp_path):
    rows = [
        film((1.0,), (1.0, 1.0), "scale", frames=frames)[0] for frames in ((40, 90), (60, 70))
    ]
    file = write(tmp_path / "video.csv", ("a", "b"), np.array(rows))
    traces = load_traces(file, frame_rate=1000, release="found")
    held = [find_release(row)[0] for row in rows]
    assert held[1] - held[0] == 20 and traces.time.tolist() == [
        float(t) for t in range(130 - held[1])
    ]
    for row, first, cut in zip(rows, held, traces.displacement, strict=True):
        np.testing.assert_allclose(
            np.ptp(cut - row[first : first + traces.time.size]), 0, atol=1e-4
        )


def test_each_point_has_a_rest_of_its_own(tmp_path):
    """One motion, seen at two places: 0.4 of it about 7, all of it about −3."""
    row = film((1.0,), (1.0, 1.0), "scale", frames=(40, 90))[0]
    file = write(tmp_path / "video.csv", ("a@0.5", "a"), np.array([0.4 * row + 7, row - 3]))
    half, tip = load_traces(file, frame_rate=1000, release="found").displacement
    np.testing.assert_allclose(half, 0.4 * tip, atol=2e-3 * np.ptp(tip))


def test_an_overdamped_tip_is_fitted_sample_by_sample():
    time = np.arange(0.0, 400.0, 2.0)
    hinges = make_hinges("scale", make_small())
    own, moved = Protocol(timestep=0.05, step_duration=401.0).simulate_steps(
        [hinges.build(np.array([1.0, 40.0]))]
    )[0]
    slow = Traces(
        time=time, displacement=CubicSpline(own, moved[0])(time)[None], names=("creeper",)
    )
    found = fit_traces(slow, make_small(1.0, 20.0), protocol=QUICK)
    assert found.p == pytest.approx([1.0, 2.0], rel=0.02)


@pytest.mark.parametrize("noise", [0.0, 0.3])
def test_the_last_held_sample_is_found_though_the_tip_first_rises(noise):
    time = np.arange(-30, 100)
    swing = np.where(
        time <= 0, 1.0, np.exp(-0.05 * time) * (np.cos(0.3 * time) + 1.5 * np.sin(0.3 * time))
    )
    signal = 250 - 60 * swing + noise * np.random.default_rng(1).standard_normal(time.size)
    first, rest = find_release(signal)
    assert first in (30, 31) and rest == pytest.approx(250, abs=0.5)


def test_the_noise_of_a_video_is_that_of_its_second_differences():
    """White noise of sd σ has second differences of sd √6 σ, and a median of 0.6745 sd."""
    with pytest.raises(InvalidInput, match=r"with a noise of 3\.7\."):
        find_release(3.7 * np.random.default_rng(0).standard_normal(20_000))


def test_rest_is_the_median_of_the_last_fifth():
    signal = np.r_[np.full(80, 5.0), np.arange(19.0), 900.0]
    assert find_rest(signal) == np.median(signal[80:]) == 9.5
    assert find_rest(np.r_[7.0, 0.0, 1.0, 2.0, 3.0, 40.0]) == 2.0  # five samples at least


def test_a_violent_swing_is_no_noise():
    rng, time = np.random.default_rng(1), np.arange(1, 300)
    swing = np.r_[np.ones(30), 4.0 * np.exp(-time / 20.0) * np.cos(2.0 * time)]
    assert find_release(swing + 0.01 * rng.standard_normal(swing.size))[0] == 29


@pytest.mark.parametrize("sign", [-1, 1])
def test_a_held_tip_that_creeps_is_let_go_where_it_leaves_either_way(sign):
    held = 1.0 + 0.004 * np.linspace(0, 1, 30)
    assert find_release(sign * np.r_[held, np.exp(-np.arange(1, 100) / 9.0)]) == (
        29,
        pytest.approx(0.0, abs=1e-3),
    )


@pytest.mark.parametrize(
    ("signal", "match"),
    [
        (np.random.default_rng(0).standard_normal(100), "no release is found"),
        (np.exp(-np.arange(100) / 10.0), "let go within the first 5 samples"),
    ],
)
def test_traces_without_a_held_part_are_refused(signal, match):
    with pytest.raises(InvalidInput, match=match):
        find_release(signal, "trace 'a'")


@pytest.mark.parametrize(
    ("header", "how", "match"),
    [
        ("frame,a", {}, "counts frames: say how many per second"),
        ("time_ms,a", {"frame_rate": 200.0}, "holds times .time_ms.; a frame rate is for"),
        ("frame,a", {"frame_rate": 0.0}, "frame_rate must be > 0, got 0"),
        ("frame,a@half", {"frame_rate": 200.0}, "what follows @ is a fraction"),
        ("frame,a@1.5", {"frame_rate": 200.0}, "what follows @ is a fraction"),
        (
            "frame,a",
            {"frame_rate": 200.0, "release": "guessed"},
            "release must be one of first, found",
        ),
    ],
)
def test_what_is_missing_or_odd_is_said(tmp_path, header, how, match):
    file = tmp_path / "t.csv"
    file.write_text(header + "\n" + "\n".join(f"{k},{np.exp(-k / 9):.5f}" for k in range(30)))
    with pytest.raises(InvalidInput, match=match):
        load_traces(file, **how)


@pytest.mark.long
def test_the_command_leaves_antenna_page_and_numbers(tmp_path):
    """The file is laid out as the guide says: a column frame, then one per point."""
    save_antenna(make_small(), tmp_path / "small.toml")
    write(tmp_path / "video.csv", ("a",), film((1.0,), (1.3, 0.8), "scale"))
    asked = ("--frame-rate", "1000", "--antenna", "small.toml", "--at", "10", "--out", "fit")
    done = run("calibrate", "--data", "video.csv", *asked, "--json", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["p"] == pytest.approx([1.3, 0.8], rel=0.05)
    fitted = load_antenna(tmp_path / "fit" / "antenna.toml")
    np.testing.assert_allclose(fitted.stiffness, found["p"][0] * make_small().stiffness)
    assert (tmp_path / "fit" / "release_a.png").is_file()
    done = run("calibrate", "--data", "video.csv", "--profile", "tilt", *asked, cwd=tmp_path)
    assert done.returncode == 2 and "--profile is for targets" in done.stderr


def test_a_lone_outlier_is_no_release():
    """The release leaves what is held for two samples; one bad sample before it does not count."""
    rng = np.random.default_rng(6)
    time = np.arange(400.0)
    signal = np.where(time < 120, 3.0, 3.0 * np.exp(-(time - 119) / 25) * np.cos(time / 4))
    signal += 0.002 * rng.standard_normal(400)
    clean, rest = find_release(signal)
    signal[60] = 9.0
    assert find_release(signal)[0] == clean
    assert abs(clean - 119) <= 2
    assert abs(rest) < 0.01
