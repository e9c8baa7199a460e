"""The pages that ``feeler robot`` leaves with --out."""

import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.ticker import MaxNLocator

from feeler.decoding.streams import StreamState
from feeler.files import write_text
from feeler.plotting.style import pick_shades
from feeler.provenance import to_json
from feeler.report import Section, write_page
from feeler.robot.classify import Answer, name_notes, name_touch
from feeler.robot.fit import RobotFit
from feeler.robot.recordings import Recording


def write_answers(
    out: Path,
    found: Sequence[Mapping[str, Any]],
    answers: Sequence[Answer],
    aligned: np.ndarray,
) -> Path:
    """robot.html, robot.png and robot.json of classified recordings."""
    names = [one["file"] for one in found]

    def draw(figure: Any) -> None:
        top = float(np.degrees(np.nanmax(np.abs(aligned)))) or 1.0
        axes = figure.subplots(len(names), 1, squeeze=False, sharex=True)[:, 0]
        for ax, name, values in zip(axes, names, aligned, strict=True):
            image = ax.imshow(
                np.degrees(values),
                aspect="auto",
                origin="lower",
                interpolation="nearest",
                extent=(-0.5, values.shape[1] - 0.5, 0.5, len(values) + 0.5),
                cmap="RdBu_r",
                vmin=-top,
                vmax=top,
            )
            ax.set_title(name, fontsize=7)
            ax.set_ylabel("channel")
            ax.yaxis.set_major_locator(MaxNLocator(integer=True))
        axes[-1].set_xlabel("sample, aligned on the tip's first peak")
        figure.colorbar(image, ax=list(axes), label="angle [°]")

    rows = [
        [
            name,
            _answer(answer),
            answer.probability,
            _name(answer),
            name_notes(answer.truth) or "no notes",
            answer.verdict,
        ]
        for name, answer in zip(names, answers, strict=True)
    ]
    return _write(
        out,
        "What the robot touched",
        f"{len(names)} recording{'s' * (len(names) != 1)}.",
        title="Recordings and answers",
        numbers=list(found),
        caption="The angle of every channel against time, each recording aligned on the first peak"
        " of its tip; one colour scale for all.",
        draw=draw,
        height=1.0 + 1.1 * len(names),
        table=(["file", "answer", "probability", "runner-up", "truth", "verdict"], rows),
    )


def write_recordings(
    out: Path, rows: Sequence[Mapping[str, Any]], recordings: Sequence[Recording]
) -> Path:
    """robot.html, robot.png and robot.json of checked recordings: every channel, and what is wrong
    or was mended.
    """
    names = [row["file"] for row in rows]

    def draw(figure: Any) -> None:
        axes = figure.subplots(len(names), 1, squeeze=False)[:, 0]
        for ax, name, one in zip(axes, names, recordings, strict=True):
            _plot_channels(one.time, one.values, ax)
            ax.set_title(name, fontsize=7)
        axes[-1].set_xlabel("time [ms]")

    cells = [
        [
            r["file"],
            r["channels"],
            r["duration_ms"],
            r["source"],
            "; ".join(r["history"]) or "nothing",
        ]
        for r in rows
    ]
    return _write(
        out,
        "What the recordings hold",
        f"{len(names)} recording{'s' * (len(names) != 1)}.",
        title="Recordings",
        numbers=rows,
        caption="Every channel, dark at the base, bright at the tip.",
        draw=draw,
        height=0.6 + 1.5 * len(names),
        table=(["file", "channels", "duration [ms]", "source", "found and mended"], cells),
    )


def write_fit(out: Path, recording: Recording, result: RobotFit, tips: np.ndarray) -> Path:
    """robot.html, robot.png and robot.json of a fitted release: the tip as recorded and as the
    fitted model moves it.
    """

    def draw(figure: Any) -> None:
        ax = figure.subplots()
        for tip, name, style in zip(tips, ("recording", "model"), ("-", "--"), strict=True):
            ax.plot(recording.time, tip, style, label=name)
        ax.set(xlabel="time since the release [ms]", ylabel="tip off its rest [mm]")
        ax.legend()

    rings = (("recording", result.target), ("model", result.reached))
    rows = [
        [name, f"{1e3 * r.frequency:.3f}", f"{r.damping_ratio:.4f}", f"{r.r_squared:.1%}"]
        for name, r in rings
    ]
    return _write(
        out,
        "The robot's two factors",
        f"p1 = {result.stiffness_factor:.4f}, p2 = {result.damping_factor:.4f} ms, error"
        f" {result.error:.2g}.",
        title="The release, recorded and fitted",
        numbers=_describe_fit(recording, result),
        caption="How far the tip is off its rest after its release, as recorded and as the model"
        " moves.",
        draw=draw,
        height=2.6,
        table=(
            ["", "damped frequency [Hz]", "damping ratio", "a damped cosine explains"],
            rows,
        ),
    )


