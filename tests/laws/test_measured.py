"""The page on slow, graded antennae says what was measured: its numbers stand in the results, and
only there.
"""

import json
import re
import tomllib
from pathlib import Path

import pytest
from scripts import load_script

from feeler.studies.paper.claims import load_claims

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


def test_rates_of_fresh_mistakes_stand_in_the_docs_as_they_were_counted():
    """Each area, and what was not judged; ``fresh.toml`` says who noticed each first."""
    rates = load_script("benchmarks/mutants", "rates")
    made = tomllib.loads((ROOT / "benchmarks/mutants/fresh.toml").read_text())["mistake"]
    table = rates.tabulate(made, rates.read_first(made))
    assert table in (ROOT / "docs/reliability.md").read_text(), (
        f"the docs should hold:\n{table}"
    )


@pytest.mark.parametrize(
    ("first", "row"),
    [
        (["tests/a.py", "tests/b.py"], "| H | wall | 2 of 2, 100% | 34% to 100% | 0 |"),
        (["tests/a.py", ""], "| H | wall | 1 of 2, 50% | 9% to 91% | 0 |"),
        (["", None], "| H | wall | 0 of 1, 0% | 0% to 79% | 1 |"),
        ([None, None], "| H | wall | not judged | – | 2 |"),
    ],
)
def test_what_was_not_judged_is_in_no_rate(first, row):
    """Wilson's intervals of 2, 1 and 0 of so few are those of any table."""
    rates = load_script("benchmarks/mutants", "rates")
    mistakes = [{"name": f"H{k}", "area": "wall"} for k in range(2)]
    made = [
        each if by is None else each | {"first": by}
        for each, by in zip(mistakes, first, strict=True)
    ]
    assert row in rates.tabulate(made, rates.read_first(made))
