"""Verbs that print numbers print them as JSON where asked: the same, and nothing beside."""

import json

import pytest

from feeler.presets import make_preset
from feeler.robot.description import get_example
from tests.cli._command import run


@pytest.fixture
def folder(tmp_path):
    run("antenna", "a.toml", "--preset", "cricket", cwd=tmp_path)
    (tmp_path / "broken.toml").write_text('schema = "feeler.antenna/1"')
    return tmp_path


def ask(*words, cwd, code=0):
    done = run(*words, "--json", cwd=cwd)
    assert done.returncode == code, done.stderr
    return json.loads(done.stdout)


def test_info_and_validate(folder):
    (said,) = ask("info", "a.toml", cwd=folder)
    assert (
        said["file"] == "a.toml"
        and said["says"] == run("info", "a.toml", cwd=folder).stdout.splitlines()
    )
    good, bad = ask("validate", "a.toml", "broken.toml", cwd=folder, code=1)
    assert good == {"file": "a.toml", "valid": True, "problems": []}
    assert not bad["valid"] and "n_segments" in bad["problems"][0]


def test_wall_takes_files_and_says_undefined_as_null(folder):
    found = ask("wall", "a.toml", "--near", "10", "--far", "12", "--steps", "2", cwd=folder)[
        "a"
    ]
    assert found["distance"] == [12.0, 10.0] and len(found["contact"]) == 2
    assert found["r2"] is None and "a fit needs 3" in found["undefined"]


def test_sensors_and_recordings_of_a_robot(folder):
    """The files are feeler's own examples, in the layout of the robot's guide."""
    table, touch = (str(get_example(name)) for name in ("calibration", "recording"))
    lines = ask("robot", "calibrate", table, "--out", "c.json", cwd=folder)
    assert (
        len(lines["slope"]) == make_preset("robot").sensors.size == 8
        and min(lines["r_squared"]) > 0.9
    )
    (said,) = ask("robot", "check", touch, "--calibration", "c.json", cwd=folder)
    assert said["channels"] == 8 and said["source"] == "surrogate" and said["history"]
