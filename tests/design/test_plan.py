"""Plans: files say what is wrong with them; a plan carried out leaves an antenna, numbers and a
page, and goes on.
"""

import json
import re
import shutil
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure
from typer.testing import CliRunner

import feeler
from feeler.cli.app import app
from feeler.cli.design import _report
from feeler.design import load_plan, page
from feeler.design import plan as outcome
from feeler.design.page import _say_making, _say_result, plot_confusion, plot_designs
from feeler.design.plan import SHEETS, TEMPLATE, make_strips, measure_tolerance, run_plan
from feeler.errors import InvalidInput
from feeler.report import Section
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


def test_by_speed_bits_stand_before_errors_and_the_least_of_the_damping_ratios_is_told(
    made, monkeypatch
):
    _, found = made
    np.testing.assert_allclose(found.final.by_speed, [[found.final.bits, found.final.errors]])
    assert found.final.bits != found.final.errors
    modes = SimpleNamespace(damping_ratio=np.array([0.5, 0.2, 0.3]))
    monkeypatch.setattr(page, "compute_modes", lambda *_: modes)
    assert page._list_cells(found.final, ANTENNA)[-1] == 0.2


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
def test_the_verb_writes_a_page_and_goes_on(again, monkeypatch):
    folder, _ = again
    found = run_plan(load_plan(folder / "task.toml"), folder / "out", workers=1)
    monkeypatch.setattr("feeler.cli.design._Watcher._draw", lambda *_: None)
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
    assert "Which antenna should I build?" in page and "data:image/" in page
    said = json.loads(
        CliRunner().invoke(app, [*asked, "--json"], catch_exceptions=False).stdout
    )
    assert said["final"]["bits"] == found.final.bits and said["fewer_errors"] == list(
        found.compare()
    )


def read_numbers(pattern, text):
    return [
        float(number) for number in re.search(pattern.replace("#", r"([\d.]+)"), text).groups()
    ]


@pytest.mark.long
def test_what_is_said_of_the_final_draws_is_what_was_counted(made, tmp_path, capsys):
    """Of eight touches the reference names all, half … wrong, the best antenna fewer: errors
    avoided, with their SE.
    """
    _, found = made
    other = np.array([[[1.0, 0.5, 0.5, 1.0], [0.75, 0.25, 0.5, 0.5]]])  # (speed, class, touch)
    mine = other * np.array([0.5, 1.0, 0.25, 0.75])
    final, reference = (
        replace(score, wrong=wrong, errors=float(wrong.mean()), errors_error=error)
        for score, wrong, error in (
            (found.final, mine, 0.031),
            (found.reference_final, other, 0.042),
        )
    )
    told = replace(found, final=final, reference_final=reference, looks=1)
    touches = (other - mine).mean(axis=(0, 1))
    fewer, error = (
        touches.mean() / other.mean(),
        touches.std(ddof=1) / np.sqrt(4) / other.mean(),
    )
    assert told.compare() == pytest.approx((fewer, error))
    assert replace(
        told, reference_final=replace(reference, errors=0.0)
    ).compare() == pytest.approx((np.nan,) * 2, nan_ok=True)
    _report(told, tmp_path, robot=False, movie=False, executor=None, as_json=False)
    said = read_numbers(
        r"final draws: # % wrong, the reference # %: errors avoided # ± # %\n",
        capsys.readouterr().out,
    )
    assert said == pytest.approx(
        [100 * mine.mean(), 100 * other.mean(), 100 * fewer, 100 * error], abs=0.5
    )
    page = re.sub("<[^>]+>", " ", (tmp_path / "design.html").read_text(encoding="utf-8"))
    told_page = (
        r"names # ± # % of noisy touches wrong, the reference # ± # %: errors avoided # ± # %"
        r" \(standard error\)"
    )
    expected = [mine.mean(), 0.031, other.mean(), 0.042, fewer, error]
    assert read_numbers(told_page, page) == pytest.approx([100 * x for x in expected], abs=0.5)
    _report(
        replace(told, looks=3), tmp_path, robot=False, movie=False, executor=None, as_json=False
    )
    assert "(look number 3)" in capsys.readouterr().out


