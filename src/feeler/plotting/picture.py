"""A figure that a notebook shows by itself, whether or not pyplot is there."""

import io

from matplotlib.figure import Figure

_DPI = 110


class Picture(Figure):
    """A matplotlib Figure that is shown where it is the last line of a notebook's cell."""

    def _repr_png_(self) -> bytes:
        kept = io.BytesIO()
        self.savefig(kept, format="png", dpi=_DPI)
        return kept.getvalue()
