"""Beside Fig. 5: trained on some touches, tested on others: a new size or place, a shifted place,
another speed; what a new touch costs, and why.
"""

from collections.abc import Mapping
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import xarray as xr

from feeler.analysis.dispersion import bootstrap_mean
from feeler.decoding import Relative, compute_left_out
from feeler.decoding.classifiers import make_lda
from feeler.decoding.sweeps import Plan
from feeler.objects.trials import SPEEDS
from feeler.report import Section, make_spread
from feeler.tensors.transforms import rectify
from paper.context import Context
from paper.data import (
    list_profiles,
    load_complete,
    load_tensors,
    select_speed,
)
from paper.window import WINDOWS, complete_tensors

_ATTRIBUTES = ("feature", "size", "location")
_SPLITS = {"size": ("feature", "location"), "place": ("feature", "size")}
"""What is left out in turn, and what is then read of the touches that have it."""
_LEFT_OUT = {"size": "size", "place": "location"}


def compute(tensors: xr.Dataset, plan: Plan, *, random_state: int = 0) -> SimpleNamespace:
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
        parts[split] = _split_parts(folds[0].classes, confusion / confusion.sum(), read)
    change = _measure_change(array, names)
    return SimpleNamespace(
        accuracy=accuracy, touches=touches, chance=chance, parts=parts, change=change
    )


def _split_parts(
    classes: np.ndarray, share: np.ndarray, read: tuple[str, ...]
) -> dict[str, float]:
    words = np.array([str(name).split(" ") for name in classes])
    return {
        a: float(share[words[:, None, k] == words[None, :, k]].sum())
        for k, a in enumerate(read)
    }


def _measure_change(array: np.ndarray, names: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Mean over pairs of touches that differ in one attribute only (places: by one step)."""
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
    return {
        a: float(np.mean(values)) if values else float("nan") for a, values in found.items()
    }


def show(context: Context, section: Section) -> None:
    """New sizes and places, by profile at slow touch, in both windows."""
    plan, names = context.effort.plan, list_profiles(context)
    data = {
        window: {
            name: compute(tensors, plan, random_state=context.seed)
            for name, tensors in profiles.items()
        }
        for window, profiles in _load_windows(context, names).items()
    }
    section.heading("New sizes and places")
    _keep_values(section, data, plan.probe)


def _load_windows(context: Context, names: list[str]) -> dict[str, dict[str, xr.Dataset]]:
    """Slow touches of every profile in the paper's window; of several, complete ones beside them,
    because it cuts them differently.
    """
    slow = {name: select_speed(load_tensors(context, name), SPEEDS["slow"]) for name in names}
    if len(names) < 2:
        return {WINDOWS[0]: slow}
    whole = {name: complete_tensors(load_complete(context, name)) for name in names}
    return dict(zip(WINDOWS, (slow, whole), strict=True))


def _keep_values(
    section: Section, data: Mapping[str, Mapping[str, SimpleNamespace]], probe: float
) -> None:
    rows = []
    for window, profiles in data.items():
        for name, new in profiles.items():
            for split, right in new.touches.items():
                one = bootstrap_mean(right, np.random.default_rng(0))
                found = make_spread(one.estimate, one.low, one.high, n=right.size)
                section.values[f"generalise.{split}.{window}.{name}"] = found
                section.values[f"generalise.chance.{split}"] = new.chance[split]
            for attribute, change in new.change.items():
                section.values[f"generalise.change.{attribute}.{window}.{name}"] = change
            shares = [(new.accuracy[s], *new.parts[s].values()) for s in _SPLITS]
            changed = [100 * new.change[attribute] for attribute in _LEFT_OUT.values()]
            rows.append(
                [window, name, *(100 * one for split in shares for one in split), *changed]
            )
    header = ["window", "profile", "new size [%]", "of it shape", "place"]
    section.table(
        [*header, "new place [%]", "of it shape", "size", "change by size [%]", "by place"],
        rows,
        "Accuracy of LDA on clean slow touches whose size, or place, was never trained (noise of"
        f" {100 * probe:g} % in training), and how often each part is right (on noisy copies)."
        " Last: by"
        " which share of its norm a tensor changes if only its size or its place (one step) does.",
    )
