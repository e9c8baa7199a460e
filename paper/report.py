"""The report of a run: one self-contained page, the figures as one PDF and one by one, the table of
results and the verdicts.
"""

import json
import os
import platform
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from markupsafe import Markup
from pypdf import PdfReader, PdfWriter

from feeler.physics.contact import get_contact
from feeler.provenance import describe_versions, list_versions
from feeler.report.page import (
    MARKER,
    PAGES,
    Part,
    Section,
    embed,
    open_templates,
    render_page,
)
from paper.context import Context
from paper.table import RESULTS, Results, read_declared
from paper.verdicts import NOT, Judged, count_intervals, count_verdicts

OPENING_MOVIE, _FRONT = "movieS2_speeds.mp4", "front"


def write_report(context: Context, sections: list[Section], judged: list[Judged]) -> Path:
    """Write ``report.html``, ``figures.pdf`` (at paper scale), ``results.csv`` and
    ``verdicts.json``; copy each figure's files and numbers to ``figures/``."""
    _write_pdf(context.out / "figures.pdf", sections)
    _copy_figures(context.out / "figures", sections)
    Results.collect(sections).write(context.out / RESULTS)
    _write_verdicts(context.out / "verdicts.json", context, judged)
    return write_page(context, sections, judged)


def write_page(context: Context, sections: list[Section], judged: list[Judged]) -> Path:
    """Write ``report.html``."""
    templates: Any = open_templates("paper").get_template("report.html").module
    made = {
        str(block["name"]): section.name
        for section in sections
        for block in section.blocks
        if "name" in block
    }
    results, figures = Results.collect(sections), read_declared("statements.toml")["figure"]
    opening, story, beside, shown = Markup(""), Markup(""), dict[str, Markup](), sections
    if context.is_cockroach:
        beside = _group(templates, judged, made)
        pictures = _draw_pictures(sections, beside)
        opening = templates.opening(
            results.fill(read_declared("statements.toml")["front"]),
            pictures.get(_FRONT, ""),
            count_verdicts(judged),
            [one for one in judged if "Abstract" in one.statement.where],
            [one for one in judged if one.verdict == NOT and one.statement.whose == "paper"],
            **_find_movie(sections),
        )
        screens = [
            templates.screen(one["title"], one["picture"], results.fill(one["words"]), *found)
            for one in figures
            if (found := pictures.get(one.get("picture", "")))
        ]
        told = {one["picture"] for one in figures if "picture" in one} | {_FRONT}
        story, shown = Markup("").join(screens), [_leave(one, told) for one in sections]
        body = templates.verdicts(
            judged,
            count_verdicts(judged),
            count_verdicts(judged, "ours"),
            count_intervals(judged),
            made,
        )
        first = Part(name="claims", title="Every statement and its verdict", body=body)
    else:
        title = "The paper's measures, of this antenna"
        first = Part(name="claims", title=title, body=templates.measures(judged))
    names = [str(name).removesuffix(".mp4") for name in made]
    body = templates.places([{"note": ""} | one for one in figures], names)
    places = Part(name="places", title="Every figure and movie", body=body)
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"
    body = templates.methods(
        _describe_methods(context), describe_versions(), machine, context.seed, sections
    )
    methods = Part(name="methods", title="Methods and conditions", body=body)
    other = f"The antenna '{context.antenna.name}', touched"
    title = "Soft antennae, touched" if context.is_cockroach else other
    parts: list[Section | Part]
    parts = [*shown, first, places, methods]
    if not context.is_cockroach:
        parts = [first, *shown, places, methods]
    page = render_page(
        title,
        _describe(context),
        parts,
        opening=opening,
        story=story,
        beside=beside,
        closed=context.is_cockroach,
    )
    return _write(context.out / "report.html", page)


def _group(templates: Any, judged: list[Judged], made: Mapping[str, str]) -> dict[str, Markup]:
    """The statements that stand beside each figure; where a run has not made it, at the end of the
    section.
    """
    groups: dict[str, list[Judged]] = defaultdict(list)
    for one in judged:
        figure, section = one.statement.figure, one.statement.section
        groups[figure if figure in made else f"section-{section}"].append(one)
    return {place: templates.beside(found, place) for place, found in groups.items()}


def _draw_pictures(
    sections: Sequence[Section], beside: Mapping[str, Markup]
) -> dict[str, tuple[Markup, str]]:
    """Every figure with what stands beside it, and what is said of a cached one, by name."""
    blocks: Any = open_templates("feeler.report").get_template("blocks.html").module
    texts = defaultdict(Markup, beside)
    return {
        str(block["name"]): (
            blocks.picture(block, _embed_from(section), texts),
            section.say_kept(),
        )
        for section in sections
        for block in section.blocks
        if block["kind"] == "figure"
    }


def _embed_from(section: Section) -> Callable[[str], Any]:
    return lambda name: embed(section.folder / name)


