"""Which antenna tells most: searched profiles beside the paper's (no figure of the paper)."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from feeler.antenna import Antenna
from feeler.files import read_shipped
from feeler.plotting.style import NOISE_COLOURS, PALETTE
from feeler.report import Section, make_interval
from paper.context import Context


def plot(stored: dict[str, Any], reference: Antenna, figure: Figure) -> None:
    """Profiles, errors on the final draws, where the exponential family went, and sensors."""
    axes = figure.subplots(2, 2).flat
    place = reference.hinge_position / reference.length
    for k, (colour, one) in enumerate(zip(PALETTE, stored["spline"].values(), strict=False)):
        axes[0].plot(place, one["stiffness"], color=colour, lw=1, label=f"search {k + 1}")
    axes[0].plot(place, reference.stiffness, color="black", label="the paper's")
    axes[0].legend()
    axes[0].set(yscale="log", xlabel="position (base 0, tip 1)", ylabel="stiffness [N·mm/rad]")
    final = stored["final"]
    x = np.arange(len(final["speeds"]))
    axes[1].plot(x, 100 * np.array(final["paper"]["errors"]), "ks", label="the paper's")
    for colour, one in zip(PALETTE, final["seeds"].values(), strict=False):
        axes[1].plot(x, 100 * np.array(one["errors"]), "o", ms=3, color=colour)
    axes[1].set_xticks(x, [f"{v:g}" for v in final["speeds"]])
    axes[1].set(xlabel="speed [m/s]", ylabel="error rate, held-out touches [%]")
    axes[1].legend()
    for noise, family in stored.get("family", {}).items():
        colour = NOISE_COLOURS[noise]
        for k, one in enumerate(family["starts"]):
            label = f"{noise} noise" if k == 0 else None
            axes[2].plot(
                [one["start_rate"], one["p"][2]],
                [one["bits"]] * 2,
                "|-",
                markevery=[0],
                color=colour,
                lw=0.5,
            )
            axes[2].plot(one["p"][2], one["bits"], "o", ms=4, color=colour, label=label)
        axes[2].plot(-0.0827, family["paper"]["bits"], "x", color=colour)
    for marker, words in (("|", "start"), ("o", "end of a search"), ("x", "the paper's")):
        axes[2].plot([], [], marker, color="#59636e", label=words)
    axes[2].set(xlabel="stiffness rate p3 [1/joint]", ylabel="bits, touches of the search")
    axes[2].legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2)
    for colour, one in zip(PALETTE, stored["spline"].values(), strict=False):
        count, cost = np.array(one["history"]).T
        axes[3].step(count, cost, where="post", color=colour)
    axes[3].set(xlabel="antennas simulated", ylabel="missing bits, touches of the search")


def _collect_values(stored: dict[str, Any]) -> dict[str, Any]:
    """The numbers that claims are held against."""
    final, found = stored["final"], {}
    for speed, mean, half in zip(final["speeds"], final["fewer"], final["half"], strict=True):
        found[f"design.fewer.{speed:g}"] = make_interval(mean, half, n=len(final["seeds"]))
    found["design.fewer.least"] = min(final["fewer"])
    return found


def show(context: Context, section: Section) -> None:
    """What was searched and stored."""
    stored = read_shipped("studies.design", "results.json")
    section.values.update(_collect_values(stored))
    section.text(
        "Searched and judged by studies/design/measure.py, whose choices stand in"
        " studies/design/declared.toml, written down before any final touch was looked at. It was"
        " run on 2026-11-24 with today's contact, on final draws that no earlier run had seen. It"
        " takes half an hour of one core, so this report reads what was found. Eighteen classes"
        " (the paper's six objects at three places), touches drawn within nuisances, noise of one"
        " peak (white); the search saw 0.3 m/s and the optimiser's draws only."
    )
    section.figure(
        "design",
        "a: stiffness of five searched splines (colours) and of the paper's antenna (black); b:"
        " their error rates on the final draws at three speeds (one evaluation each, no interval);"
        " c: where far starts of the exponential family (bars) went (crosses: the paper's); d: the"
        " searches.",
        lambda figure: plot(stored, context.antenna, figure),
        height=4.8,
        numbers=stored,
    )
    _show_final(stored["final"], section)


def _show_final(final: dict[str, Any], section: Section) -> None:
    mean = 100 * np.mean([one["errors"] for one in final["seeds"].values()], axis=0)
    rows = [
        [f"{speed:g}", 100 * paper, float(own), f"{100 * fewer:.0f} ± {100 * half:.0f}"]
        for speed, paper, own, fewer, half in zip(
            final["speeds"],
            final["paper"]["errors"],
            mean,
            final["fewer"],
            final["half"],
            strict=True,
        )
    ]
    held = "held" if final["held"] else "did not hold"
    header = [
        "m/s",
        "the paper's, wrong [%]",
        "splines, wrong [%]",
        "errors avoided [%], 95 % over five searches",
    ]
    caption = (
        "Final draws, looked at once. What was declared, at least 30 % fewer errors at each speed,"
        f" {held}."
    )
    section.table(header, rows, caption)
