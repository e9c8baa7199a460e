"""Verbs that make pictures leave a page that stands by itself and says the numbers that the verb
found.
"""

import json
import re

import numpy as np
import pytest
from typer.testing import CliRunner

from feeler.antenna.files import load_antenna
from feeler.calibration import fit_traces, load_traces
from feeler.cli.app import app
from feeler.presets import cockroach
from feeler.tracking import make_synthetic_tracks
from tests.tensors._sets import judge
from tests.tracking.dltdv import save_dltdv


def run(*words):
    found = CliRunner().invoke(app, [str(word) for word in words])
    assert found.exit_code == 0, found.output
    return found.output


def read_page(path):
    page = path.read_text(encoding="utf-8")
    assert page.startswith("<!doctype html>")
    asked = re.findall(r'(?:src|href)="(?!data:|#)([^"]+)"', page)
    assert all(link.startswith("https://doi.org/") for link in asked), asked
    assert "data:image/" in page
    return re.sub(r"data:[^\"]+", "", page)


@pytest.mark.long
def test_the_fitted_antenna_is_kept_and_its_numbers_stand_in_the_page(tmp_path):
    first = load_traces("synthetic_step")
    rows = [f"{t},{x}" for t, x in zip(first.time, first.displacement[0], strict=True)]
    (tmp_path / "trace.csv").write_text("\n".join(["time_ms,first", *rows]) + "\n")
    calibrated = tmp_path / "out"
    run(
        "calibrate",
        "--data",
        tmp_path / "trace.csv",
        "--out",
        calibrated,
        "--session-start",
        "2026-05-01T09:00:00+02:00",
    )
    assert judge(calibrated / "calibration.nwb") == []
    expected = fit_traces(load_traces(tmp_path / "trace.csv"), cockroach())
    antenna, plain = load_antenna(calibrated / "antenna.toml"), cockroach()
    np.testing.assert_allclose(antenna.stiffness / plain.stiffness, expected.p[0], rtol=1e-12)
    np.testing.assert_allclose(antenna.damping / plain.damping, expected.p[1], rtol=1e-12)
    page = read_page(calibrated / "calibration.html")
    for value in (*expected.p, *expected.low, *expected.high):
        assert f"{value:.4g}" in page
    kept = json.loads((calibrated / "calibration.json").read_text())
    np.testing.assert_allclose(kept["p"], expected.p)


def test_tracks_page_says_planted_speed(tmp_path):
    planted = np.deg2rad(80e-3)
    tracks = make_synthetic_tracks(
        np.random.default_rng(2), peak_speed=(planted, planted), noise=0.1
    )
    save_dltdv(tracks, tmp_path / "walk_xypts.csv")
    run("tracks", tmp_path / "walk_xypts.csv", "--frame-rate", 30, "--out", tmp_path / "out")
    page = read_page(tmp_path / "out" / "tracks.html")
    speeds = [float(value) for value in re.findall(r"(\d+\.\d) ± [\d.]+ \(\d+\)", page)]
    assert len(speeds) == 2
    assert speeds == pytest.approx([80, 80], rel=0.05)


def test_wall_page_names_each_antenna_and_its_r2(tmp_path):
    words = run("wall", "exponential", "--steps", 5, "--out", tmp_path)
    page = read_page(tmp_path / "wall.html")
    kept = json.loads((tmp_path / "exponential.json").read_text())
    assert len(kept["distance"]) == 5
    assert f"{kept['r2']:.3f}" in words
    assert f"{kept['r2']:.4g}" in page
