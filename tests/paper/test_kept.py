"""What a run does not compute is shown from the kept run, and says so."""

import re
from dataclasses import replace

import pytest
from PIL import Image

from feeler import provenance
from feeler.report.page import Section
from paper.context import Context
from paper.kept import find_shipped, keep_sections
from paper.report import OPENING_MOVIE
from paper.stage import Stage
from paper.statements import load_statements
from paper.verdicts import judge_statements


def show(context, section):
    section.text("Three antennae.")
    section.figure("three", "Three lines.", lambda figure: figure.subplots().plot([3, 1, 2]))
    section.values["three.lines"] = 3.0


STAGE = Stage(
    name="three", title="Three", make=show, reads=("scale", "seed", "engine", "antenna")
)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """One kept section, of a whole run with seed 0."""
    folder = tmp_path_factory.mktemp("kept")
    (made := folder / "made").mkdir()
    section = Section(name=STAGE.name, title=STAGE.title, folder=made, seconds=41.7)
    show(None, section)
    section.save()
    keep_sections([(STAGE, section)], Context(scale="paper"), folder)
    return folder


def test_a_kept_section_has_its_numbers_and_says_whence(folder):
    found = find_shipped(STAGE, Context(scale="quick"), folder)
    assert found.values == {"three.lines": 3.0} and found.scale == "paper"
    assert re.fullmatch(
        r"Precomputed at paper scale on \d{4}-\d\d-\d\d \(seed 0, 42 s\)\.", found.kept
    )
    assert (found.folder / found.blocks[1]["file"]).stat().st_size < 100_000


def test_the_first_screen_s_movie_is_kept_as_a_movie(tmp_path):
    (made := tmp_path / "made").mkdir()
    section = Section(name=STAGE.name, title=STAGE.title, folder=made)
    for name in (OPENING_MOVIE, "other.mp4"):
        path = made / name
        path.write_bytes(b"frames")
        Image.new("RGB", (4, 3)).save(path.with_suffix(".jpg"))
        section.movie(path, "A movie.")
    section.save()
    keep_sections([(STAGE, section)], Context(scale="paper"), tmp_path)
    found = find_shipped(STAGE, Context(scale="quick"), tmp_path)
    assert [block["kind"] for block in found.blocks] == ["movie", "figure"]
    assert (found.folder / OPENING_MOVIE).read_bytes() == b"frames"
    assert (found.folder / found.blocks[0]["still"]).exists()


@pytest.mark.parametrize("asked", [{"seed": 3}, {"engine": "mujoco"}, {"is_cockroach": False}])
def test_who_asks_something_else_gets_no_kept_section(folder, asked):
    assert find_shipped(STAGE, Context(scale="quick", **asked), folder) is None


def test_a_section_of_other_physics_says_so(folder, monkeypatch):
    monkeypatch.setattr(provenance, "PHYSICS", provenance.PHYSICS + 1)
    found = find_shipped(STAGE, Context(scale="quick"), folder)
    assert found.kept.endswith("Its settings or the physics have changed since.")


def test_a_kept_section_is_judged_at_its_own_scale(tmp_path):
    statement = next(one for one in load_statements() if one.scale == "paper")
    section = Section(name=statement.section, title="", folder=tmp_path)
    judged = {
        scale: next(
            one
            for one in judge_statements([replace(section, scale=scale)], Context(scale="quick"))
            if one.statement == statement
        )
        for scale in ("", "paper")
    }
    assert "paper judges it" in judged[""].why
    assert "judges it" not in judged["paper"].why
