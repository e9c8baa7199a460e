"""Movie S3: a wall comes nearer, each antenna's point of greatest curvature marked; and a body that
follows a wall by it.
"""

from collections.abc import Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput
from feeler.plotting import (
    FPS,
    OBJECT_COLOUR,
    PALETTE,
    MovingAntenna,
    choose_frames,
    say_clock,
    style,
    write_movie,
)
from feeler.report.page import Section
from feeler.wall import Course, WallTouch, find_peak
from feeler.wall.following import Run, Watch, follow
from paper.context import Context
from paper.fig3 import describe_posture, get_lead, load

_APPROACH_SLOWER, _FOLLOW_SLOWER = 15.0, 10.0  # times slower than life: 3 to 12 s of movie
_CURVATURE = "curvature beyond rest [1/mm]"
_SHOWN = (
    0.95  # [C] of bends lie within the colours; one sharp bend would leave all others white
)
_MARK: dict[str, Any] = {"marker": "o", "ls": "", "color": "#CC0000", "ms": 5, "zorder": 6}


def _write_approach(touches: Mapping[str, WallTouch], path: Path, fps: int = FPS) -> Path:
    """A wall comes nearer: one panel per antenna, from above, the body's base at the origin."""
    time = next(iter(touches.values())).motions[0].time
    frames = choose_frames(time, slower=_APPROACH_SLOWER, fps=fps)
    with style():
        figure = Figure(figsize=(7.2, 4.0), layout="constrained")
        axes = np.atleast_1d(figure.subplots(1, len(touches), sharey=True))
        norm = _scale(*(_find_curvature(touch) for touch in touches.values()))
        panels = [
            _Panel(name, touch, ax, norm)
            for (name, touch), ax in zip(touches.items(), axes, strict=True)
        ]
        axes[0].set_ylabel("y [mm]")
        figure.colorbar(
            panels[0].antenna.colours, ax=axes, label=_CURVATURE, shrink=0.8, extend="both"
        )
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center")
        away = next(iter(touches.values())).distance[0]
        words = [
            f"{say_clock(float(time[k]), _APPROACH_SLOWER)}; wall at {away[k]:.1f} mm"
            for k in frames
        ]
        clock = figure.suptitle(max(words, key=len))

        def draw(k: int) -> list[Artist]:
            clock.set_text(words[k])
            return [*(artist for panel in panels for artist in panel.draw(frames[k])), clock]

        return write_movie(path, figure, draw, len(frames), fps)


def _find_curvature(touch: WallTouch) -> np.ndarray:
    """Of each hinge beyond rest (time, segment) [1/mm]."""
    return (touch.motions[0].angle - touch.antenna.rest_angle) / touch.antenna.segment_length


def _scale(*curvature: np.ndarray) -> Normalize:
    bent = np.abs(np.concatenate([one.ravel() for one in curvature]))
    top = float(np.quantile(bent[bent > 0], _SHOWN))
    return Normalize(-top, top)


class _Panel:
    def __init__(self, name: str, touch: WallTouch, ax: Axes, norm: Normalize) -> None:
        self.touch, self.points, self.sign = touch, touch.points[0], touch.posture.sign
        bend = touch.motions[0].angle - touch.antenna.rest_angle
        self.curvature = _find_curvature(touch)
        self.peak = np.where(touch.contact[0], find_peak(touch.antenna, bend).position, np.nan)
        self.arc = np.append(touch.antenna.hinge_position, touch.antenna.length)
        self.antenna = MovingAntenna(touch.antenna, ax, norm, "RdBu_r")
        (self.dot,) = ax.plot([], [], label="greatest bend", **_MARK)
        reach = touch.antenna.length
        low, high = -0.6 * reach, 1.05 * reach
        self.wall = Rectangle((0, low), 100.0, high - low, color=OBJECT_COLOUR, lw=0)
        ax.add_patch(self.wall)
        ax.set(
            xlim=sorted((-0.3 * reach * self.sign, 0.68 * reach * self.sign)), ylim=(low, high)
        )
        ax.set(aspect="equal", title=name, xlabel="x [mm]")

    def draw(self, now: int) -> list[Artist]:
        """Artists changed to sample ``now``; the dot is hidden where nothing touches."""
        points, distance = self.points[now], self.touch.distance[0, now]
        self.wall.set_x(distance if self.sign > 0 else -distance - 100.0)
        bent = np.isfinite(self.peak[now])
        self.dot.set_data(
            *(
                [[np.interp(self.peak[now], self.arc, points[:, axis])] for axis in (0, 1)]
                if bent
                else ([], [])
            )
        )
        return [self.wall, *self.antenna.move(points, self.curvature[now]), self.dot]


