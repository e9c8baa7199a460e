"""One whole run at smoke scale: its claims, its page, its figures and its numbers."""

import csv
import json
import re
from pathlib import Path

import numpy as np
import pytest

from paper.claims import load_claims
from paper.context import Context
from paper.reproduce import STAGES, reproduce
from paper.scale import SCALES
from paper.verdicts import EVIDENCE, count_verdicts, judge_claims
from tests.figures import LEAST, find_mixed
from tests.pages import FOREIGN
from tests.windows import find_one_sided

RESULTS = Path(__file__).parents[2] / "benchmarks" / "results" / "reproduce.json"


EXPECTED = Path(__file__).parents[2] / "paper" / "expected.csv"


def is_due(claim, scale):
    return list(SCALES).index(claim.due) <= list(SCALES).index(scale)


@pytest.fixture(scope="module")
def sections(whole):
    """The sections of the run, read from its cache."""
    return {
        section.name: section
        for section in reproduce(Context(scale="smoke", out=whole, workers=1))
    }


def test_values_are_those_expected(sections):
    """``paper/expected.csv``: a change of a number is a line of that table, read in review. Another
    processor moves none by more than 1e-9 of it, but for the robot's fit error (5e-5).
    """
    expected = {row["quantity"]: row for row in csv.DictReader(EXPECTED.open(encoding="utf-8"))}
    found = {name: made for one in sections.values() for name, made in one.values.items()}
    moved = {}
    for name, row in expected.items():
        made = found.get(name, np.nan)
        value = made["value"] if isinstance(made, dict) else made
        wanted, tolerance = float(row["value"]), float(row["tolerance"])
        if not (abs(value - wanted) <= tolerance or (np.isnan(wanted) and np.isnan(value))):
            moved[name] = (value, wanted)
    assert not moved


def test_sections_write_what_claims_ask_for(sections):
    due = [claim for claim in load_claims() if is_due(claim, "smoke")]
    lacking = {
        claim.id: missing
        for claim in due
        if (missing := claim.list_keys() - set(sections[claim.section].values))
    }
    assert due and not lacking


def test_the_kept_runs_wrote_what_claims_ask_for():
    """From the values that ``paper/measure.py`` kept, so that a misspelt key fails whatever
    scale it is due at.
    """
    kept = json.loads(RESULTS.read_text())
    lacking = {}
    for claim in load_claims():
        values = kept["paper" if claim.due == "paper" else "quick"]["values"]
        if missing := claim.list_keys() - set(values.get(claim.section, ())):
            lacking[claim.id] = missing
    assert not lacking, "run: python -m paper.measure quick paper"


def test_a_claim_that_is_due_is_judged(sections):
    judged = judge_claims(list(sections.values()), Context(scale="smoke"))
    assert not [j.claim.id for j in judged if j.why.startswith("not computed")]
    assert {j.claim.id for j in judged if j.verdict == "not comparable"} == {
        claim.id for claim in load_claims() if claim.kind == "none"
    }
    assert {j.claim.id for j in judged if j.verdict == "not judged"} >= {
        claim.id for claim in load_claims() if claim.can_fail and not is_due(claim, "smoke")
    }


def test_every_section_is_made_and_on_the_page(whole, sections):
    page = (whole / "report.html").read_text()
    assert [name for name in sections] == [stage.name for stage in STAGES]
    assert "could not be made" not in page
    for section in sections.values():
        assert f'<section id="section-{section.name}">' in page
    assert len(re.findall(r'<img [^>]*src="data:image/(?:png|webp);base64,', page)) == sum(
        len(section.list_figures()) for section in sections.values()
    )
    assert (
        page.count("<video ")
        == page.count("data:video/mp4;base64,")
        == len(list((whole / "figures").glob("*.mp4")))
        >= 4
    )


