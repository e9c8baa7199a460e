"""Designed for what was never met: questions are new, gains paired, and nothing gains nothing."""

import numpy as np
import pytest

from feeler.presets import cockroach
from paper.statements import judge, load_statements
from paper.table import Results
from studies.stored import read_declared
from studies.unseen import measure
from studies.unseen.section import SHOWN, WORDS, collect_values

ASKED = read_declared("unseen")
OWN = [one for one in load_statements() if one.id.startswith("own-unseen")]


@pytest.fixture(scope="module")
def antennas():
    reference = cockroach()
    steeper = {
        "stiffness": reference.stiffness * np.linspace(2.0, 0.5, reference.n_segments),
        "damping": reference.damping,
    }
    return measure.list_antennas(reference, {"unseen": steeper, "known": steeper})


@pytest.mark.parametrize("kind", measure.NEW)
def test_questions_are_new_in_what_their_kind_says(kind):
    task = measure.make_task(ASKED, kind)
    trials = task.draw_classes(cockroach(), "test", 0.3)
    each = task.train + task.test
    for name, read in (("location", lambda t: t.location), ("size", lambda t: t.feature.size)):
        values = np.round([read(trial) for trial in trials], 6).reshape(task.n_classes, each)
        lessons, questions = np.split(values, [task.train], axis=1)
        new = {*questions.ravel()}.isdisjoint(lessons.ravel())
        assert new == (name in measure.NEW[kind])
        assert {*lessons.ravel()} == {*ASKED["task"]["nuisances"][name]}


def test_scaled_antennas_have_the_published_compliance_of_the_tip(antennas):
    reference = antennas["published"]
    arm = (reference.length - reference.hinge_position) ** 2
    for name, antenna in antennas.items():
        share = np.sum(arm / antenna.stiffness) / np.sum(arm / reference.stiffness)
        assert (share == pytest.approx(1.0)) == (name == "published" or name.endswith("_tip"))
        assert name in SHOWN


@pytest.mark.long
def test_the_judge_asks_everything_that_claims_need(antennas):
    few = {"sets": 2, "other_sets": 2, "classifier_sets": 2}
    few |= {"test": 4, "other_test": 2, "classifier_test": 2, "classifier": "lda"}
    asked = ASKED | {"final": few, "task": ASKED["task"] | {"train": 6}}
    found = measure.judge(antennas, asked, workers=1)
    values = collect_values(found)
    for one in OWN:
        assert one.list_keys() <= set(values)
    # the same antenna under two names
    assert found["unseen"] == found["known"]
    assert values["unseen.gain.over_known.unseen"]["value"] == 0.0


def test_gains_are_paired_and_in_points():
    before, after = [0.30, 0.20, 0.40], [0.20, 0.10, 0.30]
    kinds = dict.fromkeys(WORDS, before) | {"unseen, few": before}
    wrong = {
        "published": kinds,
        "unseen": dict.fromkeys(WORDS, after),
        "known": dict.fromkeys(WORDS, before),
        "unseen_tip": {"unseen, few": after},
    }
    values = collect_values(wrong)
    assert values["unseen.gain.unseen.unseen"] == pytest.approx(
        {"value": 10.0, "low": 10.0, "high": 10.0, "n": 3}
    )
    assert values["unseen.wrong.published.unseen"]["value"] == pytest.approx(30.0)
    assert values["unseen.gain.unseen_tip.unseen"]["value"] == pytest.approx(10.0)


@pytest.mark.further
@pytest.mark.parametrize("statement", OWN, ids=lambda one: one.id)
def test_no_rule_is_met_by_planted_nothing(statement):
    """Antennas that differ in nothing: each names as many wrong as the others, but for chance."""
    rng = np.random.default_rng(0)
    kinds = (*WORDS, "unseen, few", "unseen, lda")
    for _ in range(10):
        wrong = {
            name: {kind: list(0.2 + 0.03 * rng.standard_normal(16)) for kind in kinds}
            for name in SHOWN
        }
        for name in ("unseen_tip", "known_tip"):
            wrong[name] = {"unseen, few": wrong[name]["unseen, few"]}
        assert not judge(statement, Results.make(collect_values(wrong)), "paper").holds
