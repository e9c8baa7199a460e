"""One look for every figure: journal sizes, colours for the colour-blind, legends, and what a
figure says.
"""

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import combinations, cycle, pairwise
from typing import Any

import matplotlib as mpl
import numpy as np
from cycler import cycler
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, PathCollection
from matplotlib.colors import to_hex, to_rgba
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from feeler.validation import checked

# One look for every figure: journal sizes, embedded fonts, colours for the colour-blind.

SINGLE, DOUBLE = 3.5, 7.2  # inches; single and double column of most journals
# Okabe & Ito 2008: distinguishable with every common colour blindness.
PROFILE_COLOURS = {
    "exponential": "#0072B2",
    "linear": "#D55E00",
    "constant": "#009E73",
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
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
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
    for legend in _list_legends(figure):
        for line, text in zip(legend.get_lines(), legend.get_texts(), strict=False):
            if text.get_text() in loose and line.get_marker() not in ("None", "", None):
                _loosen(line, loose[text.get_text()])


def _list_legends(figure: Figure) -> list[Legend]:
    """Of the figure, its axes and its parts; searching all artists would make every tick first."""
    own = [legend for ax in figure.axes if (legend := ax.get_legend()) is not None]
    return (
        own + [*figure.legends] + [legend for part in figure.subfigs for legend in part.legends]
    )


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


# What legends say: which name has which colours, and which marks a legend lies on.


def list_named(figure: Figure) -> dict[str, list[str]]:
    """The colours, without greys, of every name in a legend and of every coloured text."""
    found: dict[str, set[str]] = {}
    for legend in figure.findobj(Legend):
        for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True):
            found.setdefault(text.get_text(), set()).update(list_colours(handle))
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            found.setdefault(text.get_text(), set()).update(list_colours(text))
    return {name: sorted(colours) for name, colours in found.items() if colours}


def find_covered(figure: Figure) -> list[str]:
    """Legends, by their first name, that lie on coloured marks of a figure that is laid out."""
    canvas = figure.canvas if isinstance(figure.canvas, FigureCanvasAgg) else None
    renderer = (canvas or FigureCanvasAgg(figure)).get_renderer()
    found = []
    for ax in figure.axes:
        if (legend := ax.get_legend()) is None:
            continue
        box = legend.get_window_extent(renderer).padded(-1.0)
        if any(_covers(box, mark) for other in figure.axes for mark in _list_marks(other)):
            found.append(legend.get_texts()[0].get_text())
    return found


def _list_marks(ax: Axes) -> list[Artist]:
    marks = (*ax.lines, *ax.collections, *ax.patches)
    return [mark for mark in marks if mark.get_visible() and list_colours(mark)]


def _covers(box: Bbox, mark: Artist) -> bool:
    assert mark.axes is not None
    shown = Bbox.intersection(box, mark.axes.bbox)
    return shown is not None and any(_meets(shown, path, fill) for path, fill in _trace(mark))


def _meets(box: Bbox, path: Path, filled: bool) -> bool:
    clean = path.cleaned(remove_nans=True)
    return bool(
        len(np.asarray(clean.vertices)) > 1 and clean.intersects_bbox(box, filled=filled)
    )


def _trace(mark: Artist) -> list[tuple[Path, bool]]:
    """The lines and areas of a mark, as they lie on the picture."""
    if isinstance(mark, Line2D):
        path = mark.get_transform().transform_path(mark.get_path())
        if mark.get_linestyle() not in ("None", "", " "):
            return [(path, False)]
        return [(Path([point, point + 1e-3]), False) for point in np.asarray(path.vertices)]
    if isinstance(mark, PathCollection):
        places = mark.get_offset_transform().transform(mark.get_offsets())
        return [(Path([point, point + 1e-3]), False) for point in places]
    if isinstance(mark, Collection):
        paths = map(mark.get_transform().transform_path, mark.get_paths())
        return [(path, mark.get_fill()) for path in paths]
    assert isinstance(mark, Patch)
    return [(mark.get_transform().transform_path(mark.get_path()), True)]


# What a figure says: how small its words are in print, which stand on one another, and which of
# its colours nothing names.

_PAGE_WIDTH = 180.0  # mm, the width of a journal's page
LEAST = 6.0  # pt
_TOUCH = 1.5  # pixels by which boxes may share an edge
_GAP = 0.25  # between numbers below an axis, of the size of their letters
_GREY = 0.1  # how far apart the parts of a grey may lie
_MEANT = {to_hex(colour) for colour in (*BASIS_COLOURS, *FEATURE_COLOURS.values())}


