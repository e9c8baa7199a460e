"""Beside Fig. 5: trained on some touches, tested on others: a new size or place, a shifted place,
another speed; what a new touch costs, and why.
"""

from collections.abc import Mapping
from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from feeler.decoding import Relative, compute_left_out, compute_sweep, make_labels
from feeler.decoding.classifiers import make_fitting_lda
from feeler.decoding.curves import Group
from feeler.decoding.plan import Plan
from feeler.experiment.touch import DURATION, touch
from feeler.plotting.look import PALETTE, PROFILE_COLOURS
from feeler.report import Section
from feeler.stimulus.ninety import SPEEDS
from feeler.studies.paper.context import Context
from feeler.studies.paper.data import list_profiles, list_touches, load_tensors, select_speed
from feeler.studies.paper.fig5_data import load
from feeler.task import Nuisances
from feeler.tensors.scaling import rectify

ATTRIBUTES = ("feature", "size", "location")
SPLITS = {"size": ("feature", "location"), "place": ("feature", "size")}
"""What is left out in turn, and what is then read of the touches that have it."""
LEFT_OUT = {"size": "size", "place": "location"}
JITTERS = {
    "place shifted by up to 2 % of the length": (0.02, 0.0),
    "speed changed by up to 10 %": (0.0, 0.1),
}
"""[C] Half-widths of uniform changes of place (share of the length) and speed (relative)."""


def compute(tensors: xr.Dataset, plan: Plan, *, random_state: int = 0) -> SimpleNamespace:
    """Leave out every size, then every place, in turn; LDA on the tensors of one speed.

    Returns
    -------
    SimpleNamespace
        By split: ``accuracy`` on clean touches of a size or place that was never trained,
        ``chance``, and ``parts[split][attribute]``, the share of the answers in which that part is
        right. ``change`` by attribute: how much a tensor changes if only that is changed (a place
        by one step), as a share of its norm.
    """
    array = rectify(tensors["angle"].transpose("trial", "sensor", "time").values)
    names = {
        a: np.array([f"{v:g}" if a != "feature" else v for v in tensors[a].values])
        for a in ATTRIBUTES
    }
    options = _list_options(plan, plan.n_repeats, random_state)
    accuracy, chance, parts = {}, {}, {}
    for split, read in SPLITS.items():
        groups = names[LEFT_OUT[split]]
        labels = np.array([" ".join(row) for row in zip(*(names[a] for a in read), strict=True)])
        least = min(np.sum(groups != group) for group in np.unique(groups))
        lda = make_fitting_lda(int(least), plan.n_copies)
        folds = list(
            compute_left_out(array / array.max(), labels, groups, estimator=lda, **options).values()
        )
        accuracy[split] = float(np.mean([sweep.clean.mean() for sweep in folds]))
        chance[split] = folds[0].chance
        confusion = sum(sweep.confusion[-1] for sweep in folds)
        parts[split] = _split_parts(folds[0].classes, confusion / confusion.sum(), read)
    change = _measure_change(array, names)
    return SimpleNamespace(accuracy=accuracy, chance=chance, parts=parts, change=change)


def _split_parts(classes: np.ndarray, share: np.ndarray, read: tuple[str, ...]) -> dict[str, float]:
    words = np.array([str(name).split(" ") for name in classes])
    return {
        a: float(share[words[:, None, k] == words[None, :, k]].sum()) for k, a in enumerate(read)
    }


