"""README says what was measured, and its tree is the tree."""

import json
from pathlib import Path

import pytest
from scripts import load_script

ROOT = Path(__file__).parents[2]


def list_rooms() -> list[str]:
    return [
        p.name
        for p in (ROOT / "src" / "feeler").iterdir()
        if p.is_dir() and (p / "__init__.py").exists()
    ]


@pytest.fixture(scope="module")
def table_maker():
    return load_script("docs", "make_table")


def test_readme_holds_the_generated_table(table_maker):
    table = table_maker.make_table(json.loads(table_maker.RESULTS.read_text()))
    assert table in (ROOT / "README.md").read_text(), "run: python docs/make_table.py"


def test_readme_s_one_result_is_the_measured_one(table_maker):
    result = table_maker.make_result(json.loads(table_maker.RESULTS.read_text()))
    assert "±" in result and "{" not in result
    assert result in (ROOT / "README.md").read_text(), "run: python docs/make_table.py"


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (0.5, "0.50"),
        ({"value": 0.5, "low": 0.4, "high": 0.6, "n": 3}, "0.50 ± 0.10"),
        ({"value": 0.5, "n": 1}, "0.50 (n = 1)"),
        ({"value": 0.5, "n": 122}, "0.50 (n = 122)"),
    ],
)
def test_a_headline_carries_its_spread_or_how_many_it_is_of(table_maker, value, said):
    assert table_maker.fill("{a.b c:.2f} bits", {"a.b c": value}) == f"{said} bits"


def test_every_stage_has_a_row(table_maker):
    from feeler.studies.paper.reproduce import STAGES

    assert [stage.title for stage in STAGES] == list(table_maker.HEADLINES)


def test_the_tree_names_every_room():
    readme = (ROOT / "README.md").read_text()
    assert not [room for room in list_rooms() if f"  {room}/" not in readme]
