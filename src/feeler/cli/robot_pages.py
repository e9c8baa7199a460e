"""The pages that ``feeler robot`` leaves with --out."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from feeler.report import Section, write_page
from feeler.robot.answer import Answer, name_notes, name_touch


def write_answers(
    out: Path, found: Sequence[Mapping[str, Any]], answers: Sequence[Answer], aligned: np.ndarray
) -> Path:
    """robot.html, robot.png and robot.json of classified recordings."""
    section, names = _begin(out, "Recordings and answers", list(found)), [one["file"] for one in found]

    def draw(figure: Any) -> None:
        top = float(np.degrees(np.nanmax(np.abs(aligned)))) or 1.0
        axes = figure.subplots(len(names), 1, squeeze=False, sharex=True)[:, 0]
        for ax, name, values in zip(axes, names, aligned, strict=True):
            image = ax.imshow(np.degrees(values), aspect="auto", origin="lower", cmap="RdBu_r", vmin=-top, vmax=top)
            ax.set_title(name, fontsize=7)
            ax.set_ylabel("channel")
        axes[-1].set_xlabel("sample, aligned on the tip's first peak")
        figure.colorbar(image, ax=list(axes), label="angle [°]")

    section.figure("robot", "Each recording, aligned; one scale.", draw, height=1.0 + 1.1 * len(names))
    rows = [
        [
            name,
            name_touch(answer.label),
            answer.probability,
            _name(answer),
            name_notes(answer.truth) or "no notes",
            _judge(answer),
        ]
        for name, answer in zip(names, answers, strict=True)
    ]
    section.table(["file", "answer", "probability", "runner-up", "truth", "verdict"], rows)
    return write_page(out / "robot.html", "What the robot touched", f"{len(names)} recordings.", section)


def write_gap(out: Path, found: Mapping[str, Mapping[str, tuple[float, float, float]]], contacts: int) -> Path:
    """robot.html, robot.png and robot.json: what each part of the gap costs, as bars."""
    section = _begin(out, "Each part of the gap alone, at full size", {"contacts": contacts, "shares": found})
    names = list(found)
    shares = 100 * np.array([found[name]["all"] for name in names])
    lost = 100 - shares

    def draw(figure: Any) -> None:
        ax = figure.subplots()
        error = np.array([shares[:, 2] - shares[:, 0], shares[:, 0] - shares[:, 1]])
        ax.barh(
            names, lost[:, 0], xerr=error, color=["C1" if name.startswith(("all", "every")) else "C0" for name in names]
        )
        ax.invert_yaxis()
        ax.set(xlabel="contacts read wrong [%], with 95 % interval", xlim=(0, max(5.0, 1.05 * lost[:, 1].max())))

    section.figure(
        "robot",
        f"Contacts (of {contacts} each) that a classifier trained on the model alone reads wrong in feature, place or speed, on "
        "surrogate robots that differ from the model in one part only. Sizes of the parts are choices (feeler.robot.Gap).",
        draw,
        height=0.8 + 0.28 * len(names),
    )
    rows = [
        [name, *(f"{100 * s['all'][k]:.0f}" for k in range(3)), f"{100 * s['feature'][0]:.0f}"]
        for name, s in found.items()
    ]
    section.table(["part", "read right, %", "from", "to", "feature right, %"], rows)
    return write_page(out / "robot.html", "What the gap costs", "Between simulation and surrogate robots.", section)


def _begin(out: Path, title: str, numbers: object) -> Section:
    out.mkdir(parents=True, exist_ok=True)
    (out / "robot.json").write_text(json.dumps(numbers, indent=1) + "\n", encoding="utf-8")
    return Section(name="robot", title=title, folder=out, vector=False)


def _name(answer: Answer) -> str:
    if answer.runner_up is None:
        return "none"
    return f"{name_touch(answer.runner_up)} ({answer.runner_up_probability:.0%})"


def _judge(answer: Answer) -> str:
    if not answer.truth:
        return ""
    wrong = [part for part, right in answer.right.items() if not right]
    return f"wrong: {', '.join(wrong)}" if wrong else "right"
