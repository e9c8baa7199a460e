"""Every claim has a rule, and every rule can fail."""

import inspect
import json
import re
from importlib import import_module
from pathlib import Path

import pytest

from feeler.errors import InvalidInput
from feeler.report import make_spread
from paper.claims import Claim, load_claims, load_effects
from paper.context import Context
from paper.reproduce import STAGES
from paper.scale import SCALES
from paper.stage import Stage
from paper.verdicts import (
    EVIDENCE,
    OTHERS,
    ClaimResult,
    _name_apart,
    count_verdicts,
    judge,
    judge_statements,
    summarise_counts,
)

CONTEXT = Context()
RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "reproduce.json"
STAGE = {stage.name: stage for stage in STAGES}


def make_claim(**fields):
    base = {
        "id": "x",
        "where": "",
        "says": "",
        "paper": "",
        "tag": "P",
        "kind": "value",
        "section": "s",
        "drawn": "nothing",
        "keys": ("a",),
    }
    return Claim(**(base | fields))


def test_there_are_enough_claims_and_each_names_a_section():
    claims = load_claims()
    assert len(claims) >= 30
    assert len({claim.id for claim in claims}) == len(claims)
    assert {claim.section for claim in claims} <= {stage.name for stage in STAGES}
    assert {claim.whose for claim in claims} == {"paper", "ours"}


@pytest.mark.parametrize(
    ("claim", "values", "verdict"),
    [
        (make_claim(target=2.0, tolerance=0.1), {"a": 2.1}, "reproduced"),
        (make_claim(target=2.0, tolerance=0.1), {"a": 3.0}, "not reproduced"),
        (make_claim(target=2.0, tolerance=0.1), {"a": 2.3}, "partly"),
        (
            make_claim(target=2.0, tolerance=0.1),
            {"a": {"value": 3.0, "low": 1.0, "high": 4.0}},
            "no evidence",
        ),
        (make_claim(kind="dip", keys=("a", "b", "c")), {"a": 2, "b": 1, "c": 3}, "reproduced"),
        (
            make_claim(kind="dip", keys=("a", "b", "c")),
            {"a": 3, "b": 2, "c": 1},
            "not reproduced",
        ),
        (make_claim(kind="share"), {"a": 0.8}, "reproduced"),
        (make_claim(kind="share"), {"a": 0.6}, "partly"),
        (make_claim(kind="share"), {"a": 0.4}, "not reproduced"),
        (make_claim(kind="order", keys=("a", "b")), {"a": 1, "b": 2}, "reproduced"),
        (make_claim(kind="order", keys=("a", "b")), {"a": 2, "b": 1}, "not reproduced"),
        (
            make_claim(kind="order", keys=("a", "b")),
            {"a": {"value": 1, "low": 0, "high": 3}, "b": 2},
            "no evidence",
        ),
        (make_claim(kind="order", keys=("a", "b", "c")), {"a": 1, "b": 5, "c": 3}, "partly"),
        (make_claim(kind="above", target=1.0), {"a": 0.5}, "not reproduced"),
        (make_claim(kind="below", target=1.0), {"a": 0.5}, "reproduced"),
        (make_claim(kind="none", why="lost"), {"a": 0.5}, "not comparable"),
        (make_claim(), {}, "not judged"),
        (make_claim(target=1.0), {"a": {"undefined": "no peak"}}, "not comparable"),
        (
            make_claim(kind="order", keys=("a", "b")),
            {"a": 1, "b": {"undefined": "no peak"}},
            "not comparable",
        ),
        (make_claim(standing="circular", why="so made", target=1.0), {"a": 1.0}, "circular"),
        (
            make_claim(standing="by construction", why="an input", target=1.0),
            {"a": 7.0},
            "by construction",
        ),
    ],
)
def test_rules(claim, values, verdict):
    assert judge(claim, values, CONTEXT).verdict == verdict


