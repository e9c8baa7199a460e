"""Convex parts of a polygon, because contact is computed between convex bodies."""

import numpy as np


def split_convex(corners: np.ndarray) -> list[np.ndarray]:
    """Convex polygons (corner, 2) that together fill a simple counter-clockwise polygon.

    A convex polygon is its own single part; any other is cut into triangles by ear clipping and neighbouring parts are
    merged while they stay convex (Hertel & Mehlhorn 1983: at most four times the fewest parts).
    """
    corners = np.asarray(corners, dtype=float)
    if _is_convex(corners):
        return [corners]
    parts = [list(triangle) for triangle in _clip_ears(corners)]
    while _merge_one(corners, parts):
        pass
    return [corners[part] for part in parts]


def _turn(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    return float((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]))


def _is_convex(corners: np.ndarray) -> bool:
    before, after = np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0)
    return all(_turn(a, b, c) >= 0 for a, b, c in zip(before, corners, after, strict=True))


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
            if joined and _is_convex(corners[joined]):
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