def _describe_fit(recording: Recording, result: RobotFit) -> dict[str, Any]:
    """A fit's numbers."""
    rings = {"recording": result.target, "model": result.reached}
    return {
        **{name: getattr(result, name) for name in ("stiffness_factor", "damping_factor")},
        "error": result.error,
        **{
            name: {
                key: getattr(ring, key) for key in ("frequency", "damping_ratio", "r_squared")
            }
            for name, ring in rings.items()
        },
        "source": recording.source,
    }


def write_stream(
    out: Path,
    classes: Sequence[tuple],
    kept: Sequence[tuple[float | None, np.ndarray, StreamState]],
) -> Path:
    """robot.html, robot.png and robot.json of a decoded stream: what the sensors said, and what was
    thought of it.
    """
    angle = np.array([values for _, values, _ in kept])
    time = np.array([np.nan if at is None else at for at, *_ in kept], dtype=float)
    time, unit = (time, "ms") if np.isfinite(time).all() else (np.arange(len(kept)), "samples")
    belief = np.array([state.posterior for *_, state in kept])
    shown = np.argsort(belief[-1])[::-1][:4]
    end = kept[-1][2]
    numbers = {
        "time": time,
        "state": [state.state for *_, state in kept],
        "classes": classes,
        "posterior": belief,
    }

    def draw(figure: Any) -> None:
        above, below = figure.subplots(2, 1, sharex=True)
        _plot_channels(time, angle.T, above, below)
        for number in shown:
            below.plot(time, belief[:, number], label=name_touch(classes[number]))
        below.set(xlabel=f"time [{unit}]", ylabel="probability", ylim=(0, 1.02))
        below.legend(fontsize=7)

    said = (
        "no contact"
        if end.label is None
        else f"{name_touch(end.label)}, {end.probability:.0%}, {end.state}"
    )
    return _write(
        out,
        "A touch while it happened",
        f"At the end: {said}.",
        title="What the sensors said, and what was thought of it",
        numbers=numbers,
        caption="Above: every channel, dark at the base, bright at the tip. Below: the four touches"
        " most probable at the end.",
        draw=draw,
        height=4.0,
    )


def _plot_channels(time: np.ndarray, angle: np.ndarray, ax: Axes, *beside: Axes) -> None:
    """Angles (channel, sample) [rad] in degrees, dark at the base, bright at the tip, with a colour
    bar that takes its room from ``ax`` and the axes ``beside`` it.
    """
    colours = pick_shades("hinge", len(angle))
    for values, colour in zip(np.degrees(angle), colours, strict=True):
        ax.plot(time, values, color=colour)
    ax.set_ylabel("angle [°]")
    numbers = ScalarMappable(Normalize(0.5, len(angle) + 0.5), ListedColormap(colours))
    ax.figure.colorbar(numbers, ax=[ax, *beside], label="channel")


def _write(
    out: Path,
    heading: str,
    lead: str,
    *,
    title: str,
    numbers: object,
    caption: str,
    draw: Callable[[Any], None],
    height: float,
    table: tuple[list[str], list[list[Any]]] | None = None,
) -> Path:
    """robot.html with one picture and perhaps a table, robot.png and robot.json."""
    out.mkdir(parents=True, exist_ok=True)
    write_text(out / "robot.json", json.dumps(to_json(numbers), indent=1) + "\n")
    section = Section(name="robot", title=title, folder=out, vector=False)
    section.figure("robot", caption, draw, height=height)
    if table:
        section.table(*table)
    return write_page(out / "robot.html", heading, lead, section)


def _answer(answer: Answer) -> str:
    """The best label; of a touch like none that was learned, only what is nearest."""
    words = name_touch(answer.label)
    unlike = f"unlike any touch known ({answer.strangeness:.3g} × the limit); nearest: {words}"
    return "; ".join([unlike if answer.strange else words, *answer.remarks])


def _name(answer: Answer) -> str:
    if answer.runner_up is None:
        return "none"
    return f"{name_touch(answer.runner_up)} ({answer.runner_up_probability:.0%})"