@pytest.mark.parametrize(
    ("claim", "values", "why"),
    [
        ({"target": 2.0, "tolerance": 0.1}, {"a": 2.1}, "within 1.8 to 2.2"),
        (
            {"target": 2.0, "tolerance": 0.1},
            {"a": 2.3},
            "off by +15%; asked for were 1.8 to 2.2, within twice of it",
        ),
        (
            {"target": 2.0, "tolerance": 0.1},
            {"a": 1.0},
            "off by -50%; asked for were 1.8 to 2.2",
        ),
        ({"kind": "share"}, {"a": 0.8}, "holds in 80%; 75% are asked for, 50% are partly"),
        ({"kind": "above", "target": 1.5}, {"a": 2.0}, "above 1.5"),
        (
            {"kind": "above", "target": 1.5},
            {"a": {"value": 2.0, "low": 1.6, "high": 3.0}},
            "above 1.5 with its whole spread",
        ),
        ({"kind": "below", "target": 1.5}, {"a": 2.0}, "not below 1.5"),
        (
            {"kind": "order", "keys": ("a", "b")},
            {"a": 2, "b": 1},
            "the ends are not in the claimed order",
        ),
        (
            {"kind": "order", "keys": ("a", "b"), "null": ("n", "m")},
            {"a": 1.0, "b": 2.0, "n": 0.125, "m": 0.5},
            (
                "in the claimed order, but identical touches give the same order of the ends (null"
                " 0.125, 0.5)"
            ),
        ),
        (
            {"kind": "above", "target": 0.1, "null": ("n",), "apart": "greater"},
            {"a": 0.5, "n": 0.625},
            (
                "above 0.1, but identical touches are discriminated as much in"
                " at least one group (null 0.625)"
            ),
        ),
    ],
)
def test_reasons_name_the_numbers_that_were_compared(claim, values, why):
    assert judge(make_claim(**claim), values, CONTEXT).why == why


@pytest.mark.parametrize(
    ("keys", "values", "ours"),
    [
        (("a",), {"a": 2.12345}, "2.123"),
        (("a",), {"a": {"value": 0.51234, "low": 0.4, "high": 0.6}}, "0.512 (0.4…0.6)"),
        (("a",), {"a": {"undefined": "no peak"}}, "undefined: no peak"),
        (
            ("r.slow", "r.fast"),
            {"r.slow": 1.5, "r.fast": {"value": 2, "low": 1, "high": 3}},
            "slow 1.5; fast 2 (1…3)",
        ),
        (("a",), {}, "–"),
    ],
)
def test_our_numbers_are_shown_with_their_spread(keys, values, ours):
    claim = make_claim(kind="order" if len(keys) > 1 else "value", target=1.0, keys=keys)
    assert judge(claim, values, CONTEXT).ours == ours


def spread(value, low, high):
    return {"value": value, "low": low, "high": high}


