"""One look for every figure: journal sizes, embedded fonts, colours for the colour-blind."""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import cycle
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from feeler.validation import checked

SINGLE, DOUBLE = 3.5, 7.2  # inches; single and double column of most journals
# Okabe & Ito 2008: distinguishable with every common colour blindness.
PROFILE_COLOURS = {
    "exponential": "#0072B2",
    "linear": "#D55E00",
    "uniform": "#009E73",
    "matched": "#CC79A7",
}
# Tol's muted scheme and two of Okabe & Ito's that no profile has: other meanings, other colours
BASIS_COLOURS = ("#882255", "#999933", "#44AA99", "#332288", "#DDCC77")
FEATURE_COLOURS = {"ball": "#56B4E9", "box": "#E69F00", "triangle": "#000000"}
NOISE_COLOURS = {"relative": "#117733", "common": "#AA4499"}
# what has no colour of its own: one's own antennas beside the paper's, say
PALETTE = ("#CC6677", "#661100", "#6699CC", "#AA8866", "#88CCEE", "#445566", "#888888")
# quantities that shade a row of marks, each with colours of its own
_SHADES = {"speed": "viridis", "wall distance": "cividis", "bend": "plasma", "hinge": "copper"}
_SPEED, _SPEEDS = " m/s", ("slow", "medium", "fast")
ANTENNA_COLOURS = ("#5b3a1e", "#d9b48f")  # its line, and its body
TENSOR_COLOURS = "magma"  # perceptually even; jet only beside the paper's own pictures
BOTH_COLOURS = "RdBu_r"  # of bending both ways, white where there is none

_RC: Any = {
    "figure.dpi": 110,
    "savefig.dpi": 220,
    "font.family": ["sans-serif", "DejaVu Sans"],  # the second for signs that the first lacks
    "font.sans-serif": ["Arial", "Helvetica", "Liberation Sans", "DejaVu Sans"],
    "font.size": 8,
    "axes.titlesize": 8,
    "axes.labelsize": 8,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "lines.linewidth": 1.3,
    "axes.prop_cycle": cycler(color=list(PALETTE)),
    "image.cmap": TENSOR_COLOURS,
    "pdf.fonttype": 42,
    "ps.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "feeler",
    "axes.titley": (
        1.0
    ),  # named, so that each measurement need not look for what stands above the axes
}


@contextmanager
def style() -> Iterator[None]:
    """Draw inside this context to get feeler's look; nothing outside it changes."""
    with mpl.rc_context(_RC):
        yield


def pick_colours(names: Iterable[str]) -> dict[str, Any]:
    """A colour for each name, the same in every figure: profiles and features have theirs, and of
    speeds ("0.06 m/s", "slow") the slower is the darker. Any other takes the next that means
    nothing else; the eighth has the first one's again.
    """
    names = list(dict.fromkeys(names))
    named = {*names} <= {*_SPEEDS}
    if names and (named or all(name.endswith(_SPEED) for name in names)):
        ordered = sorted(
            names, key=_SPEEDS.index if named else lambda name: float(name.removesuffix(_SPEED))
        )
        return dict(zip(ordered, pick_shades("speed", len(ordered)), strict=True))
    known, others = PROFILE_COLOURS | FEATURE_COLOURS, cycle(PALETTE)
    return {name: known.get(name) or next(others) for name in names}


def pick_shades(quantity: str, count: int) -> list[tuple[float, ...]]:
    """Colours of ``count`` rising values of a quantity: a speed, a bend, a hinge's place …"""
    return [
        tuple(shade) for shade in mpl.colormaps[_SHADES[quantity]](np.linspace(0, 0.9, count))
    ]


def mark_panels(axes: Any, letters: str = "abcdefghi") -> None:
    """A letter for each panel, bold, above its upper left corner."""
    for letter, ax in zip(letters, np.ravel(axes), strict=False):
        ax.set_title(letter, loc="left", fontweight="bold", fontsize=9)


@checked
def set_decades(ax: Axes) -> None:
    """A logarithmic y axis with a plain number at each decade: ticks between them only crowd a
    small panel.
    """
    ax.set_yscale("log", subs=[])
    ax.yaxis.set_major_formatter("{x:g}")


@checked
def mark_places(axis: Axis, places: Iterable[float]) -> None:
    """A plain number at each of these places of a logarithmic axis, and no other mark."""
    places = list(places)
    axis.set_ticks(places, [f"{place:g}" for place in places])
    axis.set_ticks([], minor=True)


FEWEST = 5
"""Points of a curve; of fewer no line is drawn."""


def unjoin(figure: Figure, least: int = FEWEST) -> None:
    """Curves of fewer points than ``least`` become points: a line between them would say what
    nobody measured.

    Only lines with marks are curves. What was dashed gets open marks, so that it still can be told
    from what was not.
    """
    loose: dict[object, bool] = {}
    for ax in figure.axes:
        for line in ax.lines:
            if (
                line.get_marker() not in ("None", "", None)
                and line.get_linestyle() != "None"
                and np.size(line.get_xdata()) < least
            ):
                loose[line.get_label()] = line.get_linestyle() != "-"
                _loosen(line, loose[line.get_label()])
        for container in ax.containers:
            middle = container.lines[0] if isinstance(container, ErrorbarContainer) else None
            if middle is not None and middle.get_linestyle() == "None":
                loose.setdefault(container.get_label(), False)
    # of the figure, its axes and its parts; searching all artists would make every tick first
    own = [legend for ax in figure.axes if (legend := ax.get_legend()) is not None]
    parts = [legend for part in figure.subfigs for legend in part.legends]
    for legend in (*own, *figure.legends, *parts):
        for line, text in zip(legend.get_lines(), legend.get_texts(), strict=False):
            if text.get_text() in loose and line.get_marker() not in ("None", "", None):
                _loosen(line, loose[text.get_text()])


def _loosen(line: Line2D, was_dashed: bool) -> None:
    line.set_linestyle("None")
    line.set_markersize(max(line.get_markersize(), 4.0))
    if was_dashed:
        line.set_markerfacecolor("none")


def fix_layout(figure: Figure) -> None:
    """Lay the figure out once; with a layout engine, even "none", every file would be drawn twice
    and laid out anew.

    That is why ``style`` names no engine: after each file matplotlib puts back the one that the
    style asks for.
    """
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            if not axis.get_label_text():
                axis.set_label_coords(0.5, 0.5)  # no label: nor need its place be looked for
    if engine := figure.get_layout_engine():
        engine.execute(figure)
        figure.set_layout_engine(None)
