"""No page, claim or sentence compares profiles in the paper's window of 380 ms alone: in it some
touches of the linear and of the constant profile are the same tensor. (Figures, tables and texts of
a run: tests/studies/paper/test_whole.py.)
"""

import re
from pathlib import Path

import pytest
from scripts import load_script

from feeler.studies.paper.claims import load_claims
from feeler.studies.paper.declared import read_declared
from feeler.studies.paper.findings import PLACE
from tests.windows import find_one_sided

ROOT = Path(__file__).parents[2]
WHOLE = ("spikes.", "space.")
"""Their windows count from contact, and what is compared between profiles are whole touches."""
KEY = re.compile(r"\{\{ *([^:}]+?):[^}]*\}\}")


@pytest.mark.parametrize(
    ("keys", "found"),
    [
        ({"cut.relative.linear", "cut.relative.constant"}, {"relative"}),
        ({"cut.relative.linear", "complete.relative.linear"}, set()),  # one profile alone
        (
            {f"{w}.relative.{p}" for w in ("cut", "complete") for p in ("linear", "constant")},
            set(),
        ),
        (
            {"cut.a.linear", "cut.a.constant", "complete.a.linear", "complete.b.constant"},
            {"a"},
        ),
        (
            {"generalise.size.380 ms window.linear", "generalise.size.380 ms window.constant"},
            {"generalise.size"},
        ),
        (
            {"dispersion.tensor.nmi.linear", "dispersion.tensor.nmi.constant"},
            {"dispersion.tensor.nmi"},
        ),
        ({"dispersion.tensor.nmi.slow", "dispersion.tensor.nmi.fast"}, set()),
        ({"wall.median.linear", "wall.median.constant"}, set()),
        (
            {
                "encoding.e.bins, 10.linear",
                "encoding.e.bins, 10.constant",
                "encoding.e.complete touches, bins, 10.linear",
                "encoding.e.complete touches, bins, 10.constant",
            },
            set(),
        ),
    ],
)
def test_a_comparison_in_the_cut_window_alone_is_noticed(keys, found):
    assert find_one_sided(keys) == found


def list_statements():
    """The keys of every statement: of all claims that read one effect together."""
    found = {}
    for claim in load_claims():
        keys = {key for key in claim.list_keys() if not key.startswith(WHOLE)}
        found.setdefault(claim.statement, set()).update(keys)
    return found.items()


@pytest.mark.parametrize(
    ("name", "keys"),
    list_statements(),
    ids=lambda value: value if isinstance(value, str) else str(len(value)),
)
def test_a_statement_is_read_in_both_windows(name, keys):
    assert not find_one_sided(keys), name


@pytest.mark.parametrize(
    "one",
    [
        one
        for file in ("findings.toml", "story.toml")
        for kind in read_declared(file).values()
        for one in kind
    ],
    ids=lambda one: one.get("name", one.get("title", one["words"][:30])),
)
def test_a_sentence_of_the_report_names_both_windows(one):
    text = one["words"] + one.get("number", "") + one.get("when", "")
    assert not find_one_sided(key for key, _ in PLACE.findall(text))


@pytest.mark.parametrize(
    "page", sorted((ROOT / "docs").rglob("*.md")), ids=lambda path: path.stem
)
def test_a_page_names_both_windows(page):
    keys = KEY.findall(page.read_text(encoding="utf-8"))
    assert not find_one_sided(key for key in keys if not key.startswith(WHOLE))


def test_the_headlines_of_readme_name_both_windows():
    for _, words in load_script("docs", "make_table").HEADLINES.values():
        keys = [key for key, _ in PLACE.findall(words)]
        assert not find_one_sided(key for key in keys if not key.startswith(WHOLE))