@pytest.mark.parametrize(
    ("claim", "values", "verdict"),
    [
        (make_claim(target=2.0, tolerance=0.5), {"a": 3.0}, "reproduced"),  # at the tolerance
        (make_claim(target=2.0, tolerance=0.5), {"a": 1.0}, "reproduced"),
        (
            make_claim(target=2.0, tolerance=0.1),
            {"a": spread(2.0, 1.0, 4.0)},
            "no evidence",
        ),
        (make_claim(target=2.0, tolerance=0.1), {"a": spread(2.1, 1.9, 2.15)}, "reproduced"),
        (make_claim(target=2.0, tolerance=0.1), {"a": spread(2.3, 2.1, 2.4)}, "no evidence"),
        (make_claim(target=2.0, tolerance=0.1), {"a": spread(2.3, 2.25, 2.35)}, "partly"),
        (make_claim(target=2.0, tolerance=0.1), {"a": spread(3.0, 2.5, 3.5)}, "not reproduced"),
        (make_claim(kind="within", target=2.0, tolerance=0.5), {"a": 3.5}, "not reproduced"),
        (make_claim(kind="within", target=2.0, tolerance=0.5), {"a": 2.5}, "reproduced"),
        (make_claim(target=2.0, tolerance=0.5), {"a": 4.0}, "partly"),  # at twice the tolerance
        (make_claim(target=2.0, tolerance=0.5), {"a": 4.01}, "not reproduced"),
        (make_claim(target=-2.0, tolerance=0.5), {"a": -3.0}, "reproduced"),
        (make_claim(kind="share"), {"a": 0.75}, "reproduced"),
        (make_claim(kind="share"), {"a": 0.74}, "partly"),
        (make_claim(kind="share"), {"a": 0.5}, "partly"),
        (make_claim(kind="share"), {"a": 0.49}, "not reproduced"),
        (
            make_claim(kind="dip", keys=("a", "b", "c")),
            {"a": 2, "b": 2, "c": 3},
            "not reproduced",
        ),
        (
            make_claim(kind="dip", keys=("a", "b", "c")),
            {"a": 3, "b": 2, "c": 2},
            "not reproduced",
        ),
        (make_claim(kind="above", target=1.0), {"a": spread(2, 1.1, 3)}, "reproduced"),
        (make_claim(kind="above", target=1.0), {"a": spread(2, 0.5, 3)}, "no evidence"),
        (make_claim(kind="above", target=1.0), {"a": spread(0.9, 0.5, 3)}, "no evidence"),
        (make_claim(kind="above", target=1.0), {"a": spread(0.9, 0.5, 1)}, "not reproduced"),
        (make_claim(kind="above", target=1.0), {"a": 1.0}, "not reproduced"),
        (make_claim(kind="below", target=1.0), {"a": spread(0.5, 0.1, 0.9)}, "reproduced"),
        (make_claim(kind="below", target=1.0), {"a": spread(0.5, 0.1, 1.1)}, "no evidence"),
        (make_claim(kind="below", target=1.0), {"a": spread(1.5, 0.1, 1.9)}, "no evidence"),
        (make_claim(kind="below", target=1.0), {"a": spread(1.5, 1.0, 1.9)}, "not reproduced"),
        (make_claim(kind="above", target=3.0), {"a": spread(2, 1, 4)}, "no evidence"),
        (make_claim(kind="above", target=0.2), {"a": spread(0.3, 0.1, 0.4)}, "no evidence"),
        (make_claim(kind="below", target=3.0), {"a": spread(2.5, 1, 3.5)}, "no evidence"),
        (make_claim(kind="below", target=0.2), {"a": spread(0.3, 0.1, 0.4)}, "no evidence"),
        (make_claim(kind="order", keys=("a", "b")), {"a": 1, "b": 1}, "not reproduced"),
        (
            make_claim(kind="order", keys=("a", "b")),
            {"a": spread(1, 0, 1.4), "b": spread(2, 1.5, 3)},
            "reproduced",
        ),
        (
            make_claim(kind="order", keys=("a", "b")),
            {"a": spread(1, 0, 1.6), "b": spread(2, 1.5, 3)},
            "no evidence",
        ),
        (
            make_claim(kind="order", keys=("a", "b")),
            {"a": 1, "b": spread(2, 0.5, 3)},
            "no evidence",
        ),
        (
            make_claim(kind="order", keys=("a", "b")),
            {"a": spread(2, 0, 3), "b": 1},
            "no evidence",
        ),
        (
            make_claim(kind="order", keys=("a", "b", "c")),
            {"a": 1, "b": 3, "c": spread(2, 0.5, 3)},
            "no evidence",
        ),
        (
            make_claim(kind="dip", keys=("a", "b", "c")),
            {"a": 3, "b": spread(1, 0.5, 2), "c": 4},
            "reproduced",
        ),
        (
            make_claim(kind="dip", keys=("a", "b", "c")),
            {"a": spread(3, 1.5, 3), "b": spread(1, 0.5, 2), "c": 4},
            "no evidence",
        ),
        (
            make_claim(kind="order", keys=("a", "b")),
            {"a": 1, "b": spread(2, 1.5, 3)},
            "reproduced",
        ),
        (
            make_claim(kind="order", keys=("a", "b", "c")),
            {"a": 1, "b": 2, "c": 3},
            "reproduced",
        ),
        (
            make_claim(kind="order", keys=("a", "b", "c")),
            {"a": 1, "b": spread(1.2, 0.1, 9), "c": 2},
            "reproduced",
        ),
        (make_claim(kind="order", keys=("a", "b", "c")), {"a": 1, "b": 1, "c": 3}, "partly"),
        (make_claim(kind="order", keys=("a", "b", "c")), {"a": 1, "b": 3, "c": 3}, "partly"),
        (
            make_claim(kind="order", keys=("a", "b", "c")),
            {"a": 3, "b": 2, "c": 1},
            "not reproduced",
        ),
    ],
)
def test_rules_at_their_edges(claim, values, verdict):
    assert judge(claim, values, CONTEXT).verdict == verdict