def _measure_change(array: np.ndarray, names: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Mean over pairs of touches that differ in one attribute only (places: by one step)."""
    steps = {
        a: {value: k for k, value in enumerate(sorted(set(v.tolist())))} for a, v in names.items()
    }
    found: dict[str, list[float]] = {a: [] for a in ATTRIBUTES}
    for i, j in combinations(range(len(array)), 2):
        differ = [a for a in ATTRIBUTES if names[a][i] != names[a][j]]
        near = {
            a: abs(steps[a][names[a][i]] - steps[a][names[a][j]]) == 1 or a != "location"
            for a in differ
        }
        if len(differ) == 1 and near[differ[0]]:
            size = (np.linalg.norm(array[i]) + np.linalg.norm(array[j])) / 2
            found[differ[0]].append(float(np.linalg.norm(array[i] - array[j]) / size))
    return {a: float(np.mean(values)) if values else float("nan") for a, values in found.items()}


def _list_options(plan: Plan, n_repeats: int, random_state: int) -> dict[str, Any]:
    """What ``compute_sweep`` takes for one noise ratio."""
    return {
        "ratios": (plan.probe,),
        "n_copies": plan.n_copies,
        "n_repeats": n_repeats,
        "rotate": True,
        "noise": Relative(),
        "random_state": random_state,
    }


def plot(data: Mapping[str, SimpleNamespace], figure: Figure) -> None:
    """Accuracy on a new size and a new place; and how much each attribute changes a tensor."""
    left, right = figure.subplots(1, 2)
    width = 0.8 / len(data)
    for k, (name, new) in enumerate(data.items()):
        colour = PROFILE_COLOURS.get(name, PALETTE[k % len(PALETTE)])
        shift = (k - (len(data) - 1) / 2) * width
        left.bar(
            np.arange(len(SPLITS)) + shift,
            [100 * a for a in new.accuracy.values()],
            width,
            color=colour,
            label=name,
        )
        right.bar(
            np.arange(len(ATTRIBUTES)) + shift,
            [100 * a for a in new.change.values()],
            width,
            color=colour,
        )
    for place, chance in enumerate(next(iter(data.values())).chance.values()):
        left.plot([place - 0.45, place + 0.45], [100 * chance] * 2, color="#888888", ls=":", lw=1)
    left.set_xticks(
        range(len(SPLITS)), ["new size:\nshape and place", "new place:\nshape and size"]
    )
    left.set(ylabel="right [%]", ylim=(0, 103), title="trained without it")
    right.set_xticks(range(len(ATTRIBUTES)), ["shape", "size", "place, one step"])
    right.set(ylabel="change of the tensor [% of its norm]", title="what a tensor changes with")
    left.legend(frameon=False)


def show(context: Context, section: Section) -> None:
    """New sizes and places, by profile at slow touch; then shifted places and other speeds."""
    plan = context.effort.plan
    data = {
        name: compute(
            select_speed(load_tensors(context, name), SPEEDS["slow"]),
            plan,
            random_state=context.seed,
        )
        for name in list_profiles(context)
    }
    section.heading("New sizes and places")
    section.figure(
        "fig5_new",
        "Left: accuracy of LDA on clean slow touches whose size, or place, was never trained"
        f" (noise of {100 * plan.probe:g} % in training; dotted: chance). Right: how much a tensor"
        " changes when only its shape, size or place is changed.",
        lambda figure: plot(data, figure),
        height=3.0,
        numbers={name: vars(new) for name, new in data.items()},
    )
    for name, new in data.items():
        for split in SPLITS:
            section.values[f"generalise.{split}.{name}"] = new.accuracy[split]
            section.values[f"generalise.chance.{split}"] = new.chance[split]
        for attribute, change in new.change.items():
            section.values[f"generalise.change.{attribute}.{name}"] = change
    section.table(
        ["profile", "new size [%]", "of it shape", "place", "new place [%]", "of it shape", "size"],
        [
            [
                name,
                *(
                    100 * share
                    for split in SPLITS
                    for share in (new.accuracy[split], *new.parts[split].values())
                ),
            ]
            for name, new in data.items()
        ],
        "Share of answers that are right, and of which each part is right (on noisy copies).",
    )
    if context.effort.jitters and len(data) > 1:
        _show_jittered(context, section)


def _show_jittered(context: Context, section: Section) -> None:
    """Accuracy on clean slow touches, each a little off its place or speed."""
    plan, rng = context.effort.plan, np.random.default_rng(context.seed)
    sets = {name: load_tensors(context, name) for name in list_profiles(context)}
    peak = max(float(data["angle"].max()) for data in sets.values())
    for title, (location, speed) in JITTERS.items():
        words = []
        for name, group in load(context).groups["profile"].items():
            order = [
                trial for trial in list_touches(context, name) if trial.speed == SPEEDS["slow"]
            ]
            moved = Nuisances.only(location=location, speed=speed).jitter(order, rng)
            again = touch(context.profiles[name], moved, duration=DURATION, **context.physics)
            labels = make_labels(select_speed(sets[name], SPEEDS["slow"]))
            right = score_again(
                group, rectify(again["angle"].values) / peak, labels, plan, context.seed
            )
            words.append(f"{name} {100 * right:.0f} %")
        section.text(f"Touches never trained on, {title}, tensors by profile: {', '.join(words)}.")


def score_again(
    group: Group, again: np.ndarray, labels: np.ndarray, plan: Plan, random_state: int = 0
) -> float:
    """Accuracy of LDA, trained on noisy copies of a group's tensors, on clean other ones."""
    sweep = compute_sweep(
        group.tensors,
        group.labels,
        held_out=(again, labels),
        estimator=make_fitting_lda(len(group.labels), plan.n_copies),
        **_list_options(plan, plan.other_repeats, random_state),
    )
    return float(sweep.clean.mean())
