"""Sentences are filled with a run's own numbers, or left out."""

import pytest

from feeler.paper.findings import PLACE, fill, list_findings, load_findings
from feeler.paper.reproduce import STAGES


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
    for one in load_findings():
        assert one["section"] in {stage.name for stage in STAGES}
        keys = dict(PLACE.findall(one["words"]))
        assert keys and "{" not in fill(one["words"], {key: 1 for key in keys})


def test_without_numbers_nothing_is_said():
    assert list_findings({}) == []