@pytest.mark.parametrize(
    ("apart", "ours", "null", "verdict"),
    [
        ("greater", 0.5, 0.5, "no evidence"),
        ("greater", 0.5, 0.4, "reproduced"),
        ("less", 0.5, 0.5, "no evidence"),
        ("greater", spread(0.5, 0.2, 0.8), 0.6, "no evidence"),
        ("less", spread(0.5, 0.2, 0.8), 0.4, "no evidence"),
        ("less", 0.5, 0.6, "reproduced"),
    ],
)
def test_a_null_that_does_exactly_as_well_is_enough(apart, ours, null, verdict):
    claim = make_claim(target=0.5, tolerance=0.1, null=("m",), apart=apart)
    assert judge(claim, {"a": ours, "m": null}, CONTEXT).verdict == verdict


@pytest.mark.parametrize(
    ("apart", "ours", "null", "verdict"),
    [
        ("greater", (0.2, 0.9), (0.1, 0.1), "reproduced"),
        ("greater", (0.2, 0.9), (0.2, 0.1), "no evidence"),  # the first group's null reaches it
        ("greater", (0.2, 0.9), (0.1, 0.15), "no evidence"),  # the null has the same order
        (
            "greater",
            (0.9, 0.2),
            (0.15, 0.1),
            "no evidence",
        ),  # also where the order is not the claimed one
        ("greater", (0.9, 0.2), (0.1, 0.15), "not reproduced"),
        ("less", (0.2, 0.9), (1.0, 0.95), "reproduced"),
        ("less", (0.2, 0.9), (0.1, 0.05), "no evidence"),
    ],
)
def test_what_identical_touches_do_as_well_is_no_evidence(apart, ours, null, verdict):
    claim = make_claim(kind="order", keys=("a", "b"), null=("m", "n"), apart=apart)
    assert (
        judge(claim, dict(zip("abmn", (*ours, *null), strict=True)), CONTEXT).verdict == verdict
    )


@pytest.mark.parametrize(
    ("twin", "verdict", "why"),
    [
        (
            (spread(0.7, 0.6, 0.8), spread(0.1, 0.0, 0.2)),
            "not reproduced",
            "^reversed.*0.7, 0.1",
        ),
        (
            (spread(0.7, 0.1, 0.8), spread(0.1, 0.0, 0.2)),
            "no evidence",
            "^in the claimed order",
        ),
        ((0.1, 0.7), "no evidence", "^in the claimed order"),
        ((0.1, None), "not judged", "not computed.*: n$"),
    ],
)
def test_what_carries_over_to_a_twin_may_reverse_an_order_that_identical_touches_show_too(
    twin, verdict, why
):
    claim = make_claim(kind="order", keys=("a", "b"), null=("c", "d"), twin=("m", "n"))
    values = dict(zip("abcdmn", (0.2, 0.9, 0.2, 0.9, *twin), strict=True))
    judged = judge(claim, values, CONTEXT)
    assert judged.verdict == verdict and re.search(why, judged.why)


def test_a_twin_is_not_asked_where_identical_touches_do_not_do_as_well():
    claim = make_claim(kind="order", keys=("a", "b"), null=("c", "d"), twin=("m", "n"))
    values = dict(zip("abcdmn", (0.2, 0.9, 0.1, 0.1, 0.7, 0.1), strict=True))
    assert judge(claim, values, CONTEXT).verdict == "reproduced"


