"""Beside Fig. 5: what jointly fitted codes reach on identical touches, and what of them carries
over to a twin.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from feeler.decoding.curves import Curves, Group
from feeler.decoding.groups import configure
from feeler.decoding.null import JointFit, Twins, compare_twins
from feeler.decoding.plan import Plan
from feeler.decoding.sweep import Sweep
from feeler.dispersion import INDICES, Dispersion, compute_dispersion
from feeler.report.section import Section
from feeler.studies.paper.claims import PROFILES
from feeler.studies.paper.figS6 import FigS6Data


@dataclass(frozen=True, kw_only=True, eq=False)
class Nulls:
    """By comparison (``speed``, ``profile``) and group."""

    dispersions: dict[str, Dispersion]
    """Of jointly fitted codes of identical touches, on the scale of the real ones."""
    sweeps: dict[str, dict[str, tuple[Sweep, Sweep | None]]]
    """Accuracy of the real codes, and of identical touches."""
    fits: dict[str, dict[str, JointFit]]
    twins: dict[str, Twins]
    """By group; the slow touches of the first profile stand among the speeds."""


def compute_nulls(
    groups: Mapping[str, Mapping[str, Group]],
    curves: Mapping[str, Curves],
    encoder: Any,
    plan: Plan,
    *,
    random_state: int = 0,
) -> Nulls:
    """Everything from groups and curves that are there; only the twins are fitted here."""
    return Nulls(
        dispersions={
            c: _disperse_null(groups[c], found, random_state) for c, found in curves.items()
        },
        sweeps={
            c: {
                name: (sweep, found.find_null("joint", group=name))
                for name, sweep in found.find("joint").items()
            }
            for c, found in curves.items()
        },
        fits={c: found.fits for c, found in curves.items()},
        twins=_compare_all_twins(groups, encoder, plan, random_state),
    )


def _disperse_null(members: Mapping[str, Group], found: Curves, random_state: int) -> Dispersion:
    """Dispersion of every group's null, on the common scale of the groups' own codes."""
    peak = max(group.codes["joint"].max() for group in members.values())
    codes = {name: fitted.codes for name, fitted in found.fits.items()}
    peak = max(peak, *(code.max() for code in codes.values()))
    scaled = {name: code / peak for name, code in codes.items()}
    return compute_dispersion(scaled, scale=False, random_state=random_state)


def _compare_all_twins(groups, encoder: Any, plan: Plan, random_state: int) -> dict[str, Twins]:
    """The twin test of the groups that the plan asks for."""
    unfitted = configure(encoder, {"n_restarts": plan.n_restarts, "random_state": random_state})
    return {
        name: compare_twins(group.tensors, group.labels, unfitted, plan, random_state=random_state)
        for name, group in _list_twins(groups, plan.twins).items()
    }


def _list_twins(groups: Mapping[str, Mapping[str, Group]], which: str) -> dict[str, Group]:
    """Speeds, then the other profiles: the first profile's touches are those of the slowest speed."""
    speeds, profiles = dict(groups.get("speed", {})), dict(groups.get("profile", {}))
    every = speeds | {name: g for k, (name, g) in enumerate(profiles.items()) if k or not speeds}
    ends = {*list(speeds)[:1], *list(speeds)[-1:], PROFILES[-1]}
    wanted = {"all": set(every), "ends": ends, "none": set()}[which]
    return {name: group for name, group in every.items() if name in wanted}


def show(
    section: Section, data: Nulls, real: FigS6Data, speeds: Mapping[str, str], plan: Plan
) -> None:
    """Null of each group's dispersion and accuracy, and the twin test, beside the real numbers."""
    section.heading("Identical touches, and every touch twice")
    rows = []
    for comparison, null in data.dispersions.items():
        for group, fitted in data.fits[comparison].items():
            cells = _keep_null(
                section,
                null,
                real.dispersions[comparison]["joint"],
                group,
                speeds.get(group, group),
            )
            sweep, alone = data.sweeps[comparison][group]
            assert alone is not None  # compute_curves makes one for every group
            section.values[f"classification.null.{speeds.get(group, group)}"] = spread(alone)
            accuracy = f"{100 * sweep.noisy.mean():.0f} / {100 * alone.noisy.mean():.0f}"
            end = "by its tolerance" if fitted.converged else "at the limit"
            rows.append([comparison, group, *cells, accuracy, f"{fitted.n_iter}, {end}"])
    header = [
        "by",
        "group",
        *(known.label for known in INDICES.values()),
        "accuracy [%]",
        "iterations of the null",
    ]
    section.table(
        header,
        rows,
        "Real / null: jointly fitted codes of each group's tensors, and of one of its tensors"
        " repeated. A difference that identical touches show too comes from the recipe.",
    )
    _show_twins(section, data.twins, speeds, plan)


def _keep_null(
    section: Section, null: Dispersion, real: Dispersion, group: str, name: str
) -> list[str]:
    """Cells "real / null" of every index; the null's values are kept for the claims."""
    cells = []
    for index in INDICES:
        found = null.average[index][group]
        key = f"dispersion.null.{index}.{name}"
        section.values[key] = {"value": found.estimate, "low": found.low, "high": found.high}
        cells.append(f"{real.average[index][group].estimate:.3g} / {found.estimate:.3g}")
    return cells


def _show_twins(
    section: Section, twins: Mapping[str, Twins], speeds: Mapping[str, str], plan: Plan
) -> None:
    if not twins:
        return
    rows = []
    for group, found in twins.items():
        name = speeds.get(group, group)
        section.values[f"classification.twin.{name}"] = spread(found.other)
        section.values[f"classification.twin_kept.{name}"] = found.kept
        accuracies = [
            " / ".join(f"{100 * a:.0f}" for a in sweep.noisy.mean(axis=1))
            for sweep in (found.same, found.other)
        ]
        rows.append([group, *accuracies, f"{100 * found.kept:.0f}", found.fitted.n_iter])
    ratios = " / ".join(f"{100 * ratio:.0f}" for ratio in plan.ratios)
    section.table(
        ["group", f"same twin [%] at {ratios} % noise", "other twin [%]", "kept [%]", "iterations"],
        rows,
        "Every tensor stands twice in one joint fit. Trained on noisy copies of one twin, tested on"
        " copies of the same and of the other. Kept: the share of the accuracy above chance that"
        " carries over, which is what belongs to the touch.",
    )


def spread(sweep) -> dict[str, float]:
    """Accuracy over noise ratios above 0, averaged; the spread is that of the repeats, ± 1 SD."""
    above = sweep.ratios > 0
    by_repeat = sweep.noisy[above].mean(axis=0)
    value, sd = float(by_repeat.mean()), float(by_repeat.std())
    return {"value": value, "low": value - sd, "high": value + sd}
