"""Sections as one self-contained page: pictures and movies stand inside the file, nothing comes from elsewhere."""

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from feeler.checked import checked
from feeler.report.section import Section

MIME = {".png": "image/png", ".mp4": "video/mp4"}


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of a page that a template has filled, beside those that sections are."""

    name: str
    """Where links lead to."""
    title: str
    body: Markup


def open_templates(package: str) -> Environment:
    """The templates of a package; whatever is put into one is escaped."""
    return Environment(loader=PackageLoader(package, ""), autoescape=True, undefined=StrictUndefined, trim_blocks=True)


@checked
def render_page(title: str, lead: str, parts: Sequence[Section | Part]) -> str:
    """Parts and sections, in order, as one page of HTML; ``lead`` is the paragraph below the title."""
    shown = [part if isinstance(part, Part) else _fill(part) for part in parts]
    css = Markup(files("feeler.report").joinpath("page.css").read_text(encoding="utf-8"))
    page = open_templates("feeler.report").get_template("page.html")
    return page.render(title=title, lead=lead, parts=shown, css=css, version=version("feeler"))


def _fill(section: Section) -> Part:
    blocks: Any = open_templates("feeler.report").get_template("blocks.html").module
    body = blocks.draw(section.blocks, lambda name: _embed(section.folder / name))
    return Part(name=section.name, title=section.title, body=body)


def _embed(path: Path) -> str:
    return f"data:{MIME[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"
