"""Pictures of results: spikes, bases, accuracy, closest matches, walls, and what notebooks show."""

import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import wraps
from itertools import cycle
from pathlib import Path
from types import SimpleNamespace
from typing import Annotated, Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Ellipse

from feeler.analysis import Dispersion
from feeler.antenna import Antenna
from feeler.decoding.curves import Curves
from feeler.decoding.sweeps import Sweep
from feeler.errors import InvalidInput
from feeler.plotting.style import FEWEST, PALETTE, PROFILE_COLOURS, pick_colours, pick_shades
from feeler.plotting.tensors import (
    choose_scale,
    name_scale,
    plot_tensor,
    plot_tensor_grid,
    write_touch_movie,
)
from feeler.tensors.schema import IN_SPACE
from feeler.tensors.transforms import get_bending, in_unit, measure_peak
from feeler.validation import checked
from feeler.wall import Approach, DistanceMap, find_sweep_peak

# Draw spikes: a raster of units over time, and how often all of them fire.


@checked
def plot_raster(
    times: np.ndarray,
    ax: Axes,
    side: np.ndarray | None = None,
    lead: float = 0.0,
    around: np.ndarray | None = None,
) -> None:
    """Spikes of one trial (unit, event) [ms], a row for each unit, from base to tip.

    Parameters
    ----------
    times
        NaN beyond a unit's last spike.
    side
        (unit,) 1 or −1; units of different sides share rows and differ in colour.
    lead
        Time of contact [ms], marked.
    around
        (unit,) where side 1 lies around the antenna, from x towards z [degrees].
    """
    times = np.asarray(times)
    if times.ndim != 2:
        raise InvalidInput(f"times must be (unit, event), got shape {times.shape}.")
    sides = np.ones(len(times), dtype=int) if side is None else np.asarray(side)
    turns = np.zeros(len(times)) if around is None else np.asarray(around)
    drawn = [(turn, one) for turn in np.unique(turns) for one in (1, -1)]
    members = [(turns == turn) & (sides == one) for turn, one in drawn]
    for k, (turn, one) in enumerate(drawn):
        rows = times[members[k]]
        unit, event = np.nonzero(np.isfinite(rows))
        angle = (turn + (0.0 if one == 1 else 180.0)) % 360.0
        name = {0.0: "+x", 90.0: "+z", 180.0: "−x", 270.0: "−z"}.get(angle, f"{angle:g}°")
        look: dict[str, Any] = {"color": PALETTE[k % len(PALETTE)], "ms": 2.5, "mew": 0.6}
        ax.plot(rows[unit, event], unit + 1, "|", label=f"bent towards {name}", **look)
    ax.axvline(lead, color="0.6", lw=0.6)
    ax.set(xlabel="time [ms]", ylabel="unit (base → tip)")
    ax.set_ylim(0.5, max(map(np.sum, members)) + 0.5)


@checked
def plot_touch_spikes(
    tensor: np.ndarray,
    times: np.ndarray,
    rate: np.ndarray,
    time: np.ndarray,
    side: np.ndarray,
    figure: Figure,
    lead: float = 0.0,
    around: np.ndarray | None = None,
) -> None:
    """One touch: what is felt (sensor, time) [degrees], in space (plane, sensor, time) of which the
    bending towards x and z is drawn; spikes (unit, event) [ms] below it; and the mean rate of all
    units (unit, time) [Hz].
    """
    felt = tensor[:2] if tensor.ndim == 3 else tensor[None]
    axes = figure.subplots(
        len(felt) + 2, 1, sharex=True, height_ratios=(*[2] * len(felt), 2, 1)
    )
    names = ("angle [°]",) if len(felt) == 1 else ("angle towards x [°]", "angle towards z [°]")
    norm, colours = choose_scale(*felt, both=True)
    for ax, plane, name in zip(axes, felt, names, strict=False):
        image = plot_tensor(plane, time, ax, norm, labels=False, unit="°", colours=colours)
        figure.colorbar(image, ax=ax, label=name_scale(name, norm))
        ax.set_ylabel("sensor (base → tip)")
    spikes, mean = axes[-2:]
    plot_raster(times, spikes, side, lead, around)
    spikes.set_xlabel("")
    spikes.legend(loc="upper right", markerscale=3)
    mean.plot(time, rate.mean(axis=0), color="black", lw=0.8)
    mean.set(xlabel="time [ms]", ylabel="mean rate [Hz]", xlim=(time[0], time[-1]))
    figure.align_ylabels(axes)


