"""Fig. 3A–D: a wall approaches and slides past; where the antenna bends most, and how well that
tells the distance.
"""

from collections.abc import Mapping, Sequence
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure

from feeler.antenna.antenna import Antenna
from feeler.physics.engine import DEFAULT_ENGINE
from feeler.plotting.tensor import plot_tensor
from feeler.plotting.wall import Shapes, plot_maps, plot_shapes
from feeler.report.section import Section
from feeler.studies.paper.context import Context
from feeler.studies.paper.data import list_profiles
from feeler.studies.scale import Scale
from feeler.wall import (
    DISTANCES,
    DistanceMap,
    Posture,
    WallTouch,
    approach,
    drive,
    map_distance,
    slide,
)

SLIDE_DISTANCES = (20.0, 15.0, 10.0, 6.0)  # [C] mm
STRAIGHT = {"prebend": "none"}
APART = 0.1  # [C] of a tensor's own root mean square: what tells two sliding tensors apart


def compute(
    antennas: Mapping[str, Antenna],
    *,
    effort: Scale,
    posture: Posture | None = None,
    engine: str = DEFAULT_ENGINE,
    timestep: float | None = None,
    workers: int | None = None,
) -> SimpleNamespace:
    """Everything of Fig. 3 for the given antennas, the first of which is shown in C and D.

    Returns
    -------
    SimpleNamespace
        By profile: ``sweeps``, the quasi-static approach; ``maps`` from position to distance, and
        ``straight``, the same for an antenna that is not pre-bent; ``drives``, a wall that comes
        nearer without stopping; ``far_slides``, a wall past the first profiles at every distance.
        ``slides``: a wall past the first profile at a few constant distances.
    """
    posture = posture or Posture()
    first = next(iter(antennas.values()))
    options: dict[str, Any] = {"engine": engine, "timestep": timestep, "workers": workers}
    sweeps = {name: approach(antenna, posture, DISTANCES) for name, antenna in antennas.items()}
    straight = {
        name: approach(antenna, posture.replace(**STRAIGHT)) for name, antenna in antennas.items()
    }
    return SimpleNamespace(
        sweeps=sweeps,
        maps={name: map_distance(sweep) for name, sweep in sweeps.items()},
        straight={name: map_distance(sweep) for name, sweep in straight.items()},
        slides=slide(first, posture, SLIDE_DISTANCES, **options),
        drives={
            name: drive(antennas[name], posture, **options)
            for name in list(antennas)[: effort.drives]
        },
        far_slides={
            name: slide(antennas[name], posture, DISTANCES, **options)
            for name in list(antennas)[: effort.far_slides]
        },
    )


@lru_cache(maxsize=1)
def load(context: Context) -> SimpleNamespace:
    """What this run shows, computed once for the figure, the table and the movie."""
    antennas = {name: context.profiles[name] for name in list_profiles(context)}
    return compute(antennas, effort=context.effort, engine=context.engine)


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
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
    _plot_tensors(data, figure, [figure.add_subplot(grid[2, k]) for k in (0, 1)])


