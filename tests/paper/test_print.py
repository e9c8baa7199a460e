"""The page for those who print it, and for those who do not see it."""

import base64

import pytest

from feeler.report import Section, write_page

N = 4
FAR = "word " * 4_000  # some ten screens between two pictures


@pytest.mark.long
def test_every_picture_is_printed(browser, tmp_path):
    section = Section(name="many", title="Many", folder=tmp_path, vector=False)
    for k in range(N):
        section.figure(
            f"f{k}",
            "A line.",
            lambda figure, k=k: figure.subplots().plot([0, k], [k, 1]),
            height=2.0,
        )
        section.text(FAR)
    browser.get(
        write_page(tmp_path / "page.html", "Pictures", "One below the other.", section).as_uri()
    )
    paper = base64.b64decode(browser.execute_cdp_cmd("Page.printToPDF", {})["data"])
    assert paper.count(b"/Subtype /Image") == N


# colours follow from the theme alone, the layout from the width alone: each is looked at by default
SLOW = pytest.mark.slow


@pytest.mark.long
@pytest.mark.parametrize(
    ("theme", "width"),
    [
        ("light", 390),
        ("dark", 1440),
        pytest.param("light", 1440, marks=SLOW),
        pytest.param("dark", 390, marks=SLOW),
    ],
)
def test_axe_finds_no_barrier_in_the_report(whole, browser, find_barriers, theme, width):
    browser.set_window_size(width, 900)
    browser.execute_cdp_cmd(
        "Emulation.setEmulatedMedia",
        {"features": [{"name": "prefers-color-scheme", "value": theme}]},
    )
    browser.get((whole / "report.html").as_uri())
    assert find_barriers() == []
