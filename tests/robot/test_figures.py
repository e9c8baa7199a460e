"""Figures 6, S2 and S7 draw from their data alone and are marked for what they are; examples and
commands work.
"""

import json
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

from feeler.errors import InvalidInput
from feeler.robot.description import EXAMPLES, get_example
from feeler.tracking import load_tracks
from paper import fig6, figS2
from paper.context import Context


@pytest.fixture(scope="module")
def data():
    return fig6.compute(Context(scale="smoke"))


def test_figS2_gives_back_what_was_planted_and_says_synthetic():
    data = figS2.compute(Context())
    np.testing.assert_allclose(
        data.exploration.mean_peak, data.planted, rtol=0.06
    )  # noise lifts peaks
    assert data.planted.mean() == pytest.approx(np.deg2rad(86.67e-3))
    figS2.plot(data, Figure())


def test_example_files_are_labelled():
    for name in EXAMPLES:
        assert get_example(name).read_text().startswith("# source: surrogate\n")
    with pytest.raises(InvalidInput, match="valid: recording, calibration, release"):
        get_example("other")
    tracks = (
        get_example("recording").parents[2] / "tracking" / "data" / "synthetic_tracks_xypts.csv"
    )
    assert load_tracks(tracks, frame_rate=30).source == "synthetic"


@pytest.fixture
def run(tmp_path, monkeypatch):
    from feeler.cli.app import app

    monkeypatch.chdir(tmp_path)

    def invoke(*words, **options):
        return CliRunner().invoke(app, list(words), **options)

    invoke("robot", "example", ".")
    invoke("robot", "calibrate", EXAMPLES["calibration"])
    return invoke


@pytest.mark.long
def test_the_way_from_a_table_to_an_answer(run):
    recording = EXAMPLES["recording"]
    checked = run("robot", "check", recording, "--calibration", "calibration.json")
    assert "8 channels" in checked.output and "source surrogate" in checked.output
    asked = ("--calibration", "calibration.json", "--robots", 8)
    said = run("robot", "classify", recording, *map(str, asked)).output
    assert "at 0.9 of the length, 0.27 m/s" in said
    fitted = run("robot", "fit", EXAMPLES["release"]).output
    assert "p1 = " in fitted and "source: surrogate" in fitted


@pytest.mark.long
def test_check_and_fit_leave_pages_that_say_what_they_print(run, tmp_path):
    asked = (
        "robot",
        "check",
        EXAMPLES["recording"],
        EXAMPLES["release"],
        "--calibration",
        "calibration.json",
        "--json",
    )
    checked = run(*asked, "--out", "checked")
    assert json.loads(checked.stdout) == json.loads(
        (tmp_path / "checked/robot.json").read_text()
    )
    page = (tmp_path / "checked/robot.html").read_text()
    assert page.count("<figure") == 1 and all(
        Path(EXAMPLES[name]).name in page for name in ("recording", "release")
    )
    fitted = run("robot", "fit", EXAMPLES["release"], "--json", "--out", "fitted")
    found = json.loads(fitted.stdout)
    assert found == json.loads((tmp_path / "fitted/robot.json").read_text())
    page = (tmp_path / "fitted/robot.html").read_text()
    assert (
        f"p1 = {found['stiffness_factor']:.4f}" in page
        and f"{1e3 * found['recording']['frequency']:.3f}" in page
    )


def test_conversion_gives_a_valid_set(run, tmp_path):
    xarray = pytest.importorskip("xarray")
    result = run("robot", "convert", EXAMPLES["release"], "--out", "set.nc")
    assert result.exit_code == 0
    with xarray.open_dataset(tmp_path / "set.nc", engine="h5netcdf") as dataset:
        assert dataset["angle"].dims == ("trial", "sensor", "time")
        assert dataset["source"].values.tolist() == ["surrogate"]


def test_errors_reach_the_caller(run):
    result = run("robot", "classify", EXAMPLES["recording"])
    assert isinstance(result.exception, InvalidInput) and "give --calibration" in str(
        result.exception
    )
    assert isinstance(run("tracks", "absent.csv", "--frame-rate", "30").exception, InvalidInput)
