"""A cached result says under which versions it was made, and is named when it is stale."""

import pytest
from scripts import load_script

kept = load_script("benchmarks", "kept")


@pytest.fixture
def stamp(tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "ROOT", tmp_path)
    monkeypatch.setattr(kept, "STAMPS", tmp_path / "made.json")
    monkeypatch.setattr(kept.sys, "argv", [str(tmp_path / "measure.py")])
    kept.write_kept(tmp_path / "found.json", "{}\n")
    return kept.read_stamps()["found.json"]


def test_a_result_is_stale_under_another_physics_or_release(stamp, tmp_path, monkeypatch):
    assert kept.describe(tmp_path / "found.json", stamp).endswith("current")
    for change in ({"physics": 0}, {"feeler": "0.2"}):
        assert "stale; run measure.py" in kept.describe(tmp_path / "found.json", stamp | change)


def test_a_result_without_a_note_is_named(stamp, tmp_path):
    assert "nothing is noted" in kept.describe(tmp_path / "old.json", None)
