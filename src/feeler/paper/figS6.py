"""Fig. S6 (and Fig. 5A, B): dispersion by contact speed and by stiffness profile, codes and tensors."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.decoding.verdict import Verdict, judge_order
from feeler.dispersion import GREATEST, INDICES, Dispersion, Interval, compute_dispersion
from feeler.errors import InvalidInput
from feeler.plotting.style import PALETTE

NAMES = {"pearson": "Pearson r", "ssim": "SSIM", "mse": "MSE", "nmi": "NMI"}
CLAIMS = {
    "speed": "slower touch spreads tensors more",
    "profile": "exponential spreads tensors most, constant least",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class FigS6Data:
    """Dispersions of both comparisons (``speed``, ``profile``), by kind of code."""

    dispersions: dict[str, dict[str, Dispersion]]
    """dispersions[comparison][kind]; groups in the claimed order, most dispersed first, controls after."""
    claimed: dict[str, tuple[str, ...]]
    """Groups that each claim is about, most dispersed first."""
    verdicts: tuple[Verdict, ...]


def compute(
    codes: Mapping[str, Mapping[str, Mapping[str, np.ndarray]]],
    claimed: Mapping[str, tuple[str, ...]],
    *,
    random_state: int = 0,
) -> FigS6Data:
    """All four indices of every comparison, kind of code and group, and the verdict on each order.

    Parameters
    ----------
    codes
        codes[comparison][kind][group]: arrays (trial, vector, time); stimuli in the same order in all groups of a
        comparison, all groups on one scale.
    claimed
        Groups of each comparison in the order that the paper claims, most dispersed first.
    """
    dispersions: dict[str, dict[str, Dispersion]] = {}
    verdicts = []
    for comparison, kinds in codes.items():
        dispersions[comparison] = {}
        for kind, groups in kinds.items():
            found = compute_groups(groups, random_state=random_state)
            dispersions[comparison][kind] = found
            if len(claimed[comparison]) > 1:
                verdicts += [judge(found, index, comparison, kind, claimed[comparison]) for index in INDICES]
    return FigS6Data(dispersions=dispersions, claimed=dict(claimed), verdicts=tuple(verdicts))


def compute_groups(groups: Mapping[str, np.ndarray], *, random_state: int = 0, **options) -> Dispersion:
    """Dispersion of named groups on one common scale."""
    together = np.concatenate(list(groups.values()))
    names = [name for name, array in groups.items() for _ in array]
    return compute_dispersion(together, names, random_state=random_state, **options)


def judge(found: Dispersion, index: str, comparison: str, kind: str, claimed: tuple[str, ...]) -> Verdict:
    """Verdict on one index: similar tensors have high Pearson, SSIM, NMI, and low MSE."""
    if missing := [name for name in claimed if name not in found.groups]:
        raise InvalidInput(f"no group {missing[0]!r}; groups: {', '.join(map(str, found.groups))}.")
    values = {name: found.values(index, name) for name in claimed}
    return judge_order(
        values, claim=CLAIMS[comparison], measure=f"{NAMES[index]} of {kind}", greater=not GREATEST[index]
    )


def plot(data: FigS6Data, figure: Figure | SubFigure) -> None:
    """Rows: the four indices; columns: the comparisons; side by side the kinds of code, and in each the groups."""
    axes = figure.subplots(len(INDICES), len(data.dispersions), sharex="col", sharey="row", squeeze=False)
    for (comparison, kinds), column in zip(data.dispersions.items(), axes.T, strict=True):
        for index, ax in zip(INDICES, column, strict=True):
            plot_kinds(list(kinds.values()), index, ax)
        n_groups = len(next(iter(kinds.values())).groups)
        column[-1].set_xticks(np.arange(len(kinds)) * (n_groups + 1) + (n_groups - 1) / 2, list(kinds))
        column[0].set_title(f"by {comparison}")
        column[0].legend(
            loc="lower center", bbox_to_anchor=(0.5, 1.12), ncols=n_groups, columnspacing=1, handletextpad=0
        )
    for index, ax in zip(INDICES, axes[:, 0], strict=True):
        ax.set_ylabel(f"{NAMES[index]}\n{'low' if GREATEST[index] else 'high'}: more dispersed")


def plot_index(dispersion: Dispersion, index: str, ax) -> None:
    """One kind of code, each group above its name."""
    plot_kinds([dispersion], index, ax)
    names = [str(group) for group in dispersion.groups]
    ax.set_xticks(range(len(names)), names, rotation=30, ha="right", rotation_mode="anchor", fontsize=6)
    ax.tick_params(axis="y", labelsize=6)


def plot_kinds(dispersions: Sequence[Dispersion], index: str, ax) -> None:
    """Every tensor's closest match as a dot, group averages with their 95 % intervals; a free place between sets."""
    rng = np.random.default_rng(0)  # spreads the dots sideways only
    groups = dispersions[0].groups
    starts = np.arange(len(dispersions)) * (len(groups) + 1)
    for place, group in enumerate(groups):
        values = [dispersion.values(index, group) for dispersion in dispersions]
        dots = np.repeat(starts + place, [len(v) for v in values]) + rng.uniform(-0.15, 0.15, sum(map(len, values)))
        colour = PALETTE[place % len(PALETTE)]
        ax.plot(dots, np.concatenate(values), ".", ms=2, color=colour, alpha=0.4)
        mean, low, high = np.array([_list_interval(d.average[index][group]) for d in dispersions]).T
        error = mean - low, high - mean
        ax.errorbar(starts + place + 0.28, mean, error, fmt="o", ms=4, capsize=2, color=colour, label=str(group))


def name_kinds(dispersions: Sequence[Dispersion], names: Sequence[str], ax) -> None:
    """The kind of code below the middle of each set that ``plot_kinds`` drew."""
    n_groups = len(dispersions[0].groups)
    ax.set_xticks(np.arange(len(dispersions)) * (n_groups + 1) + (n_groups - 1) / 2, names)


def _list_interval(interval: Interval) -> tuple[float, float, float]:
    return interval.estimate, interval.low, interval.high
