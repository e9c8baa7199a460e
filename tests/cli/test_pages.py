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
from tests.tensors._sets import judge


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
