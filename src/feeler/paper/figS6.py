"""Fig. S6 (and Fig. 5A, B): dispersion by contact speed and by stiffness profile, codes and tensors."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.decoding.verdict import Verdict, judge_order
from feeler.dispersion import GREATEST, INDICES, Dispersion, compute_dispersion
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
    """Rows: comparison and kind of code; columns: the four indices."""
    rows = [(comparison, kind) for comparison, kinds in data.dispersions.items() for kind in kinds]
    axes = figure.subplots(len(rows), len(INDICES), squeeze=False)
    for (comparison, kind), line in zip(rows, axes, strict=True):
        is_last = kind == list(data.dispersions[comparison])[-1]
        for index, ax in zip(INDICES, line, strict=True):
            plot_index(data.dispersions[comparison][kind], index, ax)
            ax.tick_params(axis="x", labelbottom=is_last)
            if ax in axes[0]:
                ax.set_title(f"{NAMES[index]}\n{'lower' if GREATEST[index] else 'higher'} = more dispersed", fontsize=8)
        line[0].set_ylabel(f"{kind}\nby {comparison}", fontsize=8)


def plot_index(dispersion: Dispersion, index: str, ax) -> None:
    """Every tensor's closest match as a dot, group averages with their 95 % intervals."""
    rng = np.random.default_rng(0)  # spreads the dots sideways only
    for place, group in enumerate(dispersion.groups):
        values, mean = dispersion.values(index, group), dispersion.average[index][group]
        colour = PALETTE[place % len(PALETTE)]
        ax.plot(place + rng.uniform(-0.15, 0.15, values.size), values, ".", ms=2, color=colour, alpha=0.4)
        error = [[mean.estimate - mean.low], [mean.high - mean.estimate]]
        ax.errorbar(place + 0.28, mean.estimate, error, fmt="o", ms=4, capsize=2, color=colour)
    names = [str(group) for group in dispersion.groups]
    ax.set_xticks(range(len(names)), names, rotation=30, ha="right", rotation_mode="anchor", fontsize=6)
    ax.tick_params(axis="y", labelsize=6)
