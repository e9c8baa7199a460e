"""Fig. 2E and Fig. S3: the tactile tensors of every profile, and how long each touch lasts."""

from collections.abc import Mapping
from types import SimpleNamespace

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
    load_tensors,
    select_speed,
)


def _select(tensors: xr.Dataset) -> list[list[xr.DataArray]]:
    """Curvature [1/mm]: rows of locations (middle to tip), columns of features."""
    at_speed = in_unit(tensors["curvature"], "1/mm")
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


def plot(tensors: xr.Dataset, limit: float, figure: Figure) -> None:
    """All tensors of one speed: rows locations, columns features, one colour scale up to
    ``limit`` (Fig. 2E, Fig. S3).
    """
    grid = _select(tensors)
    values = [[tensor.values for tensor in row] for row in grid]
    ax = figure.subplots()
    rows = [f"{row[0]['location'].item():g} L" for row in grid]
    columns = [f"{tensor['feature'].item()} {tensor['size'].item():g} mm" for tensor in grid[0]]
    image = plot_tensor_grid(
        values, in_unit(tensors["time"], "ms").values, ax, Normalize(0.0, limit), rows, columns
    )
    ax.set(xlabel="time [ms]", ylabel="sensor (base → tip upwards), by location of contact")
    figure.colorbar(image, ax=ax, label="curvature [1/mm] (negative drawn as 0)", pad=0.01)


def compute(context: Context) -> SimpleNamespace:
    """Each profile's tensors: ``slow`` ones by profile, and their greatest curvature ``limit``."""
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    slow = {name: select_speed(tensors, SPEEDS["slow"]) for name, tensors in sets.items()}
    sizes = next(iter(sets.values()))["angle"].sizes
    names = {"count": "trial", "sensors": "sensor", "samples": "time"}
    return SimpleNamespace(
        rows={f"tensors.{name}": int(sizes[dim]) for name, dim in names.items()},
        slow=slow,
        limit=max(float(in_unit(one["curvature"], "1/mm").max()) for one in slow.values()),
    )


def show(data: SimpleNamespace, section: Section) -> None:
    """A picture of each profile's slow tensors."""
    for k, (name, tensors) in enumerate(data.slow.items()):
        file, where = ("figS3", "Fig. S3") if k else ("fig2e", "Fig. 2E and Fig. S3")
        section.figure(
            f"{file}_{name}",
            f"Curvature over time at slow touch (0.06 m/s), profile '{name}'. Rows: locations from"
            " the middle to the tip; columns: features. One colour scale for all profiles."
            f" ({where})",
            lambda figure, tensors=tensors: plot(tensors, data.limit, figure),
            height=4.6,
        )
        save(tensors, section.folder / f"{file}_{name}.nc")


# Softness of contact, which the paper does not state.


def compute_change(reference: xr.Dataset, other: xr.Dataset) -> np.ndarray:
    """Greatest difference of any angle of each touch (trial,), as a share of its peak."""
    one, two = (data["angle"].transpose("trial", ...).values for data in (reference, other))
    axes = tuple(range(1, one.ndim))
    return np.abs(two - one).max(axis=axes) / np.abs(one).max(axis=axes)


def compute_contacts(context: Context) -> SimpleNamespace:
    """By how much slow tensors of the first profile and their dispersion change with the contact,
    the default first.

    Returns
    -------
    SimpleNamespace
        ``rows``; ``changes`` [% of the peak] of each touch (trial,) by contact; ``average`` index
        of the closest match, by index and contact.
    """
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
    arrays = {name: rectify(data["angle"].values) for name, data in found.items()}
    average = compute_dispersion(arrays, random_state=context.seed).average
    reference = found[DEFAULT_CONTACT]
    changes = {name: 100 * compute_change(reference, data) for name, data in found.items()}
    return SimpleNamespace(
        rows=_list_contacts(changes, average), changes=changes, average=average
    )


def show_contacts(data: SimpleNamespace, section: Section) -> None:
    """A table of the contacts."""
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
                *(data.average[index][name].estimate for index in INDICES),
            ]
            for name, change in data.changes.items()
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


def compute_stimuli(context: Context) -> SimpleNamespace:
    """The ``antenna``, and which stimuli this run has."""
    slow = select_speed(load_tensors(context, next(iter(context.profiles))), SPEEDS["slow"])
    return SimpleNamespace(rows={}, antenna=context.antenna, slow=slow)


def show_stimuli(data: SimpleNamespace, section: Section) -> None:
    """The stimuli."""
    section.figure(
        "fig2d_stimuli",
        "What touches, and the locations of contact. (Fig. 2D)",
        lambda figure: plot_stimuli(data.antenna, figure),
        height=1.9,
        numbers={name: data.slow[name] for name in ("feature", "size", "location")},
    )


# Movie S2: a tensor grows, slow beside fast on one clock.

_TOGETHER = "movieS2_speeds"


def compute_movie(context: Context) -> SimpleNamespace:
    """A ball at the middle, at all speeds: trial and Dataset of each by its title."""
    touches = {}
    for name in reversed(context.effort.speeds):
        speed = SPEEDS[name]
        trial = Trial(feature=Ball(radius=1.53), location=0.5, speed=speed)
        found = touch(
            context.antenna, trial, duration=DURATION, all_hinges=True, **context.physics
        )
        touches[f"{name}\n{speed:g} m/s"] = trial, found
    return SimpleNamespace(
        rows={}, antenna=context.antenna, touches=touches, fps=context.effort.fps
    )


def show_movie(data: SimpleNamespace, section: Section) -> None:
    """All speeds together."""
    path = section.folder / f"{_TOGETHER}.mp4"
    write_touches_movie(data.antenna, data.touches, path, fps=data.fps)
    section.movie(
        path,
        f"One ball of 1.53 mm touches the antenna at {len(data.touches)} speeds, {SLOWER:g} times"
        " slower than life. Below: the curvature that its sensors feel, the tensor. A slow touch"
        " fills it, a fast one is over in a few samples. (Movie S2)",
    )
