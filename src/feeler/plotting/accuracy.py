"""Draw accuracy against noise."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from feeler.decoding.curves import Curves
from feeler.decoding.sweep import Sweep
from feeler.plotting.look import FEWEST, pick_colours

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
