"""Plans: files say what is wrong with them; a plan carried out leaves an antenna, numbers and a
page, and goes on.
"""

import json
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from typer.testing import CliRunner

import feeler
from feeler.cli.app import app
from feeler.design import load_plan
from feeler.design import plan as outcome
from feeler.design.plan import TEMPLATE, make_strips, measure_tolerance, run_plan
from feeler.design.scoring import DesignTask
from feeler.design.search import (
    SHEETS,
    Constraints,
    DesignProblem,
    Space,
    optimise,
)
from feeler.errors import InvalidInput
from feeler.objects import Ball
from feeler.robot import load_robot
from tests.design.test_design import ANTENNA, TASK

TEXT = """\
schema = "feeler.design/1"
antenna = "small.toml"
[task]
objects = ["ball:radius=1.5", "box:half_width=1.5,half_height=1.5"]
locations = [0.6, 0.9]
speeds = [0.6]
deadline = 15
noise = "relative:0.5"
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
    return folder, run_plan(load_plan(write(folder)), folder / "out", workers=1)


@pytest.fixture
def again(made, tmp_path):
    """A copy of what was made, to go on with; what others look at stays as it is."""
    return shutil.copytree(made[0], tmp_path / "again"), made[1]


def test_the_best_is_that_of_the_test_draws_and_looks_are_counted_by_the_final_seed(
    made, monkeypatch, tmp_path
):
    """Planted: the end that the optimiser's draws like less is the better one on the tests."""
    folder, found = made
    low, high = sorted(found.ends, key=lambda end: end.best.bits)
    assert low.best.bits < high.best.bits
    asked = []

    def score(antenna, task, purpose="test", **_):
        asked.append(purpose)
        return replace(found.final, bits=2.0 if antenna == low.design.antenna else 1.0)

    monkeypatch.setattr(outcome, "optimise", lambda *_, **__: [high, low])
    monkeypatch.setattr(outcome, "score", score)
    again = run_plan(load_plan(folder / "task.toml"), tmp_path / "out")
    assert again.best == low.design.antenna and [one.bits for one in again.tests] == [2.0, 1.0]
    assert sorted(asked) == ["final"] * 2 + ["test"] * 3
    assert list(json.loads((tmp_path / "out" / "finals.json").read_text())) == ["3"]


def test_the_template_is_a_plan(tmp_path):
    path = tmp_path / "task.toml"
    path.write_text(TEMPLATE.format(file="task.toml"))
    plan = load_plan(path)
    assert plan.task.n_classes == 12 and dict(plan.task.seeds) == {
        "optimiser": 1,
        "test": 2,
        "final": 3,
    }
    assert (
        plan.space.names[:2] == ["stiffness 1", "stiffness 2"]
        and plan.constraints.damping_share == 1.0
    )


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"feeler.design/1"', '"feeler.robot/1"', "schema must be"),
        ("[search]", "[serach]", "task.toml has no 'serach'; valid: task, space"),
        ('noise = "relative', 'nois = "relative', r"\[task\] has no 'nois'"),
        ("relative:0.5", "relative:-1", r"\[task.noise\] size must be ≥ 0"),
        ("span = 10", 'span = "wide"', r"\[space\] span must be a number > 1"),
        ("optimiser = 1", "optimizer = 1", "seeds must name optimiser, test and final"),
        ("evaluations = 4", "evaluations = 4.5", r"\[search\] evaluations must be int"),
        ("ball:radius=1.5", "bell", r"unknown shape 'bell'"),
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
    assert [test.bits for test in found.tests] == sorted(
        (test.bits for test in found.tests), reverse=True
    )
    for purpose, mine, other in (
        ("final", found.final, found.reference_final),
        ("test", found.tests[0], found.reference_test),
    ):
        fewer = found.compare(purpose)[0]
        assert fewer == pytest.approx(1 - mine.errors / other.errors), purpose


def test_a_second_look_at_the_final_draws_is_counted(again):
    folder, found = again
    assert found.looks == 1
    same = run_plan(load_plan(folder / "task.toml"), folder / "out", workers=1)
    assert same.looks == 1 and same.final.bits == found.final.bits
    (folder / "task.toml").write_text(TEXT.replace("starts = 2", "starts = 2\nseed = 5"))
    assert run_plan(load_plan(folder / "task.toml"), folder / "out", workers=1).looks == 2