def measure_words(figure: Figure) -> dict[str, Any]:
    """The smallest letters of a figure that is drawn 180 mm wide, and pairs of texts that overlap.

    Returns
    -------
    dict
        ``least``, a size [pt]; ``over``, the pairs of texts whose boxes share more than an edge, or
        of neighbouring numbers below an axis that read as one.
    """
    canvas: Any = figure.canvas if isinstance(figure.canvas, FigureCanvasAgg) else None
    renderer = (canvas or FigureCanvasAgg(figure)).get_renderer()
    unseen = _list_unseen(figure)
    shown = [
        one
        for one in figure.findobj(Text)
        if isinstance(one, Text) and id(one) not in unseen and _is_shown(one)
    ]
    boxes = [(one.get_text(), Text.get_window_extent(one, renderer)) for one in shown]
    boxes = [(words, box) for words, box in boxes if box.width and box.height]
    over = [
        [a, b]
        for (a, first), (b, second) in combinations(boxes, 2)
        if _share(first.x0, first.x1, second.x0, second.x1)
        and _share(first.y0, first.y1, second.y0, second.y1)
    ]
    over += _find_crowded(figure, renderer)
    wide = 25.4 * figure.get_figwidth()
    sizes = [float(one.get_fontsize()) for one in shown]
    return {
        "least": round(min(sizes) * _PAGE_WIDTH / wide, 2) if sizes else LEAST,
        "over": over,
    }


def _find_crowded(figure: Figure, renderer: Any) -> list[list[str]]:
    """Neighbouring numbers below an axis that stand nearer than words do."""
    unseen, found = _list_unseen(figure), []
    for ax in figure.axes:
        labels = [
            one for one in ax.get_xticklabels() if id(one) not in unseen and _is_shown(one)
        ]
        boxes = [(one, Text.get_window_extent(one, renderer)) for one in labels]
        boxes.sort(key=lambda item: item[1].x0)
        gap: float = _GAP * figure.dpi / 72
        for (a, first), (b, second) in pairwise(boxes):
            if (
                -_TOUCH <= second.x0 - first.x1 < gap * float(a.get_fontsize())
                and not a.get_rotation()
            ):
                found.append([a.get_text(), b.get_text()])
    return found


def _list_unseen(figure: Figure) -> set[int]:
    """Labels of ticks that lie outside of what an axis shows; Matplotlib keeps them undrawn."""
    return {
        id(label)
        for axes in figure.findobj(Axes)
        if isinstance(axes, Axes)
        for axis in (axes.xaxis, axes.yaxis)
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
        for label in (tick.label1, tick.label2)
    }


def _is_shown(text: Text) -> bool:
    """Whether it and all that it stands in are visible, with something to read."""
    axes = text.axes
    inside = axes is None or axes.get_visible()
    return bool(text.get_visible() and inside and text.get_text().strip())


def _share(a: float, b: float, c: float, d: float) -> bool:
    return min(b, d) - max(a, c) > _TOUCH


def find_unnamed(figure: Figure) -> dict[str, list[str]]:
    """Colours of marks, by panel, that no legend and no text of the figure has.

    A panel with one colour needs no legend: its title and axes say what it shows; but a colour of a
    kind of object or a basis is named in its panel, or beside it, even then. Marks that are
    coloured by a map have a colour bar, greys are frames and guides, and the antenna itself is
    drawn in its own colours.
    """
    named = _list_written(figure)
    antenna, found = {to_hex(colour) for colour in ANTENNA_COLOURS}, {}
    for ax in filter(Axes.get_visible, figure.axes):
        drawn = (*ax.lines, *ax.collections, *ax.patches)
        colours = {colour for mark in drawn for colour in list_colours(mark)} - antenna
        lost = colours - named if len(colours) > 1 else set()
        lost |= colours & _MEANT - _list_written(ax.get_figure(root=False))
        if lost:
            title = ax.get_title() or ax.get_title("left") or ax.get_ylabel() or ax.get_xlabel()
            found[title] = sorted(lost)
    return found


def _list_written(part: Any) -> set[str]:
    """Colours of the legends and texts of a figure or a part of it."""
    named: set[str] = set()
    for legend in part.findobj(Legend):
        named.update(*map(list_colours, legend.legend_handles))
    for text in part.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            named.add(to_hex(text.get_color()))
    return named


def list_colours(mark: Artist | None) -> set[str]:
    """Colours that a mark or a text is drawn with, without greys."""
    found: list[Any] = []
    if isinstance(mark, Text):
        found.append(mark.get_color())
    elif isinstance(mark, Line2D):
        if mark.get_linestyle() not in ("None", "", " "):
            found.append(mark.get_color())
        if mark.get_marker() not in ("None", "", " ", None):
            found += [mark.get_markerfacecolor(), mark.get_markeredgecolor()]
    elif isinstance(mark, Collection) and mark.get_array() is None:
        found += [*mark.get_facecolor(), *mark.get_edgecolor()]
    elif isinstance(mark, Patch):
        found += [mark.get_facecolor(), mark.get_edgecolor()]
    return {to_hex(colour) for colour in found if _is_coloured(to_rgba(colour))}


def _is_coloured(colour: Iterable[float]) -> bool:
    *parts, alpha = colour
    return alpha > 0 and max(parts) - min(parts) > _GREY
