"""Sections as one self-contained page: pictures and movies stand inside the file, nothing comes
from elsewhere.
"""

import base64
import io
import os
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from PIL import Image

from feeler.disk.files import ensure_folder, writing
from feeler.errors import list_said
from feeler.records.checked import checked
from feeler.report.section import Section

_MIME = {
    ".png": "image/png",
    ".jpg": "image/jpeg",
    ".webp": "image/webp",
    ".mp4": "video/mp4",
}
_LARGE, _QUALITY = (
    80_000,
    85,
)  # bytes of a picture that is made smaller, and how well it is kept


@dataclass(frozen=True, kw_only=True)
class Part:
    """A part of a page that a template has filled, beside those that sections are.

    Attributes
    ----------
    name : str
        Where links lead to.
    turnable : bool
        Whether it shows a view that is turned by hand.
    """

    name: str
    title: str
    body: Markup
    turnable: bool = False


@lru_cache
def open_templates(package: str) -> Environment:
    """The templates of a package, compiled once; whatever is put into one is escaped."""
    return Environment(
        loader=PackageLoader(package, ""),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
    )


@checked
def render_page(
    title: str,
    lead: str,
    parts: Sequence[Section | Part],
    *,
    opening: str = "",
    story: str = "",
    beside: Mapping[str, str] | None = None,
    closed: bool = False,
    warned: Sequence[str] = (),
) -> str:
    """Parts and sections, in order, as one page of HTML.

    Parameters
    ----------
    lead
        The paragraph below the title and the ``opening``.
    opening
        What fills the first screen (Markup; a plain string is escaped).
    story
        What follows it, before the contents (Markup).
    beside
        What stands beside the figure of a name, or at the end of a section (``section-`` and its
        name).
    closed
        Whether every part is closed until it is asked for.
    warned
        What the command that writes the page has warned of.
    """
    shown = [part if isinstance(part, Part) else _fill(part, beside or {}) for part in parts]
    css, script = (
        Markup(files("feeler.report").joinpath(name).read_text(encoding="utf-8"))
        for name in ("page.css", "page.js")
    )
    if any(part.turnable for part in shown):
        script += Markup(files("feeler.report").joinpath("turn.js").read_text(encoding="utf-8"))
    page = open_templates("feeler.report").get_template("page.html")
    return page.render(
        title=title,
        lead=lead,
        opening=opening,
        story=story,
        closed=closed,
        warned=warned,
        parts=shown,
        css=css,
        script=script,
        version=version("feeler"),
    )


@checked
def write_page(path: str | os.PathLike, title: str, lead: str, *sections: Section) -> Path:
    """Keep the page of these sections; the file appears under its name only when it is whole."""
    path = Path(path)
    ensure_folder(path.parent)
    with writing(path) as part:
        text = render_page(title, lead, list(sections), warned=list_said())
        part.write_text(text, encoding="utf-8", errors="backslashreplace")
    return path


def _fill(section: Section, beside: Mapping[str, str]) -> Part:
    blocks: Any = open_templates("feeler.report").get_template("blocks.html").module
    texts = defaultdict(str, beside)
    body = blocks.draw(
        section.name,
        section.blocks,
        lambda name: embed(section.folder / name),
        texts,
        section.say_kept(),
    )
    turnable = any(block["kind"] == "turnable" for block in section.blocks)
    return Part(name=section.name, title=section.title, body=body, turnable=turnable)


def embed(path: Path) -> str:
    """A file as a data URL; a large picture as WebP, which takes two fifths of the room."""
    return _embed(path, path.stat().st_mtime_ns)


@lru_cache(maxsize=128)  # a page is written anew with each section that is ready
def _embed(path: Path, _when: int) -> str:
    raw, kind = path.read_bytes(), _MIME[path.suffix]
    if path.suffix == ".png" and len(raw) > _LARGE:
        with Image.open(path) as picture:
            picture.convert("RGB").save(
                smaller := io.BytesIO(), "WEBP", quality=_QUALITY, method=2
            )
        raw, kind = smaller.getvalue(), _MIME[".webp"]
    return f"data:{kind};base64,{base64.b64encode(raw).decode()}"
