"""Sentences are filled with a run's own numbers, or left out."""

import pytest

from feeler.studies.paper.claims import load_claims
from feeler.studies.paper.findings import (
    PLACE,
    _load_findings,
    fill,
    list_findings,
    list_numbers,
    list_topics,
)
from feeler.studies.paper.reproduce import STAGES
from feeler.studies.paper.verdicts import Judged


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


VALUES = {
    "complete.common.exponential": 0.93,
    "complete.common.constant": 0.37,
    "dispersion.tensor.nmi.slow": {"value": 0.312, "low": 0.1, "high": 0.5},
    "dispersion.tensor.nmi.fast": 0.624,
    "generalise.size.exponential": 0.183,
    "generalise.size.constant": 0.447,
    "classification.null.slow": 0.912,
}


def test_the_first_screen_shows_the_run_s_own_numbers():
    assert [number for number, _ in list_numbers(VALUES)] == ["0.31 : 0.62", "93% : 37%", "91%"]
    (slow, whole, null), words = list_numbers(VALUES), list_topics(VALUES, [])[0]["words"]
    assert (
        "slow : fast" in slow[1] and "exponential : constant" in whole[1] and "identical" in null[1]
    )
    assert "whole touches" in whole[1]  # in the paper's window profiles are not comparable
    assert f"chance, {1 / 30:.0%}".replace("%", " %") in null[1]  # all of one speed
    assert (
        "slow touches are alike their closest match with an NMI of 0.31, those of fast ones with"
        " 0.62" in words
    )
    assert [number for number, _ in list_numbers({"classification.null.slow": 0.2})] == ["20%"]


def test_a_topic_counts_the_verdicts_of_its_own_claims_of_the_paper():
    claims = load_claims()
    judged = [Judged(claim=claim, verdict="partly", ours="", why="") for claim in claims]
    counts = [topic["counts"]["partly"] for topic in list_topics({}, judged)]
    prefixes = (
        ("speed-", "lda-speed", "cnn-speed"),
        ("profile-", "lda-profile", "cnn-profile", "entropy-order", "wall-order"),
        ("bases-", "entropy-", "residual", "duration", "pca"),
    )
    expected = [
        len({c.statement for c in claims if c.whose == "paper" and c.id.startswith(words)})
        for words in prefixes
    ]
    assert counts == expected and min(counts) > 0
    assert all(topic["words"] == "" for topic in list_topics({}, judged))
