"""Speed against accuracy: the task is one for all speeds, windows hold what they say, and best is
best.
"""

import json

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import feeler
from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.information import compute_information, scale_peaks
from feeler.studies.tradeoff import (
    average_sets,
    draw_touches,
    find_best,
    load_declared,
    measure_tradeoff,
)
from feeler.studies.tradeoff.measure import list_windows

BALLS = [feeler.Ball(radius=1.5), feeler.Ball(radius=3.0)]


@pytest.fixture(scope="module")
def declared():
    return load_declared(sets=2, speeds=(0.6, 1.2), levels={"relative": (1.0,), "common": (0.03,)})


@pytest.fixture(scope="module")
def measured(declared):
    return measure_tradeoff(feeler.presets.cockroach(), declared, BALLS)


def test_all_speeds_meet_the_same_touches(declared):
    slow, fast = (draw_touches(declared, 3, speed=speed) for speed in (0.03, 1.2))
    assert len(slow) == 30
    assert [(t.feature, t.location, t.approach, t.friction) for t in slow] == [
        (t.feature, t.location, t.approach, t.friction) for t in fast
    ]
    assert draw_touches(declared, 4)[0].location != slow[0].location


def test_draws_stay_in_their_ranges(declared):
    trials = [
        trial for number in range(20) for trial in draw_touches(declared, number, BALLS, [0.7])
    ]
    assert max(abs(t.location - 0.7) for t in trials) <= declared.jitter["location"]
    assert max(abs(t.approach - 90) for t in trials) <= declared.jitter["approach"]
    assert {t.name for t in trials} == {"ball"}
    low, high = declared.jitter["friction"]
    assert all(low <= t.friction <= high for t in trials)


def test_a_window_is_the_samples_that_it_names(declared, measured):
    """20 ms at 0.6 m/s and 12 mm are not in the table of one kind only: what is the same window
    tells the same.
    """
    trials = draw_touches(declared, 1, BALLS, speed=0.6)
    angle = feeler.touch(feeler.presets.cockroach(), trials, duration=60.0)["angle"].values
    found = measured.isel(set=1).sel(speed=0.6)
    common = compute_information(angle[:, :, 6:26], 0.03, n_draws=declared.draws, random_state=1)
    assert float(found["bits"].sel(level="common 0.03", window="20 ms")) == pytest.approx(
        common.bits, abs=1e-3
    )
    every = compute_information(angle[:, :, 7:46:2], 0.03, n_draws=declared.draws, random_state=1)
    assert float(
        found["bits"].sel(level="common 0.03", window="24 mm, 20 samples")
    ) == pytest.approx(every.bits, abs=1e-3)


def test_more_samples_tell_more(measured):
    for kind in ("time", "distance"):
        mean = (
            measured["bits"]
            .mean("set")
            .isel(window=np.flatnonzero(measured["kind"].values == kind))
        )
        assert np.all(np.diff(mean.values, axis=-1) > -0.02)  # the drawn noise differs a little
    assert np.all(
        measured["bits"].sel(window="800 ms") == measured["bits"].sel(window="whole touch")
    )


def test_relative_noise_is_of_the_whole_touchs_peak(declared, measured):
    trials = draw_touches(declared, 0, BALLS, speed=1.2)
    length = feeler.presets.cockroach().length
    angle = feeler.touch(feeler.presets.cockroach(), trials, duration=np.ceil(105 + length / 1.2))[
        "angle"
    ].values
    known = compute_information(
        scale_peaks(angle)[:, :, 6:], 1.0, n_draws=declared.draws, random_state=0
    )
    found = (
        measured["accuracy"].isel(set=0).sel(speed=1.2, level="relative 1", window="whole touch")
    )
    assert float(found) == pytest.approx(known.accuracy, abs=1e-3)


def test_faster_costs_more(measured):
    assert np.all(measured["work"].sel(speed=1.2) > measured["work"].sel(speed=0.6))
    assert np.all(measured["force"].sel(speed=1.2) > measured["force"].sel(speed=0.6))


def test_best_and_what_is_not_told_from_it():
    values = np.array(
        [[[0.5, 0.9], [0.6, 0.2]], [[0.5, 0.8], [0.9, 0.1]], [[0.5, 0.7], [0.45, 0.3]]]
    )  # set, speed, window
    data = xr.Dataset(
        {"accuracy": (("set", "speed", "level", "window"), values[:, :, None])},
        {
            "speed": [0.1, 0.2],
            "level": ["a"],
            "window": ["x", "y"],
            "kind": ("window", ["time"] * 2),
            "value": ("window", [1.0, 2.0]),
        },
    )
    found = find_best(data, "a")
    assert found["best"].values.tolist() == [0.2, 0.1]
    assert found["least"].values.tolist() == [
        0.1,
        0.1,
    ]  # 0.2 is best at x, but three sets do not tell it from 0.1
    assert found["most"].values.tolist() == [0.2, 0.1]
    assert found["gain"].values == pytest.approx([0.15, 0.6])


def test_the_interval_is_students():
    rng = np.random.default_rng(0)
    draws = xr.DataArray(rng.standard_normal((5, 4000)), dims=("set", "case"))
    found = average_sets(draws)
    assert float((abs(found["mean"]) < found["half"]).mean()) == pytest.approx(0.95, abs=0.015)
    assert np.isnan(average_sets(draws[:1])["half"]).all()


def test_every_speed_has_its_matched_samples_on_the_grid():
    """At all declared speeds the matched samples lie on whole samples, so that nothing is rounded."""
    declared = load_declared()
    far, n = declared.windows["matched_distance"], declared.windows["matched_samples"]
    for speed in declared.speeds:
        at = far * np.arange(1, n + 1) / n / speed / declared.sample_interval
        assert at == pytest.approx(np.round(at), abs=1e-9)
    assert len({w.label for w in list_windows(declared)}) == len(list_windows(declared))


def test_the_verb_writes_page_picture_and_numbers(tmp_path):
    arguments = [
        "tradeoff",
        "--out",
        str(tmp_path),
        "--sets",
        "1",
        "--speed",
        "0.6",
        "--speed",
        "1.2",
    ]
    done = CliRunner().invoke(
        app, [*arguments, "--objects", "ball:radius=1.5", "--antenna", "constant", "--json"]
    )
    assert done.exit_code == 0, done.output
    assert {p.name for p in tmp_path.iterdir()} >= {
        f"tradeoff.{end}" for end in ("html", "png", "csv", "json")
    }
    kept = json.loads((tmp_path / "tradeoff.json").read_text())
    assert "constant" in kept and json.loads(done.stdout)["antennas"] == kept
    lines = (tmp_path / "tradeoff.csv").read_text().splitlines()
    assert lines[0].startswith("antenna,speed,level,window,accuracy")
    assert len(lines) == 1 + 2 * 6 * len(list_windows(load_declared()))


def test_no_speed_is_refused():
    with pytest.raises(InvalidInput, match="at least one speed > 0"):
        load_declared(speeds=())
