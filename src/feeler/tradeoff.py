"""Speed against accuracy against energy: what a touch tells by when, and what it costs, for any
antenna; as numbers, as a figure and as a page.
"""

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from scipy.special import stdtrit

from feeler.errors import InvalidInput
from feeler.files import ensure_folder, read_shipped, write_text
from feeler.objects import Task
from feeler.plotting.style import (
    NOISE_COLOURS,
    mark_places,
    pick_colours,
    pick_shades,
)
from feeler.provenance import to_json
from feeler.report import Section, write_page
from feeler.study import Study
from feeler.tensors.transforms import require_variables
from feeler.validation import checked, show


def load_declared(**changes: Any) -> Study:
    """The study that was written down beforehand, less what ``changes`` replace.

    Parameters
    ----------
    **changes
        Fields of :class:`feeler.study.Study` or of its task; ``seed`` of the touches.
    """
    found = read_shipped("feeler", "tradeoff.toml")
    asked: dict[str, Any] = {
        name: tuple(sorted(value)) if name == "speeds" else value
        for name, value in (found | changes).items()
    }
    seed = asked.pop("seed")
    task: dict[str, Any] = {name: asked.pop(name) for name in ("speeds", "nuisances")}
    seeds = {"test": seed, "train": seed + 1_000_000}
    study = Study(
        task=Task(**task, seeds=seeds), **{n: asked.pop(n) for n in found if n in asked}
    )
    return study.replace(**asked)


_LEVEL = 0.95


@checked
def average_sets(values: xr.DataArray) -> xr.Dataset:
    """``mean`` over sets and ``half``, half the width of its 95 % interval (Student's t; NaN for
    one set).
    """
    if "set" not in values.dims:
        raise InvalidInput(f"values need the dimension 'set', got {show(values.dims)}.")
    count = values.sizes["set"]
    half = (
        values.std("set", ddof=1) * stdtrit(count - 1, (1 + _LEVEL) / 2) / np.sqrt(count)
        if count > 1
        else np.nan
    )
    mean = values.mean("set")
    return xr.Dataset({"mean": mean, "half": half + 0 * mean})


@checked
def find_best(measured: xr.Dataset, level: str, field: str = "accuracy") -> xr.Dataset:
    """For each window the speed with the greatest mean, and how sure that is.

    Returns
    -------
    xarray.Dataset
        By window: ``best`` and ``second`` speed [m/s], ``mean`` and ``half`` of the best, and the
        paired difference to the second over the same sets, ``gain`` ± ``gain_half``. ``least`` and
        ``most``: range of speeds that the sets do not tell from the best.
    """
    require_variables(measured, field, "speed", "level")
    if level not in measured["level"]:
        raise InvalidInput(
            f"there is no level {level!r}; there are: {measured['level'].values}."
        )
    values = measured[field].sel(level=level)
    mean = values.mean("set")
    order = np.argsort(-mean.values, axis=0, kind="stable")
    speeds, windows = measured["speed"].values, np.arange(measured.sizes["window"])
    best, second = order[0], order[min(1, len(order) - 1)]
    difference = values.isel(speed=xr.DataArray(best, dims="window")) - values
    found = average_sets(difference.transpose("set", "speed", "window"))
    tied = found["mean"].values <= np.nan_to_num(found["half"].values)
    own, gain = average_sets(values), found.isel(speed=xr.DataArray(second, dims="window"))
    place = speeds[:, None] + 0 * mean.values
    columns = {
        "best": speeds[best],
        "second": speeds[second],
        "mean": own["mean"].values[best, windows],
        "half": own["half"].values[best, windows],
        "gain": gain["mean"].values,
        "gain_half": gain["half"].values,
        "least": np.where(tied, place, np.inf).min(axis=0),
        "most": np.where(tied, place, -np.inf).max(axis=0),
    }
    coords = {name: measured[name] for name in ("window", "kind", "value")}
    return xr.Dataset({name: ("window", value) for name, value in columns.items()}, coords)


