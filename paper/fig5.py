"""Fig. 5A–D and S6: accuracy against noise, dispersion, and touches that were never trained."""

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure, SubFigure

from feeler.analysis import INDICES
from feeler.analysis.dispersion import bootstrap_mean
from feeler.decoding import Relative, compute_left_out
from feeler.decoding.classifiers import make_lda
from feeler.decoding.sweeps import Plan
from feeler.objects.trials import SPEEDS
from feeler.plotting.results import plot_index
from feeler.plotting.style import mark_panels, pick_colours, set_decades
from feeler.report import Section, make_spread
from feeler.tensors.transforms import rectify
from paper.context import Context
from paper.data import (
    WINDOWS,
    complete_tensors,
    list_profiles,
    load_complete,
    load_tensors,
    select_speed,
)
from paper.fig5_data import MAIN
from paper.fig5_data import compute as compute_dispersion
from paper.readings_computed import trace_main

# Fig. 5A–D: how well touches are discriminated, by speed and by profile, against noise.


def compute(context: Context) -> SimpleNamespace:
    """What :func:`paper.fig5_data.compute` gives, and ``traced``, accuracy (ratio, repeat) of each
    group of each comparison under the main reading.
    """
    data = compute_dispersion(context)
    traced = {comparison: trace_main(context, comparison) for comparison in data.curves}
    return SimpleNamespace(**vars(data), traced=traced)


def plot(data: SimpleNamespace, figure: Figure) -> None:
    """The paper's panels a to d: NMI above; accuracy of each group against noise below."""
    curves = data.traced
    top, bottom = figure.subfigures(2, 1, height_ratios=(1, 1.25), squeeze=False).flat
    axes = top.subplots(1, 2 * len(curves), sharey=True, squeeze=False)[0]
    pairs = [(comparison, kind) for comparison in curves for kind in MAIN]
    for ax, (comparison, kind) in zip(axes, pairs, strict=True):
        plot_index(data.dispersions[comparison][kind], "nmi", ax)
        ax.set_title({"joint": "activations", "raw": "tensors"}[kind])
    axes[0].set_ylabel("NMI with the closest match")
    mark_panels(axes[::2])
    x, chance = (
        [100 * ratio for ratio in data.plan.ratios if ratio > 0],
        1 / _count_classes(data),
    )
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


def show(data: SimpleNamespace, section: Section) -> None:
    """Accuracy by speed and by profile, beside its null."""
    section.figure(
        "fig5_classification",
        "a, b: NMI of every tensor's closest match (dots), mean and 95 % bootstrap interval over"
        " the touches of the fixed grid, of activations and tensors. c, d: accuracy of LDA on"
        f" activations against noise ({_count_classes(data)} classes), under the reading nearest to"
        " the paper's words: principal components of all clean activations, then noise; line: mean,"
        f" shaded: ± 1 SD over {data.plan.n_repeats} repeats; chance dotted. Profiles in the"
        " paper's window; complete touches are in a figure of their own. (Fig. 5A–D)",
        lambda figure: plot(data, figure),
        height=4.4,
        numbers={"accuracy": data.traced},
    )


# Fig. S6: dispersion by contact speed and by stiffness profile, of codes and tensors.

_DRAWN = ("dispersion.tensor.", "dispersion.activation.")
_LEAST = 1e-5  # of the greatest MSE that is drawn: identical pairs have none


def plot_dispersion(data: SimpleNamespace, figure: Figure | SubFigure) -> None:
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


def show_dispersion(data: SimpleNamespace, section: Section) -> None:
    """Every closest match, by speed and by profile."""
    section.figure(
        "figS6_dispersion",
        "Every tensor's closest match among the others of its group (dots), mean and 95 % bootstrap"
        " interval over the touches of the fixed grid, by four indices; a: by speed, b: by profile."
        " Low Pearson r, SSIM and NMI and high MSE mean more dispersed. Pairs without a"
        " difference are below the axis of MSE. Profiles in the paper's"
        " window; complete touches are in a table of their own. (Fig. S6)",
        lambda figure: plot_dispersion(data, figure),
        height=6.4,
        numbers={key: one for key, one in data.rows.items() if key.startswith(_DRAWN)},
    )


# Beside Fig. 5: trained on some touches, tested on others: a new size or place, a shifted
# place, another speed; what a new touch costs, and why.

_ATTRIBUTES = ("feature", "size", "location")
_SPLITS = {"size": ("feature", "location"), "place": ("feature", "size")}
"""What is left out in turn, and what is then read of the touches that have it."""
_LEFT_OUT = {"size": "size", "place": "location"}


