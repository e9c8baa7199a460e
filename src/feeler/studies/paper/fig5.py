"""Fig. 5A–E: what slower touch and a stiffness gradient change: dispersion, accuracy against noise,
conditions.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import product
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure, SubFigure

from feeler.decoding import CODES, Confused, explain_confusion, group_tensors, make_labels
from feeler.decoding.curves import Curves, compute_curves
from feeler.decoding.plan import Plan
from feeler.decoding.splits import jitter_trials
from feeler.decoding.verdict import Verdict, compute_explained, judge_order
from feeler.encoding import LABELS
from feeler.experiment.touch import DURATION, touch
from feeler.plotting.accuracy import plot_curves
from feeler.plotting.closest import name_kinds, plot_kinds
from feeler.plotting.tensor import plot_tensor_grid
from feeler.report.section import Section
from feeler.stimulus.ninety import SPEEDS
from feeler.studies.paper import fig5_nulls, figS6
from feeler.studies.paper.claims import PROFILES, READ_BETTER
from feeler.studies.paper.context import Context
from feeler.studies.paper.data import list_profiles, list_speeds, list_touches, load_tensors
from feeler.studies.paper.fig5_nulls import Nulls, compute_nulls, spread
from feeler.studies.paper.fig5_splits import compute_splits
from feeler.studies.paper.figS6 import FigS6Data, list_verdicts

MAIN = ("joint", "raw")
PCA_RATIOS = (0.1, 0.3)


@dataclass(frozen=True, kw_only=True, eq=False)
class Fig5Data:
    """What Fig. 5A–E shows; comparisons are ``speed`` and ``profile``."""

    dispersion: FigS6Data
    curves: dict[str, Curves]
    verdicts: tuple[Verdict, ...]
    """On accuracy; those on dispersion are in ``dispersion``."""
    confused: dict[str, Confused]
    """What is confused at the noisiest level, by group and code."""
    examples: dict[str, np.ndarray]
    """One tensor (sensor, time) per condition, for 5E."""
    unit: str
    splits: dict[str, dict[str, float]]
    """Accuracy on clean touches never trained on, by split and group: shifted place, other speed.
    """
    nulls: Nulls
    """What identical touches reach, and what of jointly fitted codes carries over to a second copy
    of each touch.
    """

    def describe(self) -> str:
        """All verdicts, the variance kept, unseen touches and the confusions in words."""
        lines = [v.describe() for v in (*self.dispersion.verdicts, *self.verdicts)]
        for comparison, curves in self.curves.items():
            lines += _describe_kept(comparison, curves)
        for split, accuracies in self.splits.items():
            found = ", ".join(f"{name} {100 * value:.0f} %" for name, value in accuracies.items())
            lines.append(f"unseen touches, {split}: {found}")
        return "\n".join(
            lines + [f"{name}: {confused.describe()}" for name, confused in self.confused.items()]
        )


def compute(
    tensors: Mapping[str, Any],
    encoder: Any,
    *,
    plan: Plan,
    quantity: str = "angle",
    reference: str = "exponential",
    random_state: int = 0,
    jitter: Callable[[str, float, float], Any] | None = None,
    report: Callable[[str], None] = lambda line: None,
) -> Fig5Data:
    """Both comparisons: the reference antenna at its speeds, and all antennas at the slowest speed.

    Parameters
    ----------
    tensors
        Datasets by antenna name; the reference needs all its speeds, the others at least the
        slowest.
    encoder
        An unfitted ``ConvolutiveNMF``; cloned and fitted once per antenna and comparison: by speed
        on all tensors of the reference antenna, by profile on each antenna's slow tensors alone.
    plan
        How much is computed.
    quantity
        ``angle`` or ``curvature``; negative values are set to 0, as the encoder needs.
    jitter
        ``jitter(antenna name, location, speed)`` simulates that antenna's slow trials again, in the
        order of its Dataset, each shifted and sped up by ``jitter_trials``; None leaves these
        splits out.
    """
    groups = group_tensors(
        tensors, encoder, plan, quantity=quantity, reference=reference, random_state=random_state
    )
    report("encoded " + ", ".join(name for members in groups.values() for name in members))
    claimed = {
        c: tuple(n for n in g if c == "speed" or n in (reference, *PROFILES))
        for c, g in groups.items()
    }
    kinds = {
        c: {k: {n: g.codes[k] for n, g in gs.items()} for k in CODES} for c, gs in groups.items()
    }
    dispersion = figS6.compute(kinds, claimed, random_state=random_state)
    curves: dict[str, Curves] = {}
    for comparison, members in groups.items():
        # The first group of both comparisons is the same antenna at the same speed: noise before
        # encoding once.
        once = replace(plan, before_repeats=0) if curves and not plan.before_all else plan
        curves[comparison] = compute_curves(members, once, random_state=random_state, report=report)
    return Fig5Data(
        dispersion=dispersion,
        curves=curves,
        verdicts=tuple(_judge_curves(curves, claimed)),
        confused=_explain_all(curves, tensors[reference]),
        examples={
            n: g.tensors[len(g.tensors) // 2] for gs in groups.values() for n, g in gs.items()
        },
        unit="of the greatest " + quantity,
        splits=compute_splits(
            groups, tensors, plan, quantity=quantity, jitter=jitter, random_state=random_state
        ),
        nulls=compute_nulls(groups, curves, encoder, plan, random_state=random_state),
    )


def _judge_curves(
    curves: Mapping[str, Curves], claimed: Mapping[str, tuple[str, ...]]
) -> list[Verdict]:
    """The verdict on every accuracy curve, with what the null explains of the best group's."""
    verdicts = []
    for comparison, found in curves.items():
        names = claimed[comparison]
        for kind, noise in (
            product(CODES, found.noises) if len(names) > 1 else ()
        ):  # nothing is claimed of a lone group
            sweeps, null = found.find(kind, noise), found.find_null(kind, noise, group=names[0])
            verdicts.append(
                judge_order(
                    {name: sweeps[name].area for name in names},
                    claim=READ_BETTER[comparison],
                    measure=f"accuracy, {LABELS[kind]}, {noise} noise",
                    explained=np.nan if null is None else compute_explained(sweeps[names[0]], null),
                )
            )
    return verdicts