_TICKS = (1, 2, 5, 10, 20, 40, 100, 200, 400, 800)
_WINDOWS = {"whole touch": "-", "equal distance and samples": "--"}
_MARKS: dict[str, dict[str, Any]] = {
    "relative": {"marker": "o", "ms": 6.0, "mfc": "none"},
    "common": {"marker": "s", "ms": 2.5},
}
"""Large and hollow, or small: both are seen where they coincide."""
UNITS_OF_NOISE = {"relative": "of peak", "common": "rad"}
"""What a level of each kind is a share of, or its unit."""


def _plot_tradeoff(
    measured: Mapping[str, xr.Dataset], levels: Mapping[str, str], figure: Figure
) -> None:
    """Six panels, about 7.2 × 4.6 inches; ``levels``: what is shown of each kind of noise."""
    first, grid = next(iter(measured.values())), figure.add_gridspec(2, 3)
    places = [[figure.add_subplot(grid[row, k]) for k in range(3 - row)] for row in range(2)]
    axes = np.array([places[0], [*places[1], None]])
    common = levels["common"]
    _plot_windows(first, common, "time", axes[0, 0])
    axes[0, 0].set(
        xlabel="time since contact [ms]", title=f"{first.attrs['antenna']}: answers in time"
    )
    _plot_windows(first, common, "distance", axes[0, 1])
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
    _plot_costs(measured, [figure.add_subplot(low[k]) for k in range(2)])


def _plot_windows(data: xr.Dataset, level: str, kind: str, ax: Axes) -> None:
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
            label=f"{level} {UNITS_OF_NOISE[kind]}",
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
    ax.set_ylim(top=16 * data["speed"].values.max())  # room for the legend
    ax.legend(loc="upper right", title="noise (SD)", title_fontsize=7)


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


def _plot_costs(measured: Mapping[str, xr.Dataset], axes: Sequence[Axes]) -> None:
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


_SHOWN = ("accuracy", "bits", "work", "force", "release", "speed", "level", "window", "kind")
_ASKED = (
    "How well an ideal observer, who knows every touch exactly, discriminates {} touches by the"
    " noisy tensor, by time, by distance and by number of samples since contact; and what the touch"
    " costs."
)
_SPREAD = "Intervals are 95 % over sets of touches that were resampled."
TRADEOFF_LEAD = f"{_ASKED.format('thirty')} {_SPREAD}"


@checked
def write_tradeoff(
    measured: Mapping[str, xr.Dataset], study: Study, out: os.PathLike, conditions: str = ""
) -> Path:
    """``tradeoff.html`` in the folder ``out``, with ``tradeoff.png``, ``tradeoff.csv`` and
    ``tradeoff.json``.

    Parameters
    ----------
    measured
        By name, what one classifier tells of one antenna: parts of what
        :meth:`feeler.study.Study.run` gave, as :func:`split_measured` gives them.
    """
    if not measured:
        raise InvalidInput("nothing is measured; run a study and split what it gives.")
    for data in measured.values():
        require_variables(data, *_SHOWN)
    out = ensure_folder(out)
    section = Section(
        name="tradeoff", title="Speed, accuracy, energy", folder=out, vector=False
    )
    fill_section(section, measured, study)
    section.text(conditions)
    table = xr.concat([_tabulate(data) for data in measured.values()], "row", data_vars="all")
    table.to_dataframe().to_csv(out / "tradeoff.csv", index=False, float_format="%.6g")
    write_text(
        out / "tradeoff.json",
        json.dumps({name: to_json(data.to_dict()) for name, data in measured.items()}),
    )
    n = study.task.n_classes
    one = "One set of touches was drawn, so nothing says how far another one would differ."
    known = f"All {n} discriminated are {np.log2(n):.2f} bits."
    section.text(f"{_ASKED.format(n)} {known} {_SPREAD if study.sets > 1 else one}")
    kind, level = next(iter(study.shown.items()))
    tables = {name: _list_rows(data, study, level) for name, data in measured.items()}
    answer = "; ".join(
        f"{name} {', '.join(f'{row[-1]} m/s ({row[0]})' for row in (rows[0], rows[-1]))}"
        for name, rows in tables.items()
    )
    return write_page(
        out / "tradeoff.html",
        "Speed, accuracy and energy",
        f"Most accurate speed (in brackets those that the sets do not tell from it), noise of SD"
        f" {level} {UNITS_OF_NOISE[kind]}: {answer}.",
        section,
    )


