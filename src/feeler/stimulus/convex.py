"""Convex parts of a polygon, because contact is computed between convex bodies."""

from typing import Annotated

import numpy as np

from feeler.records.checked import checked


def measure_area(corners: np.ndarray) -> float:
    """Area of a polygon (corner, 2), positive where the corners run counter-clockwise."""
    x, y = np.asarray(corners).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def is_convex(corners: np.ndarray, slack: float = 0.0) -> bool:
    """Whether a counter-clockwise polygon turns left at every corner, or right by no more than
    ``slack`` (an area).
    """
    edge = np.roll(corners, -1, axis=0) - corners
    before = np.roll(edge, 1, axis=0)
    return bool(np.all(before[:, 0] * edge[:, 1] - before[:, 1] * edge[:, 0] >= -slack))


def trace_rim(corners: np.ndarray, rounding: float, n_arc: int = 16) -> np.ndarray:
    """Points (point, 2) around a convex part grown by ``rounding``: ``n_arc`` to each corner's arc,
    for drawing.
    """
    if rounding == 0:
        return corners
    turn = np.linspace(0.0, 2 * np.pi, n_arc * max(len(corners), 4), endpoint=False)
    outward = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return corners[np.argmax(outward @ corners.T, axis=1)] + rounding * outward


@checked
def split_convex(corners: Annotated[np.ndarray, "corner 2"]) -> list[np.ndarray]:
    """Convex polygons (corner, 2) that together fill a simple counter-clockwise polygon.

    A convex polygon is its own single part; any other is cut into triangles by ear clipping and
    neighbouring parts are merged while they stay convex (Hertel & Mehlhorn 1983: at most four times
    the fewest parts).
    """
    corners = np.asarray(corners, dtype=float)
    if is_convex(corners):
        return [corners]
    return [corners[part] for part in _merge(corners, _clip_ears(corners))]


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def _clip_ears(corners: np.ndarray) -> list[tuple[int, ...]]:
    ring, here = list(range(len(corners))), 0
    triangles: list[tuple[int, ...]] = []
    while len(ring) > 3:
        around = (
            *range(here, len(ring)),
            *range(here),
        )  # go on where the last ear was: its neighbours are often ears
        ear = next((i for i in around if _is_ear(corners, ring, i)), None)
        if ear is None:  # only corners on straight edges are left: drop the flattest
            ear = int(
                np.argmin([abs(_turn(*corners[_around(ring, i)])) for i in range(len(ring))])
            )
        else:
            triangles.append(tuple(_around(ring, ear)))
        del ring[ear]
        here = min(ear, len(ring) - 1)
    return [*triangles, tuple(ring)]


def _around(ring: list[int], i: int) -> list[int]:
    return [ring[i - 1], ring[i], ring[(i + 1) % len(ring)]]


def _is_ear(corners: np.ndarray, ring: list[int], i: int) -> bool:
    triangle = _around(ring, i)
    a, b, c = corners[triangle]
    if _turn(a, b, c) <= 0:
        return False
    x, y = corners[ring].T
    inside = np.ones(len(ring), dtype=bool)
    for p, q in ((a, b), (b, c), (c, a)):
        inside &= (q[0] - p[0]) * (y - p[1]) >= (q[1] - p[1]) * (x - p[0])
    inside[[i - 1, i, (i + 1) % len(ring)]] = False  # its own corners
    return not inside.any()


def _merge(corners: np.ndarray, triangles: list[tuple[int, ...]]) -> list[list[int]]:
    """Take out each inner edge between two parts that are convex together, in one pass over the
    edges.
    """
    parts = {number: list(triangle) for number, triangle in enumerate(triangles)}
    owner = {edge: number for number, ring in parts.items() for edge in _edges(ring)}
    for a, b in list(owner):
        first, second = owner.get((a, b)), owner.get((b, a))
        if first is None or second is None or first == second:
            continue
        joined = _join(parts[first], parts[second], a, b)
        if is_convex(corners[joined]):
            parts[first] = joined
            owner |= dict.fromkeys(_edges(parts.pop(second)), first)
            del owner[a, b], owner[b, a]
    return list(parts.values())


def _edges(ring: list[int]) -> list[tuple[int, int]]:
    return list(zip(ring, ring[1:] + ring[:1], strict=True))


def _join(first: list[int], second: list[int], a: int, b: int) -> list[int]:
    """Two rings without their common edge, which runs a → b in the first."""
    i, j = first.index(b), second.index(a)
    return first[i:] + first[:i] + (second[j:] + second[:j])[1:-1]