def test_the_page_lists_each_design_with_its_scores(made, tmp_path):
    _, found = made
    section = Section(name="design", title="", folder=tmp_path, vector=False)
    _say_result(found, section)
    _say_making(found, section, [found.tests[0], found.reference_test])
    scores, strips = [block for block in section.blocks if block["kind"] == "table"]
    assert f"At most {np.log2(4):.2f} bits" in scores["caption"]
    assert scores["header"][1:6] == [
        "bits",
        "± SE",
        "wrong [%]",
        "peak [rad]",
        "least damping ratio",
    ]
    antennas = [found.plan.reference, *(end.design.antenna for end in found.ends)]
    for row, score, antenna in zip(
        scores["rows"], (found.reference_test, *found.tests), antennas, strict=True
    ):
        least = feeler.antenna.compute_modes(antenna, 6).damping_ratio.min()
        expected = [score.bits, score.bits_error, 100 * score.errors, score.peak, least]
        assert [float(cell) for cell in row[1:6]] == pytest.approx(expected, rel=1e-3)
    made_of = make_strips(found.best)
    expected = np.stack([found.best.stiffness, made_of.width, made_of.thickness], axis=1)
    np.testing.assert_allclose(
        [[float(cell) for cell in row[1:]] for row in strips["rows"]], expected, rtol=1e-3
    )
    errors, bits = zip(
        *((one.errors, one.bits) for one in (found.tests[0], found.reference_test)), strict=True
    )
    pattern = r"test draws\): # % wrong \(# to #\) in place of # %, # bits in place of #\."
    told = read_numbers(
        pattern, next(b["text"] for b in section.blocks if "Made 5 %" in str(b.get("text")))
    )
    expected = [
        100 * np.mean(errors),
        100 * min(errors),
        100 * max(errors),
        100 * errors[0],
        np.mean(bits),
        bits[0],
    ]
    assert told == pytest.approx(expected, abs=0.06)


def test_the_pictures_of_a_design_are_in_their_units(made):
    _, found = made
    plot_designs(found, figure := Figure())
    axes = figure.axes
    assert [ax.get_ylabel() for ax in axes] == [
        "stiffness [N·mm/rad]",
        "damping [N·mm·ms/rad]",
        "damping ratio",
        "missing bits",
    ]
    antennas = [found.plan.reference, *(end.design.antenna for end in found.ends)]
    whole = [line for line in axes[0].lines if line.get_linestyle() == "-"]
    for stiff, damp, ratio, antenna in zip(
        whole, axes[1].lines, axes[2].lines, antennas, strict=True
    ):
        place = antenna.hinge_position / antenna.length
        np.testing.assert_allclose(
            [*stiff.get_data(), *damp.get_data()],
            [place, antenna.stiffness, place, antenna.damping],
        )
        np.testing.assert_allclose(
            ratio.get_ydata(), feeler.antenna.compute_modes(antenna, 6).damping_ratio
        )
    plot_confusion(found, figure := Figure())
    for ax, one, name in zip(
        figure.axes,
        (found.reference_final, found.final),
        ("reference", "design 1"),
        strict=False,
    ):
        assert ax.get_title() == f"{name}: {one.bits:.2f} bits, {100 * one.errors:.1f} % wrong"
        np.testing.assert_array_equal(ax.images[0].get_array(), one.confusion)
        assert [tick.get_text() for tick in ax.get_xticklabels()] == ["0.6", "0.9"]


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


def test_a_share_of_damping_is_lacked_as_far_as_the_worst_mode_lacks_it(monkeypatch):
    from feeler.design import search as constraints

    ratios = {"own": np.array([0.9, 0.2, 0.5]), "reference": np.array([0.8, 0.7, 0.6])}
    monkeypatch.setattr(
        constraints,
        "compute_modes",
        lambda name, n: SimpleNamespace(damping_ratio=ratios[name]),
    )
    lacks = constraints.Constraints(damping_share=1.0, modes=3).check("own", "reference")
    assert lacks == {"damping_share": pytest.approx(np.log(0.7 / 0.2))}


def test_each_hinge_is_cut_from_the_thickest_sheet_of_which_a_strip_is_soft_enough():
    from feeler.design.plan import WIDEST
    from feeler.robot.description import ROBOT_FACTS

    sheets, modulus, several = (0.125, 0.025, 0.05, 0.1), ROBOT_FACTS["modulus"].number, 0
    strips = make_strips(ANTENNA, length=0.5, sheets=sheets)
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


def test_a_section_is_whole_or_as_it_was(tmp_path, monkeypatch):
    section = Section(name="a", title="A", folder=tmp_path, values={"x": 1})
    section.save()
    before = (tmp_path / "section.json").read_text()
    section.values["x"] = 2
    with monkeypatch.context() as broken:
        broken.setattr("pathlib.Path.write_text", break_off)
        with pytest.raises(KeyboardInterrupt):
            section.save()
    assert (tmp_path / "section.json").read_text() == before
    assert Section.load(tmp_path).values == {"x": 1}
