"""Beside Fig. 5C: LDA on the tensors of every speed, in the paper's window and over whole touches;
and every reading by which the two claims on LDA are judged.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from feeler.analysis import compute_dispersion
from feeler.decoding import Relative, Sweep, compute_sweep, make_labels
from feeler.decoding.classifiers import make_lda
from feeler.decoding.sweeps import Plan
from feeler.report import Section
from paper.context import Context
from paper.data import (
    list_profiles,
    list_speeds,
    load_complete,
    load_tensors,
    select_speed,
)
from paper.fig5_complete import keep_dispersion
from paper.fig5_data import load, name_speeds, spread_accuracy
from paper.window import WINDOWS, keep_whole

JOINT_CODES, TENSORS = "jointly fitted codes", tuple(f"tensors, {window}" for window in WINDOWS)
"""What LDA may have read."""


def compute(
    groups: Mapping[str, tuple[np.ndarray, np.ndarray]], plan: Plan, *, random_state: int = 0
) -> tuple[dict[str, Sweep], Sweep]:
    """Accuracy on noisy tensors of every group, given with their labels, and on as many copies of
    one tensor, labelled as if they were different touches.
    """

    def sweep(array: np.ndarray, labels: np.ndarray, n_repeats: int) -> Sweep:
        return compute_sweep(
            array,
            labels,
            ratios=plan.ratios,
            n_copies=plan.n_copies,
            n_repeats=n_repeats,
            noise=Relative(),
            estimator=make_lda(),
            random_state=random_state,
        )

    first, labels = next(iter(groups.values()))
    repeated = np.repeat(first[:1], len(first), axis=0)
    sweeps = {name: sweep(*group, plan.n_repeats) for name, group in groups.items()}
    return sweeps, sweep(repeated, labels, plan.control_repeats or plan.n_repeats)


def show(context: Context, section: Section) -> None:
    """LDA on tensors by speed, and every reading of the claims on LDA."""
    if len(list_speeds(context, list_profiles(context)[0])) < 2:
        return
    whole, null = compute(_list_speeds(context), context.effort.plan, random_state=context.seed)
    cut = load(context).curves["speed"].find("raw")
    section.heading("Tensors by speed")
    section.table(
        ["window", *whole],
        [
            [
                window,
                *(100 * float(one.noisy[one.ratios > 0].mean()) for one in sweeps.values()),
            ]
            for window, sweeps in zip(WINDOWS, (cut, whole), strict=True)
        ],
        "Accuracy of LDA on the tensors of every speed [%], mean over the noise: in the paper's"
        " window,"
        " and over each speed's own shortest window that holds its touches whole.",
    )
    names = name_speeds(context)
    arrays = {name: array for name, (array, _) in _list_speeds(context).items()}
    section.table(
        ["closest match", *arrays],
        keep_dispersion(section, compute_dispersion(arrays, random_state=context.seed), names),
        "Averages by speed: in the paper's window, most of which a fast touch leaves empty → over"
        " each speed's own window of complete touches.",
    )
    complete: dict[str, Any] = {
        names[group]: spread_accuracy(sweep) for group, sweep in whole.items()
    }
    complete |= {
        name: section.values[key]
        for name in list_profiles(context)
        if (key := f"complete.relative.{name}") in section.values
    }
    for comparison in load(context).curves:
        _keep_values(context, section, comparison, complete, spread_accuracy(null))


def _list_speeds(context: Context) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """Whole touches of the first profile at every speed, named as the paper's groups are."""
    name = list_profiles(context)[0]
    every = load_tensors(context, name)
    names = {given: speed for speed, given in name_speeds(context).items()}
    sets = {
        names[given]: load_complete(context, name)
        if given == "slow"
        else select_speed(every, speed)
        for given, speed in reversed(list_speeds(context, name).items())
    }
    return {
        given: (_order(data, keep_whole(data)), _label(data)) for given, data in sets.items()
    }


def _order(data: xr.Dataset, array: np.ndarray) -> np.ndarray:
    return array[np.argsort(make_labels(data), kind="stable")]


def _label(data: xr.Dataset) -> np.ndarray:
    return np.sort(make_labels(data))


def _keep_values(
    context: Context,
    section: Section,
    comparison: str,
    complete: Mapping[str, dict[str, float]],
    null: dict[str, float],
) -> None:
    """Accuracy of every group, and of identical touches, in each reading."""
    curves, speeds = load(context).curves[comparison], name_speeds(context)
    alone = curves.find_null("raw")
    assert alone is not None  # compute_curves makes one for every kind of code
    for group, sweep in curves.find("raw").items():
        name = speeds.get(group, group)
        readings = {
            JOINT_CODES: (
                section.values[f"classification.lda.{name}"],
                section.values[f"classification.null.{name}"],
            ),
            TENSORS[0]: (spread_accuracy(sweep), spread_accuracy(alone)),
            TENSORS[1]: (complete[name], null),
        }
        for reading, (own, identical) in readings.items():
            section.values[f"lda.{reading}.{name}"] = own
            section.values[f"lda.null.{reading}.{name}"] = identical
