"""Small pictures for notebooks, as SVG text: no plotting library is loaded for them."""

from collections.abc import Sequence
from html import escape

import numpy as np

INK, OBJECT = "#5b3a1e", "#009E73"
_SIZE = 160  # pixels


def make_picture(
    words: str, lines: Sequence[tuple[np.ndarray, float]], polygons: Sequence[np.ndarray] = ()
) -> str:
    """HTML: a line of words over a picture of lines (point, 2) with their widths, and of filled
    polygons [mm], y up.
    """
    low, high = _bound([points for points, _ in lines], list(polygons))
    size = max(*(high - low), 1e-9)
    low, high = low - 0.05 * size, high + 0.05 * size
    width, height = high - low
    inside = [f'<polygon points="{_write(rim, low, high)}" fill="{OBJECT}"/>' for rim in polygons]
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


def _bound(*groups: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    points = np.concatenate([points for group in groups for points in group])
    return points.min(axis=0), points.max(axis=0)


def _write(points: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    return " ".join(f"{x - low[0]:.5g},{high[1] - y:.5g}" for x, y in points)
