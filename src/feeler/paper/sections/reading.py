"""Dispersion and classification: what an antenna can tell apart."""

import numpy as np

from feeler.decoding.plan import get_plan
from feeler.decoding.sensitivity import compute_sensitivity, make_table
from feeler.decoding.splits import jitter_trials
from feeler.experiment.touch import DURATION, touch
from feeler.paper import fig5, figS6
from feeler.paper.claims import PROFILES
from feeler.paper.context import Context
from feeler.paper.data import list_profiles, list_speeds, load_tensors, select_speed
from feeler.paper.encoder import make_encoder
from feeler.paper.trials import SPEEDS, trials
from feeler.report.section import Section

KINDS = {"raw": "tensor", "joint": "activation"}  # the paper's two data sets


def make(context: Context, section: Section) -> None:
    """Figs. 5A–E and S6: closest matches and accuracy, by speed and by profile, beside their null."""
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    first = next(iter(sets))
    data = fig5.compute(
        sets,
        make_encoder(context.scale),
        scale=context.scale,
        reference=first,
        random_state=context.seed,
        jitter=_make_jitter(context) if context.scale == "paper" else None,
    )
    speeds = {f"{speed:g} m/s": name for name, speed in list_speeds(context, first).items()}
    _show_dispersion(section, data, speeds)
    _show_accuracy(section, data, speeds)
    plan = get_plan(context.scale)
    section.text(
        f"Effort at this scale: noise of {', '.join(f'{100 * ratio:g}' for ratio in plan.ratios)} %, {plan.n_repeats} repeats "
        f"with {plan.n_copies} copies per trial; {', '.join(map(str, plan.other_copies)) or 'no other'} copies at "
        f"{100 * plan.probe:g} %; noise before encoding with {plan.before_repeats} repeats."
    )
    if context.scale == "paper":
        _show_sensitivity(context, section, sets)


def _make_jitter(context: Context):
    """Slow touches again, each a little off its place or speed: touches that a classifier never saw."""
    rng, order = np.random.default_rng(context.seed), trials((SPEEDS["slow"],))

    def jitter(name: str, location: float, speed: float):
        moved = jitter_trials(order, rng, location=location, speed=speed)
        options = {"timestep": context.timestep, "engine": context.engine, "workers": context.workers}
        return touch(context.profiles[name], moved, duration=DURATION, **options)

    return jitter


def _show_sensitivity(context: Context, section: Section, sets: dict) -> None:
    """How many of the unstated choices agree with the paper's orders."""
    first = next(iter(sets))
    by_speed = {name: select_speed(sets[first], SPEEDS[name]) for name in ("slow", "medium", "fast")}
    by_profile = {name: select_speed(sets[name], SPEEDS["slow"]) for name in PROFILES if name in sets}
    rows = compute_sensitivity({"speed": by_speed, "profile": by_profile}, random_state=context.seed)
    section.heading("What depends on unstated choices")
    header, cells = make_table(rows)
    section.table(
        header,
        cells,
        "One choice changed at a time. 'speed': slower touch spreads and is classified better; 'profile': exponential spreads "
        "most and is classified best. d_z: effect size over the same stimuli.",
    )


def _show_dispersion(section: Section, data: fig5.Fig5Data, speeds: dict[str, str]) -> None:
    section.figure(
        "figS6_dispersion",
        "Every tensor's closest match among the others of its group (dots) and the group's average with its 95 % bootstrap "
        "interval, by four indices. Low Pearson r, SSIM and NMI and high MSE mean more dispersed. (Fig. 5A–B, Fig. S6)",
        lambda figure: figS6.plot(data.dispersion, figure),
        height=7.0,
    )
    for found in data.dispersion.dispersions.values():
        for kind, dispersion in found.items():
            for index, groups in dispersion.average.items():
                for group, interval in groups.items():
                    if kind in KINDS:
                        key = f"dispersion.{KINDS[kind]}.{index}.{speeds.get(group, group)}"
                        section.values[key] = {"value": interval.estimate, "low": interval.low, "high": interval.high}
    section.numbers("figS6_dispersion", **{k: v for k, v in section.values.items() if k.startswith("dispersion.")})
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
    for comparison, curves in data.curves.items():
        for group, sweep in curves.find("joint").items():
            section.values[f"classification.lda.{speeds.get(group, group)}"] = _spread(sweep)
        section.values[f"classification.null.{comparison}"] = _spread(curves.find_null("joint"))
    sweep = next(iter(next(iter(data.curves.values())).find("joint").values()))
    section.values["classification.pca_variance"] = float(np.nanmean(sweep.kept_clean[np.argmin(sweep.ratios)]))
    _list_verdicts(section, data.verdicts, "The order of accuracies for each kind of code and noise.")
    section.table(
        ["by", "code", "copies", "noise [%]", "accuracy [%], mean over the noise", "null [%]"],
        fig5.list_copies(data.curves),
        "Accuracy depends on how many noisy copies of each tensor there are. The null is one tensor repeated.",
    )
    section.heading("Variance kept, unseen touches, confusions")
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
