"""The standard of figures: letters that can be read, no text on text, no legend on what is drawn,
named colours with one meaning each, units.
"""

import json
import re
import sys
from collections import defaultdict
from contextlib import contextmanager
from itertools import combinations, pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import Collection, PathCollection
from matplotlib.colors import to_hex, to_rgba
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.path import Path as Outline
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from feeler.cli import main
from feeler.plotting.style import (
    ANTENNA_COLOURS,
    BASIS_COLOURS,
    FEATURE_COLOURS,
    NOISE_COLOURS,
    PROFILE_COLOURS,
    pick_shades,
    style,
)
from feeler.report import Section

MEASURED = re.compile(
    r"\b(time|angle|speed|distance|force|frequency|length|stiffness|damping|curvature|accuracy)\b"
)
WITHOUT = re.compile(r"\[|\b(share|times|ratio|relative|sample)\b")  # a unit, or a bare number
_PAGE_WIDTH = 180.0  # mm, the width of a journal's page
LEAST = 6.0  # pt
_TOUCH = 1.5  # pixels by which boxes may share an edge
_GAP = 0.25  # between numbers below an axis, of the size of their letters
_GREY = 0.1  # how far apart the parts of a grey may lie
_MEANT = {to_hex(colour) for colour in (*BASIS_COLOURS, *FEATURE_COLOURS.values())}
OWN = {
    **{name: {to_hex(colour)} for name, colour in (PROFILE_COLOURS | FEATURE_COLOURS).items()},
    **{f"{name} noise": {to_hex(colour)} for name, colour in NOISE_COLOURS.items()},
    **{f"basis {k}": {to_hex(colour)} for k, colour in enumerate(BASIS_COLOURS, 1)},
    "a speed": {to_hex(shade) for n in range(1, 9) for shade in pick_shades("speed", n)},
}
"""The colours of what has its own in every figure."""


def find_meaning(name):
    """What a name in a figure means: which thing with a colour of its own, or its first word."""
    if re.match(r"(slow|medium|fast)\b(?!-)|[\d.]+ m/s", name):
        return "a speed"
    if re.match(r"\w+ at [\d.]+", name):
        return name  # one of several answers, not every touch of that object
    first = re.match(r"basis \d+|\w+|", name)[0]
    return f"{first} noise" if first in NOISE_COLOURS else first


def find_mixed(named):
    """Colours with two meanings, and what is not drawn in the colour of its own, from the names of
    a figure with their colours.
    """
    meanings = defaultdict(set)
    for name, colours in named.items():
        for colour in colours:
            meanings[colour].add(find_meaning(name))
    faults = [f"{c} means {sorted(found)}" for c, found in meanings.items() if len(found) > 1]
    for colour, meaning in ((c, meaning) for c, found in meanings.items() for meaning in found):
        owners = sorted(owner for owner, own in OWN.items() if colour in own)
        if meaning in OWN and meaning not in owners:
            faults.append(f"{meaning!r} is drawn in {colour}, not in its own")
        elif owners and meaning not in owners:
            faults.append(f"{meaning!r} is drawn in the colour of {owners}")
    return faults


@contextmanager
def watch_figures(seen):
    """Every figure that a section keeps is given to ``seen(figure, name, draw)`` as it was kept."""
    drawn = Section._draw

    def draw(self, name, draw, **size):
        figures = []
        found = drawn(self, name, lambda figure: figures.append(figure) or draw(figure), **size)
        with style():
            seen(figures[0], name, draw)
        return found

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Section, "_draw", draw)
        yield


def reproduce_measured(words):
    """The reproduction with the options of the command line, on one core; what was measured on the
    words of its figures is left in the file ``words``.
    """
    measured = {}
    sys.argv[1:1] = ["reproduce", "--workers", "1"]
    try:
        with watch_figures(
            lambda figure, name, _: measured.update({name: measure_all(figure)})
        ):
            main()
    finally:
        Path(words).write_text(json.dumps(measured), encoding="utf-8")


def measure_all(figure):
    """What can be read of a figure as it is drawn."""
    figure.draw_without_rendering()  # a legend's places are those of the last drawing
    return measure_words(figure) | {
        "named": list_named(figure),
        "covered": find_covered(figure),
        "unnamed": find_unnamed(figure),
    }


def find_faults(figure):
    """What a reader could not read."""
    words = measure_all(figure)
    faults = [f"letters of {words['least']} pt"] if words["least"] < LEAST else []
    faults += [f"{a!r} stands on {b!r}" for a, b in words["over"]]
    faults += [f"the legend of {first!r} lies on what is drawn" for first in words["covered"]]
    faults += find_mixed(words["named"])
    bars = [bar for ax in figure.axes if (bar := getattr(ax, "_colorbar", None))]
    named = {to_hex(colour) for bar in bars for colour in bar.cmap(np.arange(bar.cmap.N))}
    faults += [
        f"unnamed in {panel!r}: {lost}"
        for panel, colours in words["unnamed"].items()
        if (lost := sorted({*colours} - named))
    ]
    labels = {text for ax in figure.axes for text in (ax.get_xlabel(), ax.get_ylabel())}
    return faults + [
        f"without a unit: {text!r}"
        for text in sorted(labels)
        if MEASURED.search(text) and not WITHOUT.search(text)
    ]


