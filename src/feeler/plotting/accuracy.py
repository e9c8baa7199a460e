"""Draw accuracy against noise."""

from typing import Any

from matplotlib.axes import Axes

from feeler.decoding.curves import Curves
from feeler.decoding.sweep import Sweep
from feeler.plotting.look import FEWEST, PALETTE


def plot_curves(curves: Curves, kind: str, noise: str, ax: Axes) -> None:
    """Mean ± 1 SD by group; null dashed, baseline dash-dotted, chance dotted."""
    for colour, (name, sweep) in zip(PALETTE, curves.find(kind, noise).items(), strict=False):
        plot_sweep(sweep, ax, color=colour, label=name)
    own = kind == "joint"  # fixed codes have one null: identical touches get one code
    for colour, name in zip(
        PALETTE if own else ("#000000",), curves.find(kind, noise) if own else (None,), strict=False
    ):
        null = curves.find_null(kind, noise, group=name)
        if null is not None:
            first = colour in (PALETTE[0], "#000000")
            plot_sweep(
                null,
                ax,
                color=colour,
                ls="--",
                marker="s",
                label="null: one tensor repeated" if first else None,
            )
    for colour, (name, sweep) in zip(PALETTE, curves.baselines.items(), strict=False):
        label = "peak place and time only" if name == next(iter(curves.baselines)) else None
        place = 100 * sweep.ratios, 100 * sweep.noisy.mean(axis=1)
        ax.plot(*place, ls="-.", marker="x", ms=4, lw=0.7, color=colour, label=label)
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
