"""Every statement has tests that can fail, and its verdict follows from them."""

import inspect
import re
from importlib import import_module

import pytest

from feeler.errors import InvalidInput
from paper.readings import ANOTHER, NEVER, NOT, OWN_WORDS, WORDS, decide
from paper.reproduce import STAGES
from paper.scale import SCALES
from paper.statements import Statement, count_verdicts, judge, load_statements, parse_test
from paper.table import Results, read_declared

STAGE = {stage.name: stage for stage in STAGES}


def make_statement(*tests, **fields):
    base = {"id": "x", "where": "", "says": "", "section": "s", "of": "starts"}
    return Statement(**(base | {"tests": tests} | fields))


def spread(value, half, n=9):
    return {"value": value, "low": value - half, "high": value + half, "n": n}


def judge_values(statement, values, scale="paper", **options):
    return judge(statement, Results.make(values), scale, **options)


def make_values(*values, half=0.01):
    return {f"q.M{k}": spread(value, half) for k, value in enumerate(values, 1)}


ORDER, DIP = "q.[M1 < M2 < M3]", "q.[M1 > M2 < M3]"
VALUE, ABOVE, BELOW, GAIN = "q.M1 = 2 ± 10 %", "q.M1 ≥ 0.5", "q.M1 ≤ 0.5", "q.M1 ≥ 0"


@pytest.mark.parametrize(
    ("test", "values", "half", "holds"),
    [
        (ORDER, (1, 2, 3), 0.01, True),
        (ORDER, (3, 2, 1), 0.01, False),
        (ORDER, (1, 1.02, 1.04), 0.005, False),  # apart, but by less than the least effect
        (ORDER, (1, 2, 3), 1.5, None),
        (ORDER, (3, 2, 1), 1.5, None),
        (ORDER, (1, 5, 3), 0.01, False),  # the middle beyond its interval
        (ORDER, (1, 3.1, 3), 0.2, None),
        (DIP, (2, 1, 3), 0.01, True),
        (DIP, (2, 1, 3), 0.6, None),
        (DIP, (1, 2, 3), 0.01, False),
        (DIP, (1, 1.1, 3), 0.2, None),  # no dip needs evidence, too
        (VALUE, (2.1,), 0.01, True),
        (VALUE, (3.0,), 0.01, False),
        (VALUE, (2.1,), 0.2, None),
        (VALUE, (3.0,), 2.0, None),
        (ABOVE, (0.6,), 0.01, True),
        (ABOVE, (0.4,), 0.01, False),
        (ABOVE, (0.6,), 0.2, None),
        (ABOVE, (0.4,), 0.2, None),
        (BELOW, (0.4,), 0.01, True),
        (BELOW, (0.6,), 0.01, False),
        (BELOW, (-0.6,), 0.01, True),
        (GAIN, (0.3,), 0.01, True),
        (GAIN, (-0.3,), 0.01, False),
        (GAIN, (0.3,), 0.4, None),
    ],
)
def test_a_test_holds_fails_or_is_not_decided(test, values, half, holds):
    """Evidence for and against both need the interval."""
    judged = judge_values(make_statement(test), make_values(*values, half=half))
    assert judged.findings[0].agrees == (holds,), judged.why
    assert judged.verdict == {True: OWN_WORDS, False: NOT, None: NEVER}[holds]
    assert judged.why


@pytest.mark.parametrize(("by", "holds"), [(0.5, False), (1.5, True)])
def test_a_gain_needs_the_least_effect_of_its_unit(by, holds):
    """Of points it is 1: half a point that is surely there matters to no one."""
    statement = make_statement("space.gradient ≥ 0")
    judged = judge_values(statement, {"space.gradient": spread(by, 0.1)})
    assert (judged.verdict == OWN_WORDS) is holds
    assert "1 is the least that counts" in judged.why
    assert f"with 0.5: {OWN_WORDS if by >= 0.5 else NOT}" in judged.findings[0].moves
    assert f"with 2: {NOT}" in judged.findings[0].moves


@pytest.mark.parametrize(
    ("agrees", "verdict"),
    [
        ([True, False, None], OWN_WORDS),
        ([False, None, True], ANOTHER),
        ([None, True], ANOTHER),
        ([False, False], NOT),
        ([False, None], NOT),
        ([None, False], NEVER),
        ([None], NEVER),
    ],
)
def test_the_verdict_names_the_reading_nearest_to_the_words(agrees, verdict):
    assert decide(agrees) == verdict
    statement = make_statement(
        "q.{reading}.M1 ≥ 0.5", readings=[f"reading {k}" for k in range(len(agrees))]
    )
    value = {True: spread(0.6, 0.01), False: spread(0.4, 0.01), None: spread(0.5, 0.2)}
    values = {f"q.reading {k}.M1": value[one] for k, one in enumerate(agrees)}
    judged = judge_values(statement, values)
    assert judged.verdict == verdict
    assert [*judged.findings[0].agrees] == agrees


