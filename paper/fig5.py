"""Fig. 5A–D: how well touches are discriminated, by speed and by profile, against noise."""

from collections.abc import Mapping, Sequence
from types import SimpleNamespace

import numpy as np
from matplotlib.figure import Figure

from feeler.decoding import CODES
from feeler.decoding.curves import Curves
from feeler.encoding import LABELS
from feeler.plotting.results import plot_index
from feeler.plotting.style import mark_panels, pick_colours
from feeler.report import Section, make_spread
from paper.context import Context
from paper.fig5_data import (
    MAIN,
    load,
    name_speeds,
    spread_accuracy,
)
from paper.readings_computed import trace_main

KEPT_AT = (0.1, 0.3)
"""Noise ratios at which the paper names the variance that its principal components keep."""


def plot(
    data: SimpleNamespace,
    curves: Mapping[str, Mapping[str, np.ndarray]],
    ratios: Sequence[float],
    figure: Figure,
) -> None:
    """The paper's panels a to d: NMI above; accuracy (ratio, repeat) of each group against noise
    below.
    """
    top, bottom = figure.subfigures(2, 1, height_ratios=(1, 1.25), squeeze=False).flat
    axes = top.subplots(1, 2 * len(curves), sharey=True, squeeze=False)[0]
    pairs = [(comparison, kind) for comparison in curves for kind in MAIN]
    for ax, (comparison, kind) in zip(axes, pairs, strict=True):
        plot_index(data.dispersions[comparison][kind], "nmi", ax)
        ax.set_title({"joint": "activations", "raw": "tensors"}[kind])
    axes[0].set_ylabel("NMI with the closest match")
    mark_panels(axes[::2])
    x, chance = [100 * ratio for ratio in ratios if ratio > 0], 1 / _count_classes(data)
    below = bottom.subplots(1, len(curves), sharey=True, squeeze=False)[0]
    for (comparison, groups), ax in zip(curves.items(), below, strict=True):
        colours = pick_colours(groups)
        for name, found in groups.items():
            mean, sd = 100 * found.mean(axis=1), 100 * found.std(axis=1)
            ax.plot(x, mean, color=colours[name], label=name)
            ax.fill_between(x, mean - sd, mean + sd, color=colours[name], alpha=0.2, lw=0)
        ax.axhline(100 * chance, color="#888888", ls=":", lw=0.8, label="chance")
        ax.set(
            xlabel="noise [% of each vector's maximum]", ylim=(0, 103), title=f"by {comparison}"
        )
        ax.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0), borderaxespad=0.2)
    mark_panels(below, "cd")
    below[0].set_ylabel("LDA accuracy [%]")


def _count_classes(data: SimpleNamespace) -> int:
    """Every touch of a group is a class."""
    return len(next(iter(data.groups["speed"].values())).tensors)


def show(context: Context, section: Section) -> None:
    """Accuracy by speed and by profile, beside its null."""
    data, plan = load(context), context.effort.plan
    traced = {comparison: trace_main(context, comparison) for comparison in data.curves}
    section.figure(
        "fig5_classification",
        "a, b: NMI of every tensor's closest match (dots), mean and 95 % bootstrap interval over"
        " the"
        " touches of the fixed grid, of activations and tensors. c, d: accuracy of LDA on"
        " activations"
        f" against noise ({_count_classes(data)} classes), under the reading nearest to the"
        " paper's"
        " words: principal components of all clean activations, then noise; line: mean, shaded: ± 1"
        f" SD over {plan.n_repeats} repeats; chance dotted. Profiles in the paper's window;"
        " complete"
        " touches are in a figure of their own. (Fig. 5A–D)",
        lambda figure: plot(data, traced, plan.ratios, figure),
        height=4.4,
        numbers={"accuracy": traced},
    )
    section.heading("Classification, other readings")
    section.text(
        "Thirty classes (feature × location) by linear discriminant analysis of 30 principal"
        " components, here fitted to noisy training copies. The paper's copies of one tensor are in"
        " training and test alike, so its accuracy measures robustness against noise. The null is"
        " as"
        " many copies of one single tensor, fitted jointly and pushed through the same pipeline:"
        " what it reaches is no evidence that tensors differ. Fixed bases give identical tensors"
        " one"
        " code, so their null is chance."
    )
    section.values |= _collect_values(data.curves, name_speeds(context), plan.n_restarts)
    section.table(
        [
            "by",
            "code",
            "copies",
            "noise [%]",
            "accuracy [%], mean over the noise, 0 % included",
            "null [%]",
        ],
        [row for c, curves in data.curves.items() for row in _list_copies(c, curves)],
        "Accuracy depends on how many noisy copies of each tensor there are. The null is one tensor"
        " repeated. Profiles in the paper's window; complete touches stand below.",
    )


def _collect_values(
    by_comparison: Mapping[str, Curves], speeds: Mapping[str, str], starts: int
) -> dict[str, object]:
    """Accuracy of every group, and the variance kept of the first group's codes, with the ends of
    its repeats.
    """
    values: dict[str, object] = {}
    for curves in by_comparison.values():
        for group, sweep in curves.find("joint").items():
            found = spread_accuracy(sweep, starts)
            values[f"classification.lda.{speeds.get(group, group)}"] = found
    first = next(iter(next(iter(by_comparison.values())).find("joint").values()))
    for ratio in KEPT_AT:
        rows = np.isclose(first.ratios, ratio)
        for name, kept in (
            ("clean codes", first.kept_clean),
            ("noisy copies", first.kept_noisy),
        ):
            if rows.any():
                value = make_spread(
                    np.nanmean(kept[rows]),
                    np.nanmin(kept[rows]),
                    np.nanmax(kept[rows]),
                    n=starts,
                )
                values[f"classification.pca.{name} at {100 * ratio:g} % noise"] = value
    return values


def _list_copies(comparison: str, curves: Curves) -> list[list[str]]:
    """Rows of accuracy after noise of the paper's kind: comparison, code, copies, noise, each
    group, null.
    """
    rows = []
    copies = sorted({c.n_copies for c in curves.sweeps if c.when == "after"})
    for kind in CODES:
        for n in copies:
            found = curves.find(kind, n_copies=n)
            if not found:  # not tried with so many copies
                continue
            ratios = "/".join(
                f"{100 * ratio:.0f}" for ratio in next(iter(found.values())).ratios
            )
            accuracies = ", ".join(
                f"{name} {100 * sweep.noisy.mean():.0f}" for name, sweep in found.items()
            )
            own = found if kind == "joint" else list(found)[:1]
            nulls = {name: curves.find_null(kind, n_copies=n, group=name) for name in own}
            shown = ", ".join(
                f"{name} {100 * null.noisy.mean():.0f}"
                for name, null in nulls.items()
                if null is not None
            )
            rows.append([comparison, LABELS[kind], str(n), ratios, accuracies, shown])
    return rows