@pytest.mark.parametrize(
    ("values", "verdict", "why"),
    [
        (
            ((2, 1.8, 2.2), (1, 0.8, 1.2)),
            "not reproduced",
            "reversed: the ends stand in the opposite order",
        ),
        (((2, 1.1, 2.2), (1, 0.8, 1.2)), "no evidence", "the spreads of the ends overlap"),
        (
            ((2, 2, 2), (1, 1, 1)),  # no spread: not said
            "not reproduced",
            "the ends are not in the claimed order",
        ),
    ],
)
def test_an_order_is_reversed_only_beyond_its_spread(values, verdict, why):
    numbers = dict(zip("ab", (spread(*one) for one in values), strict=True))
    judged = judge(make_claim(kind="order", keys=("a", "b")), numbers, CONTEXT)
    assert judged.verdict == verdict and judged.why.startswith(why)


def test_each_definition_has_a_null_and_numbers_beside_it_of_its_own():
    claim = make_claim(
        kind="order",
        keys=("{definition}.a", "{definition}.b"),
        null=("null.{definition}.a", "null.{definition}.b"),
        shows=("{definition}.c",),
        definitions=("x", "y"),
    )
    values = {"x.a": 1.0, "x.b": 2.0, "y.a": 1.0, "y.b": 2.0, "x.c": 5.0, "y.c": 6.0}
    nulls = {"null.x.a": 1.0, "null.x.b": 2.0, "null.y.a": 0.1, "null.y.b": 0.1}
    judged = judge(claim, values | nulls, CONTEXT)
    assert [one.verdict for one in judged.readings] == ["no evidence", "reproduced"]
    assert ("y.c", 6.0) in judged.readings[1].values
    assert claim.list_keys() == {*values, *nulls}


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ({"x.a": 1.0, "y.a": 1.05}, "reproduced"),
        ({"x.a": 9.0, "y.a": 7.0}, "not reproduced"),
        ({"x.a": 1.0, "y.a": 7.0}, "depends on a definition"),
        ({"x.a": {"value": 1.0, "n": 2}, "y.a": {"value": 7.0, "n": 1}}, "not judged"),
    ],
)
def test_only_what_every_definition_says_is_a_verdict(values, verdict):
    claim = make_claim(
        keys=("{definition}.a",),
        definitions=("x", "y"),
        target=1.0,
        tolerance=0.1,
        drawn="nothing"
        if all(isinstance(value, float) for value in values.values())
        else "starts",
    )
    judged = judge(claim, values, CONTEXT)
    assert judged.verdict == verdict
    assert [found["values"] for found in judged.describe()["definitions"]] == [
        {k: v} for k, v in values.items()
    ]
    assert ("nearest: x" in judged.why) == (verdict == "depends on a definition")


def test_claims_of_our_own_are_counted_by_themselves_and_only_evidence_leads():
    paper = [
        make_claim(id=str(k), target=target, tolerance=0.1)
        for k, target in enumerate((1.0, 1.0, 5.0))
    ]
    own = make_claim(id="own", whose="ours", target=1.0, tolerance=0.1)
    made = make_claim(id="made", standing="by construction", why="an input", target=1.0)
    judged = [judge(claim, {"a": 1.0}, CONTEXT) for claim in (*paper, own, made)]
    counts = count_verdicts(judged)
    assert [counts[word] for word in EVIDENCE] == [2, 0, 1]
    assert sum(counts[word] for word in OTHERS) == counts["by construction"] == 1
    assert (
        count_verdicts(judged, "ours")["holds"]
        == sum(count_verdicts(judged, "ours").values())
        == 1
    )
    assert summarise_counts(judged).startswith(
        "statements of the paper with evidence: 2 reproduced, 0 partly, 1 not reproduced;"
    )
    assert summarise_counts(judged).endswith("statements of our own: 1 holds")


