"""On paper the page has every picture, also those far below what a screen has shown."""

import base64

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
