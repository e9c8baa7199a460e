"""Fig. 3A–D: a wall approaches and slides past; where the antenna bends most, and how well that tells the distance."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure

from feeler.antenna.antenna import Antenna
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.plotting.style import PALETTE, PROFILE_COLOURS
from feeler.plotting.tensor import plot_tensor
from feeler.wall.distance_map import DistanceMap, map_distance
from feeler.wall.peak import find_sweep_peak
from feeler.wall.posture import Posture
from feeler.wall.sensitivity import BENDS, FRICTIONS, QUICK_BENDS, READINGS, Case, compare, make_postures
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
    """A wall past the first profile at constant distances."""
    drive: WallTouch
    """A wall that comes nearer without stopping, first profile."""
    cases: list[Case]
    """The sensitivity table: quick has every reading and friction with the default pre-bend; paper has all."""


def compute(
    antennas: Mapping[str, Antenna],
    *,
    scale: str = "quick",
    posture: Posture | None = None,
    engine: str = DEFAULT_ENGINE,
    timestep: float | None = None,
    n_threads: int = 2,
) -> Fig3Data:
    """Everything of Fig. 3 for the given antennas, the first of which is shown in A, C and D.

    ``scale``: ``smoke`` has no sensitivity table, ``quick`` a part of it, ``paper`` all of it.
    """
    posture = posture or Posture()
    first = next(iter(antennas.values()))
    options = {"engine": engine} | ({} if timestep is None else {"timestep": timestep})
    sweeps = {name: approach(antenna, posture, DISTANCES) for name, antenna in antennas.items()}
    straight = {name: approach(antenna, posture.replace(**STRAIGHT)) for name, antenna in antennas.items()}
    axes = {"smoke": None, "quick": (READINGS, FRICTIONS[:2], QUICK_BENDS), "paper": (READINGS, FRICTIONS, BENDS)}[
        scale
    ]
    cases = compare(antennas, make_postures(*axes, base=posture), n_threads=n_threads) if axes else []
    return Fig3Data(
        sweeps=sweeps,
        maps={name: map_distance(sweep) for name, sweep in sweeps.items()},
        straight={name: map_distance(sweep) for name, sweep in straight.items()},
        slides=slide(first, posture, SLIDE_DISTANCES, **options),
        drive=drive(first, posture, **options),
        cases=cases,
    )


def plot(data: Fig3Data, figure: Figure | SubFigure) -> None:
    """Draw the four panels."""
    top, middle, bottom = figure.subfigures(3, 1, height_ratios=(1.3, 1.0, 0.9))
    n = len(data.sweeps)
    for ax, (name, sweep) in zip(np.atleast_1d(top.subplots(1, n, sharey=True)), data.sweeps.items(), strict=True):
        plot_sweep(sweep, ax)
        ax.set_title(name)
    top.suptitle("A  wall approaching, equilibria", x=0.01, ha="left", fontsize=8)
    left, right = middle.subplots(1, 2, sharey=True)
    plot_maps(data.maps, left)
    plot_maps(data.straight, right)
    left.set_title("B  pre-bent into an inverted J")
    right.set(title="not pre-bent", ylabel="")
    plot_tensors(data, bottom)


def plot_sweep(sweep: Sweep, ax, every: int = 4) -> None:
    """Antenna shapes at some of the distances with the point of greatest curvature (dots) and the walls."""
    points, peak = sweep.points, find_sweep_peak(sweep)
    arc = np.append(sweep.antenna.hinge_position, sweep.antenna.length)
    for step, k in enumerate(range(1, len(sweep.distance), every)):
        colour = PALETTE[step % len(PALETTE)]
        ax.plot(*points[k].T, color=colour, lw=1.2 if sweep.inverted[k] else 0.8, ls="-" if sweep.inverted[k] else ":")
        ax.axvline(sweep.posture.sign * sweep.distance[k], color=colour, lw=0.5)
        if np.isfinite(peak.position[k]):
            x, y = (np.interp(peak.position[k], arc, points[k, :, axis]) for axis in (0, 1))
            ax.plot(x, y, "o", color=colour, ms=4)
    ax.set(xlabel="x (mm)", ylabel="y, forward (mm)", aspect="equal")


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
        xlabel="point of greatest curvature (mm from base)", ylabel="wall distance (mm)", ylim=(3, 27), xlim=(-1, 43)
    )
    ax.legend(fontsize="x-small", frameon=False)


def plot_tensors(data: Fig3Data, figure: Figure | SubFigure) -> None:
    """Bending curvature over time: sliding at four distances (C), approaching (D)."""
    slides, driven = data.slides.make_dataset(), data.drive.make_dataset()
    n = slides.sizes["trial"]
    axes = np.atleast_1d(figure.subplots(1, n + 1, sharey=True, width_ratios=[1.0] * n + [1.6]))
    top = float(np.abs(slides["curvature"]).max())
    norm = Normalize(-top, top)
    for k, ax in enumerate(axes[:-1]):
        image = plot_tensor(slides["curvature"].values[k], slides["time"].values, ax, norm, labels=False)
        image.set_cmap("RdBu_r")
        ax.set(title=f"{'C  ' if k == 0 else ''}{float(slides['distance'][k]):g} mm", xlabel="time (ms)")
    image = plot_tensor(driven["curvature"].values[0], driven["time"].values, axes[-1], norm, labels=False)
    image.set_cmap("RdBu_r")
    axes[-1].set(title="D  wall approaching", xlabel="time (ms)")
    axes[0].set_ylabel("sensor (base → tip)")
    figure.colorbar(image, ax=axes, label="curvature beyond rest (1/mm)")


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
