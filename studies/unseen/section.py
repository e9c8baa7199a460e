"""An antenna designed for sizes and locations held out of its training set (no figure of the
paper).
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from feeler.antenna.segments import Antenna
from feeler.plotting.results import plot_spreads
from feeler.plotting.style import PALETTE, mark_places
from feeler.report import Section
from paper.context import Context
from studies.spikes.found import average, say_mean
from studies.stored import load_stored

_TICKS = (0.2, 0.5, 1, 2, 5, 10)
WORDS = {
    "unseen": "size and place new",
    "size": "size new",
    "place": "place new",
    "known": "both known",
}
SHOWN = {
    "published": ("published", "black", "o"),
    "unseen": ("designed for new touches", PALETTE[0], "s"),
    "known": ("designed for known touches", PALETTE[1], "^"),
    "unseen_tip": ("designed for new touches, tip as compliant as published", PALETTE[0], "D"),
    "known_tip": ("designed for known touches, tip as compliant as published", PALETTE[1], "v"),
}
"""What each antenna is called, its colour and its mark; those scaled have open marks."""


def collect_values(wrong: Mapping[str, Mapping[str, list[float]]]) -> dict[str, Any]:
    """The numbers that claims are held against: percent classified incorrectly, and gains in
    points.
    """
    values: dict[str, Any] = {"unseen.sets": len(wrong["published"]["unseen"])}

    def keep_gain(name: str, before: list[float], after: list[float]) -> None:
        found = average(100 * np.subtract(before, after))
        values[f"unseen.gain.{name}"] = found
        values[f"unseen.half.{name}"] = found["high"] - found["value"]

    for name, kinds in wrong.items():
        for kind, shares in kinds.items():
            place = f"{name}.{kind.removesuffix(', few').replace(', ', '.')}"
            if place != "published.unseen" or kind == "unseen":
                values[f"unseen.wrong.{place}"] = average(100 * np.asarray(shares))
            if name != "published":
                keep_gain(place, wrong["published"][kind], shares)
    for kind in WORDS.keys() & wrong["known"].keys():
        keep_gain(f"over_known.{kind}", wrong["known"][kind], wrong["unseen"][kind])
    return values


def plot(found: Mapping[str, Any], reference: Antenna, figure: Figure) -> None:
    """Stiffness and damping of the designs over the published, and what is classified
    incorrectly.
    """
    (stiff, damped), (left, right) = figure.subplots(2, 2)
    place = reference.hinge_position / reference.length
    for kind in ("unseen", "known"):
        label, colour, _ = SHOWN[kind]
        for ax, name in ((stiff, "stiffness"), (damped, "damping")):
            ratio = np.asarray(found["found"][kind][name]) / getattr(reference, name)
            ax.plot(place, ratio, color=colour, label=label)
            ax.axhline(1.0, color="black", lw=0.8)
            ax.set(yscale="log", xlabel="place (base 0, tip 1)", ylabel=f"{name} / published")
            mark_places(ax.yaxis, _TICKS)
    values = collect_values(found["wrong"])
    _plot_kinds(values, "wrong", ("published", "unseen", "known"), left)
    left.set_ylabel("error rate [%]")
    _plot_kinds(values, "gain", ("unseen", "known", "unseen_tip", "known_tip"), right)
    right.axhline(0.0, color="black", lw=0.8)
    right.set_ylabel("reduction of the error rate [points]")
    shown: dict[str, Any] = {}
    for ax in (left, right):
        shown |= dict(zip(*ax.get_legend_handles_labels()[::-1], strict=True))
    figure.legend(shown.values(), shown.keys(), loc="outside lower center", ncols=2)


def _plot_kinds(values: Mapping[str, Any], part: str, names: tuple[str, ...], ax: Axes) -> None:
    asked = [kind for kind in WORDS if f"unseen.gain.unseen.{kind}" in values]
    for k, name in enumerate(names):
        label, colour, mark = SHOWN[name]
        spreads = [values.get(f"unseen.{part}.{name}.{kind}", {}) for kind in asked]
        x = [i + 0.14 * (k - (len(names) - 1) / 2) for i in range(len(asked))]
        fill = "none" if name.endswith("_tip") else colour
        style: dict[str, Any] = {
            "fmt": mark,
            "ms": 4,
            "capsize": 2,
            "color": colour,
            "mfc": fill,
        }
        plot_spreads(ax, x, spreads, label=label, **style)
    ax.set_xticks(range(len(asked)), [WORDS[kind] for kind in asked])
    ax.set_xlim(-0.5, len(asked) - 0.5)


def show(context: Context, section: Section) -> None:
    """The question, what was found, and the values."""
    found, said = load_stored("unseen")
    section.text(
        "A classifier learns what shape touches it, ball, box or triangle, from touches of three"
        " sizes at three places, and is then asked about sizes and places in between. Splines of"
        " stiffness and damping are searched, at the published total compliance, for the fewest"
        " such new touches classified incorrectly; as a control, by the same search, for the fewest"
        " known ones. Both are judged on final draws that no search used. Every choice was written"
        " down before (studies/unseen/declared.toml)."
    )
    section.text(said)
    section.figure(
        "unseen",
        "a, b: stiffness and damping of both designs over the published antenna's; c: error rate"
        " on final draws; d: how much lower it is than the published antenna's; open marks: designs"
        " scaled to the published compliance of the tip. Bars: 95 % CI over sets of resampled"
        " touches.",
        lambda figure: plot(found, context.antenna, figure),
        height=5.0,
        numbers=found,
    )
    values = collect_values(found["wrong"])
    kinds = WORDS | {"unseen.lda": "both new, read by LDA"}
    kinds = {
        kind: word for kind, word in kinds.items() if f"unseen.gain.unseen.{kind}" in values
    }
    rows = [
        [SHOWN[name][0], *(_say(values, f"unseen.{part}.{name}.{kind}") for kind in kinds)]
        for part, names in (("wrong", ("published", "unseen", "known")), ("gain", [*SHOWN][1:]))
        for name in names
    ]
    header = ["antenna", *kinds.values()]
    section.table(header, rows[:3], "Classified incorrectly [%], 95 % over sets.")
    section.table(
        header,
        rows[3:],
        "Fewer classified incorrectly than with the published antenna [points].",
    )
    section.values.update(values)


def _say(values: Mapping[str, Any], key: str) -> str:
    return say_mean(values[key]) if key in values else "not asked"