# Draw bases: what an encoder takes touches to be made of.


@checked
def plot_bases(
    sets: Mapping[str, Annotated[np.ndarray, "component sensor lag"]], sampling: float, ax: Axes
) -> None:
    """A row of bases for each set (component, sensor, lag), base to tip upwards; each basis on its
    own colour scale.

    ``sampling`` [ms]. Shorter bases stand among longer ones on one scale of lags.
    """
    shape = np.max([components.shape for components in sets.values()], axis=0)
    grid = [
        [_pad(components, m, shape[1:]) for m in range(shape[0])]
        for components in sets.values()
    ]
    columns = [f"basis {m + 1}" for m in range(shape[0])]
    image = plot_tensor_grid(
        grid,
        sampling * np.arange(shape[2]),
        ax,
        Normalize(0, 1),
        list(sets),
        columns,
        "of the basis' greatest",
    )
    ax.set(xlabel="lag [ms]", ylabel="sensor (base → tip upwards)")
    if (figure := ax.get_figure(root=False)) is not None:
        figure.colorbar(
            image,
            ax=ax,
            label="share of each basis' greatest value",
            location="bottom",
            aspect=40,
            pad=0.02,
        )


def _pad(components: np.ndarray, m: int, shape: np.ndarray) -> np.ndarray:
    """Basis ``m`` as a share of its greatest value, in an otherwise empty (sensor, lag); empty if
    there is none.
    """
    padded = np.full(shape, np.nan)
    if m < len(components):
        basis = components[m]
        padded[: basis.shape[0], : basis.shape[1]] = basis / (basis.max() or 1)
    return padded


# Draw accuracy against noise.

_NULL: dict[str, Any] = {"ls": "--", "marker": "s"}
_BASELINE: dict[str, Any] = {"ls": "-.", "marker": "x", "ms": 4, "lw": 0.7}
_ANY = "#59636e"  # in a legend, what every group has


def plot_curves(curves: Curves, kind: str, noise: str, ax: Axes) -> None:
    """Mean ± 1 SD by group; null dashed, baseline dash-dotted, chance dotted."""
    found = curves.find(kind, noise)
    colours: dict[Any, Any] = pick_colours([*found, *curves.baselines])
    for name, sweep in found.items():
        plot_sweep(sweep, ax, color=colours[name], label=name)
    # fixed codes have one null: identical touches get one code
    for place, name in enumerate(found if kind == "joint" else [None]):
        null = curves.find_null(kind, noise, group=name)
        if null is not None:
            colour = colours.get(name, "#000000")
            plot_sweep(null, ax, color=colour, **_NULL)
            if not place:
                _name(null, ax, label="null: one tensor repeated", lw=1, ms=3, **_NULL)
    for place, (name, sweep) in enumerate(curves.baselines.items()):
        points = 100 * sweep.ratios, 100 * sweep.noisy.mean(axis=1)
        ax.plot(*points, color=colours[name], **_BASELINE)
        if not place:
            _name(sweep, ax, label="peak place and time only", **_BASELINE)
    ax.axhline(100 * sweep.chance, color="#888888", ls=":", lw=0.8, label="chance")
    ax.set(xlim=(0, 32), ylim=(0, 103))
    ax.tick_params(labelsize=7)


def _name(sweep: Sweep, ax: Axes, **style: Any) -> None:
    """An entry of the legend in no group's colour, of a curve with as many points as these."""
    ax.plot(100 * sweep.ratios, np.full(len(sweep.ratios), np.nan), color=_ANY, **style)


def plot_sweep(sweep: Sweep, ax: Axes, **style: Any) -> None:
    """One accuracy curve on noisy copies, mean ± 1 SD."""
    mean, sd = 100 * sweep.noisy.mean(axis=1), 100 * sweep.noisy.std(axis=1)
    (line,) = ax.plot(100 * sweep.ratios, mean, **{"lw": 1, "marker": ".", "ms": 3, **style})
    if len(mean) < FEWEST:
        ax.vlines(100 * sweep.ratios, mean - sd, mean + sd, color=line.get_color(), lw=1)
    else:
        ax.fill_between(
            100 * sweep.ratios, mean - sd, mean + sd, color=line.get_color(), alpha=0.2, lw=0
        )


