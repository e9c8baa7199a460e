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
    for page in table_maker.RESULT_PAGES:
        assert result in (ROOT / page).read_text(), f"{page}: run python docs/make_table.py"


def test_the_one_result_says_whose_signal_the_noise_is_a_share_of(table_maker):
    """The words follow the numbers: which antenna is loudest, and in which noise one leads."""
    values = {f"complete.peak.{name}": 0.1 for name in table_maker.ANTENNAS}
    for noise in ("common", "relative"):
        for name in table_maker.ANTENNAS:
            values[f"complete.{noise}.{name}"] = {"value": 0.5, "low": 0.4, "high": 0.6}
    values["complete.peak.constant"] = 0.2
    values["complete.relative.exponential"] = {"value": 0.8, "low": 0.7, "high": 0.9}
    result = table_maker.make_result({"paper": {"values": {"reading": values}}})
    assert "5 to 30 % of 0.200 rad" in result and "the constant one's:" in result
    assert "10% to 60% of the exponential antenna's and 10% to 60% of the linear" in result
    assert "In absolute noise no advantage can be told" in result
    assert "relative to each touch the gradient of stiffness helps" in result


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