def _plot_tensors(data: SimpleNamespace, figure: Figure | SubFigure, axes: Sequence) -> None:
    """Bending curvature over time: sliding at some distances, side by side (C), and approaching
    (D).
    """
    slides, driven = data.slides.make_dataset(), next(iter(data.drives.values())).make_dataset()
    curves = slides["curvature"].values[: len(SLIDE_DISTANCES)]
    n_times = curves.shape[2]
    gap = np.full((curves.shape[1], n_times // 20), np.nan)
    row = np.concatenate([part for curve in curves for part in (curve, gap)], axis=1)[
        :, : -gap.shape[1]
    ]
    norm = Normalize(-(top := float(np.abs(curves).max())), top)
    plot_tensor(row, np.arange(row.shape[1]), axes[0], norm, labels=False).set_cmap("RdBu_r")
    centres = (np.arange(len(curves)) * (n_times + gap.shape[1])) + n_times / 2
    axes[0].set(
        xticks=centres, xticklabels=[f"{d:g} mm" for d in slides["distance"].values[: len(curves)]]
    )
    axes[0].set(
        title=f"C  sliding past, {n_times} ms each",
        ylabel="sensor (base → tip)",
        xlabel="wall distance; time runs to the right",
    )
    image = plot_tensor(
        driven["curvature"].values[0], driven["time"].values, axes[1], norm, labels=False
    )
    image.set_cmap("RdBu_r")
    axes[1].set(title="D  wall approaching", xlabel="time [ms]")
    figure.colorbar(image, ax=axes, label="curvature beyond rest [1/mm]", pad=0.01)


def show(context: Context, section: Section) -> None:
    """Fig. 3A–D, and R² of every profile."""
    data = load(context)
    section.text(
        "A wall pushes a pre-bent antenna into an inverted J. How the pre-bend comes about, which"
        " angle is meant and how much the wall rubs are not stated in the paper; the default was"
        " fixed with its reason (see the guide) before any R² was looked at. It is one set-up of"
        " many: the claims are judged over the family below."
    )
    section.figure(
        "fig3_wall",
        "A: equilibrium at every distance of a wall (green) that comes nearer, base at the lower"
        " left, body looking up. Black: an inverted J in contact; red: in contact without one;"
        " grey: no contact; dots: greatest bend. B: distance against its position, with straight"
        " lines; open marks are not fitted. C, D: tactile tensors of a wall that slides past at"
        " four distances and of one that comes nearer. (Fig. 3A–D)",
        lambda figure: plot(data, figure),
        height=7.4,
        numbers={
            **{
                part: {name: getattr(found, part) for name, found in data.maps.items()}
                for part in ("distance", "position", "r2")
            },
            "shapes": {name: sweep.points for name, sweep in data.sweeps.items()},
        },
    )
    if data.far_slides:
        _show_slides(section, data)
    _list_maps(section, data)


def _show_slides(section: Section, data: SimpleNamespace) -> None:
    shapes = {name: Shapes.of_slides(touch) for name, touch in data.far_slides.items()}
    section.figure(
        "fig3_slides",
        "Where a wall that slid past backward at 0.3 m/s for 200 ms has left every antenna, at"
        " every distance; colours as in A.",
        lambda figure: plot_shapes(shapes, figure.subplots()),
        height=3.2,
        numbers={name: {"wall": s.wall, "points": s.points} for name, s in shapes.items()},
    )
    words = [f"{name} {s.inverted.sum()} of {s.contact.sum()}" for name, s in shapes.items()]
    first = next(iter(data.far_slides.values()))
    section.values["wall.unique_share"] = _compute_unique_share(first)
    section.values["wall.unique_share.twentieth"] = _compute_unique_share(first, APART / 2)
    section.text(
        "The inverted J still stands after sliding, of the distances in contact:"
        f" {', '.join(words)}."
    )


def _list_maps(section: Section, data: SimpleNamespace) -> None:
    rows = [_row(name, found) for name, found in data.maps.items()]
    rows += [_row(f"{name}, not pre-bent", found) for name, found in data.straight.items()]
    section.table(
        [
            "profile",
            "R²",
            "slope",
            "intercept [mm]",
            "error [mm]",
            "monotone",
            "told apart [mm]",
            "distances used",
            "peak at base",
        ],
        rows,
        "Default posture, then without pre-bend. Error: predicted distance, each distance left out"
        " of its own fit. Monotone: the peak moves one way over all distances used. Told apart: the"
        " longest run of distances over which the peak moves on by more than a segment per step.",
    )


def _compute_unique_share(touch: WallTouch, apart: float = APART) -> float | None:
    """Share of the distances in contact whose sliding tensor differs from every other's by more
    than ``apart`` of itself, and is most like that of a neighbouring distance: tensors of noise
    differ, too.
    """
    data = touch.make_dataset()
    met = touch.contact.any(axis=1)
    tensors = data["curvature"].values[met].reshape(int(met.sum()), -1)
    if len(tensors) < 2:
        return None
    far = np.linalg.norm(tensors[:, None] - tensors[None], axis=2) + np.diag(
        np.full(len(tensors), np.inf)
    )
    own = far.min(axis=1) > apart * np.linalg.norm(tensors, axis=1)
    beside = np.abs(far.argmin(axis=1) - np.arange(len(tensors))) == 1
    return float(np.mean(own & beside))


def _row(name: str, found: DistanceMap) -> list[object]:
    apart = (
        "none"
        if np.isnan(found.told_apart[0])
        else f"{found.told_apart[0]:.3g}–{found.told_apart[1]:.3g}"
    )
    counts = int(found.used.sum()), int(found.at_base.sum())
    monotone = ("yes" if found.monotone else "no") if found.used.sum() > 1 else "nothing to judge"
    return [name, found.r2, found.slope, found.intercept, found.error, monotone, apart, *counts]
