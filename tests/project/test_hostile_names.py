"""Names that are pieces of HTML, or addresses that run programs, stay names wherever they stand."""

from html.parser import HTMLParser

import numpy as np
import pytest

import feeler
from feeler.plotting.antennas import Movie
from feeler.records import show_html
from feeler.report import Section, write_page
from feeler.studio import write_touch_page
from feeler.studio.requests import AntennaRequest, TouchRequest

NAMES = (
    "<script>alert(1)</script>",
    '"><img src=x onerror=alert(1)>',
    "' onmouseover='alert(1)",
    "</script><script>alert(1)//",
    "</style><svg onload=alert(1)>",
    "javascript:alert(1)",
    "{{ 7 * 7 }}",
    "<!--<script>",
)


class Reader(HTMLParser):
    """What a browser would run of a page: its scripts, handlers and links."""

    def __init__(self, page):
        super().__init__()
        self.scripts, self.handlers, self.links, self.tags = 0, [], [], []
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.scripts += tag == "script"
        self.handlers += [key for key, _ in attrs if key.startswith("on")]
        self.links += [value for key, value in attrs if key in ("href", "src", "poster")]

    @property
    def found(self):
        schemes = [(link or "").split(":")[0] for link in self.links]
        return self.scripts, self.handlers, "javascript" in schemes, self.tags


def make_page(name, folder):
    """A page of a report with the name wherever a text may stand."""
    section = Section(name="one", title=name, folder=folder)
    section.text(name)
    section.heading(name)
    section.table([name, "value"], [[name, 1.0], ["other", name]], name)
    section.figure("picture", name, lambda figure: figure.subplots(), height=1.0)
    return write_page(folder / "page.html", name, name, section).read_text(encoding="utf-8")


def show_film(name, folder):
    return Movie(name + ".mp4")._repr_html_()


def show_antenna(name, folder):
    return feeler.presets.cockroach().replace(name=name)._repr_html_()


def show_trial(name, folder):
    ball = feeler.Ball(radius=1.5, name=name)
    return feeler.Trial(feature=ball, location=0.5, speed=0.3)._repr_html_()


def show_record(name, folder):
    return feeler.Ball(radius=1.5, name=name)._repr_html_()


def show_result(name, folder):
    return show_html(name, [(name, name), ("list", [name, name]), ("array", np.array([name]))])


def show_simulation(name, folder):
    antenna = feeler.presets.cockroach().replace(name=name)
    return feeler.Simulation(
        antenna,
        feeler.Trial(feature=feeler.Ball(radius=1.5, name=name), location=0.5, speed=0.3),
    )._repr_html_()


SHOWN = (
    make_page,
    show_film,
    show_antenna,
    show_trial,
    show_record,
    show_result,
    show_simulation,
)


@pytest.mark.parametrize("name", NAMES[:6])
def test_a_program_would_be_seen(name):
    page = f"<p title='{name}'>{name}</p><a href='{name}'>x</a>"
    assert Reader(page).found != Reader(page.replace(name, "plain")).found


@pytest.mark.parametrize("show", SHOWN, ids=lambda show: show.__name__)
def test_a_name_is_no_program(show, tmp_path):
    plain = Reader(show("plain", tmp_path)).found
    for name in NAMES:
        assert Reader(show(name, tmp_path)).found == plain, name


@pytest.mark.long
def test_a_name_is_no_program_in_the_page_that_computes():
    pages = [
        write_touch_page(TouchRequest(antenna=AntennaRequest(name=name)))
        for name in ("plain", NAMES[1], NAMES[3], NAMES[7])
    ]
    plain, *others = (Reader(page).found for page in pages)
    assert all(other == plain for other in others)
