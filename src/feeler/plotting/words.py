"""What a figure says: how small its words are in print, which stand on one another, and which of
its colours nothing names.
"""

from collections.abc import Iterable
from itertools import combinations
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from feeler.plotting.look import ANTENNA_COLOURS

PAGE_WIDTH = 180.0  # mm, the width of a journal's page
LEAST = 6.0  # pt
_TOUCH = 1.5  # pixels by which boxes may share an edge
_GREY = 0.05  # how far apart the parts of a grey may lie


def measure_words(figure: Figure) -> dict[str, Any]:
    """The smallest letters of a figure that is drawn 180 mm wide, and pairs of texts that overlap.

    Returns
    -------
    dict
        ``least``, a size [pt]; ``over``, the pairs of texts whose boxes share more than an edge.
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
    wide = 25.4 * figure.get_figwidth()
    sizes = [float(one.get_fontsize()) for one in shown]
    return {"least": round(min(sizes) * PAGE_WIDTH / wide, 2) if sizes else LEAST, "over": over}


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

    A panel with one colour needs no legend: its title and axes say what it shows. Marks that are
    coloured by a map have a colour bar, greys are frames and guides, and the antenna itself is
    drawn in its own colours.
    """
    named: set[str] = set()
    for legend in figure.findobj(Legend):
        named.update(*map(_list_colours, legend.legend_handles))
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            named.add(to_hex(text.get_color()))
    antenna, found = {to_hex(colour) for colour in ANTENNA_COLOURS}, {}
    for ax in filter(Axes.get_visible, figure.axes):
        drawn = (*ax.lines, *ax.collections, *ax.patches)
        colours = {colour for mark in drawn for colour in _list_colours(mark)} - antenna
        if len(colours) > 1 and (lost := colours - named):
            found[ax.get_title() or ax.get_ylabel() or ax.get_xlabel()] = sorted(lost)
    return found


def _list_colours(mark: Artist | None) -> set[str]:
    """Colours that a mark is drawn with, without greys."""
    found: list[Any] = []
    if isinstance(mark, Line2D):
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
