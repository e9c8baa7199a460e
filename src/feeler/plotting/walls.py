"""Pictures and movies of antennae beside a wall, and of a body that follows one."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Polygon, Rectangle

from feeler.antenna.segments import Antenna
from feeler.plotting.antennas import (
    FPS,
    OBJECT_COLOUR,
    MovingAntenna,
    choose_frames,
    say_clock,
    write_movie,
)
from feeler.plotting.style import PALETTE, style
from feeler.wall.approach import Approach, WallTouch, find_peak, find_sweep_peak
from feeler.wall.following import Run

APPROACH_SLOWER, FOLLOW_SLOWER = 15.0, 10.0  # times slower than life: 3 to 12 s of movie
_STEPS_FPS = 6  # equilibria a second, which have no time
_CURVATURE = "curvature beyond rest [1/mm]"
# [C] of bends lie within the colours; one sharp bend would leave all others white
SHOWN = 0.95
_MARK: dict[str, Any] = {"marker": "o", "ls": "", "color": "#CC0000", "ms": 5, "zorder": 6}


def write_drives_movie(touches: Mapping[str, WallTouch], path: Path, fps: int = FPS) -> Path:
    """Write the movie of a wall that comes nearer: one panel per antenna, from above, the body's
    base at the origin.
    """
    time = next(iter(touches.values())).motions[0].time
    frames = choose_frames(time, slower=APPROACH_SLOWER, fps=fps)
    away = next(iter(touches.values())).distance[0]
    words = [
        f"{say_clock(float(time[k]), APPROACH_SLOWER)}; wall at {away[k]:.1f} mm"
        for k in frames
    ]
    panels = {name: _show_drive(touch) for name, touch in touches.items()}
    return _write_panels(panels, path, frames, words, fps)


def write_sweeps_movie(sweeps: Mapping[str, Approach], path: Path) -> Path:
    """Write the equilibria of sweeps of as many steps, one after the other, as a movie."""
    panels = {name: _show_sweep(sweep) for name, sweep in sweeps.items()}
    n = min(len(one["away"]) for one in panels.values())
    words = [f"step {k + 1} of {n}: the wall comes nearer, in equilibrium" for k in range(n)]
    return _write_panels(panels, path, range(n), words, _STEPS_FPS)


def _write_panels(
    beside: Mapping[str, dict[str, Any]],
    path: Path,
    frames: Sequence[int] | np.ndarray,
    words: Sequence[str],
    fps: int,
) -> Path:
    with style():
        figure = Figure(figsize=(7.2, 4.0), layout="constrained")
        axes = np.atleast_1d(figure.subplots(1, len(beside)))
        norm = _scale(*(one["bend"] / one["antenna"].segment_length for one in beside.values()))
        moves = []
        for (name, one), ax in zip(beside.items(), axes, strict=True):
            colours, move = _make_panel(ax, norm, **one)
            moves.append(move)
            ax.set_title(name)
        axes[0].set_ylabel("y [mm]")
        figure.colorbar(colours, ax=axes, label=_CURVATURE, shrink=0.8, extend="both")
        figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center")
        clock = figure.suptitle(max(words, key=len))

        def draw(k: int) -> list[Artist]:
            clock.set_text(words[k])
            return [*(artist for move in moves for artist in move(frames[k])), clock]

        return write_movie(path, figure, draw, len(frames), fps)


def _scale(*curvature: np.ndarray) -> Normalize:
    bent = np.abs(np.concatenate([one.ravel() for one in curvature]))
    top = float(np.quantile(bent[bent > 0], SHOWN)) if bent.any() else 1.0
    return Normalize(-top, top)


def _show_drive(touch: WallTouch) -> dict[str, Any]:
    """What a panel shows of a wall that comes nearer, by frame."""
    antenna, motion = touch.antenna, touch.motions[0]
    bend = motion.angle - antenna.rest_angle
    return {
        "antenna": antenna,
        "sign": touch.posture.sign,
        "points": touch.points[0],
        "bend": bend,
        "peak": np.where(touch.contact[0], find_peak(antenna, bend).position, np.nan),
        "away": touch.distance[0],
    }


def _show_sweep(sweep: Approach) -> dict[str, Any]:
    """What a panel shows of equilibria, by frame."""
    return {
        "antenna": sweep.antenna,
        "sign": sweep.posture.sign,
        "points": sweep.points,
        "bend": sweep.bend,
        "peak": find_sweep_peak(sweep).position,
        "away": sweep.distance,
    }


def _make_panel(
    ax: Axes,
    norm: Normalize,
    *,
    antenna: Antenna,
    sign: float,
    points: np.ndarray,
    bend: np.ndarray,
    peak: np.ndarray,
    away: np.ndarray,
) -> tuple[Any, Callable[[int], list[Artist]]]:
    """The colours of a panel, for a colour bar, and what moves it to a sample: it gives the artists
    that changed; the dot is hidden where nothing touches.
    """
    curvature = bend / antenna.segment_length
    arc, reach = np.append(antenna.hinge_position, antenna.length), antenna.length
    drawn = MovingAntenna(antenna, ax, norm, "RdBu_r")
    (dot,) = ax.plot([], [], label="greatest bend", **_MARK)
    low, high = -0.6 * reach, 1.05 * reach
    wall = Rectangle((0, low), 2.5 * reach, high - low, color=OBJECT_COLOUR, lw=0)
    ax.add_patch(wall)
    ax.set(xlim=sorted((-0.3 * reach * sign, 0.68 * reach * sign)), ylim=(low, high))
    ax.set(aspect="equal", xlabel="x [mm]")

    def move(now: int) -> list[Artist]:
        wall.set_x(away[now] if sign > 0 else -away[now] - wall.get_width())
        shown = [[np.interp(peak[now], arc, points[now][:, axis])] for axis in (0, 1)]
        dot.set_data(*(shown if np.isfinite(peak[now]) else ([], [])))
        return [wall, *drawn.move(points[now], curvature[now]), dot]

    return drawn.colours, move


# A body that follows a wall.


def _show_course(run: Run, ax: Axes) -> None:
    """The wall, and the body's path beside it."""
    assert run.course is not None and run.antenna is not None
    line, reach = run.course.line, run.antenna.length
    behind = np.array([2.5 * reach, 0.0])
    ax.add_patch(Polygon(np.vstack([line, line[::-1] + behind]), color=OBJECT_COLOUR, lw=0))
    ax.plot(*run.body[:, :2].T, lw=0.6, color="#999999", label="path of the body")
    middle = (run.body[:, :2].min(axis=0) + run.body[:, :2].max(axis=0)) / 2
    high = np.ptp(run.body[:, 1]) / 2 + 1.2 * reach
    ax.set(
        xlim=(middle[0] - 0.6 * high, middle[0] + 0.6 * high),
        ylim=(middle[1] - high, middle[1] + high),
    )
    ax.set(aspect="equal", xlabel="x [mm]", ylabel="y [mm]")


