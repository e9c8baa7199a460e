"""The report: one self-contained page, and the figures as one PDF."""

import base64
import html
import json
import os
import platform
from importlib.resources import files
from pathlib import Path

from pypdf import PdfReader, PdfWriter

from feeler.experiment.configuration import list_versions
from feeler.paper.claims import VERDICTS, Judged
from feeler.paper.context import Context
from feeler.paper.places import PLACES
from feeler.paper.section import MARKER, PAGES, Section, make_plain
from feeler.physics.scene import Contact

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<link rel="icon" href="data:,"><title>{title}</title><style>{css}</style></head><body>
<header><h1>{title}</h1><p class="lead">{lead}</p></header>
{contents}<main>{body}</main>
<footer><p class="small">Made by feeler {version}. Paper: Meng, McDonnell, Jayaram, Mongeau 2025,
<a href="https://doi.org/10.1101/2025.10.20.683587">doi:10.1101/2025.10.20.683587</a>.</p></footer></body></html>
"""
MIME = {".png": "image/png", ".mp4": "video/mp4"}


def write_report(context: Context, sections: list[Section], claims: list[Judged]) -> Path:
    """Write ``report.html``, ``figures.pdf`` (not at smoke scale) and ``numbers.json``; copy each figure's files and
    numbers to ``figures/``."""
    path = context.out / "report.html"
    if context.is_cockroach:
        parts = [("claims", "What holds", _render_claims(claims))]
    else:
        parts = [("claims", "The paper's measures, of this antenna", _render_measures(claims))]
    parts += [(section.name, section.title, _render_section(section)) for section in sections]
    parts += [
        ("places", "Every figure and movie", _render_places(sections)),
        ("methods", "Methods and conditions", _render_methods(context, sections)),
    ]
    other = f"The antenna '{context.antenna.name}', touched"
    page = _fill_page("Soft antennae, touched" if context.is_cockroach else other, _lead(context), parts)
    partial = path.with_suffix(".part")
    partial.write_text(page)
    _write_pdf(context.out / "figures.pdf", sections)
    _copy_figures(context.out / "figures", sections)
    _write_numbers(context.out / "numbers.json", context, sections)
    return partial.replace(path)


def render_page(title: str, lead: str, sections: list[Section]) -> str:
    """Sections as one self-contained page."""
    return _fill_page(title, lead, [(section.name, section.title, _render_section(section)) for section in sections])


def _fill_page(title: str, lead: str, parts: list[tuple[str, str, str]]) -> str:
    return PAGE.format(
        title=html.escape(title),
        lead=html.escape(lead),
        css=files("feeler.paper").joinpath("report.css").read_text(),
        contents=_list_contents(parts) if len(parts) > 1 else "",
        body="".join(
            f'<section id="{name}"><h2>{html.escape(name_of)}</h2>{text}</section>' for name, name_of, text in parts
        ),
        version=list_versions()["feeler"],
    )


def _list_contents(parts: list[tuple[str, str, str]]) -> str:
    items = "".join(f'<li><a href="#{name}">{html.escape(title)}</a></li>' for name, title, _ in parts)
    return f'<nav aria-label="contents"><ol>{items}</ol></nav>'


def _lead(context: Context) -> str:
    if not context.is_cockroach:
        return (
            f"What “{context.antenna.name}” feels and can tell apart: the analyses of “Physically intelligent soft antennae "
            "enhance tactile perception by active touch” (Meng et al. 2025), done on another antenna than the paper's. "
            f"Scale: {context.scale}; seed {context.seed}; physics: {context.engine} engine."
        )
    return (
        "Everything that “Physically intelligent soft antennae enhance tactile perception by active touch” (Meng et al. "
        "2025) claims and a computer can check, made anew from the mechanics up. Each claim stands beside what came out "
        f"here, also where it fails. Scale: {context.scale}; seed {context.seed}; physics: {context.engine} engine."
    )


def _render_claims(claims: list[Judged]) -> str:
    counts = {verdict: sum(judged.verdict == verdict for judged in claims) for verdict in VERDICTS}
    items = "".join(f'<li class="{_css(v)}"><b>{n}</b>{v}</li>' for v, n in counts.items())
    rows = "".join(
        f"<tr><td>{html.escape(j.claim.says)}<br><span class='small'>{html.escape(j.claim.where)}</span></td>"
        f"<td>{html.escape(j.claim.paper)} <span class='small'>[{j.claim.tag}]</span></td><td>{html.escape(j.ours)}</td>"
        f"<td class='verdict {_css(j.verdict)}'>{j.verdict}</td>"
        f"<td class='small'>{html.escape(j.why)} <a href='#{j.claim.section}'>see</a></td></tr>"
        for j in claims
    )
    return (
        "<p>The rules for each verdict (target, tolerance or direction) were written down before the results were looked "
        "at. Brackets hold the spread. For orders, ours are listed in the order in which they should rise.</p>"
        f"<ul class='counts'>{items}</ul><div class='scroll'><table><thead><tr><th>claim</th><th>paper</th><th>ours</th>"
        f"<th>verdict</th><th>why</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _render_measures(claims: list[Judged]) -> str:
    """For another antenna: no verdicts, its numbers beside what the paper says of its own."""
    rows = "".join(
        f"<tr><td>{html.escape(j.claim.says)}</td><td>{html.escape(j.claim.paper)}</td>"
        f"<td>{html.escape(j.ours)} <a href='#{j.claim.section}'>see</a></td></tr>"
        for j in claims
        if j.ours != "–"
    )
    return (
        "<p>The paper's claims speak of its own antennae, so none is judged here. Orders compare profiles or speeds; ours are "
        "listed in the order in which the paper's should rise.</p><div class='scroll'><table><thead><tr>"
        f"<th>what the paper says of its antenna</th><th>paper</th><th>here</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )


def _css(verdict: str) -> str:
    return verdict.replace(" ", "-")


def _render_section(section: Section) -> str:
    return "".join(_render_block(block, section.folder) for block in section.blocks)


def _render_block(block: dict, folder: Path) -> str:
    kind = block["kind"]
    if kind == "text":
        return f"<p>{html.escape(block['text'])}</p>"
    if kind == "heading":
        return f"<h3>{html.escape(block['text'])}</h3>"
    if kind == "table":
        return _render_table(block)
    caption = f"<figcaption>{html.escape(block['caption'])}</figcaption>"
    if kind == "movie":
        source = _embed(folder / block["name"])
        return f"<figure><video controls loop muted playsinline preload='metadata' src='{source}'></video>{caption}</figure>"
    width, height = block["size"]
    alt = html.escape(block["caption"], quote=True)
    source = _embed(folder / f"{block['name']}.png")
    return (
        f"<figure><img loading='lazy' style='max-width:{1.35 * width:.0f}px' width='{width}' height='{height}' alt=\"{alt}\" "
        f"src='{source}'>{caption}</figure>"
    )


def _render_table(block: dict) -> str:
    head = "".join(f"<th>{html.escape(cell)}</th>" for cell in block["header"])
    rows = "".join("<tr>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>" for row in block["rows"])
    caption = f"<caption>{html.escape(block['caption'])}</caption>" if block["caption"] else ""
    return f"<div class='scroll'><table>{caption}<thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>"


def _embed(path: Path) -> str:
    return f"data:{MIME[path.suffix]};base64,{base64.b64encode(path.read_bytes()).decode()}"


def _render_places(sections: list[Section]) -> str:
    made = {block["name"]: section.name for section in sections for block in section.blocks if "name" in block}
    rows = []
    for place in PLACES:
        found = sorted(name for name in made if name.startswith(place.prefix)) if place.prefix else []
        where = ", ".join(f"<a href='#{made[name]}'>{name}</a>" for name in found) or "not in this run"
        rows.append(
            f"<tr><td>{place.name}</td><td>{html.escape(place.shows)}</td><td>{where}</td><td>{html.escape(place.note)}</td></tr>"
        )
    return (
        "<div class='scroll'><table><thead><tr><th>in the paper</th><th>shows</th><th>here</th><th>note</th></tr></thead>"
        f"<tbody>{''.join(rows)}</tbody></table></div>"
    )


def _render_methods(context: Context, sections: list[Section]) -> str:
    antenna, contact = context.antenna, Contact()
    words = (
        f"The antenna '{antenna.name}' is a chain of {antenna.n_segments} rigid segments, {antenna.length:.4g} mm long, "
        f"{1e3 * antenna.segment_mass.sum():.3g} mg, joined by damped hinge springs in one plane, clamped at its base. Objects "
        f"move on straight lines at constant velocity. Contact is MuJoCo's soft contact with a pyramidal friction cone, "
        f"solref {contact.solref} [ms, 1], solimp {contact.solimp}; no gravity; integration step {context.timestep:g} ms, "
        f"one sample per ms at {antenna.sensors.size} hinges. Tensors hold joint angle and curvature (angle over segment "
        "length) with their signs; pictures show curvature, encoder and indices take angles with negative values set to 0 "
        "and one common scale for a whole set. Physics: the "
        f"{context.engine} engine"
        + (
            ", which solves MuJoCo's discrete equations and is held against MuJoCo step for step by the tests."
            if context.engine == "chain"
            else "."
        )
    )
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}"
    versions = ", ".join(f"{name} {version}" for name, version in list_versions().items())
    rows = [
        [section.title, f"{section.seconds:.1f}", "kept from an earlier run" if section.cached else ""]
        for section in sections
    ]
    times = _render_table(
        {"header": ["stage", "seconds", ""], "rows": rows, "caption": "Time each stage took when it was made."}
    )
    return (
        f"<p>{html.escape(words)}</p>"
        f"<p class='small'>Versions: {versions}. Machine: {machine}. Seed: {context.seed}.</p>{times}"
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


def _write_numbers(path: Path, context: Context, sections: list[Section]) -> None:
    """Everything the claims are judged by; no times, no machine: equal runs leave equal bytes."""
    values = {section.name: make_plain(section.values) for section in sections}
    data = {"configuration": context.describe(), "versions": list_versions(), "values": values}
    partial = path.with_suffix(".part")
    partial.write_text(json.dumps(data, sort_keys=True, indent=1))
    partial.replace(path)


def _copy_figures(folder: Path, sections: list[Section]) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for section in sections:
        for name in section.list_figures():
            (folder / f"{name}.pdf").unlink(missing_ok=True)  # an earlier run's picture of other numbers
        if any(block["kind"] in ("figure", "movie") for block in section.blocks):
            for file in sorted(section.folder.iterdir()):
                if file.name not in (MARKER, PAGES):
                    (folder / file.name).write_bytes(file.read_bytes())
        if section.vector and section.list_figures():
            _split_pages(section, folder)


def _split_pages(section: Section, folder: Path) -> None:
    """Each figure's page as a PDF of its own."""
    for name, page in zip(section.list_figures(), PdfReader(section.folder / PAGES).pages, strict=True):
        writer = PdfWriter()
        writer.add_page(page)
        writer.write(folder / f"{name}.pdf")
