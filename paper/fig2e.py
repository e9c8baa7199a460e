"""Fig. 2E and Fig. S3: the tactile tensors of every profile, and how long each touch lasts."""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from feeler import save, touch
from feeler.analysis import INDICES, compute_dispersion
from feeler.antenna.segments import Antenna
from feeler.experiments.tactile import DURATION
from feeler.objects import Ball, Trial
from feeler.objects.trials import LOCATIONS, SPEEDS, make_features
from feeler.physics.contact import CONTACTS, DEFAULT_CONTACT
from feeler.plotting import SLOWER, write_touches_movie
from feeler.plotting.antennas import make_patch, plot_posture
from feeler.plotting.style import mark_panels
from feeler.plotting.tensors import plot_tensor_grid
from feeler.report import Section, make_spread
from feeler.tensors.transforms import in_unit, rectify
from paper.context import Context
from paper.data import (
    list_profiles,
    list_touches,
    load_complete,
    load_tensors,
    measure_window,
    select_speed,
)


def _select(tensors: xr.Dataset, speed: float) -> list[list[xr.DataArray]]:
    """Curvature [1/mm] of one speed: rows of locations (middle to tip), columns of features."""
    at_speed = in_unit(tensors["curvature"], "1/mm").sel(
        trial=np.isclose(tensors["speed"], speed)
    )
    columns = sorted(
        {
            (str(f), float(s))
            for f, s in zip(at_speed["feature"].values, at_speed["size"].values, strict=True)
        }
    )
    rows = sorted(set(at_speed["location"].values.tolist()))
    return [
        [
            at_speed.isel(
                trial=int(
                    np.flatnonzero(
                        np.isclose(at_speed["location"], row)
                        & (at_speed["feature"].values == feature)
                        & np.isclose(at_speed["size"], size)
                    )[0]
                )
            )
            for feature, size in columns
        ]
        for row in rows
    ]


def plot(tensors: xr.Dataset, speed: float, figure: Figure, limit: float | None = None) -> None:
    """All tensors of one speed: rows locations, columns features, one colour scale (Fig. 2E, Fig.
    S3).
    """
    grid = _select(tensors, speed)
    values = [[tensor.values for tensor in row] for row in grid]
    limit = limit or max(float(np.max(value)) for row in values for value in row)
    ax = figure.subplots()
    rows = [f"{row[0]['location'].item():g} L" for row in grid]
    columns = [f"{tensor['feature'].item()} {tensor['size'].item():g} mm" for tensor in grid[0]]
    image = plot_tensor_grid(
        values, in_unit(tensors["time"], "ms").values, ax, Normalize(0.0, limit), rows, columns
    )
    ax.set(xlabel="time [ms]", ylabel="sensor (base → tip upwards), by location of contact")
    figure.colorbar(image, ax=ax, label="curvature [1/mm] (negative drawn as 0)", pad=0.01)


def show(context: Context, section: Section) -> None:
    """A picture of each profile's slow tensors, and peaks of all."""
    _show_stimuli(context, section)
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    first = next(iter(sets.values()))["angle"]
    _draw_sets(section, sets)
    _tabulate(
        section, sets, {name: measure_window(load_complete(context, name)) for name in sets}
    )
    section.values |= {
        "tensors.count": int(first.sizes["trial"]),
        "tensors.sensors": int(first.sizes["sensor"]),
        "tensors.samples": int(first.sizes["time"]),
    }
    _show_contacts(context, section)
    _show_movie(context, section)


def _draw_sets(section: Section, sets: dict) -> None:
    slow = {name: select_speed(tensors, SPEEDS["slow"]) for name, tensors in sets.items()}
    limit = max(float(in_unit(tensors["curvature"], "1/mm").max()) for tensors in slow.values())
    for name, tensors in sets.items():
        figure_name = "fig2e" if name == next(iter(sets)) else "figS3"
        where = "Fig. 2E and Fig. S3" if figure_name == "fig2e" else "Fig. S3"
        section.figure(
            f"{figure_name}_{name}",
            f"Curvature over time at slow touch (0.06 m/s), profile '{name}'. Rows: locations from"
            " the middle to the tip; columns: features. One colour scale for all profiles."
            f" ({where})",
            lambda figure, tensors=tensors: plot(tensors, SPEEDS["slow"], figure, limit),
            height=4.6,
        )
        save(slow[name], section.folder / f"{figure_name}_{name}.nc")


def _tabulate(section: Section, sets: dict, windows: dict[str, Any]) -> None:
    rows = []
    for name, tensors in sets.items():
        for speed in np.unique(tensors["speed"].values)[::-1]:
            chosen = select_speed(tensors, speed)
            peak = in_unit(chosen["angle"], "deg").max(("sensor", "time")).values
            cut = windows[name].cut if np.isclose(speed, SPEEDS["slow"]) else "–"
            rows.append(
                [
                    name,
                    speed,
                    peak.min(),
                    peak.max(),
                    in_unit(chosen["curvature"], "1/mm").max().item(),
                    cut,
                    peak.size,
                ]
            )
    section.table(
        [
            "profile",
            "speed [m/s]",
            "peak angle, least [°]",
            "largest [°]",
            "peak curvature [1/mm]",
            "cut by the window",
            "trials",
        ],
        rows,
        "Peaks over sensors and time. Cut by the window: slow touches that go on, or begin again,"
        " after it, in a run of twice its length.",
    )


# Softness of contact, which the paper does not state.


