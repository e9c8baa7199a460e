"""Movie S1: the impulse test, antenna and cylinder left, tip displacement right."""

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from feeler.antenna.antenna import Antenna
from feeler.experiment.impulse import RADIUS
from feeler.paper.fig2b import IMPULSE_TRACE, Fig2BData
from feeler.plotting.movie import write_movie
from feeler.plotting.style import PALETTE, style

FRAMES = 90


def write(antenna: Antenna, data: Fig2BData, path: Path, n_frames: int = FRAMES, fps: int = 25) -> Path:
    """The movie of the impulse with the lever, about twenty-five times slower than life."""
    motion = data.motion
    points = antenna.shape(motion.angle)
    frames = np.unique(np.linspace(0, len(motion.time) - 1, min(n_frames, len(motion.time))).astype(int))
    with style():
        figure = Figure(figsize=(7.2, 3.6), layout="constrained")
        left, right = figure.subplots(1, 2)
        (line,) = left.plot([], [], color="#5b3a1e", linewidth=2)
        cylinder = left.add_patch(Circle((0, 0), RADIUS, color=PALETTE[2]))
        left.set(xlim=(-12, 30), ylim=(-2, 1.15 * antenna.length), aspect="equal", xlabel="x [mm]", ylabel="y [mm]")
        right.plot(*IMPULSE_TRACE.T, "o", color=PALETTE[0], label="published, digitised")
        (trace,) = right.plot([], [], color=PALETTE[1], label="feeler")
        right.set(xlim=(data.impulse_time[0], data.impulse_time[-1]), ylim=(-1.1, 0.3))
        right.set(xlabel="time from the largest deflection [ms]", ylabel="tip displacement / largest")
        right.legend(loc="lower right")

        def draw(k: int) -> list:
            now = frames[k]
            line.set_data(*points[now].T)
            cylinder.center = tuple(motion.object[now])
            trace.set_data(data.impulse_time[: now + 1], data.impulse[: now + 1])
            return [cylinder, line, trace]

        return write_movie(path, figure, draw, len(frames), fps)
