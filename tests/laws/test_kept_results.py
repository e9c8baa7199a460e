"""A kept result says which code made it, and is named when that code has changed."""

import sys

import pytest
from scripts import load_script

kept = load_script("benchmarks", "kept")


@pytest.fixture
def script(tmp_path, monkeypatch):
    """A script in a repository of its own."""
    monkeypatch.setattr(kept, "ROOT", tmp_path)
    monkeypatch.setattr(kept, "STAMPS", tmp_path / "made.json")
    script = tmp_path / "measure.py"
    script.write_text("from feeler.analysis import compute_nmi\n\nprint(compute_nmi)\n")
    monkeypatch.setattr(sys, "argv", [str(script)])
    return script


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("# a remark\n", "by today's code"),
        ("print(2)\n", "by other code than today's; run measure.py again"),
        ("from feeler.records import make_picture\n", "by other code than today's"),
    ],
)
def test_a_result_is_named_when_the_code_behind_it_changes(script, tmp_path, change, words):
    kept.write_kept(tmp_path / "found.json", "{}\n")
    script.write_text(script.read_text() + change)
    assert words in kept.describe(tmp_path / "found.json", kept.read_stamps()["found.json"])


def test_a_result_without_a_note_is_named(tmp_path, script):
    assert "nothing is noted" in kept.describe(tmp_path / "old.json", None)