# Draw closest matches, how far apart the tensors of each group lie; and values with their
# intervals.


def plot_index(dispersion: Dispersion, index: str, ax: Axes) -> None:
    """Every tensor's closest match as a dot, the average of each group with its 95 % interval
    beside it, above the group's name.
    """
    rng = np.random.default_rng(0)  # spreads the dots sideways only
    names = [str(group) for group in dispersion.groups]
    colours = pick_colours(names)
    for place, (name, group) in enumerate(zip(names, dispersion.groups, strict=True)):
        values, one = dispersion.values(index, group), dispersion.average[index][group]
        dots = place + rng.uniform(-0.15, 0.15, len(values))
        ax.plot(dots, values, ".", ms=2, color=colours[name], alpha=0.4)
        error = [[one.estimate - one.low], [one.high - one.estimate]]
        look: dict[str, Any] = {"fmt": "o", "ms": 4, "capsize": 2, "color": colours[name]}
        ax.errorbar([place + 0.28], [one.estimate], error, label=name, **look)
    ax.set_xticks(
        range(len(names)), names, rotation=30, ha="right", rotation_mode="anchor", fontsize=7
    )
    ax.tick_params(axis="y", labelsize=7)


def plot_spreads(
    ax: Axes,
    places: Iterable[float],
    spreads: Iterable[Mapping[str, Any]],
    *,
    across: bool = False,
    **style: Any,
) -> None:
    """Values with their intervals, in the form in which ``Section.values`` keeps them, side by side
    or (``across``) one below the other; what is undefined is left out.
    """
    known = [(at, one) for at, one in zip(places, spreads, strict=True) if "value" in one]
    at, values = [at for at, _ in known], [one["value"] for _, one in known]
    half = [one["high"] - one["value"] for _, one in known]
    if across:
        ax.errorbar(values, at, xerr=half, **style)
    else:
        ax.errorbar(at, values, yerr=half, **style)


# Antennae beside a wall at every distance, and the map from greatest curvature to distance.

_WALL = "#59636e"
_STATES = {
    "hook": ("#000000", "inverted J in contact"),
    "met": (PALETTE[0], "in contact, no J"),
    "free": ("#BBBBBB", "no contact"),
}


def list_shapes(sweep: Approach) -> SimpleNamespace:
    """Antennae beside walls, one per distance, farthest first.

    Returns
    -------
    SimpleNamespace
        ``points`` (step, node, 2) [mm]; ``wall``, its place across the body (step,) [mm];
        ``contact`` and ``inverted`` (step,); ``peak``, the point of greatest bend (step, 2) [mm],
        NaN without contact.
    """
    antenna, position = sweep.antenna, find_sweep_peak(sweep).position
    arc = np.append(antenna.hinge_position, antenna.length)
    peak = [
        [np.interp(s, arc, shape[:, axis]) for axis in (0, 1)]
        for s, shape in zip(position, sweep.points, strict=True)
    ]
    return SimpleNamespace(
        points=sweep.points,
        wall=sweep.posture.sign * sweep.distance,
        contact=sweep.contact,
        inverted=sweep.inverted,
        peak=np.array(peak),
    )


def plot_shapes(rows: Mapping[str, Any], ax, cell: tuple[float, float] = (32.0, 62.0)) -> None:
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
    ax.set(
        xticks=columns + 0.4 * cell[0],
        xticklabels=[f"{abs(x):.3g}" for x in first.wall],
        xlabel="wall distance [mm]",
        yticks=-cell[1] * np.arange(len(rows)) + 10.0,
        yticklabels=list(rows),
        aspect="equal",
        xlim=(-8, columns[-1] + cell[0]),
        ylim=(10.0 - cell[1] * (len(rows) - 0.5), 45.0),
    )
    ax.tick_params(length=0)
    ax.spines[["left", "bottom"]].set_visible(False)
    marks = [
        *(Line2D([], [], color=colour, label=words) for colour, words in _STATES.values()),
        Line2D([], [], color=_WALL, label="wall"),
        Line2D([], [], color=PALETTE[2], marker="o", ls="", ms=3, label="greatest bend"),
    ]
    ax.get_figure().legend(handles=marks, loc="outside lower center", ncols=len(marks))


