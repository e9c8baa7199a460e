"""The page on slow, graded antennae says what was measured: its numbers stand in the results, and
only there.
"""

import json
import re
from pathlib import Path

import pytest
from scripts import load_script

from paper.claims import load_claims

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def numbers():
    return load_script("docs", "build")


@pytest.fixture(scope="module")
def found(numbers):
    """Numbers that stand for what examples find while the pages are built."""
    text = (ROOT / "docs" / "whiskers.md").read_text()
    return {place["key"]: 1.0 for place in numbers.PLACE.finditer(text)}


@pytest.fixture(scope="module")
def page(numbers):
    return "\n".join((ROOT / "docs" / name).read_text() for name in numbers.PAGES)


def test_every_place_is_filled(numbers, page, found):
    assert "{{" not in numbers.insert_numbers(page, found)
    assert len(numbers.PLACE.findall(page)) > 20


def test_no_number_is_written_by_hand(numbers, page):
    """Measured numbers carry a decimal point, a per cent or a unit; windows and counts of the task
    may stand as words.
    """
    # addresses hold no measurements, and a page of somebody else's numbers names its sources
    own = "\n".join((ROOT / "docs" / name).read_text() for name in numbers.PAGES[:5])
    assert {*page.splitlines()} >= {*own.splitlines()}
    words = re.sub(r"\]\(http[^)]*\)", "]", numbers.PLACE.sub("", own))
    assert not re.findall(r"\d+\.\d+|\d+ ?(?:%|bits|µJ|mN|rad|m/s)", words)


def test_a_key_that_was_not_measured_ends_the_build(numbers):
    with pytest.raises(KeyError, match="nowhere"):
        numbers.insert_numbers("{{ nowhere:.1f }}")


def test_claims_name_a_page_that_is_there():
    pages = [ROOT / claim.where for claim in load_claims() if claim.whose == "ours"]
    assert pages and all(page.exists() for page in pages)


def test_results_are_of_whole_sets(numbers):
    values = json.loads(numbers.RESULTS.read_text())["paper"]["values"]["tradeoff"]
    assert values["tradeoff.sets"] >= 2
    assert values["choices.common"] > 0
