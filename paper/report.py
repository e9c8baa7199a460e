"""The report of a run: one self-contained page, the figures as one PDF and one by one, and the
numbers.
"""

import json
import os
import platform
from collections.abc import Mapping
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
    open_templates,
    render_page,
    to_json,
)
from paper.context import Context
from paper.declared import read_declared
from paper.findings import list_findings
from paper.story import open_report, tell_story
from paper.verdicts import EVIDENCE, OTHERS, ClaimResult, count_verdicts


def write_report(context: Context, sections: list[Section], claims: list[ClaimResult]) -> Path:
    """Write ``report.html``, ``figures.pdf`` (at paper scale) and ``numbers.json``; copy each
    figure's files and numbers to ``figures/``."""
    _write_pdf(context.out / "figures.pdf", sections)
    _copy_figures(context.out / "figures", sections)
    _write_numbers(context.out / "numbers.json", context, sections, claims)
    return write_page(context, sections, claims)


def write_page(context: Context, sections: list[Section], claims: list[ClaimResult]) -> Path:
    """Write ``report.html``."""
    templates: Any = open_templates("paper").get_template("report.html").module
    made = {
        str(block["name"]): section.name
        for section in sections
        for block in section.blocks
        if "name" in block
    }
    opening, story, beside = Markup(""), Markup(""), dict[str, Markup]()
    shown: list[Section] = sections
    if context.is_cockroach:
        opening, beside = (
            open_report(templates, sections, claims),
            _group(templates, claims, made),
        )
        story, shown = tell_story(templates, sections, claims, beside)
        findings = list_findings(
            {key: value for section in sections for key, value in section.values.items()}
        )
        first = Part(
            name="claims",
            title="Every claim and its verdict",
            body=_fill_verdicts(templates, claims, findings, made),
        )
    else:
        title = "The paper's measures, of this antenna"
        first = Part(name="claims", title=title, body=templates.measures(claims))
    names = [str(name).removesuffix(".mp4") for name in made]
    body = templates.places(
        [{"prefix": "", "note": ""} | place for place in read_declared("places.toml")["place"]],
        names,
    )
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


def _fill_verdicts(
    templates: Any,
    claims: list[ClaimResult],
    findings: list[tuple[str, str]],
    made: Mapping[str, str],
) -> Any:
    paper = count_verdicts(claims)
    evidence, others = ({word: paper[word] for word in words} for words in (EVIDENCE, OTHERS))
    ours = count_verdicts(claims, "ours")
    return templates.verdicts(claims, evidence, others, ours, findings, made)


def _group(
    templates: Any, claims: list[ClaimResult], made: Mapping[str, str]
) -> dict[str, Markup]:
    """The claims that stand beside each figure; where a run has not made it, at the end of the
    section.
    """
    groups: dict[str, list[ClaimResult]] = {}
    for judged in claims:
        place = (
            judged.claim.figure
            if judged.claim.figure in made
            else f"section-{judged.claim.section}"
        )
        groups.setdefault(place, []).append(judged)
    return {place: templates.beside(found, place) for place, found in groups.items()}


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


def _write_numbers(
    path: Path, context: Context, sections: list[Section], claims: list[ClaimResult]
) -> None:
    """Every claim with its verdict, and everything it is judged by; no times, no machine: equal
    runs leave equal bytes.
    """
    values = {section.name: to_json(section.values) for section in sections}
    data = {"configuration": context.describe(), "versions": list_versions(), "values": values}
    data["claims"] = [judged.describe() for judged in claims] if context.is_cockroach else []
    _write(path, json.dumps(data, sort_keys=True, indent=1))


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
