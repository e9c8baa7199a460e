"""Draw accuracy against noise."""

from typing import Any

from matplotlib.axes import Axes

from feeler.decoding.curves import Curves
from feeler.decoding.sweep import Sweep
from feeler.plotting.look import FEWEST, pick_colours


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
            label = None if place else "null: one tensor repeated"
            colour = colours.get(name, "#000000")
            plot_sweep(null, ax, color=colour, ls="--", marker="s", label=label)
    for place, (name, sweep) in enumerate(curves.baselines.items()):
        label = None if place else "peak place and time only"
        points = 100 * sweep.ratios, 100 * sweep.noisy.mean(axis=1)
        ax.plot(*points, ls="-.", marker="x", ms=4, lw=0.7, color=colours[name], label=label)
    ax.axhline(100 * sweep.chance, color="#888888", ls=":", lw=0.8, label="chance")
    ax.set(xlim=(0, 32), ylim=(0, 103))
    ax.tick_params(labelsize=7)


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