def test_the_words_of_every_figure_can_be_read(whole):
    """At the width of a page no letter is smaller than 6 pt, no text stands on another, no legend
    lies on what is drawn, and each colour of a mark is named and means one thing.
    """
    words = json.loads((whole.parent / "words.json").read_text(encoding="utf-8"))
    assert len(words) > 20
    assert {name: one["least"] for name, one in words.items() if one["least"] < LEAST} == {}
    assert {name: one["over"] for name, one in words.items() if one["over"]} == {}
    assert {name: one["unnamed"] for name, one in words.items() if one["unnamed"]} == {}
    assert {name: one["covered"] for name, one in words.items() if one["covered"]} == {}
    assert {name: f for name, one in words.items() if (f := find_mixed(one["named"]))} == {}


def test_what_is_claimed_stands_beside_one_figure_or_section(whole):
    page = (whole / "report.html").read_text()
    places = re.findall(r'aria-label="claims held against ([^"]+)"', page)
    assert places and len({*places}) == len(places)


def test_the_page_needs_nothing_from_elsewhere(whole):
    page = (whole / "report.html").read_text()
    assert not re.search(FOREIGN, page)
    links, targets = (
        set(re.findall(r'href="#([^"]+)"', page)),
        re.findall(r' id="([^"]+)"', page),
    )
    assert links <= {*targets} and len({*targets}) == len(targets)


def test_every_figure_has_its_numbers(whole):
    pictures = list((whole / "figures").glob("*.png"))
    assert len(pictures) >= 15
    for picture in pictures:
        assert picture.with_suffix(".json").exists() or picture.with_suffix(".nc").exists(), (
            picture.name
        )


def test_the_numbers_are_those_of_the_sections(whole, sections):
    values = json.loads((whole / "numbers.json").read_text())["values"]
    assert values == {name: section.values for name, section in sections.items()}


def test_a_second_run_comes_from_the_cache_and_a_seed_leaves_alone_what_does_not_read_it(
    sections,
):
    assert all(section.cached for section in sections.values())
    changed = {
        stage.name for stage in STAGES if stage.key(Context()) != stage.key(Context(seed=1))
    }
    assert (
        changed
        == {stage.name for stage in STAGES if "seed" in stage.reads}
        != {stage.name for stage in STAGES}
    )


def test_the_page_opens_with_the_verdicts_that_were_given(whole, sections):
    """Of the paper's claims with evidence, as many of each verdict as are judged so."""
    counts = count_verdicts(judge_claims(list(sections.values()), Context(scale="smoke")))
    page = re.sub(
        r"<(style|script).*?</\1>",
        " ",
        (whole / "report.html").read_text(encoding="utf-8"),
        flags=re.DOTALL,
    )
    words = " ".join(re.sub("<[^>]+>", " ", page).split())
    every = sum(counts[verdict] for verdict in EVIDENCE)
    assert (
        f"{counts['reproduced']} of {every} statements of the paper that this run can decide are"
        " reproduced" in words
    )
    for verdict in (verdict for verdict in EVIDENCE if counts[verdict]):
        assert f"{counts[verdict]} {verdict}" in words, verdict


def list_paths(found, path=()):
    """Every path of keys in the numbers of a figure."""
    if isinstance(found, dict):
        for key, value in found.items():
            words = re.split(r"[^\w -]+", key)  # a curve's key holds several words
            yield from list_paths(
                value, (*path, *(word.strip() for word in words if word.strip()))
            )
    else:
        yield ".".join(path)


def test_no_figure_compares_profiles_in_the_paper_s_window_alone(whole, sections):
    """A figure that does so says where complete touches stand."""
    captions = {
        block["name"]: block["caption"]
        for section in sections.values()
        for block in section.blocks
        if block["kind"] == "figure"
    }
    for name in sorted(captions):
        numbers = (whole / "figures" / name).with_suffix(".json")
        if not numbers.exists():
            continue
        section = next(s.name for s in sections.values() if name in s.list_figures())
        if section in ("space", "spikes"):  # of whole touches; windows count from contact
            continue
        keys = {f"{section}.{path}" for path in list_paths(json.loads(numbers.read_text()))}
        assert not find_one_sided(keys) or "omplete touches" in captions[name], name