@pytest.mark.parametrize("whose", ["paper", "ours"])
@pytest.mark.parametrize("scale", ["smoke", "quick", "paper"])
@pytest.mark.parametrize(
    "value", [2.0, {"value": 2.0}, {"value": 2.0, "n": 1}, make_spread(2.0, 1.9, 2.1, n=1)]
)
def test_one_draw_is_not_judged_at_any_scale(value, scale, whose):
    """Also where a value forgot to say how many draws it has."""
    claim = make_claim(kind="above", target=1.0, drawn="starts", whose=whose)
    judged = judge(claim, {"a": value}, Context(scale=scale))
    assert (judged.verdict, judged.word) == ("not judged", "not judged")
    assert judged.why == "n = 1 (starts): one draw has no spread"
    assert "…" not in judged.ours


def test_one_draw_of_any_key_or_null_is_enough_not_to_judge():
    order = {"kind": "order", "keys": ("a", "b"), "drawn": "starts"}
    values = {key: make_spread(k, k, k, n=2) for k, key in enumerate("abmn")}
    assert judge(make_claim(**order), values, CONTEXT).verdict == "reproduced"
    assert judge(make_claim(**order), values | {"b": 1.0}, CONTEXT).verdict == "not judged"
    null = make_claim(**order, null=("m", "n"))
    assert judge(null, values | {"n": 3.0}, CONTEXT).verdict == "not judged"


@pytest.mark.parametrize(
    ("verdicts", "together"),
    [
        (["reproduced"] * 4, "reproduced"),
        (["reproduced", "partly"], "partly"),
        (["reproduced", "not reproduced"], "partly"),
        (["reproduced", "no evidence"], "partly"),
        (["partly", "depends on a definition"], "partly"),
        (["no evidence", "not reproduced"], "not reproduced"),
        (["not reproduced"] * 2, "not reproduced"),
        (["no evidence", "no evidence"], "no evidence"),
        (["depends on a definition", "no evidence"], "depends on a definition"),
        (["reproduced", "not judged"], "not judged"),
    ],
)
def test_claims_that_read_one_effect_count_once(verdicts, together):
    judged = [
        ClaimResult(claim=make_claim(id=str(k), effect="e"), ours="", verdict=verdict, why="")
        for k, verdict in enumerate(verdicts)
    ]
    other = ClaimResult(claim=make_claim(id="e2"), ours="", verdict="reproduced", why="")
    assert judge_statements([*judged, other]) == {"e": together, "e2": "reproduced"}
    assert sum(count_verdicts([*judged, other]).values()) == 2


def test_every_effect_has_words_and_is_read_by_several_claims():
    effects = [claim.effect for claim in load_claims() if claim.effect]
    assert {*effects} == {*load_effects()}
    assert all(effects.count(effect) > 1 for effect in effects)
    assert not {*effects} & {claim.id for claim in load_claims()}


def test_keys_are_told_apart_by_what_differs():
    assert _name_apart(("lda.slow", "lda.fast")) == ("slow", "fast")
    assert _name_apart(("a.0.5.x", "a.1.5.x")) == ("0.5", "1.5")
    ordered = judge(
        make_claim(kind="order", keys=("a.slow", "a.fast")),
        {"a.slow": 1.0, "a.fast": 2.0},
        CONTEXT,
    )
    assert ordered.ours == "slow 1; fast 2" and ordered.is_evidence
    assert ordered.values == (("a.slow", 1.0), ("a.fast", 2.0))


def test_a_run_must_write_every_key_of_every_definition_and_what_stands_beside():
    claim = make_claim(
        keys=("{definition}.a",), definitions=("x", "y"), null=("n",), shows=("s", "t")
    )
    assert claim.list_keys() == {"x.a", "y.a", "n", "s", "t"}
    assert make_claim(keys=("a", "b")).list_keys() == {"a", "b"}


def test_the_nearest_definition_is_named():
    claim = make_claim(
        keys=("{definition}.a",), definitions=("x", "y", "z"), target=1.0, tolerance=0.1
    )
    values = {
        "x.a": spread(0.2, 1.0, 1.0),
        "y.a": spread(1.05, 0.2, 3.0),
        "z.a": {"undefined": "no"},
    }
    judged = judge(claim, values, CONTEXT)
    assert judged.why.endswith("nearest: y") and judged.verdict == "depends on a definition"
    assert not judged.is_evidence