@pytest.mark.long
def test_the_verb_writes_a_page_and_goes_on(again):
    folder, _ = again
    found = run_plan(load_plan(folder / "task.toml"), folder / "out", workers=1)
    asked = [
        "design",
        str(folder / "task.toml"),
        "--out",
        str(folder / "out"),
        "--no-movie",
        "--workers",
        "1",
    ]
    before = (folder / "out" / "journal.jsonl").stat().st_size
    answer = CliRunner().invoke(app, asked, catch_exceptions=False)
    assert answer.exit_code == 0 and "errors avoided" in answer.output
    assert (
        folder / "out" / "journal.jsonl"
    ).stat().st_size == before  # nothing was simulated again
    page = (folder / "out" / "design.html").read_text()
    assert (
        "On the final draws the best antenna" in page.partition("</header>")[0]
        and "data:image/" in page
    )
    said = json.loads(
        CliRunner().invoke(app, [*asked, "--json"], catch_exceptions=False).stdout
    )
    assert said["final"]["bits"] == found.final.bits and said["fewer_errors"] == list(
        found.compare()
    )


def test_strips_are_as_stiff_as_the_hinges_and_can_be_cut():
    strips = make_strips(feeler.presets.robot())
    assert strips.stiffness == pytest.approx(feeler.presets.robot().stiffness)
    assert set(strips.thickness) <= set(SHEETS)
    assert np.all(strips.width >= 0.5) and np.all(strips.width <= 20.0)


def test_strips_of_a_robot_are_the_robots_own_flexures(tmp_path):
    from feeler.robot import load_robot, write_robot

    robot, task = tmp_path / "robot.toml", tmp_path / "task.toml"
    write_robot(robot, 6)
    text = robot.read_text().replace("length = 0.5 ", "length = 0.7 ")
    robot.write_text(text.replace("stiffness = 1.0", "stiffness = 1.3"))
    plan = TEMPLATE.format(file="task.toml").replace('"exponential"', '"robot.toml"', 1)
    plan = plan.replace("# width = [3, 12] ", "width = [3, 12] ")
    task.write_text(plan.replace("# sheets = [0.025, 0.05, 0.075]", "sheets = [0.025, 0.05]"))
    strips = make_strips(load_robot(robot).antenna, load_plan(task).constraints)
    assert strips.width == pytest.approx(load_robot(robot).hinges.width)
    assert set(strips.thickness) == {0.05} and strips.length[0] == 0.7


def test_copies_made_wrong_differ_and_one_made_right_does_not():
    first, second = measure_tolerance(ANTENNA, TASK, copies=2)
    right = measure_tolerance(ANTENNA, TASK, copies=1, share=1e-12)[0]
    assert first.bits != second.bits
    assert right.bits == pytest.approx(feeler.design.score(ANTENNA, TASK).bits, abs=1e-6)


def test_each_hinge_is_cut_from_the_thickest_sheet_of_which_a_strip_is_soft_enough():
    from feeler.design.plan import WIDEST
    from feeler.robot.description import ROBOT_FACTS

    sheets, modulus, several = (0.125, 0.025, 0.05, 0.1), ROBOT_FACTS["modulus"].number, 0
    strips = make_strips(ANTENNA, Constraints(sheets=sheets))
    for stiffness, thickness in zip(ANTENNA.stiffness, strips.thickness, strict=True):
        width = {sheet: 12 * stiffness * 0.5 / (modulus * sheet**3) for sheet in sheets}
        fits = [sheet for sheet in sheets if 0.5 <= width[sheet] <= WIDEST]
        several += len(fits) > 1
        assert not fits or thickness == max(fits)
    assert several


