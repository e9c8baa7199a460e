"""Antennae beside a wall at every distance, and the map from greatest curvature to distance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse

from feeler.plotting.look import PALETTE, PROFILE_COLOURS, pick_shades
from feeler.wall import Approach, DistanceMap, WallTouch, find_peak, find_sweep_peak

_WALL = "#59636e"
_STATES = {
    "hook": ("#000000", "inverted J in contact"),
    "met": (PALETTE[0], "in contact, no J"),
    "free": ("#BBBBBB", "no contact"),
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Shapes:
    """Antennae beside walls, one per distance, farthest first.

    Attributes
    ----------
    points : np.ndarray
        (step, node, 2) [mm]
    wall : np.ndarray
        Place of the wall across the body (step,) [mm].
    peak : np.ndarray
        Point of greatest bend (step, 2) [mm], NaN without contact.
    """

    points: np.ndarray
    wall: np.ndarray
    contact: np.ndarray
    inverted: np.ndarray
    peak: np.ndarray

    @classmethod
    def of_sweep(cls, sweep: Approach) -> "Shapes":
        """Equilibria of an approach."""
        position = find_sweep_peak(sweep).position
        state = (sweep.distance, sweep.contact, sweep.inverted, position)
        return cls._make(sweep.antenna, sweep.points, sweep.posture, *state)

    @classmethod
    def of_slides(cls, touch: WallTouch) -> "Shapes":
        """Where a sliding wall has left every antenna in the end."""
        last = np.stack([motion.angle[-1] for motion in touch.motions])
        contact, inverted = touch.contact[:, -1], touch.inverted[:, -1]
        peak = find_peak(touch.antenna, last - touch.antenna.rest_angle).position
        state = (touch.distance[:, -1], contact, inverted, np.where(contact, peak, np.nan))
        return cls._make(touch.antenna, touch.points[:, -1], touch.posture, *state)

    @classmethod
    def _make(cls, antenna, points, posture, distance, contact, inverted, position) -> "Shapes":
        arc = np.append(antenna.hinge_position, antenna.length)
        peak = np.array(
            [
                [np.interp(s, arc, shape[:, axis]) for axis in (0, 1)]
                for s, shape in zip(position, points, strict=True)
            ]
        )
        return cls(
            points=points,
            wall=posture.sign * distance,
            contact=contact,
            inverted=inverted,
            peak=peak,
        )


def plot_shapes(
    rows: Mapping[str, Shapes], ax, cell: tuple[float, float] = (32.0, 62.0)
) -> None:
    """Every shape beside its wall: a row per antenna, a column per distance; ``cell`` [mm].

    The figure gets the legend.
    """
    lines, colours, walls, dots = [], [], [], []
    for row, shapes in enumerate(rows.values()):
        for column, points in enumerate(shapes.points):
            shift = np.array([column * cell[0], -row * cell[1]])
            lines.append(points + shift)
            kind = "free" if not shapes.contact[column] else "met"
            colours.append(_STATES["hook" if shapes.inverted[column] else kind][0])
            walls.append(
                np.array([[shapes.wall[column], -18.0], [shapes.wall[column], 38.0]]) + shift
            )
            dots.append(shapes.peak[column] + shift)
    ax.add_collection(LineCollection(walls, colors=_WALL, linewidths=0.8))
    ax.add_collection(LineCollection(lines, colors=colours, linewidths=0.9))
    ax.plot(*np.array(dots).T, "o", color=PALETTE[2], ms=2)
    first = next(iter(rows.values()))
    columns = cell[0] * np.arange(len(first.wall))
    ax.set(xticks=columns + 0.4 * cell[0], xticklabels=[f"{abs(x):.3g}" for x in first.wall])
    ax.set_xlabel("wall distance [mm]")
    ax.set(
        yticks=-cell[1] * np.arange(len(rows)) + 10.0, yticklabels=list(rows), aspect="equal"
    )
    ax.set(xlim=(-8, columns[-1] + cell[0]), ylim=(10.0 - cell[1] * (len(rows) - 0.5), 45.0))
    ax.tick_params(length=0)
    ax.spines[["left", "bottom"]].set_visible(False)
    marks = [Line2D([], [], color=colour, label=words) for colour, words in _STATES.values()]
    marks.append(Line2D([], [], color=_WALL, label="wall"))
    marks.append(
        Line2D([], [], color=PALETTE[2], marker="o", ls="", ms=3, label="greatest bend")
    )
    ax.get_figure().legend(handles=marks, loc="outside lower center", ncols=len(marks))


def plot_approach(rows: Mapping[str, Shapes], axes: Sequence[Axes], every: int = 4) -> None:
    """Every ``every``-th shape of each antenna in a panel of its own, over one another, base at
    the origin, coloured by the distance of its wall; dots: greatest bend.
    """
    distances = np.abs(next(iter(rows.values())).wall)[::every]
    colours = pick_shades("wall distance", len(distances))
    for (name, shapes), ax in zip(rows.items(), axes, strict=True):
        for k, colour in zip(range(0, len(shapes.wall), every), colours, strict=True):
            ax.axvline(shapes.wall[k], color=colour, lw=0.8, ls="--")
            ax.plot(
                *shapes.points[k].T, color=colour, lw=1.2, label=f"{distances[k // every]:.3g}"
            )
            ax.plot(*shapes.peak[k], "o", color=colour, mec="#000000", mew=0.5, ms=4, zorder=3)
        ax.add_patch(Ellipse((-3.0, -4.0), 5.0, 9.0, color="#BBBBBB", lw=0))
        ax.text(-3.0, -11.0, "head", ha="center", fontsize=7, color="#59636e")
        ax.set(title=name, xlabel="x [mm]", aspect="equal")
    axes[0].set_ylabel("y [mm]")
    if (figure := axes[0].get_figure(root=False)) is not None:
        handles, labels = axes[0].get_legend_handles_labels()
        dot = Line2D([], [], marker="o", ls="", color="#FFFFFF", mec="#000000", ms=4)
        figure.legend(
            [*handles, dot],
            [*labels, "greatest bend"],
            loc="outside right center",
            title="wall distance [mm]",
            title_fontsize=7,
        )


def plot_maps(maps: Mapping[str, DistanceMap], ax) -> None:
    """Distance against the peak's position, lines and R²; peaks at the base as open marks."""
    for mark, (name, found) in zip("os^D", maps.items(), strict=False):
        colour = PROFILE_COLOURS.get(name, PALETTE[0])
        r2 = f"R² {found.r2:.3f}" if not found.undefined else "R² undefined"
        ax.plot(
            found.position[found.used],
            found.distance[found.used],
            mark,
            ms=3,
            color=colour,
            label=f"{name}: {r2}",
        )
        rest = ~found.used & np.isfinite(found.position)
        ax.plot(
            found.position[rest],
            found.distance[rest],
            mark,
            mfc="none",
            ms=3 + "os^D".index(mark),
            color=colour,
        )
        if not found.undefined:
            ends = np.array(
                [np.nanmin(found.position[found.used]), np.nanmax(found.position[found.used])]
            )
            ax.plot(ends, found.predict(ends), "--", lw=0.8, color=colour)
    ax.set(
        xlabel="point of greatest curvature [mm from base]",
        ylabel="wall distance [mm]",
        ylim=(3, 56),
        xlim=(-1.5, 43),
    )
    ax.plot([], [], "o", mfc="none", ms=3, color="#59636e", label="open: not fitted")
    ax.legend(loc="upper center", ncols=2, columnspacing=1.0)
