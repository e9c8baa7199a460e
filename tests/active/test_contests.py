"""Comparing policies: the verdict is what it says, journals are taken up, and the command makes its
page.
"""

import json

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

from feeler.active import Observer, parse_policy
from feeler.active.contests import (
    confirm_steering,
    fill_comparison,
    judge_steering,
    load_contest,
)
from feeler.cli.app import app
from feeler.errors import InvalidInput
from feeler.presets import cockroach
from feeler.report import Section
from paper.context import Context
from studies.active import section as open_active
from studies.active.section import load_found

SMALL = {"known": 8, "copies": 1, "duration": 20.0, "deadlines": (10.0, 20.0), "sets": 2}
NAMES = ["fixed:0.6", "slow-after-contact:1.2,0.12"]


@pytest.fixture(scope="module")
def comparison():
    return load_contest(**SMALL)


def test_a_journal_is_taken_up_and_changes_nothing(comparison, tmp_path):
    journal = tmp_path / "journal.jsonl"
    whole = comparison.run(cockroach(), NAMES)
    comparison.run(cockroach(), NAMES[:1], journal=journal)
    with journal.open("a") as file:
        file.write('{"name": "cut off')
    taken = comparison.run(cockroach(), NAMES, journal=journal)
    xr.testing.assert_identical(taken, whole)
    lines = [json.loads(line) for line in journal.read_text().splitlines()]
    assert len(lines) == 1 + len(NAMES) * comparison.sets
    assert np.all((whole["accuracy"] >= 0) & (whole["accuracy"] <= 1))
    assert float(whole["work"].min()) >= 0


def test_every_set_is_what_a_fresh_observer_makes_of_it(comparison):
    """Asked after other sets and other policies; no set is another set again."""
    found = comparison.run(cockroach(), NAMES)
    for number in range(comparison.sets):
        task = comparison.make_task(cockroach(), number)
        assert task.seed == 1000 * comparison.seed + number
        for name in NAMES:
            fresh = Observer(task, period=comparison.period, random_state=number)
            seen = fresh.run(parse_policy(name), comparison.copies)
            one = found.sel(policy=name).isel(set=number)
            rows = [round(d / comparison.period) for d in comparison.deadlines]
            np.testing.assert_array_equal(one["accuracy"], seen.accuracy[rows])
            np.testing.assert_array_equal(one["hits"], seen.hits[rows])
            np.testing.assert_array_equal(one["work"], seen.work[rows].mean(axis=1))
    assert np.all(found["accuracy"].isel(set=0) != found["accuracy"].isel(set=1))


def test_a_journal_gives_no_other_contest_s_answer(comparison, tmp_path):
    """More copies are run anew; other touches, noise, decisions or antennas are refused."""
    journal, name = tmp_path / "journal.jsonl", NAMES[:1]
    comparison.run(cockroach(), name, journal=journal)
    more = comparison.replace(copies=3, sets=1)
    xr.testing.assert_identical(
        more.run(cockroach(), name, journal=journal), more.run(cockroach(), name)
    )
    before = journal.read_bytes()
    others = (
        {"known": 9},
        {"seed": 1},
        {"noise": "common:0.02"},
        {"noise": "relative:0.03"},
        {"duration": 25.0},
        {"period": 10.0},
        {"deadlines": (10.0,)},
    )
    for changes in others:
        with pytest.raises(InvalidInput, match="belongs to another contest"):
            comparison.replace(**changes).run(cockroach(), name, journal=journal)
    with pytest.raises(InvalidInput, match="belongs to another contest"):
        comparison.run(cockroach("linear"), name, journal=journal)
    assert journal.read_bytes() == before


def test_a_policy_that_looks_ahead_is_not_taken_for_one_that_does_not(comparison, tmp_path):
    journal, names = tmp_path / "journal.jsonl", ["fixed:0.6"]
    small = comparison.replace(copies=3, ahead_copies=1, ahead_sets=1)
    small.run(cockroach(), names, journal=journal)
    ahead = small.replace(fixed=(), ahead=("fixed:0.6",))
    found = ahead.run(cockroach(), names, journal=journal)
    xr.testing.assert_identical(found, ahead.run(cockroach(), names))
    assert np.isnan(found["accuracy"].isel(set=1)).all()


def test_a_policy_of_one_s_own_that_changed_is_run_again(comparison, tmp_path):
    journal, mine = tmp_path / "journal.jsonl", tmp_path / "mine.py"
    found = []
    for speed in (0.3, 1.2):
        mine.write_text(f"def policy(known):\n    return {speed}\n")
        found.append(comparison.run(cockroach(), [f"{mine}:policy"], journal=journal))
    assert np.all(found[0]["work"] < found[1]["work"])


def make_measured(comparison, accuracy):
    """One accuracy for each policy and set."""
    names = [*comparison.fixed[:1], *comparison.steered[:2]]
    values = np.repeat(np.array(accuracy, float)[:, :, None], 2, axis=2)
    work = np.broadcast_to(np.array([1.0, 3.0, 0.2])[:, None, None], values.shape)
    coords = {"policy": names, "deadline": [10.0, 20.0]}
    dims = ("policy", "set", "deadline")
    return xr.Dataset(
        {"accuracy": (dims, values), "work": (dims, work)}, coords, {"antenna": "toy"}
    )


