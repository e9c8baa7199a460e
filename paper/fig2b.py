"""Fig. 2B and Movie S1: the tip after a step and during an impulse, simulated against the digitised
traces.
"""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure
from matplotlib.patches import Circle

from feeler.analysis import measure_free_response
from feeler.antenna.segments import Antenna
from feeler.experiments.mechanics import RADIUS, hit, release
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.plotting import (
    FPS,
    PALETTE,
    SLOWER,
    MovingAntenna,
    choose_frames,
    say_clock,
    style,
    write_movie,
)
from feeler.plotting.style import mark_panels
from feeler.presets import cockroach
from feeler.report.page import Section
from feeler.tensors.transforms import in_unit
from paper.context import Context

# Digitised from the first author's poster [A]: time [ms] from the first opposite peak (step) or the
# largest deflection (impulse), displacement relative to the largest. The animals' own step trace
# leaves −1 at −27 ms, the simulated one at −19 ms. Bands of ±1 SD could not be read off.
STEP_TRACE = np.array(
    [[-19.0, -1.0], [-9.0, 0.0], [0.0, 0.41], [19.0, 0.0], [29.0, -0.06], [46.0, 0.0]]
)
_STEP_ANIMALS_START = -27.0
_IMPULSE_TRACE = np.array([[-22.0, 0.0], [0.0, -1.0], [22.5, 0.0], [30.0, 0.07]])
# [C] mm, mm/ms: not published; chosen after seeing how long the trace's contact lasts
_LEVER, _LEVER_SPEED = 20.0, 0.45
_STEP_SPAN, _IMPULSE_SPAN = 100.0, 60.0  # ms


def compute(
    antenna: Antenna | None = None,
    *,
    engine: str = DEFAULT_ENGINE,
    sample_interval: float = 0.2,
    **options: Any,
) -> SimpleNamespace:
    """Simulate both experiments on ``antenna`` (default: the cockroach's).

    Returns
    -------
    SimpleNamespace
        ``step`` over ``step_time``, ``impulse`` over ``impulse_time`` and ``slow`` over
        ``slow_time``: displacements relative to the largest over time [ms] since the turning point
        that the traces share; ``slow`` is the slow impulse on a straight path, which calibration
        uses. ``free`` (:class:`~feeler.analysis.FreeResponse`) of the step, and ``motion``
        (a Dataset of :func:`~feeler.experiments.mechanics.hit`) with the lever, for Movie S1.
    """
    antenna = cockroach() if antenna is None else antenna
    options |= {"engine": engine, "sample_interval": sample_interval}
    released = release(antenna, duration=2 * _STEP_SPAN, **options)
    time = in_unit(released["time"], "ms").values
    tip = in_unit(released["tip"], "mm").values[0, :, 0]
    free = measure_free_response(time, tip)
    step_time, step = time - (free.peak_time or 0.0), -tip / tip[0]
    swung = hit(
        antenna, lever=_LEVER, speed=_LEVER_SPEED, duration=2 * _IMPULSE_SPAN, **options
    )
    slow = hit(antenna, **options)
    impulse_time, impulse = _scale(swung)
    slow_time, slow_impulse = _scale(slow)
    return SimpleNamespace(
        step_time=step_time,
        step=step,
        free=free,
        impulse_time=impulse_time,
        impulse=impulse,
        slow_time=slow_time,
        slow=slow_impulse,
        motion=swung,
    )