def _leave(section: Section, told: set[str]) -> Section:
    """The section with links in place of the figures of the story; a page carries each once."""
    return replace(
        section,
        blocks=[
            {"kind": "moved", "figure": block["name"]} if block.get("name") in told else block
            for block in section.blocks
            if block.get("name") != OPENING_MOVIE
        ],
    )


def _find_movie(sections: Sequence[Section]) -> dict[str, str]:
    for section in sections:
        for block in section.blocks:
            if block.get("name") == OPENING_MOVIE and block["kind"] == "movie":
                path = section.folder / OPENING_MOVIE
                still, caption = embed(path.with_suffix(".jpg")), str(block["caption"])
                return {"movie": embed(path), "still": still, "caption": caption}
    return {"movie": "", "still": "", "caption": ""}


def _describe(context: Context) -> str:
    if not context.is_cockroach:
        return (
            f"What “{context.antenna.name}” feels and can discriminate: the analyses of “Physically"
            " intelligent soft antennae enhance tactile perception by active touch” (Meng et al."
            f" 2025), done on another antenna than the paper's. Scale: {context.scale}; seed"
            f" {context.seed}; physics: {context.engine} engine."
        )
    return (
        "Everything that “Physically intelligent soft antennae enhance tactile perception by"
        " active touch” (Meng et al. 2025) claims and a computer can check, made anew from the"
        " mechanics up. Each claim stands beside what came out here, also where it fails. Scale:"
        f" {context.scale}; seed {context.seed}; physics: {context.engine} engine."
    )


def _describe_methods(context: Context) -> str:
    antenna, contact = context.antenna, get_contact(None, context.antenna)
    end = (
        ", which solves MuJoCo's discrete equations and is held against MuJoCo step for step by the"
        " tests."
    )
    return (
        f"The antenna '{antenna.name}' is a chain of {antenna.n_segments} rigid segments,"
        f" {antenna.length:.4g} mm long, {1e3 * antenna.segment_mass.sum():.3g} mg, joined by"
        " damped hinge springs in one plane, clamped at its base. Objects move on straight lines"
        " at constant velocity. Contact is MuJoCo's soft contact with a pyramidal friction cone,"
        f" solref {contact.solref} [ms, 1], solimp {contact.solimp}; no gravity; integration step"
        f" {context.timestep:g} ms, one sample per ms at {antenna.sensors.size} hinges. Tensors"
        " hold joint angle and curvature (angle over segment length) with their signs; pictures"
        " show curvature, encoder and indices take angles with negative values set to 0 and one"
        f" common scale for a whole set. Physics: the {context.engine}"
        f" engine{end if context.engine == 'chain' else '.'}"
    )


def _write_pdf(path: Path, sections: list[Section]) -> None:
    drawn = [section for section in sections if section.vector and section.list_figures()]
    if not drawn:
        path.unlink(missing_ok=True)  # an earlier run's, of other figures
        return
    writer = PdfWriter()
    for section in drawn:
        writer.append(PdfReader(section.folder / PAGES))
    partial = path.with_suffix(".part")
    with partial.open("wb") as stream:
        writer.write(stream)
    partial.replace(path)


def _write_verdicts(path: Path, context: Context, judged: list[Judged]) -> None:
    """What the run was made with, and every verdict; no times, no machine: equal runs leave equal
    bytes.
    """
    data: dict[str, Any] = {
        "configuration": context.describe(),
        "versions": list_versions(),
        "verdicts": {
            one.statement.id: {
                "says": one.statement.says,
                "verdict": one.word,
                "why": one.why,
                "readings": [vars(reading) for reading in one.readings],
            }
            for one in judged
            if context.is_cockroach
        },
    }
    _write(path, json.dumps(data, sort_keys=True, indent=1, ensure_ascii=False))


def _write(path: Path, text: str) -> Path:
    """The file appears under its name only when it is whole."""
    partial = path.with_suffix(".part")
    partial.write_text(text, encoding="utf-8")
    return partial.replace(path)


def _copy_figures(folder: Path, sections: list[Section]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for section in sections:
        for name in section.list_figures():
            (folder / f"{name}.pdf").unlink(
                missing_ok=True
            )  # an earlier run's picture of other numbers
        if any(block["kind"] in ("figure", "movie") for block in section.blocks):
            for file in sorted(section.folder.iterdir()):
                if file.name not in (MARKER, PAGES):
                    (folder / file.name).write_bytes(file.read_bytes())
        if section.vector and section.list_figures():
            _split_pages(section, folder)


def _split_pages(section: Section, folder: Path) -> None:
    """Each figure's page as a PDF of its own."""
    for name, page in zip(
        section.list_figures(), PdfReader(section.folder / PAGES).pages, strict=True
    ):
        writer = PdfWriter()
        writer.add_page(page)
        writer.write(folder / f"{name}.pdf")