def test_what_was_chosen_is_confirmed_on_fresh_sets_alone(comparison):
    # the first two sets choose steered[0]; on the others it gains 10 and 20 points, and steered[1],
    # better there, isn't asked
    measured = make_measured(
        comparison, [[0.5] * 4, [0.9, 0.9, 0.6, 0.7], [0.1, 0.1, 1.0, 1.0]]
    )
    verdict = judge_steering(measured.isel(set=slice(2)), comparison)
    found = confirm_steering(measured, verdict, 2).sel(deadline=10.0)
    assert float(found["gain"]) == pytest.approx(15)
    assert float(found["half"]) == pytest.approx(
        12.706 * 10 / 2, rel=1e-3
    )  # Student's t of one degree, 97.5 %
    assert (float(found["fixed_accuracy"]), float(found["steered_accuracy"])) == pytest.approx(
        (50, 65)
    )
    with pytest.raises(InvalidInput, match="at least two sets from number 3 on"):
        confirm_steering(measured, verdict, 3)


def test_steering_is_judged_on_sets_it_was_not_chosen_on(comparison):
    # steered[0] is the best on the sets that choose, and not the best of all sets
    lucky = make_measured(
        comparison, [[0.5, 0.5, 0.5, 0.5], [0.9, 0.2, 0.9, 0.2], [0.6, 0.6, 0.6, 0.6]]
    )
    found = judge_steering(lucky, comparison).sel(deadline=10.0)
    assert found["steered"] == comparison.steered[0]
    assert float(found["gain"]) == pytest.approx(-30)
    assert not bool(found["pays"])
    sure = make_measured(comparison, [[0.5, 0.5, 0.5, 0.5], [0.6, 0.61, 0.6, 0.6], [0.1] * 4])
    found = judge_steering(sure, comparison).sel(deadline=20.0)
    assert float(found["gain"]) == pytest.approx(10.5)
    assert bool(found["pays"]) == (10.5 - float(found["half"]) > 0)


def test_two_sets_leave_nothing_that_can_be_said_and_the_page_says_so(comparison, tmp_path):
    """One set to choose on, one to judge on: no interval, and no verdict where there is none."""
    measured = make_measured(comparison, [[0.5, 0.5], [0.9, 0.9], [0.6, 0.6]])
    section = Section(name="active", title="", folder=tmp_path, vector=False)
    fill_comparison(section, measured, comparison)
    *_, verdict = [block for block in section.blocks if block["kind"] == "table"]
    assert {(row[6], row[7]) for row in verdict["rows"]} == {("one set", "cannot be said")}
    assert "four sets or more" in verdict["caption"]
    assert "undefined" not in str(section.blocks)


@pytest.mark.long
def test_the_command_makes_its_page(tmp_path):
    mine = tmp_path / "mine.py"
    mine.write_text("def policy(known):\n    return 1.2 if known.time < 10 else 0.3\n")
    asked = [
        "active",
        "--out",
        str(tmp_path / "out"),
        "--sets",
        "1",
        "--copies",
        "1",
        "--no-movie",
        "--json",
    ]
    result = CliRunner().invoke(
        app, [*asked, "--policy", "fixed:1.2", "--policy", f"{mine}:policy"]
    )
    assert result.exit_code == 0, result.output
    assert "Most accurate of" in (tmp_path / "out" / "active.html").read_text()
    found = json.loads((tmp_path / "out" / "active.json").read_text())
    assert {
        name: item for name, item in json.loads(result.stdout).items() if name != "page"
    } == found
    assert found["coords"]["policy"]["data"] == ["fixed:1.2", f"{mine}:policy"]


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sets": 0}, "sets must be ≥ 1"),
        ({"deadlines": (500.0,)}, "multiples of 5 ms up to"),
        ({"deadlines": (12.0,)}, "multiples of 5 ms"),
    ],
)
def test_what_cannot_be_compared_is_named(changes, said):
    with pytest.raises(InvalidInput, match=said):
        load_contest(**changes)


def test_one_set_cannot_be_judged(comparison):
    measured = make_measured(comparison, [[0.5], [0.6], [0.6]])
    with pytest.raises(InvalidInput, match="at least two sets"):
        judge_steering(measured, comparison)


def make_section(folder):
    return Section(name="tradeoff", title="", folder=folder, vector=False)


@pytest.mark.long
def test_what_is_stored_comes_out_again(tmp_path):
    section = make_section(tmp_path)
    open_active.show(Context(), section)
    assert abs(section.values["active.again"]) < 1e-6
    assert 0 <= section.values["active.pays"] <= len(load_contest().deadlines)
    _, confirmed = load_found(load_contest())
    assert section.values["active.confirmed"] == sum(confirmed["gain"] >= load_contest().gain)
    assert {"active"} <= {*section.list_figures()}


def test_another_antenna_is_not_shown_what_is_stored_for_the_published_one(tmp_path):
    section = make_section(tmp_path)
    open_active.show(Context(antenna=cockroach("linear"), is_cockroach=False), section)
    assert not section.blocks


def test_results_of_other_choices_are_refused():
    with pytest.raises(
        InvalidInput, match=r"made with noise common:0.03, declared is common:0.05"
    ):
        load_found(load_contest(noise="common:0.05"))
