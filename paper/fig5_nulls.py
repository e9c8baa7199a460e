"""Beside Fig. 5: what jointly fitted codes reach on identical touches, and what of them carries
over to a twin.
"""

from collections.abc import Mapping

import numpy as np

from feeler.analysis import INDICES, Dispersion, compute_dispersion
from feeler.decoding.curves import DuplicateControl, Group, JointFit, compare_twins, configure
from feeler.decoding.sweeps import Plan
from feeler.report import Section, make_spread
from paper.context import Context
from paper.declared import CLAIMED
from paper.fig5_data import load, name_speeds, spread_accuracy


def show(context: Context, section: Section) -> None:
    """Null of each group's dispersion and accuracy, and the twin test, beside the real numbers."""
    data, speeds = load(context), name_speeds(context)
    starts = context.effort.plan.null_restarts
    section.heading("Identical touches, and every touch twice")
    rows = []
    for comparison, curves in data.curves.items():
        null = disperse_null(data.groups[comparison], curves.fits, context.seed)
        real = data.dispersions[comparison]["joint"]
        for group, sweep in curves.find("joint").items():
            name, fitted = speeds.get(group, group), curves.fits[group]
            cells = []
            for index in INDICES:
                found = null.average[index][group]
                key = f"dispersion.null.{index}.{name}"
                section.values[key] = make_spread(
                    found.estimate, found.low, found.high, n=starts
                )
                cells.append(
                    f"{real.average[index][group].estimate:.3g} / {found.estimate:.3g}"
                )
            alone = curves.find_null("joint", group=group)
            assert alone is not None  # compute_curves makes one for every group
            section.values[f"classification.null.{name}"] = spread_accuracy(alone, starts)
            cells.append(f"{100 * sweep.noisy.mean():.0f} / {100 * alone.noisy.mean():.0f}")
            end = "by its tolerance" if fitted.converged else "at the limit"
            rows.append([comparison, group, *cells, f"{fitted.n_iter}, {end}"])
    section.table(
        [
            "by",
            "group",
            *(known.label for known in INDICES.values()),
            "accuracy [%]",
            "iterations of the null",
        ],
        rows,
        "Real / null: jointly fitted codes of each group's tensors, and of one of its tensors"
        " repeated. A difference that identical touches show too comes from the recipe. Profiles in"
        " the paper's window; complete touches stand below.",
    )
    if twins := _compare_all_twins(data.groups, context):
        _show_twins(section, twins, speeds, context.effort.plan)


def disperse_null(
    members: Mapping[str, Group], fits: Mapping[str, JointFit], random_state: int
) -> Dispersion:
    """Dispersion of every group's null, on the common scale of the groups' own codes."""
    peak = max(
        *(group.codes["joint"].max() for group in members.values()),
        *(fitted.codes.max() for fitted in fits.values()),
    )
    scaled = {name: fitted.codes / peak for name, fitted in fits.items()}
    return compute_dispersion(scaled, scale=False, random_state=random_state)


def _compare_all_twins(
    groups: Mapping[str, Mapping[str, Group]], context: Context
) -> dict[str, DuplicateControl]:
    """The twin test of the groups that the plan asks for."""
    plan, seed = context.effort.plan, context.seed
    encoder = configure(context.effort.make_encoder(), {"random_state": seed})
    return {
        name: compare_twins(group.tensors, group.labels, encoder, plan, random_state=seed)
        for name, group in _list_twins(groups, plan.twins).items()
    }


def _list_twins(groups: Mapping[str, Mapping[str, Group]], which: str) -> dict[str, Group]:
    """Speeds, then the other profiles; the first profile's touches are the slowest speed's."""
    speeds, profiles = groups.get("speed", {}), groups.get("profile", {})
    others = list(profiles.items())[1 if speeds else 0 :]
    every = {**speeds, **dict(others)}
    ends = {*list(speeds)[:1], *list(speeds)[-1:], CLAIMED[-1]}
    wanted = {"all": set(every), "ends": ends, "none": set()}[which]
    return {name: group for name, group in every.items() if name in wanted}


def _bound_kept(found: DuplicateControl) -> tuple[float, float]:
    """The 95 % interval of the share that carries over, over touches (bootstrap)."""
    same, other = (sweep.area - sweep.chance for sweep in (found.same, found.other))
    picks = np.random.default_rng(0).integers(same.size, size=(2000, same.size))
    height, carried = same[picks].mean(axis=1), np.maximum(other[picks].mean(axis=1), 0.0)
    kept = np.divide(carried, height, out=np.zeros(len(picks)), where=height > 0)
    low, high = np.quantile(kept, [0.025, 0.975])
    return float(low), float(high)


def _show_twins(
    section: Section,
    twins: Mapping[str, DuplicateControl],
    speeds: Mapping[str, str],
    plan: Plan,
) -> None:
    rows = []
    for group, found in twins.items():
        name = speeds.get(group, group)
        section.values[f"classification.twin.{name}"] = spread_accuracy(
            found.other, plan.null_restarts
        )
        low, high = _bound_kept(found)
        section.values[f"classification.twin_kept.{name}"] = make_spread(
            found.kept, low, high, n=plan.null_restarts
        )
        accuracies = [
            " / ".join(f"{100 * a:.0f}" for a in sweep.noisy.mean(axis=1))
            for sweep in (found.same, found.other)
        ]
        rows.append([group, *accuracies, f"{100 * found.kept:.0f}", found.fitted.n_iter])
    ratios = " / ".join(f"{100 * ratio:.0f}" for ratio in plan.ratios)
    section.table(
        [
            "group",
            f"same twin [%] at {ratios} % noise",
            "other twin [%]",
            "kept [%]",
            "iterations",
        ],
        rows,
        "Every tensor stands twice in one joint fit. Trained on noisy copies of one twin, tested on"
        " copies of the same and of the other. Kept: the share of the accuracy above chance that"
        " carries over, which is what belongs to the touch.",
    )