def _frame_distances(run: Run, ax: Axes) -> None:
    """The frame in which distances are drawn against time."""
    ax.axhline(run.target, ls="--", lw=0.8, color="#59636e", label="to be kept")
    both = np.concatenate([run.distance, run.estimate])
    ax.set(xlim=(0, run.time[-1]), ylim=(0, 1.35 * np.nanmax(both)))
    ax.set(xlabel="time [ms]", ylabel="distance of the wall [mm]")


_TRUE: dict[str, Any] = {"color": "#1b1f24", "label": "true distance"}
_FELT: dict[str, Any] = {"marker": ".", "ls": "", "ms": 2, "color": PALETTE[0]} | {
    "label": "felt, from the point of greatest curvature"
}


def plot_run(run: Run, figure: Figure, n_shown: int = 8) -> None:
    """Draw a run: from above with ``n_shown`` postures, and the true and the felt distance."""
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.4))
    _show_course(run, left)
    assert run.antenna is not None
    for now in np.linspace(0, len(run.time) - 1, n_shown).round().astype(int):
        left.plot(*_find_points(run, now).T, lw=0.9, color=PALETTE[0])
        left.plot(*run.body[now, :2], "s", ms=3, color="#1b1f24")
    _frame_distances(run, right)
    right.plot(run.time, run.distance, **_TRUE)
    right.plot(run.time, run.estimate, **_FELT)
    right.legend(loc="upper left")


def _find_points(run: Run, now: int) -> np.ndarray:
    """Base, hinges and tip (joint, 2) [mm] in a sample of a run."""
    assert run.angle is not None and run.antenna is not None
    heading = run.body[now, 2] + run.posture.base_angle
    return run.antenna.shape(run.angle[now], base_angle=heading) + run.body[now, :2]


def write_run_movie(run: Run, path: Path, fps: int = FPS) -> Path:
    """Write the movie of a run: from above, and the true and the felt distance as they come in."""
    assert run.angle is not None and run.antenna is not None
    frames = choose_frames(run.time, slower=FOLLOW_SLOWER, fps=fps)
    curvature = (run.angle - run.antenna.rest_angle) / run.antenna.segment_length
    with style():
        figure = Figure(figsize=(7.2, 4.0), layout="constrained")
        left, right = figure.subplots(1, 2, width_ratios=(1, 1.4))
        _show_course(run, left)
        shown = MovingAntenna(run.antenna, left, _scale(curvature), "RdBu_r")
        (body,) = left.plot([], [], "s", ms=5, color="#1b1f24", zorder=6, label="body")
        left.legend(loc="lower left")
        figure.colorbar(shown.colours, ax=left, label=_CURVATURE, shrink=0.8, extend="both")
        (true,) = right.plot([], [], **_TRUE)
        (felt,) = right.plot([], [], **_FELT)
        _frame_distances(run, right)
        right.legend(loc="upper left")
        clock = right.set_title(say_clock(float(run.time[-1]), FOLLOW_SLOWER))

        def draw(k: int) -> list[Artist]:
            now = frames[k]
            body.set_data(run.body[now : now + 1, 0], run.body[now : now + 1, 1])
            true.set_data(run.time[: now + 1], run.distance[: now + 1])
            felt.set_data(run.time[: now + 1], run.estimate[: now + 1])
            clock.set_text(say_clock(float(run.time[now]), FOLLOW_SLOWER))
            return [
                *shown.move(_find_points(run, now), curvature[now]),
                body,
                true,
                felt,
                clock,
            ]

        return write_movie(path, figure, draw, len(frames), fps)