def break_off(path, text, **_):
    """The process ends in the middle of writing."""
    with open(path, "w", encoding="utf-8") as file:
        file.write(text[: len(text) // 2])
    raise KeyboardInterrupt


def test_a_ledger_of_looks_is_whole_or_as_it_was_and_loses_none_of_two_searches(
    tmp_path, monkeypatch
):
    path, task = tmp_path / "finals.json", SimpleNamespace(seeds={"final": 3})
    antennas = [ANTENNA.replace(damping=ANTENNA.damping * (1 + k / 100)) for k in range(24)]
    with ThreadPoolExecutor(4) as pool:
        counts = list(pool.map(lambda one: outcome._count_looks(path, task, one), antennas))
    assert sorted(counts) == list(range(1, 25))
    before = path.read_text()
    with monkeypatch.context() as broken:
        broken.setattr("pathlib.Path.write_text", break_off)
        with pytest.raises(KeyboardInterrupt):
            outcome._count_looks(path, SimpleNamespace(seeds={"final": 4}), ANTENNA)
    assert path.read_text() == before and len(json.loads(before)["3"]) == 24
    assert outcome._count_looks(path, SimpleNamespace(seeds={"final": 4}), ANTENNA) == 1


ROBOT = """schema = "feeler.robot/1"
name = "mine"
[hinges]
width = [8.0, 7.0, 6.0, 5.0]
thickness = 0.05
length = 0.6
modulus = 2400
[links]
length = [8.0, 8.0, 8.0, 8.0]
mass = [0.03, 0.03, 0.03, 0.03]
radius = 1.0
[factors]
stiffness = 0.8
damping = 6.0
[sensors]
hinges = [1, 2, 3, 4]
"""


def test_a_plan_takes_the_robot_and_what_can_be_cut_of_its_sheets(tmp_path):
    """The flexures that the robot has can be cut; of half the width, or of no such sheet, not."""
    (tmp_path / "mine.toml").write_text(ROBOT)
    text = TEXT.replace("small.toml", "mine.toml")
    text += "[constraints]\nwidth = [5, 8]\nsheets = [0.05]\n"
    (tmp_path / "d.toml").write_text(text)
    plan = load_plan(tmp_path / "d.toml")
    keep, robot = plan.constraints, load_robot(tmp_path / "mine.toml")
    assert plan.reference == robot.antenna
    assert (keep.stiffness_factor, keep.modulus, keep.hinge_length) == (0.8, 2400.0, 0.6)
    assert keep.check(robot.antenna, robot.antenna)["width"] == pytest.approx(0, abs=1e-9)
    k = robot.antenna.stiffness
    narrow = robot.antenna.replace(stiffness=k / 2)
    assert keep.check(narrow, robot.antenna)["width"] == pytest.approx(np.log(2))
    wide = robot.antenna.replace(stiffness=3 * k)
    assert keep.check(wide, robot.antenna)["width"] == pytest.approx(np.log(3))
    both = keep.replace(sheets=(0.05, 0.05 * 3 ** (1 / 3)), width=(4.9, 8.1))
    assert (
        both.check(wide, robot.antenna)["width"] == 0
    )  # of the thicker sheet they are as before
    stiff = keep.replace(stiffest=2.0).check(wide, robot.antenna)["stiffest"]
    assert stiff == pytest.approx(np.log(1.5))
    with pytest.raises(InvalidInput, match=r"width must be 0 < low"):
        keep.replace(width=(8.0, 5.0))


def test_an_objective_of_one_s_own_is_made_small_within_the_constraints():
    """The antenna whose total compliance is nearest to 1.5 times the reference's; an optimiser from
    outside asks and tells the same problem.
    """
    space, calls = Space(reference=ANTENNA, stiffness=1, damping=0, span=4.0), []
    wanted = 1.5 * np.sum(1 / ANTENNA.stiffness)

    def miss(design):
        calls.append(design)
        return float(np.log(np.sum(1 / design.antenna.stiffness) / wanted) ** 2)

    task = DesignTask(objects=(Ball(radius=1.5), Ball(radius=3.0)))
    found = optimise(task, space, objective=miss, evaluations=60)[0]
    factor = found.design.antenna.stiffness / ANTENNA.stiffness
    np.testing.assert_allclose(factor, 1 / 1.5, rtol=1e-2)
    assert len(calls) >= 10
    kept = Constraints(softest=0.8)
    bound = optimise(task, space, kept, objective=miss, evaluations=60)[0]
    np.testing.assert_allclose(
        bound.design.antenna.stiffness / ANTENNA.stiffness, 0.8, rtol=0.02
    )
    problem = DesignProblem(task=task, space=space, objective=miss)
    costs = {
        x: problem.look(np.array([x])).cost for x in np.linspace(-1, 1, 41)
    }  # told from outside
    best = min(costs, key=costs.get)
    assert np.exp(np.log(4.0) * best) == pytest.approx(1 / 1.5, rel=0.05)
    assert problem.look(np.array([0.3])).x == [0.3] and problem.evaluations == 42
    with pytest.raises(InvalidInput, match="peak_angle is known of touches"):
        optimise(task, space, Constraints(peak_angle=0.2), objective=miss)