def _explain_all(curves: Mapping[str, Curves], data: Any) -> dict[str, Confused]:
    """What is confused at the noisiest level, for the paper's code and the tensors."""
    found = {}
    known = {label: k for k, label in enumerate(make_labels(data))}
    for (comparison, both), kind in product(curves.items(), MAIN):
        for name, sweep in both.find(kind).items():
            rows = [known[label] for label in sweep.classes]
            attributes = {a: np.asarray(data[a])[rows] for a in ("feature", "size", "location")}
            title = f"{comparison} {name}, {LABELS[kind]}, noise {100 * sweep.ratios[-1]:.0f} %"
            found[title] = explain_confusion(sweep.confusion[-1], attributes)
    return found


def list_copies(curves: Mapping[str, Curves]) -> list[list[str]]:
    """Rows of accuracy after noise of the paper's kind: comparison, code, copies, noise, each
    group, null.
    """
    rows = []
    for comparison, found_here in curves.items():
        copies = sorted({c.n_copies for c in found_here.sweeps if c.when == "after"})
        for kind, n in product(CODES, copies):
            if found := found_here.find(kind, n_copies=n):  # else not tried with so many copies
                ratios = "/".join(
                    f"{100 * ratio:.0f}" for ratio in next(iter(found.values())).ratios
                )
                accuracies = ", ".join(
                    f"{name} {100 * sweep.noisy.mean():.0f}" for name, sweep in found.items()
                )
                nulls = [
                    (name, found_here.find_null(kind, n_copies=n, group=name)) for name in found
                ]
                chosen = nulls if kind == "joint" else nulls[:1]
                shown = ", ".join(
                    f"{name} {100 * null.noisy.mean():.0f}"
                    for name, null in chosen
                    if null is not None
                )
                rows.append([comparison, LABELS[kind], str(n), ratios, accuracies, shown])
    return rows


def _describe_kept(comparison: str, curves: Curves) -> list[str]:
    name, sweep = next(iter(curves.find("joint").items()))
    pairs = zip(
        sweep.ratios, sweep.kept_noisy.mean(axis=1), sweep.kept_clean.mean(axis=1), strict=True
    )
    kept = ", ".join(f"{100 * r:.0f} %: {100 * a:.0f} / {100 * b:.0f} %" for r, a, b in pairs)
    return [
        f"by {comparison}, {name}: variance that 30 components keep, of noisy copies / of clean"
        f" codes, at {kept}"
    ]


def plot(data: Fig5Data, figure: Figure) -> None:
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
        block.suptitle(f"{letter}  LDA accuracy by {comparison}", x=0.02, ha="left", fontsize=9)
        for noise, line in zip(curves.noises, axes, strict=True):
            for kind, ax in zip(CODES, line, strict=True):
                plot_curves(curves, kind, noise, ax)
            line[0].set_ylabel(f"accuracy [%]\n{noise} noise", fontsize=7)
        for kind, above, below in zip(CODES, axes[0], axes[-1], strict=True):
            above.set_title(LABELS[kind], fontsize=7)
            below.set_xlabel("noise [%]", fontsize=7)
        near = {
            "ncols": 7,
            "fontsize": 7,
            "columnspacing": 1.0,
            "handletextpad": 0.3,
        }  # seven words beside each other
        block.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside lower center", **near)


def _plot_top(data: Fig5Data, figure: SubFigure) -> None:
    """NMI of codes and tensors for both comparisons, and one tensor per condition."""
    left, right = figure.subfigures(1, 2, width_ratios=(3, 2), squeeze=False).flat
    axes = left.subplots(1, len(data.curves), squeeze=False)[0]
    for letter, comparison, ax in zip("AB", data.curves, axes, strict=False):
        found = [data.dispersion.dispersions[comparison][kind] for kind in MAIN]
        plot_kinds(found, "nmi", ax)
        name_kinds(found, [LABELS[kind] for kind in MAIN], ax)
        ax.set_title(f"{letter}  by {comparison}", fontsize=7)
        ax.tick_params(labelsize=7)
        ax.legend(fontsize=7, handletextpad=0)
    axes[0].set_ylabel("NMI with closest match", fontsize=7)
    _plot_examples(data, right.subplots())
    right.suptitle(f"E  one tensor per condition ({data.unit})", fontsize=7)


