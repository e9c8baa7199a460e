"""Fig. 3A–D: a wall approaches and slides past; where the antenna bends most, and how well that tells the distance."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure

from feeler.antenna.antenna import Antenna
from feeler.paper.fig3_shapes import Shapes, plot_shapes
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.plotting.style import PALETTE, PROFILE_COLOURS
from feeler.plotting.tensor import plot_tensor
from feeler.wall.distance_map import DistanceMap, map_distance
from feeler.wall.posture import Posture
from feeler.wall.sensitivity import BENDS, FRICTIONS, ONE_CHANGE, READINGS, Case, compare, make_postures
from feeler.wall.sliding import WallTouch, drive, slide
from feeler.wall.sweep import DISTANCES, Sweep, approach

PAPER_R2 = {"exponential": 0.985, "linear": 0.924, "constant": 0.704}  # [P]
SLIDE_DISTANCES = (20.0, 15.0, 10.0, 6.0)  # [C] mm
STRAIGHT = {"prebend": "none"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Fig3Data:
    """What Fig. 3 shows."""

    sweeps: Mapping[str, Sweep]
    """Quasi-static approach per profile."""
    maps: Mapping[str, DistanceMap]
    """Position → distance per profile, default posture."""
    straight: Mapping[str, DistanceMap]
    """The same for an antenna that is not pre-bent."""
    slides: WallTouch
    """A wall past the first profile at a few constant distances."""
    drives: Mapping[str, WallTouch]
    """A wall that comes nearer without stopping, per profile."""
    far_slides: Mapping[str, WallTouch]
    """A wall past every profile at every distance; empty unless paper scale."""
    cases: list[Case]
    """The sensitivity table: quick has the default and three single changes; paper has all combinations."""


def compute(
    antennas: Mapping[str, Antenna],
    *,
    scale: str = "quick",
    posture: Posture | None = None,
    engine: str = DEFAULT_ENGINE,
    timestep: float | None = None,
    n_threads: int = 2,
) -> Fig3Data:
    """Everything of Fig. 3 for the given antennas, the first of which is shown in C and D.

    ``scale``: ``smoke`` has no sensitivity table, ``quick`` a part of it, ``paper`` all of it.
    """
    posture = posture or Posture()
    name, first = next(iter(antennas.items()))
    driven = {name: first} if scale == "smoke" else antennas
    options = {"engine": engine} | ({} if timestep is None else {"timestep": timestep})
    sweeps = {name: approach(antenna, posture, DISTANCES) for name, antenna in antennas.items()}
    straight = {name: approach(antenna, posture.replace(**STRAIGHT)) for name, antenna in antennas.items()}
    axes = {"smoke": None, "quick": (ONE_CHANGE,), "paper": (READINGS, FRICTIONS, BENDS)}[scale]
    known = [*sweeps.items(), *straight.items()]
    cases = compare(antennas, make_postures(*axes, base=posture), n_threads=n_threads, known=known) if axes else []
    return Fig3Data(
        sweeps=sweeps,
        maps={name: map_distance(sweep) for name, sweep in sweeps.items()},
        straight={name: map_distance(sweep) for name, sweep in straight.items()},
        slides=slide(first, posture, SLIDE_DISTANCES, **options),
        drives={name: drive(antenna, posture, **options) for name, antenna in driven.items()},
        far_slides={name: slide(antenna, posture, DISTANCES, **options) for name, antenna in antennas.items()}
        if scale == "paper"
        else {},
        cases=cases,
    )


def plot(data: Fig3Data, figure: Figure | SubFigure) -> None:
    """Draw the four panels."""
    grid = figure.add_gridspec(3, 2, height_ratios=(1.5, 1.0, 0.8))
    top = figure.add_subplot(grid[0, :])
    plot_shapes({name: Shapes.of_sweep(sweep) for name, sweep in data.sweeps.items()}, top)
    top.set_title("A  wall approaching, equilibrium at every distance", loc="left")
    left, right = (figure.add_subplot(grid[1, k]) for k in (0, 1))
    plot_maps(data.maps, left)
    plot_maps(data.straight, right)
    left.set_title("B  pre-bent into an inverted J")
    right.set(title="not pre-bent", ylabel="")
    plot_tensors(data, figure, [figure.add_subplot(grid[2, k]) for k in (0, 1)])


def plot_maps(maps: Mapping[str, DistanceMap], ax) -> None:
    """Distance against position of the peak, lines and R²; peaks at the base hinge as open marks."""
    for name, found in maps.items():
        colour = PROFILE_COLOURS.get(name, PALETTE[0])
        r2 = f"R² {found.r2:.3f}" if not found.undefined else "R² undefined"
        ax.plot(found.position[found.used], found.distance[found.used], ".", color=colour, label=f"{name}: {r2}")
        rest = ~found.used & np.isfinite(found.position)
        ax.plot(found.position[rest], found.distance[rest], "o", mfc="none", ms=3, color=colour)
        if not found.undefined:
            ends = np.array([np.nanmin(found.position[found.used]), np.nanmax(found.position[found.used])])
            ax.plot(ends, found.predict(ends), "--", lw=0.8, color=colour)
    ax.set(
        xlabel="point of greatest curvature [mm from base]", ylabel="wall distance [mm]", ylim=(3, 27), xlim=(-1, 43)
    )
    ax.legend(fontsize="x-small", frameon=False)


def plot_tensors(data: Fig3Data, figure: Figure | SubFigure, axes: Sequence) -> None:
    """Bending curvature over time: sliding at some distances, side by side (C), and approaching (D)."""
    slides, driven = data.slides.make_dataset(), next(iter(data.drives.values())).make_dataset()
    curves = slides["curvature"].values[: len(SLIDE_DISTANCES)]
    n_times = curves.shape[2]
    gap = np.full((curves.shape[1], n_times // 20), np.nan)
    row = np.concatenate([part for curve in curves for part in (curve, gap)], axis=1)[:, : -gap.shape[1]]
    norm = Normalize(-(top := float(np.abs(curves).max())), top)
    plot_tensor(row, np.arange(row.shape[1]), axes[0], norm, labels=False).set_cmap("RdBu_r")
    centres = (np.arange(len(curves)) * (n_times + gap.shape[1])) + n_times / 2
    axes[0].set(xticks=centres, xticklabels=[f"{d:g} mm" for d in slides["distance"].values[: len(curves)]])
    axes[0].set(title=f"C  sliding past, {n_times} ms each", ylabel="sensor (base → tip)")
    image = plot_tensor(driven["curvature"].values[0], driven["time"].values, axes[1], norm, labels=False)
    image.set_cmap("RdBu_r")
    axes[1].set(title="D  wall approaching", xlabel="time [ms]")
    figure.colorbar(image, ax=axes, label="curvature beyond rest [1/mm]", pad=0.01)


def tabulate(cases: list[Case]) -> list[dict[str, object]]:
    """The sensitivity table as rows of plain values; R² is None where it is undefined."""
    return [
        {
            "antenna": case.antenna,
            "reading": case.posture.reading,
            "friction": case.posture.friction,
            "prebend": case.posture.prebend,
            "hook_share": case.posture.hook_share,
            "tip_heading": case.posture.tip_heading,
            **case.measure,
            "in_contact": case.n_contact,
            "inverted": case.n_inverted,
            "used": int(case.map.used.sum()),
            "at_base": int(case.map.at_base.sum()),
            "r2": None if case.map.undefined else round(case.map.r2, 4),
            "undefined": case.map.undefined,
            "slope": None if case.map.undefined else round(case.map.slope, 4),
            "error_mm": None if case.map.undefined else round(case.map.error, 3),
            "monotone": case.map.monotone,
        }
        for case in cases
    ]