def test_all_tests_of_a_statement_must_hold_and_what_fails_is_named():
    statement = make_statement("a.M1 ≥ 0.5", "b.M1 ≥ 0.5", "c.M1 ≥ 0.5")
    values = {"a.M1": spread(1, 0.1), "b.M1": spread(0.1, 0.1), "c.M1": spread(0.5, 0.1)}
    judged = judge_values(statement, values)
    assert judged.verdict == NOT
    assert judged.why.startswith("1 of 3 tests hold") and "open" not in judged.why


@pytest.mark.parametrize(
    ("values", "why"),
    [
        ({}, "not computed in this run"),
        ({"q.M1": spread(1, 0, n=1)}, r"n = 1 \(starts\)"),
        ({"q.M1": {"undefined": "no peak"}}, "undefined"),
    ],
)
def test_what_was_not_computed_decides_nothing(values, why):
    judged = judge_values(make_statement(ABOVE), values)
    assert judged.verdict == NEVER and re.search(why, judged.why)


def test_effort_is_no_evidence():
    statement, values = make_statement(ABOVE, scale="paper"), make_values(0.1)
    judged = judge_values(statement, values, "smoke")
    assert judged.verdict == NEVER and "paper judges it" in judged.why
    assert judge_values(statement, values).verdict == NOT


def test_another_antenna_is_measured_and_not_judged():
    judged = judge_values(make_statement(ABOVE), make_values(0.6), is_cockroach=False)
    assert judged.verdict == NEVER and "another antenna" in judged.why
    assert judged.ours == "0.6 (0.59 to 0.61)"


def test_our_own_are_counted_by_themselves_in_their_own_words():
    mine, theirs = (make_statement(ABOVE, id=name, whose=name) for name in ("ours", "paper"))
    judged = [judge_values(one, make_values(0.6)) for one in (mine, theirs)]
    assert judged[0].word == "holds" and judged[1].word == OWN_WORDS
    assert [*count_verdicts(judged)] == [*WORDS]
    assert sum(count_verdicts(judged).values()) == 1
    assert count_verdicts(judged, "ours")["holds"] == 1


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"scale": "huge"}, "scale must be one of smoke, quick, published, paper, got 'huge'"),
        ({"tests": ("q ~ 3",)}, "'q ~ 3' is no test; write"),
        ({"tests": ("q.[a < b > c]",)}, "is no test; write"),
        ({"why": "lost"}, "has tests and, as `why`"),
        ({"of": ""}, 'set `of`, for instance to "starts"'),
        ({"section": ""}, "and `section`"),
        ({"readings": ("x",)}, "must hold {reading}"),
    ],
)
def test_a_misspelt_statement_is_refused(fields, message):
    with pytest.raises(InvalidInput, match=re.escape(message)):
        make_statement(**({"tests": (ABOVE,)} | fields))


def test_what_is_declared_is_whole():
    statements = load_statements()
    assert len({one.id for one in statements}) == len(statements) > 100
    assert {one.section for one in statements if one.section} <= {*STAGE}
    for one in statements:
        for sentence in one.list_sentences():
            assert len({*sentence.groups}) == len(sentence.groups)
    answers = read_declared("statements.toml")["answer"]
    assert {one["statement"] for one in answers if "statement" in one} <= {
        one.id for one in statements
    }


def test_a_line_says_what_is_compared():
    order = parse_test("a.[x < y].b")
    assert (order["key"], order["groups"]) == ("a.{group}.b", ("x", "y"))
    bound = parse_test("receptor.best.sample.0.0003 ≤ -0.0827")
    assert (bound["kind"], bound["key"]) == ("below", "receptor.best.sample.0.0003")
    assert bound["target"] == (-0.0827,)


def list_knobs(stage):
    """What of a scale the modules of a stage ask for."""
    source = "".join(inspect.getsource(import_module(name)) for name in stage.modules)
    return set(re.findall(r"effort\.(\w+)", source))


def test_a_statement_is_held_back_only_where_its_section_computes_less_than_at_paper_scale():
    """ "Too little is computed" is a false word of a section that computes all."""
    for number, known in enumerate(SCALES.values()):
        for one in load_statements():
            if number >= [*SCALES].index(one.scale) or one.section in (*known.kept, ""):
                continue
            stage = STAGE[one.section]
            assert "scale" in stage.reads, f"{one.id}: its section is the same at every scale"
            knobs = list_knobs(stage) - {"fps"}  # how a movie looks
            assert any(getattr(known, k) != getattr(SCALES["paper"], k) for k in knobs), one.id
