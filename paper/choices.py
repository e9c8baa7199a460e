"""How many of the choices that the paper leaves open agree with its claims."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from feeler.analysis import INDICES, compute_dispersion
from feeler.decoding import compute_sweep, make_labels, make_lda
from feeler.decoding.curves import Verdict, judge_order
from feeler.objects.noise import Common
from feeler.objects.trials import SPEEDS
from feeler.report.page import Section
from feeler.tensors.transforms import rectify
from paper.context import Context
from paper.data import (
    list_profiles,
    list_speeds,
    load_complete,
    load_tensors,
    select_speed,
)
from paper.declared import CLAIMED
from paper.window import WINDOWS, complete_tensors

_CHOICES: dict[str, tuple[Any, ...]] = {
    "quantity": ("angle", "curvature"),
    "sign": ("rectified", "signed"),
    "sensors": ("all", "every second", "distal half"),
    "scaling": ("common", "per group"),
    "sizes": ("both", "small", "large"),
    "window": (1.0, 0.7),
}
"""Unstated choices [C], the default first; ``window`` is the share of the recording that is kept.
"""


_N_COPIES, _RATIO = 4, 0.2  # of the noise, at one common level, for LDA on the tensors
_Row = tuple[dict[str, Any], list[Verdict]]
"""One combination of choices with its verdicts, by claim and measure."""


def compute_sensitivity(
    comparisons: Mapping[str, Mapping[str, Any]],
    *,
    indices: Sequence[str] = tuple(INDICES),
    random_state: int = 0,
) -> list[_Row]:
    """Verdicts with each of the unstated choices changed, one at a time.

    Parameters
    ----------
    comparisons
        comparisons[claim][group]: Datasets with the same stimuli, groups in the order claimed, most
        dispersed (and best classified) first.
    """
    rows = []
    for choices in _list_choices():
        verdicts = []
        for claim, groups in comparisons.items():
            arrays, labels = _choose(groups, choices)
            verdicts += _judge(claim, arrays, labels, indices, random_state)
        rows.append((choices, verdicts))
    return rows


def _list_choices() -> list[dict[str, Any]]:
    """The default, then every single departure from it."""
    default = {name: values[0] for name, values in _CHOICES.items()}
    return [default] + [
        default | {name: value} for name, values in _CHOICES.items() for value in values[1:]
    ]


def _choose(
    groups: Mapping[str, Any], choices: Mapping[str, Any]
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Arrays of every group under one combination, and the labels that all groups share."""
    arrays, labels = {}, np.array([])
    for name, data in groups.items():
        keep = _choose_sizes(np.asarray(data["size"]), choices["sizes"])
        every = make_labels(data)
        trials = keep[np.argsort(every[keep], kind="stable")]
        array = data[choices["quantity"]].values[trials]
        array = array[:, _choose_sensors(array.shape[1], choices["sensors"])]
        array = array[:, :, : round(choices["window"] * array.shape[2])]
        arrays[name] = rectify(array) if choices["sign"] == "rectified" else array
        labels = every[trials]
    peaks = {name: np.abs(array).max() for name, array in arrays.items()}
    common = max(peaks.values())
    per_group = choices["scaling"] == "per group"
    return {
        n: array / (peaks[n] if per_group else common) for n, array in arrays.items()
    }, labels


def _choose_sizes(size: np.ndarray, which: str) -> np.ndarray:
    wanted = {"both": size, "small": size.min(), "large": size.max()}[which]
    return np.flatnonzero(np.isin(size, wanted))


def _choose_sensors(n: int, which: str) -> slice:
    return {
        "all": slice(None),
        "every second": slice(1, None, 2),
        "distal half": slice(n // 2, None),
    }[which]


def _judge(
    claim: str,
    arrays: Mapping[str, np.ndarray],
    labels: np.ndarray,
    indices: Sequence[str],
    random_state: int,
) -> list[Verdict]:
    found = compute_dispersion(arrays, indices=indices, scale=False, random_state=random_state)
    verdicts = [
        judge_order(
            {name: found.values(index, name) for name in arrays},
            claim=claim,
            measure=INDICES[index].label,
            greater=not INDICES[index].is_similarity,
        )
        for index in indices
    ]
    areas = {
        name: compute_sweep(
            array,
            labels,
            ratios=(_RATIO,),
            n_copies=_N_COPIES,
            n_repeats=2,
            noise=Common(reference=1.0),
            rotate=True,
            estimator=make_lda(min(30, _N_COPIES * len(labels) - 1)),
            random_state=random_state,
        ).area
        for name, array in arrays.items()
    }
    return [*verdicts, judge_order(areas, claim=claim, measure="accuracy of tensors")]


def _count_agreement(rows: list[_Row]) -> dict[tuple[str, str], tuple[int, int]]:
    """How many combinations agree (fully) with the claim, and how many there are, by claim and
    measure.
    """
    counts: dict[tuple[str, str], tuple[int, int]] = {}
    for _, verdicts in rows:
        for verdict in verdicts:
            agreeing, total = counts.get((verdict.claim, verdict.measure), (0, 0))
            counts[verdict.claim, verdict.measure] = (
                agreeing + (verdict.word == "agrees"),
                total + 1,
            )
    return counts


def _make_table(rows: list[_Row]) -> tuple[list[str], list[list[str]]]:
    """Header and cells: a row per combination with each verdict and its effect size, then how many
    agree.
    """
    default, _ = rows[0]
    totals = _count_agreement(rows)
    cells = []
    for choices, verdicts in rows:
        changed = [f"{k}: {v}" for k, v in choices.items() if v != default[k]]
        words = {
            (v.claim, v.measure): f"{v.word}, d_z {v.difference.effect:.2g}" for v in verdicts
        }
        cells.append(
            [", ".join(changed) or "default", *(words.get(key, "–") for key in totals)]
        )
    cells.append(["in all", *(f"{agree} of {n} agree" for agree, n in totals.values())])
    return ["choice", *(f"{claim}, {measure}" for claim, measure in totals)], cells


def show(context: Context, section: Section) -> None:
    """How many of the unstated choices agree with the paper's orders."""
    if not context.effort.choices:
        return
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    first = next(iter(sets))
    slowest_first = reversed(list_speeds(context, first).items())
    by_speed = {name: select_speed(sets[first], speed) for name, speed in slowest_first}
    names = [name for name in CLAIMED if name in sets]
    by_window = {
        WINDOWS[0]: {name: select_speed(sets[name], SPEEDS["slow"]) for name in names},
        WINDOWS[1]: {name: complete_tensors(load_complete(context, name)) for name in names},
    }
    by_profile = {f"profile, {window}": groups for window, groups in by_window.items()}
    rows = compute_sensitivity({"speed": by_speed, **by_profile}, random_state=context.seed)
    section.heading("What depends on unstated choices")
    header, cells = _make_table(rows)
    section.table(
        header,
        cells,
        "One choice changed at a time. 'speed': slower touch spreads and is classified better;"
        " 'profile': exponential spreads most and is classified best; in the paper's window some"
        " touches of the others are the same tensor. d_z: effect size over the same stimuli.",
    )
