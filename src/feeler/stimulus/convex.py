"""Convex parts of a polygon, because contact is computed between convex bodies."""

import numpy as np


def measure_area(corners: np.ndarray) -> float:
    """Area of a polygon (corner, 2), positive where the corners run counter-clockwise."""
    x, y = np.asarray(corners).T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def is_convex(corners: np.ndarray, slack: float = 0.0) -> bool:
    """Whether a counter-clockwise polygon turns left at every corner, or right by no more than ``slack`` (an area)."""
    edge = np.roll(corners, -1, axis=0) - corners
    before = np.roll(edge, 1, axis=0)
    return bool(np.all(before[:, 0] * edge[:, 1] - before[:, 1] * edge[:, 0] >= -slack))


def trace_rim(corners: np.ndarray, rounding: float, n_arc: int = 16) -> np.ndarray:
    """Points (point, 2) around a convex part grown by ``rounding``: ``n_arc`` to each corner's arc, for drawing."""
    if rounding == 0:
        return corners
    turn = np.linspace(0.0, 2 * np.pi, n_arc * max(len(corners), 4), endpoint=False)
    outward = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    return corners[np.argmax(outward @ corners.T, axis=1)] + rounding * outward


def split_convex(corners: np.ndarray) -> list[np.ndarray]:
    """Convex polygons (corner, 2) that together fill a simple counter-clockwise polygon.

    A convex polygon is its own single part; any other is cut into triangles by ear clipping and neighbouring parts are
    merged while they stay convex (Hertel & Mehlhorn 1983: at most four times the fewest parts).
    """
    corners = np.asarray(corners, dtype=float)
    if is_convex(corners):
        return [corners]
    parts = [list(triangle) for triangle in _clip_ears(corners)]
    while _merge_one(corners, parts):
        pass
    return [corners[part] for part in parts]


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def _clip_ears(corners: np.ndarray) -> list[tuple[int, int, int]]:
    ring, triangles = list(range(len(corners))), []
    while len(ring) > 3:
        ear = next((i for i in range(len(ring)) if _is_ear(corners, ring, i)), None)
        if ear is None:  # only corners on straight edges are left: drop the flattest
            ear = int(np.argmin([abs(_turn(*corners[_around(ring, i)])) for i in range(len(ring))]))
        else:
            triangles.append(tuple(_around(ring, ear)))
        del ring[ear]
    return [*triangles, tuple(ring)]


def _around(ring: list[int], i: int) -> list[int]:
    return [ring[i - 1], ring[i], ring[(i + 1) % len(ring)]]


def _is_ear(corners: np.ndarray, ring: list[int], i: int) -> bool:
    triangle = _around(ring, i)
    a, b, c = corners[triangle]
    if _turn(a, b, c) <= 0:
        return False
    others = corners[[j for j in ring if j not in triangle]]
    return not any(_turn(a, b, p) >= 0 and _turn(b, c, p) >= 0 and _turn(c, a, p) >= 0 for p in others)


def _merge_one(corners: np.ndarray, parts: list[list[int]]) -> bool:
    """Join the first two parts that share an edge and are convex together; whether there were any."""
    for i, first in enumerate(parts):
        for j in range(i + 1, len(parts)):
            joined = _join(first, parts[j])
            if joined and is_convex(corners[joined]):
                parts[i] = joined
                del parts[j]
                return True
    return False


def _join(first: list[int], second: list[int]) -> list[int] | None:
    for k, (a, b) in enumerate(zip(first, first[1:] + first[:1], strict=True)):
        if b in second and second[(second.index(b) + 1) % len(second)] == a:
            start = second.index(a)
            ring = second[start:] + second[:start]  # a … b
            return first[: k + 1] + ring[1:-1] + first[k + 1 :]
    return None
