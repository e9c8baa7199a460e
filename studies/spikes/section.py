"""What spikes tell of a touch, by when, from which antenna (no figure of the paper)."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from feeler.plotting.results import plot_spreads
from feeler.plotting.style import mark_places, pick_colours
from feeler.report import Section
from paper.context import Context
from paper.data import CLAIMED
from studies.spikes.found import (
    PACES,
    Found,
    average,
    collect_values,
    say_mean,
)
from studies.spikes.study import load_spiking
from studies.stored import load_stored

READ_BY = {
    "ideal": "ideal observer",
    "counts": "counts in 10 ms",
    "first": "first spike of each unit",
    "onset": "first spike of all",
}
DEADLINES = ("20 ms", "50 ms", "100 ms", "200 ms", "whole touch")
_LOOK: dict[str, Any] = {"ms": 3.5, "capsize": 2, "lw": 1.0}
_STYLES = {"ideal": "-o", "counts": "--s", "first": ":^"}
CHANGES = {
    "own": "Poisson trains of 56 places",
    "shared": "gain of the exponential antenna",
    "100 spikes": "100 spikes a touch",
    "200 spikes": "200 spikes a touch",
    "regular": "regular trains (gamma of order 4, 1 ms of rest)",
    "spread 3 ms": "latency spread by 3 ms",
    "receptor 0.003 rad": "receptor noise of 0.003 rad",
    "phasic": "phasic part alone",
    "tonic": "tonic part alone",
    "hair": "hair sensilla, by rate of bending",
    "28 places": "28 places",
    "14 places": "14 places",
    "7 places": "7 places",
    "4 places": "4 places",
    "null": "one touch repeated",
}


def plot(cells: Mapping[str, Any], figure: Figure) -> None:
    """By deadline and code; by profile and gain; by number of places; by what is changed."""
    found = Found(cells)
    (by_time, by_profile), (by_place, by_change) = figure.subplots(2, 2)
    for pace, colour in pick_colours(PACES).items():
        _plot_deadlines(found, pace, colour, by_time)
        for gain, style in (("own", "s"), ("shared", "D")):
            spreads = [average(found.get(p, pace, "counts", gain)) for p in CLAIMED]
            fill = colour if gain == "own" else "none"
            x = np.arange(len(CLAIMED)) + (0.12 if gain == "shared" else -0.12)
            plot_spreads(by_profile, x, spreads, fmt=style, color=colour, mfc=fill, **_LOOK)
    by_time.set(ylabel="accuracy [%]", ylim=(0, 104))
    by_profile.set_xticks(range(len(CLAIMED)), CLAIMED)
    by_profile.set(ylabel="accuracy by counts [%]", ylim=(0, 104), xlim=(-0.5, 2.5))
    _plot_places(found, by_place)
    _plot_changes(found, by_change)
    _explain(figure)


def _plot_deadlines(found: Found, pace: str, colour: Any, ax: Axes) -> None:
    """What each classifier names right by each deadline, the whole touch last."""
    for code, style in _STYLES.items():
        spreads = [average(found.get("exponential", pace, code, "own", w)) for w in DEADLINES]
        plot_spreads(ax, range(len(DEADLINES)), spreads, fmt=style, color=colour, **_LOOK)
    ax.set_xticks(range(len(DEADLINES)), [name.split()[0] for name in DEADLINES])
    ax.set_xlabel("time since contact [ms]")


def _plot_places(found: Found, ax: Axes) -> None:
    """Slow whole touches from fewer places."""
    places = {"4 places": 4, "7 places": 7, "14 places": 14, "28 places": 28, "own": 56}
    for code, style in _STYLES.items():
        spreads = [average(found.get("exponential", "slow", code, name)) for name in places]
        colour = pick_colours(PACES)["slow"]
        plot_spreads(ax, places.values(), spreads, fmt=style, color=colour, **_LOOK)
    ax.set_xscale("log")
    mark_places(ax.xaxis, places.values())
    ax.set(xlabel="places with sensilla", ylabel="accuracy, slow touches [%]", ylim=(0, 104))


def _plot_changes(found: Found, ax: Axes) -> None:
    """Whole touches by what is changed, read by counts."""
    shown = [
        name for name in CHANGES if "places" not in name and name not in ("shared", "null")
    ]
    for pace, colour in pick_colours(PACES).items():
        spreads = [average(found.get("exponential", pace, "counts", name)) for name in shown]
        style = {"fmt": "s", "color": colour, "ms": 3, "capsize": 2}
        plot_spreads(ax, range(len(shown)), spreads, across=True, **style)
    words = ["as drawn (Poisson)" if name == "own" else name for name in shown]
    ax.set_yticks(range(len(shown)), words)
    ax.invert_yaxis()
    ax.set(xlabel="accuracy by counts [%]", xlim=(0, 104))


def _explain(figure: Figure) -> None:
    """What colours and marks mean, once for all panels."""
    marks = [
        *(Line2D([], [], color=c, label=pace) for pace, c in pick_colours(PACES).items()),
        *(
            Line2D(
                [], [], color="0.3", marker=style[-1], ls=style[:-1], ms=4, label=READ_BY[code]
            )
            for code, style in _STYLES.items()
        ),
        Line2D([], [], color="0.3", marker="s", ls="none", ms=4, label="counts, own gain"),
        Line2D(
            [], [], color="0.3", marker="D", ls="none", ms=4, mfc="none", label="shared gain"
        ),
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=4)


def show(_context: Context, section: Section) -> None:
    """The question, what was found, and the values."""
    cells, said = load_stored("spikes")
    values = collect_values(cells)
    section.text(
        "A brain sees spikes, not angles. Sensilla after Szczecinski et al. 2021 sit on both sides"
        " of the antenna at 56 places; thirty touches, each resampled in every set, are read from"
        " their trains. How strongly an antenna drives them is not known: each antenna has a gain"
        " of its own, or all have the exponential antenna's. Every choice and every expectation"
        " was written down before (studies/spikes/declared.toml)."
    )
    section.text(
        f"{said} They are of {values['spikes.sets.ideal']} sets for the ideal observer and"
        f" {values['spikes.sets.counts']} for classifiers that learn, of {load_spiking().sets} that"
        " were declared at most; the clock ended the runs."
    )
    section.figure(
        "spikes",
        "Accuracy from spikes, thirty classes. a: the exponential antenna by deadline; b: counts"
        " over untruncated touches by antenna and gain; c: slow touches from fewer places; d: by"
        f" what is changed. Bars: 95 % CI over sets of thirty resampled touches (n ="
        f" {values['spikes.sets.ideal']} for the ideal observer, {values['spikes.sets.counts']}"
        " for the others).",
        lambda figure: plot(cells, figure),
        height=5.5,
        numbers={name: one["value"] for name, one in values.items() if _is_known(one)},
    )
    _write_tables(section, Found(cells))
    section.values.update(values)


def _is_known(value: Any) -> bool:
    return isinstance(value, dict) and "value" in value


def _write_tables(section: Section, found: Found) -> None:
    """Classified correctly by profile, gain and speed; by what is changed; spikes and bits."""
    rows = [
        [
            *(profile, gain, READ_BY[code]),
            *(say_mean(average(found.get(profile, pace, code, gain))) for pace in PACES),
        ]
        for profile in CLAIMED
        for gain in ("own", "shared")
        for code in ("ideal", "counts", "first")
    ]
    section.table(
        ["antenna", "gain", "read by", *PACES],
        rows,
        "Whole touches classified correctly [%], 95 %.",
    )
    rows = [[CHANGES[name], *_read_paces(found, "counts", name)] for name in CHANGES]
    section.table(
        ["exponential antenna, counts", *PACES],
        rows,
        "Whole touches classified correctly [%], 95 %.",
    )
    rows = [[READ_BY[code], *_read_paces(found, code, field="place")] for code in READ_BY]
    section.table(
        ["exponential antenna, read by", *PACES],
        rows,
        "Place classified correctly, of five, in whole touches [%], 95 %.",
    )
    rows = [
        [profile, speed, *_count(found, profile, speed)]
        for profile in CLAIMED
        for speed in PACES
    ]
    section.table(
        ["antenna", "speed", "spikes a touch", "bits", "bits per thousand spikes"],
        rows,
        "Whole touches at the antenna's own gain, by the ideal observer (log₂ 30 = 4.9 bits).",
    )


def _read_paces(found: Found, code: str, variant: str = "own", field: str = "accuracy") -> list:
    """What is read of the exponential antenna's whole touches, by speed."""
    return [
        say_mean(average(found.get("exponential", pace, code, variant, field=field)))
        for pace in PACES
    ]


def _count(found: Found, profile: str, speed: str) -> list[str]:
    spikes, bits = (found.get(profile, speed, "ideal", field=f) for f in ("spikes", "bits"))
    told = average(found.per_thousand(profile, speed))
    return [f"{spikes.mean():.0f}", say_mean(average(bits), 2), say_mean(told, 1)]
