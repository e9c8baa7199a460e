"""The report's section on readings: a strip of points for every sentence, verdicts, and what the
documentation shows of them.
"""

import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.analysis import INDICES
from feeler.plotting.style import PALETTE
from feeler.provenance import to_json
from feeler.report import Section
from paper.context import Context
from paper.readings import COLUMNS, Finding, collect, judge_sentences, list_readings

_COLOURS = {True: PALETTE[2], False: "#9A9A9A", None: PALETTE[1]}


def plot(finding: Finding, ax: Axes) -> None:
    """A strip for each group: a dot for each reading, coloured by whether it agrees, the main one
    as a diamond, identical touches as ticks below, the paper's values as crosses.
    """
    sentence = finding.sentence
    readings = list_readings(sentence, finding.rows)
    rng = np.random.default_rng(0)  # spreads the dots across a strip only
    shift = rng.uniform(-0.22, 0.22, len(readings))
    nulls = finding.rows.groupby("group", sort=False)["null"]
    for place, group in enumerate(sentence.groups):
        for agrees, colour in _COLOURS.items():
            own = [k for k, one in enumerate(readings) if one.agrees is agrees]
            values = [readings[k].spreads[place][0] for k in own]
            ax.plot(values, place + shift[own], ".", ms=4, color=colour, alpha=0.7, mew=0)
        main = [one.spreads[place][0] for one in readings if one.main]
        ax.plot(main, [place] * len(main), "D", ms=6, mfc="none", mec="#000000", mew=1.2)
        if group in nulls.groups:
            null = nulls.get_group(group).dropna().unique()
            if null.size:
                look: dict[str, Any] = {"ms": 5, "color": PALETTE[3], "alpha": 0.6}
                ax.plot(null, np.full(len(null), place - 0.36), "|", **look)
        if sentence.target:
            ax.plot(sentence.target[place], place, "x", ms=7, color="#C00000", mew=1.5)
    ax.set_yticks(range(len(sentence.groups)), sentence.groups)
    ax.set_ylim(-0.55, len(sentence.groups) - 0.5)
    ax.set_xlabel(sentence.unit)


def plot_findings(findings: Sequence[Finding], figure: Figure) -> None:
    """The strips of sentences that differ in their index alone, side by side, with one legend."""
    axes = figure.subplots(1, len(findings), squeeze=False)[0]
    for ax, finding in zip(axes, findings, strict=True):
        plot(finding, ax)
        index = finding.sentence.index
        ax.set_title(INDICES[index].label if index else "", fontsize=8)
    for colour, label in zip(_COLOURS.values(), ("agrees", "does not", "open"), strict=True):
        axes[0].plot([], [], ".", color=colour, label=label)
    axes[0].plot([], [], "D", mfc="none", mec="#000000", label="main reading")
    if any(one.rows["null"].notna().any() for one in findings):
        axes[0].plot([], [], "|", color=PALETTE[3], label="identical touches")
    if findings[0].sentence.target:
        axes[0].plot(
            [],
            [],
            "x",
            color="#C00000",
            label="the paper"
            if findings[0].sentence.kind in ("value", "factor")
            else "asked for",
        )
    figure.legend(loc="outside lower center", ncols=6, fontsize=7, frameon=False)


def make_section(sections: Sequence[Section], context: Context) -> Section:
    """The report's own section: every sentence's verdict, its strip, and on what it depends."""
    folder = context.out / "cache" / "readings"
    folder.mkdir(parents=True, exist_ok=True)
    section = Section(
        name="readings", title="The paper by its own words", folder=folder, vector=False
    )
    rows = collect(sections)
    findings = judge_sentences(rows)
    section.text(
        "The paper leaves open how some of its numbers were computed. For every sentence with a"
        " number or an order, readings.toml declares the choices that its words leave open, with"
        " a word on how natural each option is; the first option of each is nearest to the words"
        " and was chosen from them alone. All readings are computed. A sentence is reproduced"
        " under the paper's own words where the reading of all first options agrees with it."
    )
    section.table(
        ["figure", "sentence", "verdict", "main reading", "on what it depends"],
        [
            [one.sentence.figure, one.sentence.says, one.verdict, one.note, one.line]
            for one in findings.values()
        ],
        f"{len(findings)} sentences, in the paper's order.",
    )
    for members in _group(findings):
        _show_strips(section, members)
    for name, one in findings.items():
        decided = one.rows.drop_duplicates("reading")["agrees"].dropna()
        if len(decided):
            section.values[f"readings.{name}"] = {
                "value": float(decided.mean()),
                "n": len(decided),
            }
        for _, row in one.rows[one.rows["main"]].iterrows():
            ends = {end: row[end] for end in ("low", "high") if np.isfinite(row[end])}
            if np.isfinite(row["value"]):
                key = f"readings.{name}.{row['group']}"
                section.values[key] = {"value": row["value"], **ends, "n": int(row["n"])}
    rows[list(COLUMNS)].to_csv(folder / "readings.csv", index=False, float_format="%.6g")
    section.save()
    return section