def classify_new(tensors: xr.Dataset, plan: Plan, *, random_state: int = 0) -> SimpleNamespace:
    """Leave out every size, then every place, in turn; LDA on the tensors of one speed.

    Returns
    -------
    SimpleNamespace
        By split: ``accuracy`` on clean touches of a size or place that was never trained, how often
        each of these ``touches`` (trial,) was classified correctly, ``chance``, and
        ``parts[split][attribute]``, the share of the answers in which that part is right.
        ``change`` by attribute: how much a tensor changes if only that
        is changed (a place by one step), as a share of its norm.
    """
    array = rectify(tensors["angle"].transpose("trial", "sensor", "time").values)
    names = {
        a: np.array([f"{v:g}" if a != "feature" else v for v in tensors[a].values])
        for a in _ATTRIBUTES
    }
    options = {
        "ratios": (plan.probe,),
        "n_copies": plan.n_copies,
        "n_repeats": plan.n_repeats,
        "noise": Relative(),
        "random_state": random_state,
    }
    accuracy, touches, chance, parts = {}, {}, {}, {}
    for split, read in _SPLITS.items():
        groups = names[_LEFT_OUT[split]]
        labels = np.array(
            [" ".join(row) for row in zip(*(names[a] for a in read), strict=True)]
        )
        folds = list(
            compute_left_out(
                array / array.max(), labels, groups, estimator=make_lda(), **options
            ).values()
        )
        touches[split] = np.concatenate([sweep.hits[-1].mean(axis=0) for sweep in folds])
        accuracy[split] = float(touches[split].mean())
        chance[split] = folds[0].chance
        confusion = sum(sweep.confusion[-1] for sweep in folds)
        words = np.array([str(name).split(" ") for name in folds[0].classes])
        share = confusion / confusion.sum()
        parts[split] = {
            a: float(share[words[:, None, k] == words[None, :, k]].sum())
            for k, a in enumerate(read)
        }
    # Mean over pairs of touches that differ in one attribute only (places: by one step)
    steps = {
        a: {value: k for k, value in enumerate(sorted(set(v.tolist())))}
        for a, v in names.items()
    }
    found: dict[str, list[float]] = {a: [] for a in _ATTRIBUTES}
    for i, j in combinations(range(len(array)), 2):
        differ = [a for a in _ATTRIBUTES if names[a][i] != names[a][j]]
        near = {
            a: abs(steps[a][names[a][i]] - steps[a][names[a][j]]) == 1 or a != "location"
            for a in differ
        }
        if len(differ) == 1 and near[differ[0]]:
            size = (np.linalg.norm(array[i]) + np.linalg.norm(array[j])) / 2
            found[differ[0]].append(float(np.linalg.norm(array[i] - array[j]) / size))
    change = {
        a: float(np.mean(values)) if values else float("nan") for a, values in found.items()
    }
    return SimpleNamespace(
        accuracy=accuracy, touches=touches, chance=chance, parts=parts, change=change
    )


def compute_new(context: Context) -> SimpleNamespace:
    """New sizes and places, by profile at slow touch, in both windows: ``rows``, and ``lines`` of a
    table.
    """
    rows: dict[str, object] = {}
    lines, plan = [], context.effort.plan
    for window, profiles in _load_windows(context).items():
        for name, tensors in profiles.items():
            new = classify_new(tensors, plan, random_state=context.seed)
            for split, right in new.touches.items():
                one = bootstrap_mean(right, np.random.default_rng(0))
                found = make_spread(one.estimate, one.low, one.high, n=right.size)
                rows[f"generalise.{split}.{window}.{name}"] = found
                rows[f"generalise.chance.{split}"] = new.chance[split]
            for attribute, change in new.change.items():
                rows[f"generalise.change.{attribute}.{window}.{name}"] = change
            shares = [(new.accuracy[s], *new.parts[s].values()) for s in _SPLITS]
            changed = [100 * new.change[attribute] for attribute in _LEFT_OUT.values()]
            lines.append(
                [window, name, *(100 * one for split in shares for one in split), *changed]
            )
    return SimpleNamespace(rows=rows, lines=lines, probe=plan.probe)


def _load_windows(context: Context) -> dict[str, dict[str, xr.Dataset]]:
    """Slow touches of every profile in the paper's window; of several, complete ones beside them,
    because it cuts them differently.
    """
    names = list_profiles(context)
    slow = {name: select_speed(load_tensors(context, name), SPEEDS["slow"]) for name in names}
    if len(names) < 2:
        return {WINDOWS[0]: slow}
    whole = {name: complete_tensors(load_complete(context, name)) for name in names}
    return dict(zip(WINDOWS, (slow, whole), strict=True))


def show_new(data: SimpleNamespace, section: Section) -> None:
    """A table of new sizes and places."""
    section.heading("New sizes and places")
    header = ["window", "profile", "new size [%]", "of it shape", "place"]
    section.table(
        [*header, "new place [%]", "of it shape", "size", "change by size [%]", "by place"],
        data.lines,
        "Accuracy of LDA on clean slow touches whose size, or place, was never trained (noise of"
        f" {100 * data.probe:g} % in training), and how often each part is right (on noisy copies)."
        " Last: by"
        " which share of its norm a tensor changes if only its size or its place (one step) does.",
    )