def plot_approach(rows: Mapping[str, Any], axes: Sequence[Axes], every: int = 4) -> None:
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
    marks = zip(cycle("os^D"), cycle(PALETTE), strict=False)
    for (mark, usual), (name, found) in zip(marks, maps.items(), strict=False):
        colour = PROFILE_COLOURS.get(name, usual)
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
    ax.set(xlabel="point of greatest curvature [mm from base]", ylabel="wall distance [mm]")
    ax.plot([], [], "o", mfc="none", ms=3, color="#59636e", label="open: not fitted")
    ax.legend(loc="center left", bbox_to_anchor=(1.0, 0.5))


# What notebooks show: a figure that shows itself, pictures of results, and one trial of a
# Dataset as picture and movie.

_DPI = 110
_QUANTITIES = ("stiffness [N·mm/rad]", "damping [N·mm·ms/rad]")


class Picture(Figure):
    """A matplotlib Figure that is shown where it is the last line of a notebook's cell."""

    def _repr_png_(self) -> bytes:
        kept = io.BytesIO()
        self.savefig(kept, format="png", dpi=_DPI)
        return kept.getvalue()


def _open(width: float, height: float = 2.8) -> Picture:
    return Picture(figsize=(width, height), layout="constrained")


def _drawn(width: float, height: float = 2.8) -> Callable[[Callable], Callable[..., Figure]]:
    """Let what draws a result into a figure make a picture of this size [inches], unless it is
    given a figure, and return it.
    """

    def decorate(draw: Callable[[Any, Figure], None]) -> Callable[..., Figure]:
        @wraps(draw)
        def picture(result: Any, figure: Figure | None = None) -> Figure:
            figure = figure or _open(width, height)
            draw(result, figure)
            return figure

        return picture

    return decorate


@_drawn(7.0)
def draw_sweep(sweep: Any, figure: Figure) -> None:
    """Accuracy against noise with its spread, and what is taken for what at the last ratio."""
    curve, counts = figure.subplots(1, 2)
    for name, values in (("noisy copies", sweep.noisy), ("clean originals", sweep.clean)):
        mean, spread = 100 * values.mean(axis=1), 100 * values.std(axis=1)
        curve.errorbar(sweep.ratios, mean, spread, marker="o", ms=3, capsize=2, label=name)
    curve.axhline(100 * sweep.chance, color="0.6", ls=":", label="chance")
    curve.set(xlabel="noise ratio", ylabel="accuracy [%]", ylim=(0, 102))
    curve.legend(fontsize=7)
    total = sweep.confusion[-1].sum(axis=1, keepdims=True)
    image = counts.imshow(100 * sweep.confusion[-1] / np.maximum(total, 1), vmin=0, vmax=100)
    places = range(len(sweep.classes))
    counts.set_xticks(places, map(str, sweep.classes), rotation=45, ha="right")
    counts.set_yticks(places, map(str, sweep.classes))
    counts.set(xlabel="taken for", ylabel="was", title=f"at noise {sweep.ratios[-1]:g}")
    figure.colorbar(image, ax=counts, label="share of the touches [%]")


@_drawn(7.0)
def draw_measurements(fit: Any, figure: Figure) -> None:
    """Fitted parameters with their intervals, and the hinges along the antenna before and after."""
    factors, profile = figure.subplots(1, 2)
    places = np.arange(len(fit.p))
    whiskers = np.abs([fit.p - fit.low, fit.high - fit.p])
    for k, known in enumerate(fit.determined):
        colour = PALETTE[0] if known else "0.6"
        factors.errorbar(
            places[k], fit.p[k], whiskers[:, [k]], fmt="o", color=colour, capsize=3
        )
    for row in fit.each if len(fit.each) > 1 else ():
        factors.plot(places + 0.15, row, ".", color="0.4", ms=3)
    names = [name.replace("_", " ") for name in fit.names]
    factors.set_xticks(places, names, rotation=30, ha="right")
    factors.axhline(1.0, color="0.7", lw=0.8)
    factors.set(ylabel="factor or tilt, 95 % interval", title="grey: hardly determined")
    for name, label, colour in zip(
        ("stiffness", "damping"), _QUANTITIES, PALETTE, strict=False
    ):
        before, after = getattr(fit.start, name), getattr(fit.antenna, name)
        x = fit.antenna.hinge_position / fit.antenna.length
        profile.semilogy(x, np.atleast_2d(after)[0], color=colour, label=label)
        profile.semilogy(x, np.atleast_2d(before)[0], "--", color=colour, lw=0.8)
    profile.set(xlabel="place (base 0, tip 1)", title="dashed: before the fit")
    profile.legend(fontsize=7)


