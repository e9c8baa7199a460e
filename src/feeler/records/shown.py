"""What notebooks show of a result: a picture above a table of its fields, made when it is shown."""

import base64
from collections.abc import Sequence
from dataclasses import fields, is_dataclass
from html import escape
from pkgutil import resolve_name
from typing import Any, ClassVar

import numpy as np

_MAX_LISTED = 8  # numbers that are written out
_PICTURES = (
    "feeler.plotting.results"  # named, not imported: who only computes needs no pictures
)
INK, OBJECT = "#5b3a1e", "#8C9196"
_SIZE = 160  # pixels


class Shown:
    """A result that shows itself in a notebook; ``plot`` draws it anywhere.

    ``DRAWN`` is the function that draws it, ``draw(result)`` gives a figure; empty for no picture.
    """

    DRAWN: ClassVar[str] = ""

    def plot(self) -> Any:
        """A picture of the result: a matplotlib Figure, which notebooks show."""
        return resolve_name(f"{_PICTURES}:{self.DRAWN}")(self)

    def _repr_html_(self) -> str:
        rows = [(one.name, getattr(self, one.name)) for one in fields(self)]  # type: ignore[arg-type]
        return show_html(type(self).__name__, rows, self.plot() if self.DRAWN else None)


def show_html(title: str, rows: list[tuple[str, Any]], figure: Any = None) -> str:
    """HTML: a title, a picture, and a table of names and values."""
    cells = "".join(
        f"<tr><td><b>{escape(name)}</b></td><td>{escape(tell_value(value))}</td></tr>"
        for name, value in rows
    )
    picture = ""
    if figure is not None:
        data = base64.b64encode(figure._repr_png_()).decode()
        picture = f'<img alt="{escape(title)}" src="data:image/png;base64,{data}"/>'
    return f"<div><b>{escape(title)}</b><br/>{picture}<table>{cells}</table></div>"


def tell_value(value: Any) -> str:
    """A value in one line: few numbers as they are, many as their shape and range."""
    if isinstance(value, float | np.floating):
        return f"{value:.4g}"
    if isinstance(value, np.ndarray) and value.dtype.kind in "fiu" and value.size:
        if value.ndim == 1 and value.size <= _MAX_LISTED:
            return ", ".join(f"{number:.4g}" for number in value)
        finite = value[np.isfinite(value)]
        span = f"{finite.min():.4g} … {finite.max():.4g}" if finite.size else "no finite number"
        return f"{' × '.join(map(str, value.shape))}, {span}"
    if isinstance(value, tuple | list) and len(value) > _MAX_LISTED:
        return f"{len(value)} of {type(value[0]).__name__}"
    if isinstance(value, tuple | list):
        return ", ".join(map(tell_value, value))
    if is_dataclass(value) and not isinstance(value, type):
        return f"{type(value).__name__} of {', '.join(one.name for one in fields(value))}"
    text = " ".join(str(value).split())
    return text if len(text) <= 120 else f"{text[:110]} …"


def make_picture(
    words: str, lines: Sequence[tuple[np.ndarray, float]], polygons: Sequence[np.ndarray] = ()
) -> str:
    """HTML: a line of words over a picture of lines (point, 2) with their widths, and of filled
    polygons [mm], y up.
    """
    points = np.concatenate([*(points for points, _ in lines), *polygons])
    low, high = points.min(axis=0), points.max(axis=0)
    size = max(*(high - low), 1e-9)
    low, high = low - 0.05 * size, high + 0.05 * size
    width, height = high - low
    inside = [
        f'<polygon points="{_write(rim, low, high)}" fill="{OBJECT}"/>' for rim in polygons
    ]
    for points, thick in lines:
        look = (
            f'fill="none" stroke="{INK}" stroke-linecap="round"'
            f' stroke-width="{max(thick, 0.01 * size):.4g}"'
        )
        inside.append(f'<polyline points="{_write(points, low, high)}" {look}/>')
    shown = (
        f'width="{_SIZE * width / max(width, height):.0f}"'
        f' height="{_SIZE * height / max(width, height):.0f}"'
    )
    box = f'viewBox="0 0 {width:.6g} {height:.6g}"'
    return (
        f'<div>{escape(words)}<br/><svg xmlns="http://www.w3.org/2000/svg" {shown}'
        f" {box}>{''.join(inside)}</svg></div>"
    )


def _write(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    return " ".join(f"{x - low[0]:.5g},{high[1] - y:.5g}" for x, y in points)
