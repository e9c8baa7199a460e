"""The pictures of a section: PNG files, and pages of one PDF."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rcParams
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure
from PIL import Image

from feeler.plotting.legends import find_covered, list_named
from feeler.plotting.look import DOUBLE, fix_layout, style, unjoin
from feeler.plotting.tensor import list_tensors
from feeler.plotting.words import find_unnamed, measure_words


class Pictures:
    """Draws into ``folder`` and, if ``vector``, into the PDF ``pages``, which is whole once it is
    closed.
    """

    def __init__(self, folder: Path, pages: Path, *, vector: bool) -> None:
        self._folder, self._path, self._vector = folder, pages, vector

    def draw(
        self, name: str, draw: Callable[[Figure], None], *, width: float | None, height: float
    ) -> tuple[tuple[float, float], list[dict[str, Any]], dict[str, Any]]:
        """Keep what ``draw(figure)`` draws; gives its size [inches], by default as wide as two
        columns, its tensors, and how its words can be read.
        """
        width = DOUBLE if width is None else width
        with style():
            figure = Figure(figsize=(width, height), layout="constrained")
            FigureCanvasAgg(figure)
            draw(figure)
            unjoin(figure)
            fix_layout(figure)
            panels = list_tensors(figure)
            _save_png(figure, self._folder / f"{name}.png")
            words = measure_words(figure) | {"unnamed": find_unnamed(figure)}
            words |= {"named": list_named(figure), "covered": find_covered(figure)}
            if self._vector:
                self._pages.savefig(figure)
        return (width, height), panels, words

    def close(self) -> None:
        """End the PDF, if any page was drawn."""
        if "_pages" in self.__dict__:
            with style():  # the fonts are embedded now
                self._pages.close()

    @cached_property
    def _pages(self) -> PdfPages:
        """One file for all figures: its fonts, which are slow to embed, are embedded once."""
        return PdfPages(self._path, metadata={"CreationDate": None})


def _save_png(figure: Figure, path: Path) -> None:
    """Without the layer for transparency, which every picture fills: a fifth smaller than what
    ``savefig`` writes.
    """
    figure.set_dpi(dpi := rcParams["savefig.dpi"])
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    Image.fromarray(np.asarray(canvas.buffer_rgba())[..., :3]).save(
        path, compress_level=6, dpi=(dpi, dpi)
    )