def compute_change(reference: xr.Dataset, other: xr.Dataset) -> np.ndarray:
    """Greatest difference of any angle of each touch (trial,), as a share of its peak."""
    one, two = (data["angle"].transpose("trial", ...).values for data in (reference, other))
    axes = tuple(range(1, one.ndim))
    return np.abs(two - one).max(axis=axes) / np.abs(one).max(axis=axes)


def compute_contacts(context: Context) -> dict[str, xr.Dataset]:
    """Slow touches of the first profile by contact, the default first."""
    name = list_profiles(context)[0]
    slow = SPEEDS["slow"]
    touches = [trial for trial in list_touches(context, name) if trial.speed == slow]
    found = {DEFAULT_CONTACT: select_speed(load_tensors(context, name), slow)}
    for contact in CONTACTS:
        if contact != DEFAULT_CONTACT:
            found[contact] = touch(
                context.profiles[name],
                touches,
                contact=contact,
                engine=context.engine,
                workers=context.workers,
                duration=DURATION,
                seed=context.seed,
            )
    return found


def _show_contacts(context: Context, section: Section) -> None:
    """By how much slow tensors and their dispersion change with the contact."""
    found = compute_contacts(context)
    arrays = {name: rectify(data["angle"].values) for name, data in found.items()}
    dispersion = compute_dispersion(arrays, random_state=context.seed)
    reference = found[DEFAULT_CONTACT]
    changes = {name: 100 * compute_change(reference, data) for name, data in found.items()}
    section.values |= _list_contacts(changes, dispersion.average)
    section.heading("Softness of contact")
    section.table(
        [
            "contact",
            "median change [% of the peak]",
            "greatest",
            *(known.label for known in INDICES.values()),
        ],
        [
            [
                name,
                float(np.median(change)),
                float(change.max()),
                *(dispersion.average[index][name].estimate for index in INDICES),
            ]
            for name, change in changes.items()
        ],
        "Slow touches of the exponential profile with other softness of contact, which the paper"
        " does not state: greatest change of any angle of a touch, and mean index of the closest"
        " match. Tensors of single slow touches depend on it; their dispersion hardly does.",
    )


def _list_contacts(changes: Mapping[str, np.ndarray], average: Mapping) -> dict[str, object]:
    values: dict[str, object] = {}
    for name, change in changes.items():
        if name != DEFAULT_CONTACT:
            values[f"contact.{name}.slow"] = make_spread(
                np.median(change), change.min(), change.max(), n=len(change)
            )
        for index in INDICES:
            one = average[index][name]
            values[f"contact.{name}.{index}"] = make_spread(
                one.estimate, one.low, one.high, n=len(change)
            )
    return values


# Fig. 2D: what touches, and where.


def plot_stimuli(antenna: Antenna, figure: Figure) -> None:
    """The six features and the five locations (Fig. 2D)."""
    left, right = figure.subplots(1, 2, width_ratios=(1, 2))
    plot_posture(antenna.shape(), left, linewidth=2)
    left.plot(
        np.zeros(len(LOCATIONS)),
        np.array(LOCATIONS) * antenna.length,
        "o",
        color="#CC0000",
        markersize=4,
    )
    left.set(
        xlabel="x [mm]",
        ylabel="y [mm]",
        xlim=(-16, 16),
        aspect="equal",
        title="locations",
    )
    for i, feature in enumerate(make_features()):
        right.add_patch(make_patch(feature, np.array([8.0 * i, 0.0]), np.array([1.0, 0.0])))
        right.text(
            8.0 * i - feature.size,
            -5.5,
            f"{feature.kind}\n{feature.size:g} mm",
            ha="center",
            fontsize=7,
        )
    right.annotate(
        "motion", (46, 5), (38, 5), arrowprops={"arrowstyle": "->"}, va="center", fontsize=7
    )
    right.plot([34, 39], [-8, -8], color="black", lw=1.5)
    right.text(40, -8, "5 mm", va="center", fontsize=7)
    right.axis("off")
    mark_panels(left, "d")
    right.set(xlim=(-8, 48), ylim=(-9, 8), aspect="equal", title="features (half-size)")


def _show_stimuli(context: Context, section: Section) -> None:
    """The stimuli, and which of them this run has."""
    slow = select_speed(load_tensors(context, next(iter(context.profiles))), SPEEDS["slow"])
    section.figure(
        "fig2d_stimuli",
        "What touches, and the locations of contact. (Fig. 2D)",
        lambda figure: plot_stimuli(context.antenna, figure),
        height=1.9,
        numbers={name: slow[name] for name in ("feature", "size", "location")},
    )


# Movie S2: a tensor grows, slow beside fast on one clock.

_TOGETHER = "movieS2_speeds"


def _show_movie(context: Context, section: Section) -> None:
    """A ball at the middle, at all speeds together."""
    fps, touches = context.effort.fps, {}
    for speed in reversed(context.effort.speeds):
        trial = Trial(feature=Ball(radius=1.53), location=0.5, speed=SPEEDS[speed])
        touches[speed] = (
            trial,
            touch(
                context.antenna, trial, duration=DURATION, all_hinges=True, **context.physics
            ),
        )
    path = section.folder / f"{_TOGETHER}.mp4"
    titles = {f"{speed}\n{SPEEDS[speed]:g} m/s": found for speed, found in touches.items()}
    write_touches_movie(context.antenna, titles, path, fps=fps)
    section.movie(
        path,
        f"One ball of 1.53 mm touches the antenna at {len(touches)} speeds, {SLOWER:g} times slower"
        " than life. Below: the curvature that its sensors feel, the tensor. A slow touch fills it,"
        " a fast one is over in a few samples. (Movie S2)",
    )
