"""A body that follows a wall, sent while it runs."""

from threading import Event
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.studio.hand import Say
from feeler.studio.study import heed
from feeler.studio.touching import describe_antenna
from feeler.wall import FOLLOWING, DistanceMap, calibrate, follow, make_turn

_PIECE = 20  # periods of 1 ms
_FACES = (120.0, 150.0)  # [C] mm before and after the turn


def run_along_wall(antenna: Antenna, turn: float, speed: float, say: Say, stop: Event) -> None:
    """Calibrate, then run past one turn of ``turn`` degrees; the map is kept for the next run."""
    course = make_turn(turn, _FACES)
    corners = course.line.tolist()
    say(
        {
            "part": "begin",
            "antenna": describe_antenna(antenna),
            "wall": corners,
            "heading": FOLLOWING.base_angle,
        }
    )
    rows: list[tuple[np.ndarray, np.ndarray]] = []
    sent = 0

    def watch(body: np.ndarray, angle: np.ndarray) -> None:
        nonlocal sent
        heed(stop)
        rows.append((body, angle))
        if len(rows) == _PIECE:
            say({"part": "piece", "first": sent}, **_take(rows))
            sent += _PIECE

    known = _find_map(antenna, speed, stop)
    run = follow(antenna, course, speed=speed, distance_map=known, watch=watch)
    if rows:
        say({"part": "piece", "first": sent}, **_take(rows))
    end: dict[str, Any] = {
        "error": run.error,
        "collided": run.collided,
        "target": run.target,
        "nearest": run.nearest,
    }
    say({"part": "end", **end}, distance=run.distance, estimate=run.estimate)


def _take(rows: list[tuple[np.ndarray, np.ndarray]]) -> dict[str, np.ndarray]:
    taken = {
        "body": np.array([body for body, _ in rows]),
        "angle": np.array([angle for _, angle in rows]),
    }
    rows.clear()
    return taken


_maps: dict[tuple[Antenna, float], DistanceMap] = {}


def _find_map(antenna: Antenna, speed: float, stop: Event) -> DistanceMap:
    def watch(body: np.ndarray, angle: np.ndarray) -> None:
        heed(stop)

    if (antenna, speed) not in _maps:
        if len(_maps) >= 32:
            _maps.clear()
        _maps[antenna, speed] = calibrate(antenna, speed=speed, watch=watch)
    return _maps[antenna, speed]
