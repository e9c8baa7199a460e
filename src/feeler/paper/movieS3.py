"""Movie S3: a wall comes nearer, each antenna's point of greatest curvature marked; and a body that follows a wall by it."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from feeler.errors import InvalidInput
from feeler.paper.context import Context
from feeler.paper.fig3 import load
from feeler.plotting.look import PROFILE_COLOURS, style
from feeler.plotting.movie import write_movie
from feeler.report.section import Section
from feeler.wall.following import follow
from feeler.wall.peak import find_peak
from feeler.wall.sliding import WallTouch


def write(touches: Mapping[str, WallTouch], path: Path, n_frames: int, fps: int = 25) -> Path:
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


def show(context: Context, section: Section) -> None:
    """The movie, and a body that follows a wall."""
    path = write(load(context).drives, section.folder / "movieS3_wall.mp4", context.effort.frames["S3"])
    section.movie(path, "A wall comes nearer, every profile. (Movie S3)")
    if context.effort.follows:
        _follow(context, section)


def _follow(context: Context, section: Section) -> None:
    rows: list[list[object]] = []
    for name, antenna in context.profiles.items():
        try:
            run = follow(antenna)
        except InvalidInput:  # its peak stays at the base hinge: that is the result
            rows.append([name, *["no map to steer by"] * 4])
            continue
        rows.append([name, run.error, run.estimate_error, run.nearest, "yes" if run.collided else "no"])
    section.heading("Following a wall by it")
    section.table(
        ["profile", "tracking error [mm]", "estimate error [mm]", "nearest [mm]", "collided"],
        rows,
        "A point body at 0.45 m/s along a wall with turns, steering by the estimated distance.",
    )
