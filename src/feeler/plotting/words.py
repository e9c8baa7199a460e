"""The words of a figure: how small they are in print, and which stand on one another."""

from itertools import combinations
from typing import Any

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

PAGE_WIDTH = 180.0  # mm, the width of a journal's page
LEAST = 6.0  # pt
_TOUCH = 1.5  # pixels by which boxes may share an edge


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
