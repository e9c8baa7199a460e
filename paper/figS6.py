"""Fig. S6: dispersion by contact speed and by stiffness profile, of codes and tensors."""

from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.analysis import INDICES
from feeler.encoding import LABELS
from feeler.plotting.results import plot_kinds
from feeler.report import Section, make_spread
from paper.context import Context
from paper.fig5_data import load, name_speeds

_KINDS = {"raw": "tensor", "joint": "activation"}
"""What the values of the paper's two data sets are called."""


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Rows: the four indices; columns: the comparisons; side by side the kinds of code, and in each
    the groups.
    """
    axes = figure.subplots(
        len(INDICES), len(data.dispersions), sharex="col", sharey="row", squeeze=False
    )
    for letter, (comparison, kinds), column in zip(
        "AB", data.dispersions.items(), axes.T, strict=False
    ):
        for index, ax in zip(INDICES, column, strict=True):
            plot_kinds(list(kinds.values()), index, ax)
        n_groups = len(next(iter(kinds.values())).groups)
        column[-1].set_xticks(
            np.arange(len(kinds)) * (n_groups + 1) + (n_groups - 1) / 2,
            [LABELS[kind].replace(", ", ",\n").replace(" (", "\n(") for kind in kinds],
        )
        column[0].set_title(f"{letter}  by {comparison}", loc="left")
        column[0].legend(
            loc="lower center",
            bbox_to_anchor=(0.5, 1.12),
            ncols=n_groups,
            columnspacing=1,
            handletextpad=0,
        )
    for index, ax in zip(INDICES, axes[:, 0], strict=True):
        ax.set_ylabel(
            f"{INDICES[index].label}\n{'low' if INDICES[index].is_similarity else 'high'}: more"
            " dispersed"
        )


def show(context: Context, section: Section) -> None:
    """Every closest match, by speed and by profile."""
    data, speeds = load(context), name_speeds(context)
    values = {
        f"dispersion.{_KINDS[kind]}.{index}.{speeds.get(group, group)}": make_spread(
            *(interval.estimate, interval.low, interval.high),
            n=context.effort.plan.n_restarts
            if kind == "joint"
            else dispersion.values(index, group).size,
        )
        for found in data.dispersions.values()
        for kind, dispersion in found.items()
        if kind in _KINDS
        for index, groups in dispersion.average.items()
        for group, interval in groups.items()
    }
    section.figure(
        "figS6_dispersion",
        "Every tensor's closest match among the others of its group (dots) and the group's average"
        " with its 95 % bootstrap interval, by four indices. Low Pearson r, SSIM and NMI and high"
        " MSE mean more dispersed. Profiles in the paper's window; complete touches stand below,"
        " under that heading. (Fig. 5A–B, Fig. S6)",
        lambda figure: plot(data, figure),
        height=7.0,
        numbers=values,
    )
    section.values |= values
