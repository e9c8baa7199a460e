"""What spikes tell: claims follow from planted truths, and nothing bears none of them out."""

import numpy as np
import pytest

from feeler.objects.trials import SPEEDS
from paper.data import CLAIMED
from paper.readings import NEVER, NOT
from paper.statements import judge, load_statements
from paper.table import Results
from studies.spikes.found import PACES, collect_values
from studies.spikes.section import (
    CHANGES,
    DEADLINES,
    READ_BY,
)
from studies.spikes.study import load_spiking

OWN = [one for one in load_statements() if one.id.startswith("own-spikes")]
SETS = 9


def plant(say, seed=0):
    """Cells of all that is asked, whose accuracy is what ``say`` gives, but for chance."""
    rng = np.random.default_rng(seed)
    cells = {}
    for profile in CLAIMED:
        for speed in PACES:
            for code in READ_BY:
                for variant in CHANGES:
                    for window in DEADLINES:
                        key = "/".join((profile, speed, code, variant, window))
                        right = say(profile, speed, code, variant, window)
                        right = right + 0.002 * rng.standard_normal(SETS)
                        right = [*right]
                        cells[key] = {"accuracy": right, "place": right, "bits": right}
                        cells[key]["spikes"] = right
    return cells


def say_expected(profile, speed, code, variant, window):
    """A world in which everything that was declared comes true."""
    if variant == "null":
        return 0.033
    slow = PACES.index(speed)  # 0 slow, 2 fast
    if window == "50 ms":
        return 0.3 + 0.2 * slow
    if profile != "exponential":
        return {"linear": 0.7, "uniform": 0.4}[profile] + 0.1 * slow * (profile == "uniform")
    changed = {"receptor 0.003 rad": -0.1, "regular": 0.03, "7 places": -0.2}
    return 0.95 - 0.1 * slow + changed.get(variant, 0.0)


def judge_all(cells):
    results = Results.make(collect_values(cells))
    return {one.id: judge(one, results, "paper") for one in OWN}


def test_what_was_declared_is_what_is_shown():
    study = load_spiking()
    assert set(study.levels) == set(CHANGES)
    assert set(study.classifiers) == set(READ_BY)
    assert tuple(study.task.speeds) == tuple(SPEEDS[pace] for pace in PACES)
    assert tuple(name for _, _, name in study.list_windows()) == DEADLINES


def test_a_world_as_expected_bears_out_every_claim():
    found = judge_all(plant(say_expected))
    assert all(found[one.id].holds for one in OWN if one.tests)


@pytest.fixture(scope="module")
def turned():
    """Each accuracy mirrored: what was better is worse."""
    return judge_all(plant(lambda *key: 1.0 - say_expected(*key)))


@pytest.mark.parametrize("statement", OWN, ids=lambda one: one.id)
def test_the_world_turned_round_bears_out_none(turned, statement):
    found = turned[statement.id]
    assert not statement.tests or found.verdict == NOT, found.why


@pytest.fixture(scope="module", params=[1 / 30, 0.5, 1.0])
def nothing(request):
    """What is right in a world where nothing differs from anything but by chance; two draws."""
    return request.param, [
        judge_all(plant(lambda *key: request.param, seed)) for seed in (1, 2)
    ]


@pytest.mark.further
@pytest.mark.parametrize("statement", OWN, ids=lambda one: one.id)
def test_nothing_bears_out_no_claim(nothing, statement):
    """At a level of 95 % some are borne out by chance, but not in two draws; places that everybody
    names are named.
    """
    right, draws = nothing
    held = [found[statement.id].holds for found in draws]
    named = statement.id.startswith("own-spikes-place") and right >= 0.5
    assert named or not all(held)


def test_what_was_not_read_is_undefined_and_not_judged():
    cells = {key: one for key, one in plant(say_expected).items() if "fast" not in key}
    values = collect_values(cells)
    assert "undefined" in values["spikes.slower.200.counts"]
    statement = next(one for one in OWN if one.id == "own-spikes-equal")
    found = judge(statement, Results.make(values), "paper")
    assert (found.verdict, found.why) == (NEVER, "undefined in this run")


def test_costs_and_gains_have_their_signs_and_the_null_is_the_greatest_of_all():
    """A receptor's noise costs 10 points, regular trains gain 3; one null of many is high."""
    high = ("uniform", "fast", "first", "null", "whole touch")
    values = collect_values(plant(lambda *key: 0.4 if key == high else say_expected(*key)))
    for name, points in (("cost.receptor", 10.0), ("gain.regular", 3.0), ("null", 40.0)):
        assert values[f"spikes.{name}"]["value"] == pytest.approx(points, abs=0.4)


def test_differences_are_paired_and_the_least_sure_neighbour_counts():
    cells = {}
    for speed, right in (("slow", [0.9, 0.7]), ("medium", [0.8, 0.6]), ("fast", [0.4, 0.5])):
        cells[f"exponential/{speed}/counts/own/whole touch"] = {"accuracy": right}
    found = collect_values(cells)["spikes.slower.whole.counts"]
    assert found["value"] == pytest.approx(25)  # 40 and 10: the other is 10 in both
    assert found["low"] < 10
