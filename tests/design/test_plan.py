"""Plans: files say what is wrong with them; a plan carried out leaves an antenna, numbers and a page, and goes on."""

import json

import numpy as np
import pytest
from typer.testing import CliRunner

import feeler
from feeler.cli.app import app
from feeler.design import load_plan
from feeler.design.making import SHEETS, make_strips, measure_tolerance
from feeler.design.outcome import carry_out
from feeler.design.plan import TEMPLATE
from feeler.errors import InvalidInput
from tests.design.test_design import ANTENNA, TASK

TEXT = """\
schema = "feeler.design/1"
antenna = "small.toml"
[task]
objects = ["ball:radius=1.5", "box:half_width=1.5,half_height=1.5"]
locations = [0.6, 0.9]
speeds = [0.6]
deadline = 15
level = 0.5
train = 2
test = 2
[task.seeds]
optimiser = 1
test = 2
final = 3
[space]
stiffness = 1
damping = 1
span = 10
[search]
evaluations = 4
starts = 2
"""


def write(folder, text=TEXT):
    feeler.save_antenna(ANTENNA, folder / "small.toml")
    path = folder / "task.toml"
    path.write_text(text)
    return path


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    folder = tmp_path_factory.mktemp("plan")
    return folder, carry_out(load_plan(write(folder)), folder / "out", workers=1)


def test_the_template_is_a_plan(tmp_path):
    path = tmp_path / "task.toml"
    path.write_text(TEMPLATE.format(file="task.toml"))
    plan = load_plan(path)
    assert plan.task.n_classes == 12 and plan.task.seeds == (1, 2, 3)
    assert plan.space.names[:2] == ["stiffness 1", "stiffness 2"] and plan.constraints.damping_share == 1.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"feeler.design/1"', '"feeler.robot/1"', "schema must be"),
        ("[search]", "[serach]", "unknown key 'serach'"),
        ("level = 0.5", "levl = 0.5", r"\[task\] has no 'levl'"),
        ("level = 0.5", "level = -1.0", r"\[task\] level must be finite and > 0"),
        ("span = 10", 'span = "wide"', r"\[space\]"),
        ("optimiser = 1", "optimizer = 1", "seeds must name"),
        ("evaluations = 4", "evaluations = 4.5", r"\[search\] evaluations must be int"),
        ("ball:radius=1.5", "bell", r"\[task\] .*unknown .*'bell'"),
        ("small.toml", "none.toml", "cannot read"),
        ("[space]", "[space", "task.toml"),
    ],
)
def test_a_wrong_file_is_told_what_is_wrong(tmp_path, old, new, words):
    with pytest.raises(InvalidInput, match=words):
        load_plan(write(tmp_path, TEXT.replace(old, new)))


def test_what_is_left_is_whole(made):
    folder, found = made
    kept = feeler.load_antenna(folder / "out" / "antenna.toml")
    assert np.array_equal(kept.stiffness, found.best.stiffness)
    numbers = json.loads((folder / "out" / "design.json").read_text())
    assert numbers["final"]["errors"] == found.final.errors
    assert [test.bits for test in found.tests] == sorted((test.bits for test in found.tests), reverse=True)
    fewer = found.compare()[0]
    assert fewer == pytest.approx(1 - found.final.errors / found.reference_final.errors)


def test_a_second_look_at_the_final_draws_is_counted(made):
    folder, found = made
    assert found.looks == 1
    same = carry_out(load_plan(folder / "task.toml"), folder / "out", workers=1)
    assert same.looks == 1 and same.final.bits == found.final.bits
    (folder / "task.toml").write_text(TEXT.replace("starts = 2", "starts = 2\nseed = 5"))
    assert carry_out(load_plan(folder / "task.toml"), folder / "out", workers=1).looks == 2


def test_the_verb_writes_a_page_and_goes_on(made, monkeypatch):
    folder, _ = made
    found = carry_out(load_plan(folder / "task.toml"), folder / "out", workers=1)
    monkeypatch.setattr("feeler.cli.design._Watcher._draw", lambda *_: None)
    asked = ["design", str(folder / "task.toml"), "--out", str(folder / "out"), "--no-movie", "--workers", "1"]
    before = (folder / "out" / "journal.jsonl").stat().st_size
    answer = CliRunner().invoke(app, asked, catch_exceptions=False)
    assert answer.exit_code == 0 and "errors avoided" in answer.output
    assert (folder / "out" / "journal.jsonl").stat().st_size == before  # nothing was simulated again
    page = (folder / "out" / "design.html").read_text()
    assert "Which antenna should I build?" in page and "data:image/png" in page
    said = json.loads(CliRunner().invoke(app, [*asked, "--json"], catch_exceptions=False).stdout)
    assert said["final"]["bits"] == found.final.bits and said["fewer_errors"] == list(found.compare())


def test_strips_are_as_stiff_as_the_hinges_and_can_be_cut():
    strips = make_strips(feeler.presets.robot())
    assert strips.stiffness == pytest.approx(feeler.presets.robot().stiffness)
    assert set(strips.thickness) <= set(SHEETS)
    assert np.all(strips.width >= 0.5) and np.all(strips.width <= 20.0)


def test_copies_made_wrong_differ_and_one_made_right_does_not():
    first, second = measure_tolerance(ANTENNA, TASK, copies=2)
    right = measure_tolerance(ANTENNA, TASK, copies=1, share=1e-12)[0]
    assert first.bits != second.bits
    assert right.bits == pytest.approx(feeler.design.score(ANTENNA, TASK).bits, abs=1e-6)
