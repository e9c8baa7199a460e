"""Draw what slow and fast touches tell, by when, and what they cost."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from feeler.plotting.style import NOISE_COLOURS, mark_places, pick_colours, pick_shades
from feeler.studies.tradeoff.best import average_sets, find_best

_TICKS = (1, 2, 5, 10, 20, 40, 100, 200, 400, 800)
_WINDOWS = {"whole touch": "-", "equal distance and samples": "--"}
_MARKS: dict[str, dict[str, Any]] = {
    "relative": {"marker": "o", "ms": 6.0, "mfc": "none"},
    "common": {"marker": "s", "ms": 2.5},
}
"""Large and hollow, or small: both are seen where they coincide."""
UNITS_OF_NOISE = {"relative": "of peak", "common": "rad"}
"""What a level of each kind is a share of, or its unit."""


def plot_tradeoff(
    measured: Mapping[str, xr.Dataset], levels: Mapping[str, str], figure: Figure
) -> None:
    """Six panels, about 7.2 × 4.6 inches; ``levels``: what is shown of each kind of noise."""
    first, grid = next(iter(measured.values())), figure.add_gridspec(2, 3)
    places = [[figure.add_subplot(grid[row, k]) for k in range(3 - row)] for row in range(2)]
    axes = np.array([places[0], [*places[1], None]])
    common = levels["common"]
    plot_windows(first, common, "time", axes[0, 0])
    axes[0, 0].set(
        xlabel="time since contact [ms]", title=f"{first.attrs['antenna']}: answers in time"
    )
    plot_windows(first, common, "distance", axes[0, 1])
    axes[0, 1].set(xlabel="distance since contact [mm]", title="the same, per distance")
    speeds = axes[0, 0].get_legend_handles_labels()
    figure.legend(*speeds, loc="outside upper center", ncols=len(speeds[1]))
    _plot_best(first, levels, axes[0, 2])
    colours = pick_colours(measured)
    for ax, kind in zip(axes[1, :2], ("common", "relative"), strict=True):
        for name, data in measured.items():
            _plot_speeds(data, levels[kind], ax, color=colours[name], label=name)
        ax.set_title(f"noise {levels[kind]} {UNITS_OF_NOISE[kind]}")
    marks = axes[1, 0].get_legend_handles_labels()[0] + [
        Line2D([], [], color="#59636e", ls=line, label=f"bits: {window}")
        for window, line in _WINDOWS.items()
    ]
    figure.legend(handles=marks, loc="outside lower center", ncols=3)
    low = grid[1, 2].subgridspec(2, 1)
    plot_costs(measured, [figure.add_subplot(low[k]) for k in range(2)])


def plot_windows(data: xr.Dataset, level: str, kind: str, ax: Axes) -> None:
    """Accuracy against window, a line for each speed, with its interval over the sets."""
    chosen = data.isel(window=np.flatnonzero(data["kind"].values == kind)).sel(level=level)
    found = average_sets(100 * chosen["accuracy"])
    colours = pick_shades("speed", data.sizes["speed"])
    for colour, speed in zip(colours, data["speed"].values, strict=True):
        one, x = found.sel(speed=speed), chosen["value"].values
        ax.plot(x, one["mean"], marker=".", ms=3, color=colour, label=f"{speed:g} m/s")
        ax.fill_between(
            x,
            one["mean"] - one["half"],
            one["mean"] + one["half"],
            color=colour,
            alpha=0.25,
            lw=0,
        )
    ax.set(xscale="log", ylim=(0, 103), ylabel="ideal accuracy [%]")
    mark_places(ax.xaxis, [tick for tick in _TICKS if x[0] <= tick <= x[-1]])


def _plot_best(data: xr.Dataset, levels: Mapping[str, str], ax: Axes) -> None:
    """Best speed against deadline; bars: speeds that the sets do not tell from it."""
    for kind, level in levels.items():
        colour, best = NOISE_COLOURS[kind], find_best(data, level)
        best = best.isel(window=np.flatnonzero(best["kind"].values == "time"))
        x, y, least, most = (best[name].values for name in ("value", "best", "least", "most"))
        ax.errorbar(
            x,
            y,
            [y - least, most - y],
            lw=1,
            capsize=2,
            color=colour,
            label=level,
            **_MARKS[kind],
        )
    ax.set(
        xscale="log",
        yscale="log",
        xlabel="deadline [ms since contact]",
        ylabel="best speed [m/s]",
    )
    mark_places(ax.xaxis, [tick for tick in _TICKS if x[0] <= tick <= x[-1]])
    mark_places(ax.yaxis, data["speed"].values)
    ax.legend(loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=2, columnspacing=1.0)


def _plot_speeds(data: xr.Dataset, level: str, ax: Axes, **style: Any) -> None:
    """Bits against speed: whole touches, and (dashed) at equal distance and samples."""
    matched = data["window"].values[data["kind"].values == "distance and samples"][0]
    for window, line in zip(("whole touch", matched), _WINDOWS.values(), strict=True):
        found = average_sets(data["bits"].sel(level=level, window=window))
        shown = style | ({} if line == "-" else {"label": None})
        ax.errorbar(
            data["speed"],
            found["mean"],
            found["half"],
            ls=line,
            marker=".",
            ms=3,
            capsize=2,
            **shown,
        )
    ax.set(xscale="log", xlabel="speed [m/s]", ylabel="bits")
    mark_places(ax.xaxis, data["speed"].values)


def plot_costs(measured: Mapping[str, xr.Dataset], axes: Sequence[Axes]) -> None:
    """Work on the antenna, and below it the peak force, against speed."""
    costs = {"work": "work of a\ntouch [µJ]", "force": "peak force\n[mN]"}
    colours = pick_colours(measured)
    for ax, (cost, label) in zip(axes, costs.items(), strict=True):
        for name, data in measured.items():
            mean = data[cost].mean("set")
            ax.plot(data["speed"], mean, marker=".", ms=3, color=colours[name], label=name)
        ax.set(xscale="log", ylabel=label)
        mark_places(ax.xaxis, data["speed"].values)
    axes[0].tick_params(labelbottom=False)
    axes[1].set_xlabel("speed [m/s]")