@_drawn(5.0)
def draw_prediction(found: Any, figure: Figure) -> None:
    """A filmed release (dots) and what the antenna does (lines)."""
    ax = figure.subplots()
    rows = zip(found.place, found.recorded, found.simulated, strict=True)
    for place, recorded, simulated in rows:
        (line,) = ax.plot(found.time, simulated, label=f"at {place:.2g} of the length")
        ax.plot(found.time, recorded, ".", ms=3, color=line.get_color())
    ax.set(xlabel="time since the release [ms]", ylabel="share of the held displacement")
    ax.set_title(f"{found.name}: off by {found.error:.1%} (r.m.s.)")
    ax.legend(fontsize=7)


def draw_study(study: Any) -> Figure:
    """What a study found: a prediction, else the fit, else the antenna's shape."""
    if study.predictions:
        return draw_prediction(study.predictions[0])
    if study.fit is not None:
        return draw_measurements(study.fit)
    figure = _open(3.0)
    if study.antenna is not None:
        figure.subplots().plot(*study.antenna.shape()[:, :2].T)
    return figure


def draw_forces(curves: Sequence[Any], fit: Any, figure: Figure) -> None:
    """Force against deflection from where the antenna rests: as measured (dots) and of the fitted
    antenna (lines), the force at rest taken off.
    """
    from feeler.calibration import compute_force

    ax = figure.subplots()
    for curve in curves:
        end = f": force at {curve.at:.4g} mm"
        others = [zero for name, (zero, _) in fit.zero.items() if name.endswith(end)]
        zero = fit.zero.get(f"{curve.name}{end}", [np.mean(others or [0.0])])[0]
        moved = np.sort(curve.deflection - zero)
        force = 1e3 * curve.force[np.argsort(curve.deflection)]
        pushed = moved * moved[np.abs(moved).argmax()] >= 0
        model = 1e3 * compute_force(fit.antenna, moved[pushed], curve.at)
        (dots,) = ax.plot(
            moved,
            force - np.mean(force[pushed] - model),
            ".",
            label=f"{curve.name}, {curve.at:.3g} mm from the base",
        )
        ax.plot(moved[pushed], model, color=dots.get_color())
    ax.set(xlabel="deflection from rest [mm]", ylabel="force [mN]")
    ax.legend(fontsize=7)


@_drawn(4.0)
def draw_force(curve: Any, figure: Figure) -> None:
    """Force against deflection, as measured."""
    ax = figure.subplots()
    ax.plot(curve.deflection, 1e3 * curve.force, ".")
    ax.set(
        xlabel="deflection [mm]",
        ylabel="force [mN]",
        title=f"{curve.name}, {curve.at:.3g} mm from the base",
    )


@_drawn(5.0)
def draw_film(film: Any, figure: Figure) -> None:
    """How far each point of an antenna is aside of where it comes to rest."""
    ax = figure.subplots()
    for place, row in zip(film.place[film.place > 0], film.displacement, strict=True):
        ax.plot(film.time, row, lw=1, label=f"at {place:.2g} of the length")
    ax.set(xlabel="time [ms]", ylabel=f"aside of its rest [{film.unit}]", title=film.name)
    ax.legend(fontsize=7)


@_drawn(4.0)
def draw_approach(sweep: Any, figure: Figure) -> None:
    """An antenna in equilibrium at every distance of the wall, the nearest darkest."""
    ax = figure.subplots()
    shades = np.linspace(0.8, 0.0, len(sweep.distance))
    for points, shade in zip(sweep.points, shades, strict=True):
        ax.plot(*points.T, color=str(shade), lw=0.8)
    ax.set(xlabel="x, towards the wall [mm]", ylabel="y, forward [mm]", aspect="equal")