@checked
def split_measured(found: xr.Dataset) -> dict[str, xr.Dataset]:
    """Each antenna's part of a study, and each classifier's if there are several, by name."""
    require_variables(found, "antenna", "classifier")
    parts = {}
    for antenna in found["antenna"].values:
        for classifier in found["classifier"].values:
            name = (
                str(antenna) if found.sizes["classifier"] == 1 else f"{antenna}, {classifier}"
            )
            one = found.sel(antenna=antenna, classifier=classifier, drop=True)
            parts[name] = one.assign_attrs(antenna=name)
    return parts


def fill_section(section: Section, measured: Mapping[str, xr.Dataset], study: Study) -> None:
    """The figure and its tables."""
    told = study.sets > 1
    bars = ", bars: speeds that the sets do not tell from it" * told
    brackets = ", in brackets the range that the sets do not tell from it" * told
    section.figure(
        "tradeoff",
        "a, b: accuracy of an ideal observer at each speed, against time and distance since contact"
        f" (first antenna, absolute noise); c: the best speed for each deadline{bars}; d, e: bits"
        " of untruncated touches and (dashed) at equal distance and equal number of samples; f, g:"
        f" work on the antenna and peak force. n = {study.sets} set(s) of touches.",
        lambda figure: _plot_tradeoff(measured, study.shown, figure),
        height=4.8,
    )
    for name, data in measured.items():
        for kind, level in study.shown.items():
            section.table(
                ["window", *(f"{v:g} m/s" for v in data["speed"].values), "best"],
                _list_rows(data, study, level),
                f"{name}, noise {level} {UNITS_OF_NOISE.get(kind, '')}: bits, and accuracy in %."
                f" Best speed by accuracy [m/s]{brackets}.",
            )
    costs = [
        [name, cost, *(float(x) for x in data[field].mean("set"))]
        for name, data in measured.items()
        for field, cost in (
            ("work", "work [µJ]"),
            ("force", "peak force [mN]"),
            ("release", "last contact [ms]"),
        )
    ]
    speeds = next(iter(measured.values()))["speed"].values
    section.table(["antenna", "of a whole touch", *(f"{v:g} m/s" for v in speeds)], costs)


def _list_rows(data: xr.Dataset, study: Study, level: str) -> list[list[object]]:
    """Matched rows: the same time, the same distance, the same distance and samples, and the whole
    touch.
    """
    wanted = [f"{t:g} ms" for t in study.windows["matched_times"]]
    wanted.append(f"{study.windows['matched_distance']:g} mm")
    wanted += [
        str(w)
        for w in data["window"].values[
            np.isin(data["kind"].values, ("distance and samples", "whole touch"))
        ]
    ]
    bits, accuracy = (
        average_sets(data[field].sel(level=level))["mean"] for field in ("bits", "accuracy")
    )
    best = find_best(data, level)
    rows: list[list[object]] = []
    for window in wanted:
        cells = [
            f"{float(b):.2f} ({100 * float(a):.0f})"
            for b, a in zip(bits.sel(window=window), accuracy.sel(window=window), strict=True)
        ]
        found = best.sel(window=window)
        fastest = f"{float(found['best']):g}"
        if study.sets > 1 and len(cells) > 1:
            fastest += f" ({float(found['least']):g}…{float(found['most']):g})"
        rows.append([window, *cells, fastest])
    return rows


def _tabulate(data: xr.Dataset) -> xr.Dataset:
    """A row per speed, level and window: means over the sets, and half their interval."""
    found = {
        f"{field}{ending}": average_sets(data[field])[part]
        for field in ("accuracy", "bits")
        for ending, part in (("", "mean"), ("_half", "half"))
    }
    costs = {name: data[name].mean("set") for name in ("work", "force", "release")}
    names = ("antenna", "speed", "level", "window")
    table = (
        xr.Dataset(found | costs)
        .drop_vars(("kind", "value"))
        .assign(antenna=data.attrs["antenna"])
    )
    flat = table.stack(row=names[1:]).reset_index("row")
    return flat.reset_coords()[[*names, *found, *costs]]
