"""How the report begins: the first screen, then the paper in its own order, a figure a screen."""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from markupsafe import Markup

from feeler.report.page import Section, embed, open_templates
from paper.findings import (
    OPEN,
    choose_answer,
    list_abstract,
    list_headlines,
    list_not_reproduced,
    list_screens,
)
from paper.verdicts import EVIDENCE, ClaimResult, judge_statements

_QUESTION = (
    "Does an antenna with a stiff base and a soft tip feel more, and more if it moves slowly?"
)
OPENING_MOVIE = "movieS2_speeds.mp4"


def open_report(
    templates: Any, sections: Sequence[Section], claims: list[ClaimResult]
) -> Markup:
    """The first screen: the question, its answer, a movie, three findings, and what holds."""
    words = Counter(judge_statements(claims).values())
    return templates.opening(
        _QUESTION,
        choose_answer(claims),
        OPENING_MOVIE.removesuffix(".mp4"),
        headlines=list_headlines(_collect_values(sections), claims),
        held=[words[word] for word in EVIDENCE],
        depends=words[OPEN],
        never=_count_unsupported(claims),
        stated=words.total(),
        abstract=list_abstract(claims),
        failed=list_not_reproduced(claims),
        **_find_movie(sections),
    )


def _count_unsupported(claims: list[ClaimResult]) -> int:
    """Statements that depend on a definition and are reproduced by none that was tried."""
    supported = {
        one.claim.statement
        for one in claims
        if "reproduced" in {reading.verdict for reading in one.readings}
    }
    found = judge_statements(claims).items()
    return sum(word == OPEN and name not in supported for name, word in found)


def tell_story(
    templates: Any,
    sections: Sequence[Section],
    claims: list[ClaimResult],
    beside: Mapping[str, Markup],
) -> tuple[Markup, list[Section]]:
    """The screens after the first, and the sections without what now stands in the story."""
    blocks: Any = open_templates("feeler.report").get_template("blocks.html").module
    known = {
        str(block["name"]): (section, block)
        for section in sections
        for block in section.blocks
        if block["kind"] == "figure"
    }
    screens = []
    for screen in list_screens(_collect_values(sections)):
        if screen["figure"] in known:
            section, block = known[screen["figure"]]
            picture = blocks.picture(block, _embed_from(section), defaultdict(Markup, beside))
            screens.append(screen | {"picture": picture, "kept": section.say_kept()})
    unmet = [
        one
        for one in claims
        if one.claim.whose == "paper" and one.is_evidence and one.verdict != "reproduced"
    ]
    told = {screen["figure"] for screen in screens}
    told_so_far = [templates.screen(screen) for screen in screens]
    story = Markup("").join([*told_so_far[:-1], templates.failures(unmet), *told_so_far[-1:]])
    return story, [_leave(section, told) for section in sections]


def _embed_from(section: Section):
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


def _collect_values(sections: Sequence[Section]) -> dict[str, Any]:
    return {key: value for section in sections for key, value in section.values.items()}


def _find_movie(sections: Sequence[Section]) -> dict[str, str]:
    for section in sections:
        for block in section.blocks:
            if block.get("name") == OPENING_MOVIE and block["kind"] == "movie":
                path = section.folder / OPENING_MOVIE
                still, caption = embed(path.with_suffix(".jpg")), str(block["caption"])
                return {"movie": embed(path), "still": still, "caption": caption}
    return {"movie": "", "still": "", "caption": ""}