def _write_following(
    antenna: Antenna, run: Run, angles: np.ndarray, path: Path, fps: int = FPS
) -> Path:
    """A body follows a wall: the scene from above, and the true and the felt distance as they come
    in.
    """
    course, time = Course(), run.time
    frames = choose_frames(time, slower=_FOLLOW_SLOWER, fps=fps)
    curvature = (angles - antenna.rest_angle) / antenna.segment_length
    with style():
        figure = Figure(figsize=(7.2, 4.0), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.4))
        behind = np.array([100.0, 0.0])
        left.add_patch(
            Polygon(
                np.vstack([course.line, course.line[::-1] + behind]), color=OBJECT_COLOUR, lw=0
            )
        )
        left.plot(*run.body[:, :2].T, lw=0.6, color="#999999", label="path of the body")
        shown = MovingAntenna(antenna, left, _scale(curvature), "RdBu_r")
        (body,) = left.plot([], [], "s", ms=5, color="#1b1f24", zorder=6, label="body")
        reach = 1.2 * antenna.length
        middle = (run.body[:, :2].min(axis=0) + run.body[:, :2].max(axis=0)) / 2
        high = np.ptp(run.body[:, 1]) / 2 + reach
        left.set(
            xlim=(middle[0] - 0.6 * high, middle[0] + 0.6 * high),
            ylim=(middle[1] - high, middle[1] + high),
        )
        left.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
        left.legend(loc="lower left")
        figure.colorbar(shown.colours, ax=left, label=_CURVATURE, shrink=0.8, extend="both")
        (true,) = right.plot([], [], color="#1b1f24", label="true distance")
        (felt,) = right.plot(
            [],
            [],
            ".",
            ms=2,
            color=PALETTE[0],
            label="felt, from the point of greatest curvature",
        )
        right.axhline(run.target, ls="--", lw=0.8, color="#59636e", label="to be kept")
        both = np.concatenate([run.distance, run.estimate])
        right.set(
            xlim=(0, time[-1]),
            ylim=(0, 1.35 * np.nanmax(both)),
            xlabel="time [ms]",
            ylabel="distance of the wall [mm]",
        )
        right.legend(loc="upper left")
        clock = right.set_title(say_clock(float(time[-1]), _FOLLOW_SLOWER))

        def draw(k: int) -> list[Artist]:
            now = frames[k]
            x, y, heading = run.body[now]
            points = (
                antenna.shape(angles[now], base_angle=heading + get_lead().base_angle)
                + run.body[now, :2]
            )
            body.set_data([x], [y])
            true.set_data(time[: now + 1], run.distance[: now + 1])
            felt.set_data(time[: now + 1], run.estimate[: now + 1])
            clock.set_text(say_clock(float(time[now]), _FOLLOW_SLOWER))
            return [*shown.move(points, curvature[now]), body, true, felt, clock]

        return write_movie(path, figure, draw, len(frames), fps)


def show(context: Context, section: Section) -> None:
    """The movies, and how well bodies follow."""
    path = _write_approach(
        load(context).drives, section.folder / "movieS3_wall.mp4", context.effort.fps
    )
    section.movie(
        path,
        f"A wall (grey) comes nearer to each antenna, {_APPROACH_SLOWER:g} times slower than life;"
        f" colours: curvature beyond rest, on one scale, which {100 * (1 - _SHOWN):.0f} % of bends"
        " exceed; red: the point of greatest bend while in contact. (Movie S3)",
    )
    if context.effort.followers != 0:
        _follow(context, section)


def _keep(angles: list[np.ndarray]) -> Watch:
    return lambda _, angle: angles.append(angle.copy())


def _follow(context: Context, section: Section) -> None:
    rows: list[list[object]] = []
    section.heading("Following a wall by it")
    shown = False
    for name, antenna in islice(context.profiles.items(), context.effort.followers):
        angles: list[np.ndarray] = []
        try:
            run = follow(antenna, posture=get_lead(), watch=_keep(angles))
        except InvalidInput:  # its peak stays at the base hinge: that is the result
            rows.append([name, *["no map to steer by"] * 4])
            continue
        rows.append(
            [name, run.error, run.estimate_error, run.nearest, "yes" if run.collided else "no"]
        )
        if not shown:
            shown = True
            path = section.folder / "movieS3_following.mp4"
            bent = get_lead().bend(antenna)
            _write_following(
                bent, run, np.array([angles[0], *angles]), path, context.effort.fps
            )
            section.movie(
                path,
                "A point body runs at 0.45 m/s along a wall with a turn and steers by where the"
                f" antenna '{name}' bends most, {_FOLLOW_SLOWER:g} times slower than life; colours:"
                " curvature beyond rest. (Movie S3)",
            )
    section.table(
        ["profile", "tracking error [mm]", "estimate error [mm]", "nearest [mm]", "collided"],
        rows,
        "A point body at 0.45 m/s along a wall with turns, steering by the estimated distance, in"
        f" the leading set-up ({describe_posture(get_lead())}). With friction it sticks and slips,"
        " so that a rounding can lead to another run, such as that of another kind of processor.",
    )
