"""What a figure says: how small its words are in print, which stand on one another, and which of
its colours nothing names.
"""

from collections.abc import Iterable
from itertools import combinations, pairwise
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

from feeler.plotting.look import ANTENNA_COLOURS, BASIS_COLOURS, FEATURE_COLOURS

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
