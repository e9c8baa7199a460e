"""The report of a run: ``report.html``, one section for each figure of the paper; ``details.html``,
everything that was computed; the figures one by one and as one PDF; the table of results and the
verdicts.
"""

import io
import json
import os
import platform
import re
from base64 import b64encode
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from markupsafe import Markup
from PIL import Image
from pypdf import PdfReader, PdfWriter

from feeler.files import write_text, writing
from feeler.physics.contact import get_contact
from feeler.provenance import describe_versions, list_versions
from feeler.report import (
    MARKER,
    PAGES,
    Part,
    Section,
    draw_block,
    open_templates,
    render_page,
)
from paper.context import Context
from paper.statements import MARKS, Judged, count_intervals, count_verdicts
from paper.table import RESULTS, Results, fill_front, read_declared

DETAILS = "details.html"
OPENING_MOVIE, _FRONT = "movieS2_speeds.mp4", "front"
_THUMB = (150, 96)  # pixels
_NAMED = re.compile(r"(?:Fig\.|,) (S?\d)")


def write_report(context: Context, sections: list[Section], judged: list[Judged]) -> Path:
    """Write ``report.html``, ``details.html``, ``figures.pdf`` (at paper scale), ``results.csv``
    and ``verdicts.json``; copy each figure's files and numbers to ``figures/``.
    """
    _write_pdf(context.out / "figures.pdf", sections)
    folder = context.out / "figures"
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
    Results.collect(sections).write(context.out / RESULTS)
    # What the run was made with, and every verdict; no times, no machine: equal runs leave equal
    # bytes.
    data: dict[str, Any] = {
        "configuration": context.describe(),
        "versions": list_versions(),
        "verdicts": {
            one.statement.id: {
                "says": one.statement.says,
                "verdict": one.word,
                "why": one.why,
                "ours": one.ours,
                "findings": [
                    {
                        part: getattr(found, part)
                        for part in ("verdict", "ours", "note", "moves")
                    }
                    for found in one.findings
                ],
            }
            for one in judged
            if context.is_cockroach
        },
    }
    text = json.dumps(data, sort_keys=True, indent=1, ensure_ascii=False)
    write_text(context.out / "verdicts.json", text)
    return write_page(context, sections, judged)


def write_page(context: Context, sections: list[Section], judged: list[Judged]) -> Path:
    """Write ``report.html`` and ``details.html``; of another antenna ``report.html`` alone."""
    report = context.out / "report.html"
    templates: Any = open_templates("paper").get_template("report.html").module
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"
    body = templates.methods(
        _describe_methods(context), describe_versions(), machine, context.seed, sections
    )
    parts: list[Section | Part] = [
        *sections,
        Part(name="methods", title="Methods and conditions", body=body),
    ]
    if not context.is_cockroach:
        name = f"The antenna '{context.antenna.name}', touched"
        measures = Part(
            name="claims",
            title="The paper's measures, of this antenna",
            body=templates.measures(judged),
        )
        write_text(report, render_page(name, _describe(context), [measures, *parts]))
        return report
    body = templates.statements(
        judged,
        count_verdicts(judged, "ours"),
        count_intervals(judged),
        {*_find_blocks(sections)},
    )
    first = Part(name="claims", title="Every statement and its verdict", body=body)
    title = "Meng et al. 2025, recomputed: every section and number"
    write_text(context.out / DETAILS, render_page(title, _describe(context), [first, *parts]))
    write_text(report, _render_story(context, sections, judged))
    return report


def _find_blocks(sections: Sequence[Section]) -> dict[str, tuple[Section, dict[str, Any]]]:
    """Every figure and movie with its section, by name."""
    return {
        str(block["name"]).removesuffix(".mp4"): (section, block)
        for section in sections
        for block in section.blocks
        if "name" in block
    }


def list_named(one: Judged) -> list[str]:
    """The figures of the paper that a statement names, such as ``5`` and ``S6``."""
    parts = one.statement.where.split(";")
    return [name for part in parts if "Fig." in part for name in _NAMED.findall(part)]


def place_statement(one: Judged) -> str:
    """The figure of the paper to which a statement belongs: the first that it names, or that of
    our picture; "": none.
    """
    if named := list_named(one):
        return named[0]
    own = re.match(r"fig(S?\d)", one.statement.figure)
    return own[1] if own and one.statement.whose == "paper" else ""


