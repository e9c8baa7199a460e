"""Dispersion and classification: what an antenna can tell apart."""

import numpy as np

from feeler.paper import fig5, figS6
from feeler.paper.context import Context
from feeler.paper.data import list_profiles, list_speeds, load_tensors
from feeler.paper.encoder import make_encoder
from feeler.paper.section import Section

KINDS = {"raw": "tensor", "joint": "activation"}  # the paper's two data sets


def make(context: Context, section: Section) -> None:
    """Figs. 5A–E and S6: closest matches and accuracy, by speed and by profile, beside their null."""
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    first = next(iter(sets))
    data = fig5.compute(
        sets, make_encoder(context.scale), scale=context.scale, reference=first, random_state=context.seed
    )
    speeds = {f"{speed:g} m/s": name for name, speed in list_speeds(context, first).items()}
    _show_dispersion(section, data, speeds)
    _show_accuracy(section, data, speeds)


def _show_dispersion(section: Section, data: fig5.Fig5Data, speeds: dict[str, str]) -> None:
    section.figure(
        "figS6_dispersion",
        "Every tensor's closest match among the others of its group (dots) and the group's average with its 95 % bootstrap "
        "interval, by four indices. Low Pearson r, SSIM and NMI and high MSE mean more dispersed. (Fig. 5A–B, Fig. S6)",
        lambda figure: figS6.plot(data.dispersion, figure),
        height=8.5,
    )
    for found in data.dispersion.dispersions.values():
        for kind, dispersion in found.items():
            for index, groups in dispersion.average.items():
                for group, interval in groups.items():
                    if kind in KINDS:
                        key = f"dispersion.{KINDS[kind]}.{index}.{speeds.get(group, group)}"
                        section.values[key] = {"value": interval.estimate, "low": interval.low, "high": interval.high}
    _list_verdicts(section, data.dispersion.verdicts, "The order of groups, index by index.")


def _show_accuracy(section: Section, data: fig5.Fig5Data, speeds: dict[str, str]) -> None:
    section.heading("Classification")
    section.text(
        "Thirty classes (feature × location) by linear discriminant analysis of 30 principal components, trained on noisy "
        "copies. The paper's copies of one tensor stand in training and test alike, so its accuracy measures robustness "
        "against noise. Each curve therefore stands beside its null (dashed): as many copies of one single tensor pushed "
        "through the same pipeline. What the null reaches is no evidence that tensors differ."
    )
    section.figure(
        "fig5_classification",
        "Top: NMI of the closest match. Below: accuracy against noise for each kind of code, by speed and by profile; mean ± 1 "
        "SD over repeats; null dashed, peak-position baseline dash-dotted, chance dotted. (Fig. 5A–E)",
        lambda figure: fig5.plot(data, figure),
        height=9.0,
    )
    for curves in data.curves.values():
        for group, sweep in curves.find("joint").items():
            section.values[f"classification.lda.{speeds.get(group, group)}"] = _spread(sweep)
        null = curves.find_null("joint")
    section.values["classification.null"] = _spread(null)
    sweep = next(iter(data.curves["speed"].find("joint").values()))
    section.values["classification.pca_variance"] = float(np.nanmean(sweep.kept_clean[np.argmin(sweep.ratios)]))
    _list_verdicts(section, data.verdicts, "The order of accuracies for each kind of code and noise.")
    section.heading("Copies, variance kept, confusions")
    for line in data.describe().splitlines()[len(data.dispersion.verdicts) + len(data.verdicts) :]:
        section.text(line)
    section.numbers(
        "fig5_classification",
        curves={c: {str(tuple(k)): v.noisy for k, v in curves.sweeps.items()} for c, curves in data.curves.items()},
        clean={c: {str(tuple(k)): v.clean for k, v in curves.sweeps.items()} for c, curves in data.curves.items()},
    )


def _list_verdicts(section: Section, verdicts, caption: str) -> None:
    if verdicts:
        section.table(["verdict"], [[verdict.describe()] for verdict in verdicts], caption)


def _spread(sweep) -> dict[str, float]:
    """Accuracy over noise ratios above 0, averaged; the spread is that of the repeats, ± 1 SD."""
    above = sweep.ratios > 0
    by_repeat = sweep.noisy[above].mean(axis=0)
    value, sd = float(by_repeat.mean()), float(by_repeat.std())
    return {"value": value, "low": value - sd, "high": value + sd}
