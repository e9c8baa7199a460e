"""Numbers in the pages are those of the results, and none of the findings is written by hand."""

import re
from pathlib import Path

import pytest
from scripts import load_script

from paper.statements import load_statements
from paper.table import KEPT, Results

ROOT = Path(__file__).parents[2]
FINDINGS = ("amplitude", "receptor_noise", "unseen", "slow_and_graded", "searched", "presets")


@pytest.fixture(scope="module")
def numbers():
    return load_script("docs", "measured")


def test_pages_hold_what_the_results_say(numbers):
    assert numbers.main(["--check"]) == 0
    assert len(numbers.list_pages()) > 8


def test_a_page_is_filled_with_value_and_interval_and_filling_again_changes_nothing(numbers):
    values = {
        "a.b": {"value": 0.5, "low": 0.4, "high": 0.6},
        "n": 7.0,
        "c": {"value": 1.0, "low": 0.5, "high": 1.2},
    }
    page = (
        "A <!-- a.b:±.0% -->x<!-- / -->, <!-- n:d --><!-- / --> and <!-- c:±.1f --><!-- / -->."
    )
    filled = numbers.fill(page, values)
    assert numbers.PLACE.sub(r"\g<text>", filled) == "A 50% ± 10%, 7 and 1.0 (0.5 to 1.2)."
    assert numbers.fill(filled, values) == filled


def test_no_number_is_written_by_hand(numbers):
    """Measured numbers carry a decimal point, a per cent or a unit; windows and counts of the task
    may stand as words.
    """
    own = "\n".join((ROOT / "docs" / f"{name}.md").read_text() for name in FINDINGS)
    # addresses hold no measurements, and a page of somebody else's numbers names its sources
    words = re.sub(r"\]\(http[^)]*\)", "]", numbers.PLACE.sub("", own))
    assert not re.findall(r"\d+\.\d+|\d+ ?(?:%|bits|µJ|mN|rad|m/s)", words)


def test_a_key_that_was_not_measured_is_an_error(numbers):
    with pytest.raises(KeyError, match="nowhere"):
        numbers.fill("<!-- nowhere:.1f --><!-- / -->", {})


def test_statements_name_a_page_that_is_there():
    pages = [ROOT / one.where for one in load_statements() if one.whose == "ours"]
    assert pages and all(page.exists() for page in pages)


def test_results_are_of_whole_sets():
    results = Results.read(KEPT)
    assert results.get("tradeoff.sets").value >= 2
    assert results.get("choices.common").value > 0
