"""Fig. 5A–E: how well touches are discriminated, by speed and by profile, against noise."""

from collections.abc import Mapping
from types import SimpleNamespace

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure

from feeler.decoding import CODES
from feeler.decoding.curves import Curves
from feeler.encoding import LABELS
from feeler.plotting.results import name_kinds, plot_curves, plot_kinds
from feeler.plotting.tensors import plot_tensor_grid
from feeler.report import Section, make_spread
from paper.context import Context
from paper.fig5_data import (
    MAIN,
    load,
    name_speeds,
    spread_accuracy,
)

KEPT_AT = (0.1, 0.3)
"""Noise ratios at which the paper names the variance that its principal components keep."""
_UNIT = "of the greatest angle"


def plot(data: SimpleNamespace, figure: Figure) -> None:
    """5A, B above with the conditions of 5E; 5C and D below, a column per kind of code, a row per
    noise model.
    """
    n_blocks = len(data.curves)
    top, *blocks = figure.subfigures(
        1 + n_blocks, 1, height_ratios=(1.2, *[2] * n_blocks), squeeze=False
    ).flat
    _plot_top(data, top)
    for (comparison, curves), block in zip(data.curves.items(), blocks, strict=True):
        letter = "C" if comparison == "speed" else "D"
        axes = block.subplots(len(curves.noises), len(CODES), sharex=True, sharey=True)
        block.suptitle(f"{letter}  LDA accuracy by {comparison}", x=0.02, ha="left", fontsize=8)
        for noise, line in zip(curves.noises, axes, strict=True):
            for kind, ax in zip(CODES, line, strict=True):
                plot_curves(curves, kind, noise, ax)
            line[0].set_ylabel(f"accuracy [%]\n{noise} noise", fontsize=7)
        for kind, above, below in zip(CODES, axes[0], axes[-1], strict=True):
            above.set_title(LABELS[kind], fontsize=7)
            below.set_xlabel("noise [%]", fontsize=7)
        block.legend(
            *axes[0, 0].get_legend_handles_labels(),
            loc="outside lower center",
            ncols=7,
            fontsize=7,
            columnspacing=1.0,
            handletextpad=0.3,
        )


def _plot_top(data: SimpleNamespace, figure: SubFigure) -> None:
    """NMI of codes and tensors for both comparisons, and one tensor per condition."""
    left, right = figure.subfigures(1, 2, width_ratios=(3, 2), squeeze=False).flat
    axes = left.subplots(1, len(data.curves), squeeze=False)[0]
    for letter, comparison, ax in zip("AB", data.curves, axes, strict=False):
        found = [data.dispersions[comparison][kind] for kind in MAIN]
        plot_kinds(found, "nmi", ax)
        name_kinds(found, [LABELS[kind] for kind in MAIN], ax)
        ax.set_title(f"{letter}  by {comparison}", loc="left")
        ax.tick_params(labelsize=7)
        ax.legend(fontsize=7, handletextpad=0)
    axes[0].set_ylabel("NMI with closest match", fontsize=7)
    examples = {
        name: group.tensors[len(group.tensors) // 2]
        for members in data.groups.values()
        for name, group in members.items()
    }
    _plot_examples(examples, right.subplots())
    right.suptitle(f"E  one tensor per condition ({_UNIT})", fontsize=8)


def _plot_examples(examples: Mapping[str, np.ndarray], ax: Axes) -> None:
    """One tensor (sensor, time) of each condition, on one colour scale."""
    tensors = list(examples.values())
    norm = Normalize(0, max(tensor.max() for tensor in tensors))
    time = np.arange(tensors[0].shape[1])
    image = plot_tensor_grid(
        [[tensor] for tensor in tensors], time, ax, norm, list(examples), [""], _UNIT
    )
    if (figure := ax.get_figure(root=False)) is not None:
        figure.colorbar(image, ax=ax, pad=0.02)
    ax.tick_params(labelsize=7)
    ax.set_xlabel("time [ms]", fontsize=7)
    ax.set_ylabel("sensor (base → tip upwards)", fontsize=7)


def show(context: Context, section: Section) -> None:
    """Accuracy by speed and by profile, beside its null."""
    data, plan = load(context), context.effort.plan
    section.heading("Classification")
    section.text(
        "Thirty classes (feature × location) by linear discriminant analysis of 30 principal"
        " components, trained on noisy copies. The paper's copies of one tensor stand in training"
        " and test alike, so its accuracy measures robustness against noise. Each curve of jointly"
        " fitted codes therefore stands beside its own null (dashed, same colour): as many copies"
        " of one single tensor of that group, fitted jointly and pushed through the same pipeline."
        " What the null reaches is no evidence that tensors differ. Fixed bases give identical"
        " tensors one code, so their null (black) is chance."
    )
    section.figure(
        "fig5_classification",
        "Top: NMI of the closest match, and one tensor for each condition. Below: accuracy"
        " against noise for each kind of code, by speed and by profile; mean ± 1 SD over repeats;"
        " null dashed, peak-position baseline dash-dotted, chance dotted. Profiles in the paper's"
        " window; complete touches stand below, under that heading. (Fig. 5A–E)",
        lambda figure: plot(data, figure),
        height=9.0,
        numbers={
            name: {
                comparison: {str(tuple(k)): getattr(v, part) for k, v in curves.sweeps.items()}
                for comparison, curves in data.curves.items()
            }
            for name, part in (("curves", "noisy"), ("clean", "clean"))
        },
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
    section.heading("Variance kept, and confusions")
    for comparison, curves in data.curves.items():
        section.text(_describe_kept(comparison, curves))
    for name, confused in data.confused.items():
        section.text(f"{name}: {confused.describe()}")
    section.text(
        f"Effort at this scale: noise of {', '.join(f'{100 * ratio:g}' for ratio in plan.ratios)}"
        f" %, {plan.n_repeats} repeats with {plan.n_copies} copies per trial;"
        f" {', '.join(map(str, plan.other_copies)) or 'no other'} copies at {100 * plan.probe:g} %;"
        f" noise before encoding with {plan.before_repeats} repeats."
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


def _describe_kept(comparison: str, curves: Curves) -> str:
    name, sweep = next(iter(curves.find("joint").items()))
    pairs = zip(
        sweep.ratios, sweep.kept_noisy.mean(axis=1), sweep.kept_clean.mean(axis=1), strict=True
    )
    kept = ", ".join(f"{100 * r:.0f} %: {100 * a:.0f} / {100 * b:.0f} %" for r, a, b in pairs)
    return (
        f"by {comparison}, {name}: variance that 30 components keep, of noisy copies / of clean"
        f" codes, at {kept}"
    )
