"""What legends say: which name has which colours, and which marks a legend lies on."""

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, PathCollection
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from feeler.plotting.words import list_colours


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
