"""Fig. 1C, and the scene of Fig. 3A, as a drawing: a cockroach with one antenna along a wall."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Ellipse, Rectangle

from feeler.plotting.antennas import OBJECT_COLOUR, plot_posture
from feeler.plotting.results import Shapes
from feeler.plotting.style import ANTENNA_COLOURS, PALETTE, mark_panels
from feeler.report.page import Section
from feeler.wall import Approach
from paper.context import Context
from paper.fig3 import load

_ANTENNAE_PER_BODY = 1.5  # [P] an antenna's length, in lengths of the body


def _choose_wall(shapes: Shapes) -> int:
    """Which of the distances is drawn: the middle one of those with an inverted J, or else of
    those in contact.
    """
    bent = np.flatnonzero(shapes.inverted & shapes.contact)
    met = bent if bent.size else np.flatnonzero(shapes.contact)
    return int(met[len(met) // 2])


def plot(sweep: Approach, ax: Axes) -> None:
    """Body, the free antenna, the one along the wall with its greatest bend, and the distance."""
    shapes, antenna = Shapes.of_sweep(sweep), sweep.antenna
    at, side = _choose_wall(shapes), sweep.posture.sign
    free = int(np.flatnonzero(~shapes.contact)[0]) if not shapes.contact.all() else 0
    wall, reach = abs(float(shapes.wall[at])), antenna.length
    _draw_body(reach / _ANTENNAE_PER_BODY, ax)
    for points, flip in ((shapes.points[at], side), (shapes.points[free], -side)):
        shown = points * [flip, 1]
        plot_posture(shown, ax, lw=2.2, zorder=4)
        ax.plot(*shown[antenna.sensors - 1].T, ".", ms=0.9, color="#FFFFFF", zorder=5)
    top = float(max(shapes.points[k][:, 1].max() for k in (at, free)))
    low, high = -0.75 * reach, top + 9.0
    ax.add_patch(Rectangle((wall, low), 5.0, high - low, color=OBJECT_COLOUR, lw=0))
    ax.text(wall + 2.5, 0.5 * (low + high), "wall", rotation=90, ha="center", va="center")
    peak = shapes.peak[at] * [side, 1]
    ax.plot(*peak, "o", ms=6, mfc="none", mec=PALETTE[2], mew=1.5, zorder=6)
    ax.annotate(
        "greatest bend",
        peak,
        (wall + 8.0, peak[1]),
        arrowprops={"arrowstyle": "-", "lw": 0.6, "color": PALETTE[2]},
        va="center",
        color=PALETTE[2],
    )
    level = top + 3.0
    ax.annotate("", (wall, level), (0, level), arrowprops={"arrowstyle": "<->", "lw": 0.8})
    ax.text(0.5 * wall, level + 0.5, "wall distance", ha="center", va="bottom")
    ax.plot([0, 0], [0, level + 2], ":", color="#888888", lw=0.8, zorder=0)
    ax.set(xlim=(-0.75 * reach, wall + 20), ylim=(low, high), aspect="equal")
    ax.axis("off")
    mark_panels(ax, "c")
    ax.plot([-0.7 * reach, -0.7 * reach + 10], [low + 3] * 2, color="black", lw=1.5)
    ax.text(-0.7 * reach + 5, low + 4, "10 mm", ha="center", va="bottom")


def _draw_body(length: float, ax: Axes) -> None:
    """Head, pronotum and abdomen of a body of this length [mm], head at the origin; a sketch."""
    for centre, wide, long in ((0.05, 0.16, 0.1), (0.2, 0.3, 0.24), (0.62, 0.34, 0.76)):
        ax.add_patch(
            Ellipse(
                (0, -centre * length),
                wide * length,
                long * length,
                fc=ANTENNA_COLOURS[1],
                ec="#FFFFFF",
                lw=0.8,
            )
        )
    for front, back in ((0.25, 0.05), (0.35, 0.5), (0.5, 1.0)):
        for side in (-1, 1):
            knee = side * 0.32 * length
            ax.plot(
                [0, knee, 1.35 * knee],
                [-front * length, -0.5 * (front + back) * length, -back * length],
                color=ANTENNA_COLOURS[0],
                lw=0.8,
                zorder=0,
            )


def show(context: Context, section: Section) -> None:
    """The first profile in the leading set-up."""
    sweep = next(iter(load(context).sweeps.values()))
    shapes = Shapes.of_sweep(sweep)
    if not (context.is_cockroach and shapes.contact.any()):
        return
    section.figure(
        "fig1_animal",
        "A cockroach from above. Both antennae are the model's: the one along the wall is at rest"
        " in the leading set-up, the other one is free, pre-bent as this set-up asks. White dots:"
        " sensors. The body is a sketch of the length that the paper gives, two thirds of an"
        " antenna's. Along a wall an antenna bends most at one place; where that is may tell how"
        " far the wall is. (Fig. 1C, 3A)",
        lambda figure: plot(sweep, figure.subplots()),
        height=3.4,
        numbers={"points": shapes.points[_choose_wall(shapes)]},
    )
