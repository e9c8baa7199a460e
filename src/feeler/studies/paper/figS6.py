"""Fig. S6 (and Fig. 5A, B): dispersion by contact speed and by stiffness profile, codes and
tensors.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.figure import Figure, SubFigure

from feeler.decoding.verdict import Verdict, judge_order
from feeler.dispersion import INDICES, Dispersion, compute_dispersion
from feeler.encoding import LABELS
from feeler.errors import InvalidInput
from feeler.plotting.closest import plot_kinds
from feeler.report.section import Section
from feeler.studies.paper.claims import SPREADS_MORE

KINDS = {"raw": "tensor", "joint": "activation"}  # the paper's two data sets


@dataclass(frozen=True, kw_only=True, eq=False)
class FigS6Data:
    """Dispersions of both comparisons (``speed``, ``profile``), by kind of code."""

    dispersions: dict[str, dict[str, Dispersion]]
    """dispersions[comparison][kind]; groups in the claimed order, most dispersed first, controls
    after.
    """
    claimed: dict[str, tuple[str, ...]]
    """Groups that each claim is about, most dispersed first."""
    verdicts: tuple[Verdict, ...]


def compute(
    codes: Mapping[str, Mapping[str, Mapping[str, np.ndarray]]],
    claimed: Mapping[str, tuple[str, ...]],
    *,
    random_state: int = 0,
) -> FigS6Data:
    """All four indices of every comparison, kind of code and group, and the verdict on each order.

    Parameters
    ----------
    codes
        codes[comparison][kind][group]: arrays (trial, vector, time); stimuli in the same order in
        all groups of a comparison, all groups on one scale.
    claimed
        Groups of each comparison in the order that the paper claims, most dispersed first.
    """
    dispersions: dict[str, dict[str, Dispersion]] = {}
    verdicts = []
    for comparison, kinds in codes.items():
        dispersions[comparison] = {}
        for kind, groups in kinds.items():
            found = compute_dispersion(groups, random_state=random_state)
            dispersions[comparison][kind] = found
            if len(claimed[comparison]) > 1:
                verdicts += [
                    _judge(found, index, comparison, kind, claimed[comparison]) for index in INDICES
                ]
    return FigS6Data(dispersions=dispersions, claimed=dict(claimed), verdicts=tuple(verdicts))


def _judge(
    found: Dispersion, index: str, comparison: str, kind: str, claimed: tuple[str, ...]
) -> Verdict:
    """Verdict on one index: similar tensors have high Pearson, SSIM, NMI, and low MSE."""
    if missing := [name for name in claimed if name not in found.groups]:
        raise InvalidInput(f"no group {missing[0]!r}; groups: {', '.join(map(str, found.groups))}.")
    values = {name: found.values(index, name) for name in claimed}
    known = INDICES[index]
    measure = f"{known.label} of {LABELS[kind]}"
    return judge_order(
        values, claim=SPREADS_MORE[comparison], measure=measure, greater=not known.is_similarity
    )


def plot(data: FigS6Data, figure: Figure | SubFigure) -> None:
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
            [_wrap(kind) for kind in kinds],
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


def _wrap(kind: str) -> str:
    return LABELS[kind].replace(", ", ",\n").replace(" (", "\n(")


def show(section: Section, data: FigS6Data, speeds: Mapping[Any, str]) -> None:
    """Every closest match; ``speeds`` names groups by speed. Fig. 5 calls this with what it has
    computed.
    """
    section.figure(
        "figS6_dispersion",
        "Every tensor's closest match among the others of its group (dots) and the group's average"
        " with its 95 % bootstrap interval, by four indices. Low Pearson r, SSIM and NMI and high"
        " MSE mean more dispersed. (Fig. 5A–B, Fig. S6)",
        lambda figure: plot(data, figure),
        height=7.0,
    )
    for found in data.dispersions.values():
        for kind, dispersion in found.items():
            for index, groups in dispersion.average.items():
                for group, interval in groups.items():
                    if kind in KINDS:
                        key = f"dispersion.{KINDS[kind]}.{index}.{speeds.get(group, group)}"
                        section.values[key] = {
                            "value": interval.estimate,
                            "low": interval.low,
                            "high": interval.high,
                        }
    section.numbers(
        "figS6_dispersion",
        **{k: v for k, v in section.values.items() if k.startswith("dispersion.")},
    )
    list_verdicts(section, data.verdicts, "The order of groups, index by index.")


def list_verdicts(section: Section, verdicts: Sequence[Verdict], caption: str) -> None:
    """One line each, if there are any."""
    if verdicts:
        section.table(["verdict"], [[verdict.describe()] for verdict in verdicts], caption)
