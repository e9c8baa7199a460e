"""The Python of guides and tutorials runs as it is copied, shows what it gives, and a sentence
below each piece says when that is good.
"""

import re
from pathlib import Path

import matplotlib.pyplot as plt
import pytest
from scripts import load_script

DOCS = Path(__file__).parents[2] / "docs"
CHEAP = ("antenna", "simulation")  # pages that take less than two seconds
NEEDED = {
    "active": "gymnasium",
    "cluster": "torch",
    "training": "torch",
    "reading_out": "torch",
}
NEEDED |= {"design": "cma", "studio": "anywidget"}

MAKER = load_script("docs", "build")
PAGES = {p.stem + p.parent.name[0]: p for room in MAKER.RUN for p in (DOCS / room).glob("*.md")}


def test_a_notebook_runs_all_of_its_tutorial():
    pages = [p.read_text(encoding="utf-8") for p in (DOCS / "tutorial").glob("*.md")]
    assert not [
        found for page in pages for found in MAKER.CODE.finditer(page) if found["needs"]
    ]


def test_pieces_share_names_start_afresh_and_leave_pictures(tmp_path):
    page = (
        "```python\na = 1\nopen('a.png', 'w').close()\nprint(a)\n```\n\n**Not run here**: it needs"
        " a\ncluster.\n\n```python\n1 / 0\n```\n\n```python\nprint(a + 1)\n```\n"
    )
    shown = MAKER.run_pieces(page, tmp_path)
    assert re.findall(r"```text\n(.*)\n```", shown) == ["1", "2"]
    assert [path.name for path in tmp_path.iterdir()] == ["a.png"]
    with pytest.raises(NameError):
        MAKER.run_pieces("```python\nprint(a)\n```\n", tmp_path)


@pytest.mark.parametrize(
    "name",
    [
        name if name[:-1] in CHEAP else pytest.param(name, marks=pytest.mark.slow)
        for name in PAGES
    ],
)
def test_a_page_runs_as_it_is_copied(name, tmp_path):
    if needed := NEEDED.get(name[:-1]):
        pytest.importorskip(needed)
    page = PAGES[name].read_text(encoding="utf-8")
    shown = MAKER.run_pieces(page, tmp_path)
    plt.close("all")
    pieces = [found for found in MAKER.CODE.finditer(page) if not found["needs"]]
    assert shown.count("\n```text\n") - page.count("\n```text\n") >= len(
        [found for found in pieces if "print(" in found["code"]]
    )
