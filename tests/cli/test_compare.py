"""Any antennas side by side: other numbers of sensors, own objects; equal antennas get equal
answers.
"""

import json

import pytest

from tests.cli._command import run

OBJECT = """[[object]]
name = "bolt"
shape = "ball"
radius = 3.0
"""


@pytest.mark.long
def test_equal_antennas_have_equal_numbers_and_others_their_own(tmp_path):
    (tmp_path / "objects.toml").write_text(OBJECT)
    run("antenna", "twin.toml", "--preset", "robot", cwd=tmp_path)
    asked = (
        "--scale",
        "smoke",
        "--objects",
        "objects.toml",
        "--speed",
        "0.3",
        "--out",
        "c.html",
        "--json",
    )
    done = run("compare", "robot", "twin.toml", "cricket", *asked, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert (
        found["antennas"] == ["robot", "twin", "cricket"]
        and "over all classes" in (tmp_path / "c.html").read_text()
    )
    measures = [
        by_antenna
        for by_antenna in found.values()
        if isinstance(by_antenna, dict) and "twin" in by_antenna
    ]
    assert len(measures) == 11
    assert all(m["robot"] == m["twin"] for m in measures) and all(
        m["robot"] != m["cricket"] for m in measures[:7]
    )