@_drawn(7.0)
def draw_optimum(end: Any, figure: Figure) -> None:
    """Stiffness and damping of a design along the antenna, and how the search came to it."""
    profile, way = figure.subplots(1, 2)
    end = getattr(end, "ends", (end,))[0]  # of a plan that was carried out, the best
    antenna = end.design.antenna
    hinge = np.arange(1, antenna.n_segments + 1)
    profile.semilogy(hinge, antenna.stiffness.ravel(), "o-", ms=3, label="stiffness [N·mm/rad]")
    profile.semilogy(hinge, antenna.damping.ravel(), "s--", ms=3, label="damping [N·mm·ms/rad]")
    profile.set(xlabel="hinge, base to tip", title="the best found")
    profile.legend(fontsize=7)
    way.step(*np.array(end.history).T, where="post")
    way.set(xlabel="antennas simulated", ylabel="what is missing (cost)", title="the search")


def plot_psth(drawn: xr.Dataset, psth: xr.DataArray, figure: Figure) -> None:
    """Draw trains trial by trial, a block for each unit, above the rates over all trials."""
    raster, rate = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    times = drawn["spike_time"].transpose("unit", "trial", "event").values
    lead = drawn["lead"].values if "lead" in drawn.coords else np.zeros(times.shape[1])
    own = times - np.asarray(lead, dtype=float).reshape(1, -1, 1)
    for k, unit in enumerate(own):
        rows = k * own.shape[1] + np.arange(own.shape[1])
        colour = PALETTE[k % len(PALETTE)]
        raster.eventplot(
            [row[np.isfinite(row)] for row in unit], lineoffsets=rows, color=colour
        )
        rate.plot(
            psth["time"], psth.values[k], color=colour, lw=1, label=f"{psth['unit'].values[k]}"
        )
    for ax in (raster, rate):
        ax.axvline(0.0, color="0.6", lw=0.8)
    raster.set(ylabel="trial, by unit", yticks=[])
    rate.set(xlabel="time since contact [ms]", ylabel="rate [Hz]")
    if len(own) <= 10:
        rate.legend(title="unit", fontsize=7)


def plot_exploration(
    result: Any,
    figure: Figure,
    titles: Sequence[str] = (),
    touched: Sequence[Any] | None = None,
) -> None:
    """Draw angle and absolute speed of both sides, a row per film; ``touched`` are its contacts."""
    axes = figure.subplots(len(result.sweeps), 2, squeeze=False, sharex="row")
    titles = titles or [f"film {k + 1}" for k in range(len(axes))]
    for k, (row, title, pair) in enumerate(zip(axes, titles, result.sweeps, strict=True)):
        for side, sweeps in zip(("left", "right"), pair, strict=True):
            time = sweeps.time * 1e-3
            row[0].plot(time, np.rad2deg(sweeps.angle), lw=0.8, label=side)
            row[1].plot(time, np.rad2deg(np.abs(sweeps.speed)) * 1e3, lw=0.8)
            peak = np.rad2deg(sweeps.peak_speed) * 1e3
            row[1].plot(sweeps.peak_time * 1e-3, peak, "k.", ms=3)
        for span in (
            [] if touched is None else touched[k][["on_ms", "off_ms"]].to_numpy() * 1e-3
        ):
            row[0].axvspan(*span, color="0.85", lw=0, zorder=0)
        row[0].set(title=title[:40], xlabel="time [s]", ylabel="angle [°]")
        row[1].set(title="speed, peaks dotted", xlabel="time [s]", ylabel="|speed| [°/s]")
    figure.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)


def draw_exploration(result: Any) -> Picture:
    """Angles and speeds of an exploration."""
    figure = _open(6.0, 1.2 + 1.5 * len(result.sweeps))
    plot_exploration(result, figure)
    return figure


@_drawn(7.0)
def draw_tracks(tracks: Any, figure: Figure) -> None:
    """Where every landmark was, as the film shows it, and x against time."""
    path, trace = figure.subplots(1, 2)
    for name, place in zip(tracks.landmarks, np.moveaxis(tracks.position, 1, 0), strict=True):
        path.plot(place[:, 0], place[:, 1], ".", ms=2, label=name)
        trace.plot(tracks.time * 1e-3, place[:, 0], lw=0.8)
    path.set(xlabel=f"x [{tracks.unit}]", ylabel=f"y upwards [{tracks.unit}]", aspect="equal")
    trace.set(xlabel="time [s]", ylabel=f"x [{tracks.unit}]")
    path.legend(fontsize=7)


