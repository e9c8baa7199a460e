"""Reports: sections of figures, movies, tables and numbers as one self-contained page."""

import base64
import io
import json
import os
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property, lru_cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from matplotlib import rcParams
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from feeler.errors import list_said
from feeler.files import ensure_folder, write_text, writing
from feeler.plotting.style import (
    DOUBLE,
    fix_layout,
    mark_panels,
    style,
    unjoin,
)
from feeler.plotting.tensors import list_tensors
from feeler.provenance import to_json
from feeler.validation import checked

# A section of a report: figures, movies, tables, words and numbers, files of one folder.

PAGES = "figures.pdf"
MARKER = "section.json"


@dataclass(kw_only=True)
class Section:
    """What one stage leaves behind; ``values`` are the numbers that claims are held against.

    Attributes
    ----------
    vector : bool
        Whether figures are also kept as pages of a PDF.
    kept : str
        What is said of a section that another run made; "" of this run's own.
    scale : str
        The scale of the run that made it; "": this run's.
    waits : bool
        Whether this run is still making its own.
    failed : str
        Why it could not be made; "" where it was.
    """

    name: str
    title: str
    folder: Path
    vector: bool = True
    blocks: list[dict[str, object]] = field(default_factory=list)
    values: dict[str, object] = field(default_factory=dict)
    seconds: float = 0.0
    cached: bool = False
    kept: str = ""
    scale: str = ""
    waits: bool = False
    failed: str = ""

    def text(self, words: str) -> None:
        """A paragraph."""
        self.blocks.append({"kind": "text", "text": words})

    def heading(self, words: str) -> None:
        """A heading within the section."""
        self.blocks.append({"kind": "heading", "text": words})

    def table(
        self, header: Sequence[str], rows: Sequence[Sequence[object]], caption: str = ""
    ) -> None:
        """A table; numbers are shown with four digits."""
        plain = [[_show(cell) for cell in row] for row in rows]
        self.blocks.append(
            {"kind": "table", "header": list(header), "rows": plain, "caption": caption}
        )

    def figure(
        self,
        name: str,
        caption: str,
        draw: Callable,
        *,
        width: float | None = None,
        height: float = 3.0,
        numbers: Mapping[str, object] | None = None,
    ) -> None:
        """Draw with ``draw(figure)``; keep it as PNG and, if ``vector``, as a page of a PDF.

        Parameters
        ----------
        name : str
            Name of the picture's file, and of the JSON file with its numbers.
        caption : str
        draw : callable
            Draws into the ``Figure`` that it is given.
        width, height : float
            [inches]; default width: two columns.
        numbers : mapping of str to array, optional
            The numbers that the figure draws.
        """
        inches, tensors = self._draw(name, draw, width=width, height=height)
        size = [round(96 * side) for side in inches]
        block = {"kind": "figure", "name": name, "caption": caption}
        self.blocks.append(block | {"size": size, "hover": tensors})
        if numbers is not None:
            self.numbers(name, **numbers)

    def _draw(
        self, name: str, draw: Callable[[Figure], None], *, width: float | None, height: float
    ) -> tuple[tuple[float, float], list[dict[str, Any]]]:
        """Keep what ``draw(figure)`` draws; gives its size [inches], by default as wide as two
        columns, and its tensors. Where no panel has a letter, each of two to nine gets one.
        """
        width = DOUBLE if width is None else width
        with style():
            figure = Figure(figsize=(width, height), layout="constrained")
            FigureCanvasAgg(figure)
            draw(figure)
            drawn = [ax for ax in figure.axes if ax.get_label() != "<colorbar>"]
            if 1 < len(drawn) < 10 and not any(ax.get_title(loc="left") for ax in drawn):
                mark_panels(drawn)
            unjoin(figure)
            fix_layout(figure)
            panels = list_tensors(figure)
            # without the layer for transparency, which every picture fills: a fifth smaller than
            # what `savefig` writes
            figure.set_dpi(dpi := rcParams["savefig.dpi"])
            canvas = FigureCanvasAgg(figure)
            canvas.draw()
            Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3]).save(
                self.folder / f"{name}.png", compress_level=6, dpi=(dpi, dpi)
            )
            if self.vector:
                self._pages.savefig(figure)
        return (width, height), panels

    @cached_property
    def _pages(self) -> Any:
        """One file for all figures: its fonts, which are slow to embed, are embedded once."""
        from matplotlib.backends.backend_pdf import PdfPages  # slow to load

        return PdfPages(self.folder / PAGES, metadata={"CreationDate": None})

    def list_figures(self) -> list[str]:
        """Names of the figures, in the order of the pages of ``figures.pdf``."""
        return [str(block["name"]) for block in self.blocks if block["kind"] == "figure"]

    def movie(self, path: Path, caption: str) -> None:
        """A movie already written into the folder, and its still if there is one."""
        still = path.with_suffix(".jpg").name if path.with_suffix(".jpg").exists() else ""
        self.blocks.append(
            {"kind": "movie", "name": path.name, "caption": caption, "still": still}
        )

    def turnable(self, name: str, caption: str, scene: Mapping[str, object]) -> None:
        """A touch in space that is turned by hand; ``scene`` is what
        :func:`feeler.plotting.antennas.describe_turnable` gives.
        """
        self.blocks.append(
            {"kind": "turnable", "name": name, "caption": caption, "scene": dict(scene)}
        )

    def numbers(self, name: str, **arrays: object) -> None:
        """Keep the numbers a figure draws as JSON."""
        text = json.dumps(
            {key: to_json(value) for key, value in arrays.items()}, sort_keys=True
        )
        write_text(self.folder / f"{name}.json", text)

    def say_kept(self) -> str:
        """What a reader must know of a section that another run made; "" of this run's own."""
        waits = " This run is making its own; this page is written anew when it is there."
        return self.kept and self.kept + waits * self.waits

    def save(self) -> None:
        """Close the PDF and write ``section.json``, which says that the section is whole."""
        if "_pages" in self.__dict__:
            with style():  # the fonts are embedded now
                self._pages.close()
        data = asdict(self) | {"folder": None, "values": to_json(self.values)}
        write_text(self.folder / MARKER, json.dumps(data, sort_keys=True, indent=1))

    @classmethod
    def load(cls, folder: Path) -> "Section":
        """Read a section that ``save`` wrote."""
        return cls(
            **json.loads((folder / MARKER).read_text()) | {"folder": folder, "cached": True}
        )


