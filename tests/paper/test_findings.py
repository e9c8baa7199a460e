"""Sentences are filled with a run's own numbers, or left out."""

import pytest

from paper.claims import load_claims
from paper.declared import read_declared
from paper.findings import (
    OPEN,
    PLACE,
    _load_findings,
    choose_answer,
    fill,
    list_abstract,
    list_findings,
    list_headlines,
    list_not_reproduced,
    list_screens,
)
from paper.reproduce import STAGES
from paper.story import _count_unsupported
from paper.verdicts import ClaimResult


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({"a.b c": 0.123, "d": 4}, "12% of 4"),
        ({"a.b c": {"value": 0.5, "low": 0.1, "high": 0.9}, "d": 4}, "50% of 4"),
        ({"a.b c": {"undefined": "nothing there"}, "d": 4}, ""),
        ({"d": 4}, ""),
    ],
)
def test_a_sentence_says_the_values_or_nothing(values, said):
    assert fill("{a.b c:.0%} of {d:d}", values) == said


def test_every_finding_has_a_section_and_numbers_of_its_own():
    for one in _load_findings():
        assert one["section"] in {stage.name for stage in STAGES}
        keys = dict(PLACE.findall(one["words"]))
        assert keys and "{" not in fill(one["words"], {key: 1 for key in keys})


def test_without_numbers_nothing_is_said():
    assert list_findings({}) == []


def judge_all(verdict, *but):
    """Every claim with one verdict, those named with the other."""
    other = {"reproduced": "partly"}.get(verdict, "reproduced")
    return [
        ClaimResult(claim=claim, verdict=other if claim.id in but else verdict, ours="", why="")
        for claim in load_claims()
    ]


STORY = read_declared("story.toml")
KEYS = {
    key: 0.81
    for part in ("headline", "screen")
    for one in STORY[part]
    for text in one.values()
    if isinstance(text, str)
    for key, _ in PLACE.findall(text)
}


def test_the_answer_is_yes_only_while_what_it_rests_on_holds():
    answers = [one["words"] for one in STORY["answer"]]
    assert choose_answer(judge_all("reproduced")) == answers[0]
    assert choose_answer(judge_all("partly")) == answers[-1]
    for name in STORY["answer"][0]["holds"]:
        assert choose_answer(judge_all("reproduced", name)) == answers[1]


@pytest.mark.parametrize("answer", STORY["answer"], ids=lambda one: one["words"][:9])
def test_the_answer_is_short_and_rests_on_claims_that_exist(answer):
    assert len(answer["words"].split()) <= 25
    standing = {claim.id: claim.standing for claim in load_claims()}
    assert all(standing[name] == "evidence" for name in answer["holds"])


def test_a_headline_needs_its_numbers_and_its_claims():
    shown = list_headlines(KEYS, judge_all("reproduced"))
    assert [one["number"] for one in shown] == ["81%", "0.81 m/s", "81%"]
    assert list_headlines({}, judge_all("reproduced")) == []
    resting = [one for one in STORY["headline"] if one["holds"]]
    assert resting and len(list_headlines(KEYS, judge_all("partly"))) == 3 - len(resting)


def test_a_headline_goes_without_the_sentence_that_a_run_cannot_fill():
    """A run without the linear antenna still says the rest."""
    values = {key: one for key, one in KEYS.items() if not key.endswith(".linear")}
    when = list_headlines(values, judge_all("reproduced"))[0]["when"]
    assert "linear" not in when and "relative to each touch" in when and "{" not in when


def test_the_abstract_s_words_stand_beside_their_verdicts():
    shown = list_abstract(judge_all("reproduced", "sparsity-speed"))
    assert [one["verdict"] for one in shown] == ["partly", *["reproduced"] * 5]
    assert {one["open"] for one in shown} == {""}
    hang = list_abstract(judge_all("depends on a definition"))
    assert all(one["open"] for one in hang)
    assert list_abstract([]) == []


def test_what_is_not_reproduced_is_said_in_a_line_each_and_why():
    found = list_not_reproduced(judge_all("not reproduced"))
    told = [one for one in found if one["why"]]
    assert len(told) == len(STORY["unmet"]) < len(found)
    assert all(len(f"{one['words']} {one['why']}".split()) <= 30 for one in told)
    assert list_not_reproduced(judge_all("reproduced")) == []


def test_a_screen_leaves_out_the_sentence_that_it_cannot_fill():
    full, empty = list_screens(KEYS), list_screens({})
    assert len(full) == len(empty) <= 10
    for one, less in zip(full, empty, strict=True):
        assert "{" not in one["words"] + less["words"] and less["words"]
        assert len(less["words"]) <= len(one["words"])


def test_what_no_definition_reproduces_is_counted_apart():
    """Of four statements two are open and never reproduced, one is open and reproduced by one of
    its definitions, and one is not open.
    """
    claims = [one for one in load_claims() if one.whose == "paper" and one.definitions]
    first, second, third, fourth = ({one.statement: one for one in claims}[name] for name in sorted(
        {one.statement for one in claims})[:4])  # fmt: skip

    def read(claim, verdict, *readings):
        under = tuple(
            ClaimResult(claim=claim, verdict=word, ours="", why="") for word in readings
        )
        return ClaimResult(claim=claim, verdict=verdict, ours="", why="", readings=under)

    judged = [
        read(first, OPEN, "not reproduced", "partly"),
        read(second, OPEN, "reproduced", "not reproduced"),
        read(third, "no evidence", "no evidence", "no evidence"),
        read(fourth, OPEN, "partly", "partly"),
    ]
    assert _count_unsupported(judged) == 2
