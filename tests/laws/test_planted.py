"""The mistakes that are planted by hand still fit the code, and the page that lists them lists all."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
LIST = tomllib.loads((ROOT / "benchmarks" / "mutants" / "planted.toml").read_text(encoding="utf-8"))
PAGE = (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("mistake", LIST["mistake"], ids=lambda mistake: mistake["name"])
def test_a_mistake_has_one_place_and_its_tests_and_its_row(mistake):
    source = (ROOT / "src" / "feeler" / mistake["file"]).read_text(encoding="utf-8")
    assert source.count(mistake["before"]) == 1 and mistake["before"] != mistake["after"]
    tests = [test.partition("::") for test in mistake["tests"].split()]
    assert tests and all(
        name in (ROOT / path).read_text(encoding="utf-8") for path, _, name in tests
    )
    named = ", ".join(f"`{test.removeprefix('tests/')}`" for test in mistake["tests"].split())
    assert f"| {mistake['name']} | {mistake['says']} | `{mistake['file']}` | {named} |" in PAGE


def test_names_are_given_once():
    names = [mistake["name"] for mistake in LIST["mistake"]]
    assert len({*names}) == len(names)


@pytest.mark.parametrize("line", LIST.get("equivalent", []), ids=lambda one: one["line"][:30])
def test_a_line_where_nothing_is_planted_is_there_and_has_its_reason(line):
    source = (ROOT / "src" / "feeler" / line["file"]).read_text(encoding="utf-8")
    assert line["line"] in {one.strip() for one in source.splitlines()} and line["why"]