def list_named(figure):
    """The colours, without greys, of every name in a legend and of every coloured text."""
    found = {}
    for legend in figure.findobj(Legend):
        for text, handle in zip(legend.get_texts(), legend.legend_handles, strict=True):
            found.setdefault(text.get_text(), set()).update(list_colours(handle))
    for text in figure.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            found.setdefault(text.get_text(), set()).update(list_colours(text))
    return {name: sorted(colours) for name, colours in found.items() if colours}


def find_covered(figure):
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


def _list_marks(ax):
    marks = (*ax.lines, *ax.collections, *ax.patches)
    return [mark for mark in marks if mark.get_visible() and list_colours(mark)]


def _covers(box, mark):
    shown = Bbox.intersection(box, mark.axes.bbox)
    return shown is not None and any(_meets(shown, path, fill) for path, fill in _trace(mark))


def _meets(box, path, filled):
    clean = path.cleaned(remove_nans=True)
    return bool(
        len(np.asarray(clean.vertices)) > 1 and clean.intersects_bbox(box, filled=filled)
    )


def _trace(mark):
    """The lines and areas of a mark, as they lie on the picture."""
    if isinstance(mark, Line2D):
        path = mark.get_transform().transform_path(mark.get_path())
        if mark.get_linestyle() not in ("None", "", " "):
            return [(path, False)]
        return [(Outline([point, point + 1e-3]), False) for point in np.asarray(path.vertices)]
    if isinstance(mark, PathCollection):
        places = mark.get_offset_transform().transform(mark.get_offsets())
        return [(Outline([point, point + 1e-3]), False) for point in places]
    if isinstance(mark, Collection):
        paths = map(mark.get_transform().transform_path, mark.get_paths())
        return [(path, mark.get_fill()) for path in paths]
    return [(mark.get_transform().transform_path(mark.get_path()), True)]


def measure_words(figure):
    """The smallest letters of a figure that is drawn 180 mm wide, and pairs of texts that overlap.

    Returns
    -------
    dict
        ``least``, a size [pt]; ``over``, the pairs of texts whose boxes share more than an edge, or
        of neighbouring numbers below an axis that read as one.
    """
    canvas = figure.canvas if isinstance(figure.canvas, FigureCanvasAgg) else None
    renderer = (canvas or FigureCanvasAgg(figure)).get_renderer()
    unseen = _list_unseen(figure)
    shown = [one for one in figure.findobj(Text) if id(one) not in unseen and _is_shown(one)]
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


def _find_crowded(figure, renderer):
    """Neighbouring numbers below an axis that stand nearer than words do."""
    unseen, found = _list_unseen(figure), []
    for ax in figure.axes:
        labels = [
            one for one in ax.get_xticklabels() if id(one) not in unseen and _is_shown(one)
        ]
        boxes = [(one, Text.get_window_extent(one, renderer)) for one in labels]
        boxes.sort(key=lambda item: item[1].x0)
        gap = _GAP * figure.dpi / 72
        for (a, first), (b, second) in pairwise(boxes):
            if (
                -_TOUCH <= second.x0 - first.x1 < gap * float(a.get_fontsize())
                and not a.get_rotation()
            ):
                found.append([a.get_text(), b.get_text()])
    return found


def _list_unseen(figure):
    """Labels of ticks that lie outside of what an axis shows; Matplotlib keeps them undrawn."""
    return {
        id(label)
        for axes in figure.findobj(Axes)
        for axis in (axes.xaxis, axes.yaxis)
        for tick in (*axis.get_major_ticks(), *axis.get_minor_ticks())
        if not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
        for label in (tick.label1, tick.label2)
    }


def _is_shown(text):
    """Whether it and all that it stands in are visible, with something to read."""
    axes = text.axes
    inside = axes is None or axes.get_visible()
    return bool(text.get_visible() and inside and text.get_text().strip())


def _share(a, b, c, d):
    return min(b, d) - max(a, c) > _TOUCH


def find_unnamed(figure):
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


def _list_written(part):
    """Colours of the legends and texts of a figure or a part of it."""
    named = set()
    for legend in part.findobj(Legend):
        named.update(*map(list_colours, legend.legend_handles))
    for text in part.findobj(Text):
        if text.get_visible() and text.get_text().strip():
            named.add(to_hex(text.get_color()))
    return named


def list_colours(mark):
    """Colours that a mark or a text is drawn with, without greys."""
    found = []
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


def _is_coloured(colour):
    *parts, alpha = colour
    return alpha > 0 and max(parts) - min(parts) > _GREY
