"""Fig. S6: dispersion by contact speed and by stiffness profile, of codes and tensors."""

from types import SimpleNamespace
from typing import Any

from matplotlib.figure import Figure, SubFigure

from feeler.analysis import INDICES
from feeler.plotting.results import plot_index
from feeler.plotting.style import mark_panels, set_decades
from feeler.report import Section, make_spread
from paper.context import Context
from paper.fig5_data import MAIN, load, name_speeds

_LEAST = 1e-5  # of the greatest MSE that is drawn: identical pairs have none
_KINDS = {"raw": "tensor", "joint": "activation"}
"""What the values of the paper's two data sets are called."""


def plot(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
    """Rows: the four indices; columns: activations and tensors, by speed (a) and by profile (b)."""
    pairs = [(comparison, kind) for comparison in data.dispersions for kind in MAIN]
    axes = figure.subplots(len(INDICES), len(pairs), sharex="col", squeeze=False)
    for column, (comparison, kind) in zip(axes.T, pairs, strict=True):
        for index, ax in zip(INDICES, column, strict=True):
            plot_index(data.dispersions[comparison][kind], index, ax)
            if not INDICES[index].is_similarity:
                set_decades(ax)
                ax.set_ylim(bottom=max(ax.get_ylim()[0], _LEAST * ax.get_ylim()[1]))
        column[0].set_title({"joint": "activations", "raw": "tensors"}[kind])
    mark_panels(axes[0, :: len(MAIN)])
    named: dict[str, Any] = {}
    for ax in axes[0]:
        named |= dict(zip(*ax.get_legend_handles_labels()[::-1], strict=True))
    figure.legend(named.values(), named.keys(), loc="outside lower center", ncols=len(named))
    for index, ax in zip(INDICES, axes[:, 0], strict=True):
        ax.set_ylabel(INDICES[index].label)


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
        "Every tensor's closest match among the others of its group (dots), mean and 95 % bootstrap"
        " interval over the touches of the fixed grid, by four indices; a: by speed, b: by profile."
        " Low Pearson r, SSIM and NMI and high MSE mean more dispersed. Pairs without a"
        " difference are below the axis of MSE. Profiles in the paper's"
        " window; complete touches are in a table of their own. (Fig. S6)",
        lambda figure: plot(data, figure),
        height=6.4,
        numbers=values,
    )
    section.values |= values