def _group(findings: Mapping[str, Finding]) -> list[list[Finding]]:
    """Sentences that differ in their index alone together; those without rows left out."""
    groups: dict[str, list[Finding]] = {}
    for name, one in findings.items():
        if len(one.rows):
            groups.setdefault(name.replace(one.sentence.index or "\0", "index"), []).append(one)
    return [*groups.values()]


def _show_strips(section: Section, members: list[Finding]) -> None:
    first = members[0].sentence
    words = first.says.split(": ")[0] if first.index else first.says
    section.heading(f"{first.figure}: {words}")
    n = len(members[0].rows.drop_duplicates("reading"))
    section.figure(
        f"readings_{first.id}",
        f"{words}: {n} reading{'s' * (n > 1)}. The paper: {first.paper}.",
        lambda figure: plot_findings(members, figure),
        height=1.0 + 0.36 * len(first.groups),
        numbers={
            one.sentence.id: one.rows[["reading", "group", "value", "agrees"]].to_dict("list")
            for one in members
        },
    )
    section.table(
        ["verdict", "main reading", "on what it depends", "threshold"],
        [
            [
                f"{INDICES[one.sentence.index].label}: {one.verdict}"
                if one.sentence.index
                else one.verdict,
                *(one.note, one.line, one.moves),
            ]
            for one in members
        ],
    )
    if first.choice:
        section.table(
            [
                "choice",
                "what it asks",
                "options, nearest first; how many agree",
                "why the first",
            ],
            [
                [
                    one.name,
                    one.asks,
                    ", ".join(
                        f"{option} ({word}; {_count_option(members, one.name, option)})"
                        for option, word in one.options.items()
                    ),
                    one.why,
                ]
                for one in first.choice
            ],
        )


def _count_option(members: list[Finding], name: str, option: str) -> str:
    """How many readings with one option agree, of those that decide."""
    rows = pd.concat([one.rows for one in members])
    rows = rows.drop_duplicates(["sentence", "reading"]).dropna(subset="agrees")
    own = rows[rows["choices"].map(lambda chosen: chosen.get(name) == option).astype(bool)]
    return f"{int(own['agrees'].sum())} of {len(own)}"


def write_results(sections: Sequence[Section], context: Context) -> str:
    """What the documentation shows, as JSON: values, and every sentence with its finding."""
    section = make_section(sections, context)
    findings = judge_sentences(collect(sections))
    more = {
        key: value
        for one in sections
        for key, value in one.values.items()
        if key.startswith("contact.")
    }
    values = {key.removeprefix("readings."): value for key, value in section.values.items()}
    lines = [
        {"figure": one.sentence.figure, "says": one.sentence.says}
        | {"verdict": one.verdict, "note": one.note, "line": one.line, "moves": one.moves}
        for one in findings.values()
    ]
    plain = to_json(values | more | {"sentences": len(findings)})
    return json.dumps({"values": plain, "findings": lines}, indent=1, sort_keys=True) + "\n"


def main() -> None:
    """Keep the results of a finished run: ``python -m paper.readings_page out``."""
    from benchmarks.kept import ROOT, write_kept
    from paper.reproduce import reproduce

    context = Context(out=Path(sys.argv[1]))
    text = write_results(reproduce(context)[:-1], context)
    write_kept(ROOT / "benchmarks" / "results" / "readings.json", text)


if __name__ == "__main__":
    main()