@pytest.mark.parametrize(
    ("scale", "verdict"), [("smoke", "not judged"), ("quick", "not reproduced")]
)
def test_effort_is_no_verdict_on_the_paper(scale, verdict):
    judged = judge(make_claim(target=90.0, due="quick"), {"a": 16}, Context(scale=scale))
    assert (judged.verdict, judged.ours) == (verdict, "16")
    assert (
        scale == "quick"
        or judged.why == "too little is computed at smoke scale; a run at quick scale judges it"
    )


def list_held_back():
    """Claims that a scale does not judge, though their section is computed in it."""
    for number, (scale, knobs) in enumerate(SCALES.items()):
        for claim in load_claims():
            if number < [*SCALES].index(claim.due) and claim.section not in knobs.kept:
                yield scale, claim


def list_knobs(stage: Stage) -> set[str]:
    """What of a scale the modules of a stage ask for."""
    source = "".join(inspect.getsource(import_module(name)) for name in stage.modules)
    return set(re.findall(r"effort\.(\w+)", source))


def test_a_claim_is_held_back_only_where_its_section_computes_less_than_at_paper_scale():
    """ "Too little is computed" is a false word of a section that computes all."""
    for scale, claim in list_held_back():
        stage = STAGE[claim.section]
        assert "scale" in stage.reads, f"{claim.id}: its section is the same at every scale"
        knobs = list_knobs(stage) - {"fps"}  # how a movie looks
        less = [k for k in knobs if getattr(SCALES[scale], k) != getattr(SCALES["paper"], k)]
        assert less, f"{claim.id}: {scale} scale computes as much of {claim.section} as paper"


def test_not_judged_means_that_less_was_counted_than_in_the_measured_run():
    """Its n is smaller, or it is absent; a value without n is another one."""
    measured = {
        scale: {key: value for part in found["values"].values() for key, value in part.items()}
        for scale, found in json.loads(RESULTS.read_text()).items()
    }
    whole = measured["paper"]

    def is_less(key, values):
        mine, full = values.get(key), whole.get(key)
        if isinstance(mine, dict) and isinstance(full, dict) and "n" in full:
            return mine.get("n", 1) < full["n"]
        return mine is None or mine != full

    for scale, claim in list_held_back():
        readings = [claim.read_by(name) for name in claim.definitions] or [claim]
        keys = {key for one in readings for key in (*one.keys, *one.null, *one.twin)}
        if values := measured[scale]:
            assert any(is_less(key, values) for key in keys), f"{claim.id} at {scale} scale"


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"due": "huge"}, "due must be one of smoke, quick, published, paper, got 'huge'"),
        ({"kind": "valeu"}, "kind must be one of value, .*got 'valeu'"),
        ({"standing": "circular"}, "add a sentence as `why`"),
        ({"kind": "none"}, "add a sentence as `why`"),
        ({"drawn": ""}, 'set `drawn`, for instance to "starts"'),
        ({"null": ("m", "n")}, "1 keys but 2 nulls"),
        ({"twin": ("m", "n")}, "needs two twins.* got 2 and 0"),
        ({"null": ("m",), "twin": ("n",)}, "needs two twins.* got 1 and 1"),
        ({"definitions": ("x",)}, "must hold {definition}"),
        ({"definitions": ("x",), "keys": ("{definition}.a", "b")}, "must hold {definition}"),
    ],
)
def test_a_misspelt_rule_is_refused(fields, message):
    with pytest.raises(InvalidInput, match=message):
        make_claim(**fields)


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (2.0, "2"),
        (0.123456, "0.1235"),
        (True, "True"),
        ("text", "text"),
        ({"undefined": "no contact"}, "undefined: no contact"),
        (None, "–"),
    ],
)
def test_another_antenna_is_measured_but_not_judged(value, shown):
    judged = judge(
        make_claim(target=2.0, tolerance=0.1), {"a": value}, Context(is_cockroach=False)
    )
    assert (judged.verdict, judged.ours) == ("not comparable", shown)
    assert "another antenna" in judged.why
