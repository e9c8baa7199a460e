"""Every claim has a rule, and every rule can fail."""

import pytest

from feeler.errors import InvalidInput
from feeler.paper.claims import Claim, judge, load_claims
from feeler.paper.context import Context
from feeler.paper.reproduce import STAGES

CONTEXT = Context()


def make_claim(**fields):
    base = {
        "id": "x",
        "where": "",
        "says": "",
        "paper": "",
        "tag": "P",
        "kind": "value",
        "section": "s",
        "keys": ("a",),
    }
    return Claim(**(base | fields))


def test_there_are_enough_claims_and_each_names_a_section():
    claims = load_claims()
    assert len(claims) >= 30
    assert len({claim.id for claim in claims}) == len(claims)
    assert {claim.section for claim in claims} <= {stage.name for stage in STAGES}
    assert all(claim.why for claim in claims if claim.kind == "none")


@pytest.mark.parametrize(
    ("claim", "values", "verdict"),
    [
        (make_claim(target=2.0, tolerance=0.1), {"a": 2.1}, "reproduced"),
        (make_claim(target=2.0, tolerance=0.1), {"a": 3.0}, "not reproduced"),
        (make_claim(target=2.0, tolerance=0.1), {"a": {"value": 3.0, "low": 1.0, "high": 4.0}}, "partly"),
        (make_claim(kind="order", keys=("a", "b")), {"a": 1, "b": 2}, "reproduced"),
        (make_claim(kind="order", keys=("a", "b")), {"a": 2, "b": 1}, "not reproduced"),
        (make_claim(kind="order", keys=("a", "b")), {"a": {"value": 1, "low": 0, "high": 3}, "b": 2}, "partly"),
        (make_claim(kind="order", keys=("a", "b", "c")), {"a": 1, "b": 5, "c": 3}, "partly"),
        (make_claim(kind="above", target=1.0), {"a": 0.5}, "not reproduced"),
        (make_claim(kind="below", target=1.0), {"a": 0.5}, "reproduced"),
        (make_claim(kind="none", why="lost"), {"a": 0.5}, "not comparable"),
        (make_claim(), {}, "not comparable"),
        (make_claim(target=1.0), {"a": {"undefined": "no peak"}}, "not reproduced"),
        (make_claim(kind="order", keys=("a", "b"), null="n"), {"a": 1, "b": 2, "n": 1.5}, "partly"),
        (make_claim(kind="order", keys=("a", "b"), null="n"), {"a": 1, "b": 2, "n": 0.5}, "reproduced"),
    ],
)
def test_rules(claim, values, verdict):
    assert judge(claim, values, CONTEXT).verdict == verdict


@pytest.mark.parametrize(("scale", "verdict"), [("smoke", "not comparable"), ("quick", "not reproduced")])
def test_effort_is_no_verdict_on_the_paper(scale, verdict):
    judged = judge(make_claim(target=90.0, due="quick"), {"a": 16}, Context(scale=scale))
    assert (judged.verdict, judged.ours) == (verdict, "16")
    assert scale == "quick" or judged.why == "smoke scale computes too little to judge it; due at quick scale"


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"due": "huge"}, "unknown scale 'huge'; valid: smoke"),
        ({"kind": "valeu"}, "unknown kind 'valeu'; valid: value"),
    ],
)
def test_a_misspelt_rule_is_refused(fields, message):
    with pytest.raises(InvalidInput, match=message):
        make_claim(**fields)


@pytest.mark.parametrize(
    ("value", "shown"), [(2.0, "2"), ({"undefined": "no contact"}, "undefined: no contact"), (None, "–")]
)
def test_another_antenna_is_measured_but_not_judged(value, shown):
    judged = judge(make_claim(target=2.0, tolerance=0.1), {"a": value}, Context(is_cockroach=False))
    assert (judged.verdict, judged.ours) == ("not comparable", shown)
    assert "another antenna" in judged.why
