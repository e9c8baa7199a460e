"""The page for those who print it, and for those who do not see it."""

import base64

import pytest

from feeler.report import Section, write_page

N = 4
FAR = "word " * 20_000  # many screens between two pictures


def test_every_picture_is_printed(browser, tmp_path):
    section = Section(name="many", title="Many", folder=tmp_path, vector=False)
    for k in range(N):
        section.figure(f"f{k}", "A line.", lambda figure, k=k: figure.subplots().plot([0, k], [k, 1]), height=2.0)
        section.text(FAR)
    browser.get(write_page(tmp_path / "page.html", "Pictures", "One below the other.", section).as_uri())
    paper = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {})["data"])
    assert paper.count(b"/Subtype /Image") == N


@pytest.mark.parametrize("width", [390, 1440])
@pytest.mark.parametrize("theme", ["light", "dark"])
def test_axe_finds_no_barrier_in_the_report(whole, browser, find_barriers, theme, width):
    browser.set_window_size(width, 900)
    browser.execute_cdp_cmd(
        "Emulation.setEmulatedMedia", {"features": [{"name": "prefers-color-scheme", "value": theme}]}
    )
    browser.get((whole / "report.html").as_uri())
    assert find_barriers() == []
