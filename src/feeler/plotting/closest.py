"""Draw closest matches, how far apart the tensors of each group lie; and values with their
intervals.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from feeler.dispersion import Dispersion, Interval
from feeler.plotting.look import pick_colours


def plot_index(dispersion: Dispersion, index: str, ax: Axes) -> None:
    """One kind of code, each group above its name."""
    plot_kinds([dispersion], index, ax)
    names = [str(group) for group in dispersion.groups]
    ax.set_xticks(
        range(len(names)), names, rotation=30, ha="right", rotation_mode="anchor", fontsize=7
    )
    ax.tick_params(axis="y", labelsize=7)


def plot_kinds(dispersions: Sequence[Dispersion], index: str, ax: Axes) -> None:
    """Every tensor's closest match as a dot, group averages with their 95 % intervals; a free place
    between sets.
    """
    sets = [
        {str(g): (d.values(index, g), d.average[index][g]) for g in d.groups}
        for d in dispersions
    ]
    plot_groups(sets, ax)


def plot_groups(sets: Sequence[Mapping[str, tuple[np.ndarray, Interval]]], ax: Axes) -> None:
    """Every value (trial,) of each group as a dot, its average with the interval beside it; a free
    place between sets.
    """
    rng = np.random.default_rng(0)  # spreads the dots sideways only
    starts = np.arange(len(sets)) * (len(sets[0]) + 1)
    colours = pick_colours(sets[0])
    for place, group in enumerate(sets[0]):
        values = [members[group][0] for members in sets]
        dots = np.repeat(starts + place, [len(v) for v in values]) + rng.uniform(
            -0.15, 0.15, sum(map(len, values))
        )
        colour = colours[group]
        ax.plot(dots, np.concatenate(values), ".", ms=2, color=colour, alpha=0.4)
        mean, low, high = np.array([_list_interval(members[group][1]) for members in sets]).T
        error = mean - low, high - mean
        ax.errorbar(
            starts + place + 0.28,
            mean,
            error,
            fmt="o",
            ms=4,
            capsize=2,
            color=colour,
            label=group,
        )


def name_kinds(dispersions: Sequence[Dispersion], names: Sequence[str], ax: Axes) -> None:
    """The kind of code below the middle of each set that ``plot_kinds`` drew."""
    n_groups = len(dispersions[0].groups)
    ax.set_xticks(np.arange(len(dispersions)) * (n_groups + 1) + (n_groups - 1) / 2, names)


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


def _list_interval(interval: Interval) -> tuple[float, float, float]:
    return interval.estimate, interval.low, interval.high
