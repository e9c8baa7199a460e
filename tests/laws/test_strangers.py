"""What strangers meet first says the same as the code: recipe, paper, and what only the owner
knows.
"""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
SECTIONS = (
    "Summary",
    "Statement of need",
    "State of the field",
    "Software design",
    "Research impact statement",
    "AI usage disclosure",
    "Acknowledgements",
    "References",
)


def test_the_recipe_has_the_versions_and_bounds_of_the_project():
    recipe = (ROOT / "conda" / "meta.yaml").read_text()
    run = recipe.partition("  run:\n")[2].partition("\n\n")[0]
    listed = {line.strip().removeprefix("- ").replace(" ", "") for line in run.split("\n")}
    wanted = {one.replace(" ", "") for one in PROJECT["dependencies"]}
    assert listed == wanted | {f"python{PROJECT['requires-python']}"}
    assert f'version = "{PROJECT["version"]}"' in recipe


def test_the_paper_has_its_sections_and_cites_what_is_listed():
    text = (ROOT / "paper" / "paper.md").read_text()
    assert tuple(re.findall(r"^# (.+)$", text, re.MULTILINE)) == SECTIONS
    listed = re.findall(
        r"^@\w+\{(\w+),", (ROOT / "paper" / "paper.bib").read_text(), re.MULTILINE
    )
    assert sorted(set(re.findall(r"@(\w+)\d{0}", text.partition("bibliography")[2]))) == sorted(
        listed
    )


def test_what_only_the_owner_knows_is_listed_in_one_place():
    table = (ROOT / "OWNER.md").read_text()
    texts = [p for p in ROOT.glob("*/*.md") if "OWNER:" in p.read_text()]
    assert [p.relative_to(ROOT).as_posix() for p in texts] == ["paper/paper.md"]
    assert "paper/paper.md" in table and "CITATION.cff" in table