def _plot_examples(data: Fig5Data, ax) -> None:
    """One tensor of each condition on one colour scale."""
    tensors = list(data.examples.values())
    norm = Normalize(0, max(tensor.max() for tensor in tensors))
    time = np.arange(tensors[0].shape[1])
    image = plot_tensor_grid(
        [[tensor] for tensor in tensors], time, ax, norm, list(data.examples), [""], data.unit
    )
    image.set_cmap("cividis")
    if (figure := ax.get_figure(root=False)) is not None:
        figure.colorbar(image, ax=ax, pad=0.02)
    ax.tick_params(labelsize=7)
    ax.set_xlabel("time [ms]", fontsize=7)
    ax.set_ylabel("sensor (base → tip upwards)", fontsize=7)


@lru_cache(maxsize=1)
def load(context: Context) -> Fig5Data:
    """What this run shows, computed once; ``fig5_complete`` and ``fig5_new`` stand beside it."""
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    return compute(
        sets,
        context.effort.make_encoder(),
        plan=context.effort.plan,
        reference=next(iter(sets)),
        random_state=context.seed,
        jitter=_make_jitter(context) if context.effort.jitters else None,
    )


def show(context: Context, section: Section) -> None:
    """Figs. 5A–E and S6: closest matches and accuracy, by speed and by profile, beside their null."""
    data, plan = load(context), context.effort.plan
    speeds = {
        f"{speed:g} m/s": name
        for name, speed in list_speeds(context, list_profiles(context)[0]).items()
    }
    figS6.show(section, data.dispersion, speeds)
    _show_accuracy(section, data, speeds)
    fig5_nulls.show(section, data.nulls, data.dispersion, speeds, plan)
    section.text(
        f"Effort at this scale: noise of {', '.join(f'{100 * ratio:g}' for ratio in plan.ratios)}"
        f" %, {plan.n_repeats} repeats with {plan.n_copies} copies per trial;"
        f" {', '.join(map(str, plan.other_copies)) or 'no other'} copies at {100 * plan.probe:g} %;"
        f" noise before encoding with {plan.before_repeats} repeats."
    )


def _make_jitter(context: Context):
    """Slow touches again, each a little off its place or speed: touches that a classifier never
    saw.
    """
    rng = np.random.default_rng(context.seed)

    def jitter(name: str, location: float, speed: float) -> Any:
        order = [trial for trial in list_touches(context, name) if trial.speed == SPEEDS["slow"]]
        moved = jitter_trials(order, rng, location=location, speed=speed)
        return touch(context.profiles[name], moved, duration=DURATION, **context.physics)

    return jitter


def _show_accuracy(section: Section, data: Fig5Data, speeds: dict[str, str]) -> None:
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
        "Top: NMI of the closest match. Below: accuracy against noise for each kind of code, by"
        " speed and by profile; mean ± 1 SD over repeats; null dashed, peak-position baseline"
        " dash-dotted, chance dotted. (Fig. 5A–E)",
        lambda figure: plot(data, figure),
        height=9.0,
    )
    for curves in data.curves.values():
        for group, sweep in curves.find("joint").items():
            name, null = speeds.get(group, group), curves.find_null("joint", group=group)
            section.values |= {
                f"classification.lda.{name}": spread(sweep),
                f"classification.null.{name}": spread(null),
            }
    first = next(iter(next(iter(data.curves.values())).find("joint").values()))
    for ratio in PCA_RATIOS:
        rows = np.isclose(first.ratios, ratio)
        for name, kept in (("clean codes", first.kept_clean), ("noisy copies", first.kept_noisy)):
            value = float(np.nanmean(kept[rows])) if rows.any() else None
            section.values[f"classification.pca.{name} at {100 * ratio:g} % noise"] = value
    list_verdicts(
        section, data.verdicts, "The order of accuracies for each kind of code and noise."
    )
    section.table(
        ["by", "code", "copies", "noise [%]", "accuracy [%], mean over the noise", "null [%]"],
        list_copies(data.curves),
        "Accuracy depends on how many noisy copies of each tensor there are. The null is one tensor"
        " repeated.",
    )
    section.heading("Variance kept, unseen touches, confusions")
    for line in data.describe().splitlines()[len(data.dispersion.verdicts) + len(data.verdicts) :]:
        section.text(line)
    section.numbers(
        "fig5_classification",
        curves={
            c: {str(tuple(k)): v.noisy for k, v in curves.sweeps.items()}
            for c, curves in data.curves.items()
        },
        clean={
            c: {str(tuple(k)): v.clean for k, v in curves.sweeps.items()}
            for c, curves in data.curves.items()
        },
    )
