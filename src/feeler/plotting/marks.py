"""The marks of a figure: which of its colours nothing names."""

from collections.abc import Iterable
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import to_hex, to_rgba
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.text import Text

from feeler.plotting.look import ANTENNA_COLOURS

_GREY = 0.05  # how far apart the parts of a grey may lie


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