@checked
def make_spread(value: float, low: float, high: float, *, n: int) -> dict[str, float]:
    """A value of ``n`` draws with the ends of its spread, in the form in which ``Section.values``
    keeps it; one draw has no spread, so its ends are left out.
    """
    ends = {"low": float(low), "high": float(high)} if n > 1 else {}
    return {"value": float(value), **ends, "n": int(n)}


@checked
def make_interval(mean: float, half: float, *, n: int) -> dict[str, float]:
    """``mean`` ± ``half`` of ``n`` draws."""
    return make_spread(mean, mean - half, mean + half, n=n)


def _show(cell: object) -> str:
    if isinstance(cell, bool | str):
        return str(cell)
    if isinstance(cell, int | np.integer):
        return f"{cell:d}"
    if isinstance(cell, float | np.floating):
        return f"{cell:.4g}" if np.isfinite(cell) else "undefined"
    return str(cell)


# Sections as one self-contained page: pictures and movies stand inside the file, nothing comes
# from elsewhere.

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
    bare: bool = False,
    warned: Sequence[str] = (),
    command: str = "",
) -> str:
    """Parts and sections, in order, as one page of HTML.

    Parameters
    ----------
    lead
        The paragraph below the title.
    opening
        What fills the rest of the first screen (Markup; a plain string is escaped).
    bare
        Whether the page has no list of contents.
    warned
        What the command that writes the page has warned of.
    command
        The command that writes it.
    """
    shown = [part if isinstance(part, Part) else _fill(part) for part in parts]
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
        bare=bare,
        warned=warned,
        command=command,
        parts=shown,
        css=css,
        script=script,
        version=version("feeler"),
    )


@checked
def write_page(path: str | os.PathLike, title: str, lead: str, *sections: Section) -> Path:
    """Keep the page of these sections, with the main result as its ``lead`` and the command that
    makes it; the file appears under its name only when it is whole.
    """
    path, program = Path(path), Path(sys.argv[0])
    own = "feeler" in (program.stem, program.parent.name)  # no script, test or notebook
    command = shlex.join(["feeler", *sys.argv[1:]]) if own else ""
    ensure_folder(path.parent)
    with writing(path) as part:
        text = render_page(title, lead, list(sections), warned=list_said(), command=command)
        part.write_text(text, encoding="utf-8", errors="backslashreplace")
    return path


def _fill(section: Section) -> Part:
    kept = open_templates("feeler.report").get_template("blocks.html").module
    body = kept.say_kept(section.say_kept()) + Markup("").join(  # type: ignore[attr-defined]
        draw_block(section, block) for block in section.blocks
    )
    return Part(
        name=section.name,
        title=section.title,
        body=body,
        turnable=any(block["kind"] == "turnable" for block in section.blocks),
    )


def draw_block(section: Section, block: Mapping[str, Any]) -> Markup:
    """One block of a section as HTML, its files inside."""
    blocks: Any = open_templates("feeler.report").get_template("blocks.html").module
    return blocks.draw(block, lambda name: embed(section.folder / name))


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


__all__ = ["Part", "Section", "make_interval", "make_spread", "render_page", "write_page"]

__dir__ = __all__.copy