def _scale(impulse: xr.Dataset) -> tuple[np.ndarray, np.ndarray]:
    """Time since the tip was farthest out [ms], and its displacement over the largest."""
    time, tip = impulse["time"].values, impulse["tip"].values
    size = np.abs(tip)
    return time - float(time[np.argmax(size)]), -tip / size.max()


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Step left, impulse right."""
    left, right = figure.subplots(1, 2)
    _plot_step(data, left)
    _plot_impulse(data, right)
    mark_panels(left, "b")


def _plot_step(data: SimpleNamespace, ax) -> None:
    """Free response of the tip after the step."""
    ax.plot(data.step_time, data.step, color=PALETTE[1], label="feeler")
    ax.plot(*STEP_TRACE.T, "o", color=PALETTE[0], label="published: simulation, digitised")
    ax.plot(
        _STEP_ANIMALS_START,
        -1.0,
        "s",
        color=PALETTE[0],
        fillstyle="none",
        label="published: animals leave −1, digitised",
    )
    ax.axhline(0.0, color="#888888", lw=0.6)
    ax.set(
        xlabel="time from the first opposite peak [ms]",
        ylabel="tip displacement / step",
        xlim=(-32, _STEP_SPAN - 32),
    )
    ax.set_title("step")
    ax.legend(loc="lower right")


def _plot_impulse(data: SimpleNamespace, ax) -> None:
    """Tip during and after the hit."""
    ax.plot(
        data.impulse_time,
        data.impulse,
        color=PALETTE[1],
        label=f"feeler, lever {_LEVER:g} mm, {_LEVER_SPEED:g} m/s",
    )
    ax.plot(
        data.slow_time, data.slow, color=PALETTE[4], ls="--", label="feeler, straight, 0.2 m/s"
    )
    ax.plot(*_IMPULSE_TRACE.T, "o", color=PALETTE[0], label="published: digitised")
    ax.axhline(0.0, color="#888888", lw=0.6)
    ax.set(
        xlabel="time from the largest deflection [ms]",
        ylabel="tip displacement / largest",
        xlim=(-60, _IMPULSE_SPAN),
    )
    ax.set(title="impulse", ylim=(-1.08, 0.62))  # room for the legend above the curves
    ax.legend(loc="upper left")


def _write_movie_s1(
    antenna: Antenna, data: SimpleNamespace, path: Path, fps: int = FPS
) -> Path:
    """Antenna and cylinder left, tip displacement right: the impulse with the lever."""
    angle, time, place = (data.motion[name].values for name in ("angle", "time", "object"))
    points = antenna.shape(angle)
    curvature = angle / antenna.segment_length
    frames = choose_frames(time, fps=fps)
    with style():
        figure = Figure(figsize=(7.2, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2)
        norm = Normalize(-(top := float(np.abs(curvature).max())), top)
        line = MovingAntenna(antenna, left, norm, "RdBu_r")
        cylinder = left.add_patch(Circle((0, 0), RADIUS, color=PALETTE[2]))
        high = 1.05 * max(antenna.length, float(place[:, 1].max()) + RADIUS)
        left.set(
            xlim=(-12, 30), ylim=(-2, high), aspect="equal", xlabel="x [mm]", ylabel="y [mm]"
        )
        figure.colorbar(ScalarMappable(norm, "RdBu_r"), ax=left, label="curvature [1/mm]")
        right.plot(*_IMPULSE_TRACE.T, "o", color=PALETTE[0], label="published: digitised")
        (trace,) = right.plot([], [], color=PALETTE[1], label="feeler")
        right.set(xlim=(data.impulse_time[0], data.impulse_time[-1]), ylim=(-1.1, 0.3))
        right.set(
            xlabel="time from the largest deflection [ms]",
            ylabel="tip displacement against the push / largest",
        )
        right.legend(loc="lower right")
        clock = right.set_title(say_clock(float(time[-1])))

        def draw(k: int) -> list:
            now = frames[k]
            cylinder.center = tuple(place[now])
            trace.set_data(data.impulse_time[: now + 1], data.impulse[: now + 1])
            clock.set_text(say_clock(float(time[now])))
            return [cylinder, *line.move(points[now], curvature[now]), trace, clock]

        return write_movie(path, figure, draw, len(frames), fps)


def show(context: Context, section: Section) -> None:
    """The two experiments, and the movie of one."""
    data = compute(context.antenna, engine=context.engine)
    section.figure(
        "fig2b_responses",
        "Tip after a released step (left) and during a hit (right): simulation with the published"
        " constants against the traces digitised from the poster [A] (the step trace seems to be"
        " the published simulation's own). (Fig. 2B)",
        lambda figure: plot(data, figure),
        height=3.0,
        numbers={
            name: getattr(data, name)
            for name in ("step", "step_time", "impulse", "impulse_time")
        },
    )
    movie = section.folder / "movieS1_impulse.mp4"
    _write_movie_s1(context.antenna, data, movie, context.effort.fps)
    section.movie(
        movie,
        f"The impulse test in simulation, {SLOWER:g} times slower than life: a cylinder on a lever"
        " pushes the antenna to the right and slips off. Displacement is drawn against the push,"
        " as the published trace is. (Movie S1)",
    )
    section.values["calibration.rejected"] = data.free.rejected
