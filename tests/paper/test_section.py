"""A section's figures, as files and as pages of one PDF."""

import json

import pytest
from pypdf import PdfReader

from feeler.plotting.style import DOUBLE, SINGLE
from feeler.report import Section
from paper.context import Context
from paper.report import write_report

WIDTHS = {"wide": DOUBLE, "narrow": SINGLE}


def make_section(folder, vector):
    folder.mkdir()
    section = Section(name="antenna", title="The antenna", folder=folder, vector=vector)
    for name, width in WIDTHS.items():
        section.figure(
            name,
            "A line.",
            lambda figure: figure.subplots().plot([1, 2]),
            width=width,
            height=2,
        )
    section.save()
    return section


def test_vector_figures_become_pages_at_journal_size_with_embedded_fonts(tmp_path):
    section = make_section(tmp_path / "section", vector=True)
    write_report(Context(out=tmp_path), [section], [])
    pages = PdfReader(tmp_path / "figures.pdf").pages
    assert [float(page.mediabox.width) / 72 for page in pages] == pytest.approx(
        list(WIDTHS.values()), abs=0.02
    )
    for page in pages:
        for font in page["/Resources"]["/Font"].values():
            assert (
                "/FontFile2"
                in font.get_object()["/DescendantFonts"][0].get_object()["/FontDescriptor"]
            )


def test_a_run_without_vector_figures_leaves_none_of_an_earlier_one(tmp_path):
    write_report(Context(out=tmp_path), [make_section(tmp_path / "quick", vector=True)], [])
    write_report(
        Context(out=tmp_path, scale="smoke"),
        [make_section(tmp_path / "smoke", vector=False)],
        [],
    )
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {
        "narrow.png",
        "wide.png",
    }
    assert not (tmp_path / "figures.pdf").exists()
    assert "data:image/" in (tmp_path / "details.html").read_text()


@pytest.mark.parametrize("vector", [True, False])
def test_a_saved_section_loads_as_it_was(tmp_path, vector):
    section = make_section(tmp_path / "section", vector=vector)
    again = Section.load(section.folder)
    assert (again.vector, again.blocks, again.cached) == (
        vector,
        json.loads(json.dumps(section.blocks)),
        True,
    )