def _render_story(context: Context, sections: list[Section], judged: list[Judged]) -> str:
    """The page with a section for each figure of the paper."""
    templates: Any = open_templates("paper").get_template("report.html").module
    results, declared = Results.collect(sections), read_declared("statements.toml")
    blocks = _find_blocks(sections)
    groups, by_id = (
        defaultdict[str, list[Judged]](list),
        {one.statement.id: one for one in judged},
    )
    theirs = [one for one in judged if one.statement.whose == "paper"]
    for one in theirs:
        groups[place_statement(one)].append(one)
    parts, thumbs = [], []
    for figure in declared["figure"]:
        number = figure["name"].removeprefix("Fig. ")
        own = groups.pop(number, [])
        found = [blocks[name] for name in figure["pictures"] if name in blocks]
        named = [one for one in theirs if number in list_named(one)]
        said = {one.say_kept(): None for one, _ in found if one.kept}
        body = templates.figure(
            Markup("").join(draw_block(*one) for one in found),
            results.fill(figure.get("words", "")),
            own,
            [one for one in named if one not in own],
            [*said],
            [name for name in blocks if name.startswith(figure["prefix"])],
        )
        anchor = f"fig{number.replace(' ', '')}"
        parts.append(Part(name=anchor, title=f"{figure['name']}  {figure['title']}", body=body))
        marks = [one.mark for one in {one.statement.id: one for one in (*own, *named)}.values()]
        counts = {mark: n for mark in MARKS.values() if (n := marks.count(mark))}
        told = "; ".join(f"{counts[m]} {word}" for word, m in MARKS.items() if m in counts)
        thumbs.append(
            (
                *(figure["name"], anchor, _shrink(*found[0]) if found else "", counts),
                told or "no statement of the paper",
            )
        )
    rest = [one for found in groups.values() for one in found]
    parts += [
        Part(name=name, title=title, body=body)
        for name, title, body in (
            ("rest", "Sentences of the paper without a figure", templates.listed(rest)),
            ("beyond", "Beyond the paper", templates.beyond(_list_studies(sections, judged))),
            ("reading", "How to read this page", templates.reading(count_intervals(judged))),
        )
    ]
    counts = count_verdicts(judged)
    answers = [
        (
            one["asks"],
            results.fill(one["words"]),
            by_id.get(one.get("statement", "")),
            fill_front(results) if one.get("table") else None,
        )
        for one in declared["answer"]
    ]
    section, block = blocks.get(_FRONT, (None, None))
    opening = templates.opening(
        [one for one in answers if one[1]],
        draw_block(section, block) if section and block else "",
        section.say_kept() if section else "",
        counts,
        thumbs,
    )
    able = sum(counts.values()) - [*counts.values()][-1]
    first = next(iter(counts.values()))
    return render_page(
        f"Meng et al. 2025, recomputed: {first} of {able} comparable statements are reproduced as"
        " the paper words them",
        _describe(context),
        parts,
        opening=opening,
        bare=True,
    )


def _list_studies(
    sections: Sequence[Section], judged: Sequence[Judged]
) -> list[tuple[Section, list[Judged]]]:
    """Sections beyond the paper with the statements of our own that they decide."""
    own = defaultdict[str, list[Judged]](list)
    for one in judged:
        if one.statement.whose == "ours":
            own[one.statement.section].append(one)
    return [(section, own[section.name]) for section in sections if section.name in own]


def _shrink(section: Section, block: dict[str, Any]) -> str:
    """A block's picture, or a movie's still, as a small one that stands inside the page."""
    name = block.get("still") or block.get("file") or f"{block['name']}.png"
    with Image.open(section.folder / str(name)) as picture:
        small = picture.convert("RGB")
    small.thumbnail(_THUMB)
    small.save(stream := io.BytesIO(), "WEBP", quality=70)
    return f"data:image/webp;base64,{b64encode(stream.getvalue()).decode()}"


def _describe(context: Context) -> str:
    made = f"Scale: {context.scale}; seed {context.seed}; physics: {context.engine} engine."
    if not context.is_cockroach:
        return (
            f"What “{context.antenna.name}” feels and can discriminate: the analyses of Meng et al."
            f" 2025, done on another antenna than the paper's. {made}"
        )
    return (
        "An independent computational reproduction of “Physically intelligent soft antennae enhance"
        f" tactile perception by active touch”. {made}"
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
    with writing(path) as part:
        writer.write(part)


def _split_pages(section: Section, folder: Path) -> None:
    """Each figure's page as a PDF of its own."""
    for name, page in zip(
        section.list_figures(), PdfReader(section.folder / PAGES).pages, strict=True
    ):
        writer = PdfWriter()
        writer.add_page(page)
        writer.write(folder / f"{name}.pdf")
