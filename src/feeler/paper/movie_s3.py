"""Movie S3: a wall comes nearer and each antenna bends, its point of greatest curvature marked."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler.antenna.antenna import Antenna
from feeler.plotting.movie import write_movie
from feeler.plotting.style import PROFILE_COLOURS, style
from feeler.wall.peak import find_peak
from feeler.wall.posture import Posture
from feeler.wall.sliding import WallTouch, drive

FRAMES = 84
SPEED = 0.06  # mm/ms; [P] the slow exploration speed


def compute(
    antennas: Mapping[str, Antenna], *, posture: Posture | None = None, **options: object
) -> dict[str, WallTouch]:
    """The continuous approach of every antenna; ``options`` go to :func:`feeler.wall.drive`."""
    return {name: drive(antenna, posture, **({"speed": SPEED} | options)) for name, antenna in antennas.items()}


def write(touches: Mapping[str, WallTouch], path: Path, n_frames: int = FRAMES, fps: int = 25) -> Path:
    """Write the movie: one panel per antenna, seen from above, the body's base at the origin."""
    with style():
        figure = Figure(figsize=(1.8 * len(touches), 3.2), layout="constrained")
        panels = [
            _Panel(name, touch, ax)
            for (name, touch), ax in zip(touches.items(), np.atleast_1d(figure.subplots(1, len(touches))), strict=True)
        ]
        samples = len(next(iter(touches.values())).motions[0].time)
        frames = np.unique(np.linspace(0, samples - 1, min(n_frames, samples)).astype(int))

        def draw(k: int) -> list:
            return [artist for panel in panels for artist in panel.draw(frames[k])]

        return write_movie(path, figure, draw, len(frames), fps)


class _Panel:
    def __init__(self, name: str, touch: WallTouch, ax) -> None:
        self.touch, self.points = touch, touch.points[0]
        bend = touch.motions[0].angle - touch.antenna.rest_angle
        self.peak = np.where(touch.contact[0], find_peak(touch.antenna, bend).position, np.nan)
        self.arc = np.append(touch.antenna.hinge_position, touch.antenna.length)
        (self.line,) = ax.plot([], [], color=PROFILE_COLOURS.get(name, "#5b3a1e"), lw=1.5)
        (self.dot,) = ax.plot([], [], "o", color="#CC0000", ms=5)
        (self.wall,) = ax.plot([], [], color="#888888", lw=3)
        self.clock = ax.text(0.04, 0.02, "", transform=ax.transAxes, fontsize=7)
        reach = touch.antenna.length
        side = sorted((-0.25 * reach * touch.posture.sign, 0.7 * reach * touch.posture.sign))
        ax.set(xlim=side, ylim=(-0.6 * reach, 1.05 * reach), aspect="equal", title=name, xlabel="x [mm]")
        self.span = ax.get_ylim()

    def draw(self, now: int) -> list:
        """Artists changed to sample ``now``; the dot is hidden where nothing touches."""
        points, touch = self.points[now], self.touch
        distance = touch.distance[0, now]
        self.line.set_data(*points.T)
        self.wall.set_data([touch.posture.sign * distance] * 2, self.span)
        bent = np.isfinite(self.peak[now])
        place = [[np.interp(self.peak[now], self.arc, points[:, axis])] for axis in (0, 1)] if bent else ([], [])
        self.dot.set_data(*place)
        self.clock.set_text(f"{distance:.1f} mm")
        return [self.wall, self.line, self.dot, self.clock]
