"""Numbers in the pages are those of the results, and none of the findings is written by hand."""

import pytest
from scripts import load_script


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


def test_a_key_that_was_not_measured_is_an_error(numbers):
    with pytest.raises(KeyError, match="nowhere"):
        numbers.fill("<!-- nowhere:.1f --><!-- / -->", {})