@_drawn(7.2, 3.6)
def draw_run(run: Any, figure: Figure) -> None:
    """A run along a wall, from above and by its distances."""
    from feeler.plotting.walls import plot_run

    plot_run(run, figure)


@_drawn(4.5, 3.2)
def draw_map(found: Any, figure: Figure) -> None:
    """The wall's distance against the point of greatest curvature."""
    plot_maps({"map": found}, figure.subplots())


def draw_encoder(encoder: Any) -> Picture:
    """The bases that an encoder has learned."""
    bases = encoder.components_
    figure = _open(1.6 + 1.5 * len(bases))
    plot_bases({"bases": bases}, 1.0, figure.subplots())
    return figure


@_drawn(5.0, 4.4)
def draw_selection(selection: Any, figure: Figure) -> None:
    """Held-out error of each encoder compared over its sparseness, and the dissimilarity of its
    starts; the chosen one is ringed.
    """
    table = selection.table
    error, starts = figure.subplots(2, sharex=True)
    sparseness = [0.0 if value is None else float(value) for value in table.sparseness]
    table = table.assign(place=sparseness).sort_values("place")
    several = table.n_lags.nunique() > 1
    groups = table.groupby(["n_components", "n_lags"])
    colours = cycle(PALETTE)
    for colour, ((bases, lags), rows) in zip(colours, groups, strict=False):
        label = f"{bases} × {lags} samples" if several else f"{bases}"
        style = {"color": colour, "marker": "o", "ms": 3, "lw": 1}
        error.errorbar(rows.place, 100 * rows.held_out, 100 * rows["sem"], label=label, **style)
        starts.plot(rows.place, rows.dissimilarity, **style)
    chosen = table[table.chosen].iloc[0]
    ring = {"marker": "o", "ms": 11, "mfc": "none", "mec": "k", "ls": "none", "label": "chosen"}
    error.plot(chosen.place, 100 * chosen.held_out, **ring)
    error.set(ylabel="held-out squares\nnot explained [%]", yscale="log")
    error.legend(title="bases", fontsize="small")
    starts.set(xlabel="sparseness (0: none)", ylabel="dissimilarity\nof the starts")
    starts.set_ylim(bottom=0)


@checked
def plot_trial(
    tensors: xr.Dataset, trial: int = 0, variable: str = "curvature", ax: Axes | None = None
) -> Axes:
    """One trial's (sensor, time) as an image with its colour bar: bending away from the object is
    positive, and negative values are drawn too.
    """
    if variable not in tensors.data_vars or not {"trial", "sensor", "time"} <= set(
        tensors[variable].dims
    ):
        valid = [
            name
            for name, item in tensors.data_vars.items()
            if {"trial", "sensor", "time"} <= set(item.dims)
        ]
        raise InvalidInput(
            f"no tensor {variable!r} in this Dataset; valid:"
            f" {', '.join(map(str, valid)) or 'none'}."
        )
    taken = tensors[variable].isel(trial=_check_trial(tensors, trial))
    taken = get_bending(taken) if variable in IN_SPACE else taken  # all that bends
    values = taken.transpose("sensor", "time").values
    ax = Picture(figsize=(4.5, 3.0), layout="constrained").subplots() if ax is None else ax
    largest = max(measure_peak(values), 1e-12)
    unit = str(tensors[variable].attrs.get("units", ""))
    image = plot_tensor(
        values,
        in_unit(tensors["time"], "ms").values,
        ax,
        Normalize(min(0.0, float(np.nanmin(values))), largest),
        unit=unit,
    )
    ax.figure.colorbar(image, ax=ax, label=f"{variable} [{unit}]")
    return ax


@checked
def write_trial_movie(
    tensors: xr.Dataset, antenna: Antenna, path: Path, trial: int = 0, **how: Any
) -> Path:
    """The antenna as the sensors tell it beside the tensor as it grows; ``how`` as for
    ``write_touch_movie``.
    """
    return write_touch_movie(
        antenna, None, tensors.isel(trial=[_check_trial(tensors, trial)]), path, **how
    )


def _check_trial(tensors: xr.Dataset, trial: int) -> int:
    if not 0 <= trial < tensors.sizes["trial"]:
        raise InvalidInput(
            f"trial must be from 0 to {tensors.sizes['trial'] - 1}, got {trial}."
        )
    return trial
