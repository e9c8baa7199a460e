"""Beside Fig. 5: trained on one size or place, tested on another; what a new touch costs, and why."""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from feeler.decoding import compute_left_out
from feeler.decoding.classifiers import make_fitting_lda
from feeler.decoding.noise import Relative
from feeler.decoding.plan import Plan
from feeler.plotting.look import PALETTE, PROFILE_COLOURS
from feeler.report.section import Section
from feeler.stimulus.ninety import SPEEDS
from feeler.studies.paper.context import Context
from feeler.studies.paper.data import list_profiles, load_tensors, select_speed
from feeler.tensors.scaling import rectify

ATTRIBUTES = ("feature", "size", "location")
SPLITS = {"size": ("feature", "location"), "place": ("feature", "size")}
"""What is left out in turn, and what is then read of the touches that have it."""
LEFT_OUT = {"size": "size", "place": "location"}


@dataclass(frozen=True, kw_only=True, eq=False)
class New:
    """One group's accuracy on clean touches of a size or place that was never trained, and what
    changes its tensors.
    """

    accuracy: dict[str, float]
    """By split."""
    chance: dict[str, float]
    parts: dict[str, dict[str, float]]
    """parts[split][attribute]: share of the answers in which that part is right."""
    change: dict[str, float]
    """By attribute: how much a tensor changes if only that is changed (a place by one step), as a
    share of its norm.
    """


def compute(tensors: xr.Dataset, plan: Plan, *, random_state: int = 0) -> New:
    """Leave out every size, then every place, in turn; LDA on the tensors of one speed."""
    array = rectify(tensors["angle"].transpose("trial", "sensor", "time").values)
    names = {
        a: np.array([f"{v:g}" if a != "feature" else v for v in tensors[a].values])
        for a in ATTRIBUTES
    }
    options = {
        "ratios": (plan.probe,),
        "n_copies": plan.n_copies,
        "n_repeats": plan.n_repeats,
        "rotate": True,
    }
    options |= {"noise": Relative(each="tensor"), "random_state": random_state}
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
    return New(accuracy=accuracy, chance=chance, parts=parts, change=_measure_change(array, names))


def _split_parts(classes: np.ndarray, share: np.ndarray, read: tuple[str, ...]) -> dict[str, float]:
    words = np.array([str(name).split(" ") for name in classes])
    return {
        a: float(share[words[:, None, k] == words[None, :, k]].sum()) for k, a in enumerate(read)
    }


def _measure_change(array: np.ndarray, names: Mapping[str, np.ndarray]) -> dict[str, float]:
    """Mean over pairs of touches that differ in one attribute only; of places, in neighbours only."""
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


def plot(data: Mapping[str, New], figure: Figure) -> None:
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
    """New sizes and places, by profile at slow touch."""
    sets = {
        name: select_speed(load_tensors(context, name), SPEEDS["slow"])
        for name in list_profiles(context)
    }
    plan = context.effort.plan
    data = {
        name: compute(tensors, plan, random_state=context.seed) for name, tensors in sets.items()
    }
    section.heading("New sizes and places")
    section.figure(
        "fig5_new",
        "Left: accuracy of LDA on clean slow touches whose size, or place, was never trained"
        f" (noise of {100 * plan.probe:g} % in training; dotted: chance). Right: how much a tensor"
        " changes when only its shape, size or place is changed.",
        lambda figure: plot(data, figure),
        height=3.0,
    )
    for name, new in data.items():
        section.values |= {
            f"generalise.{split}.{name}": value for split, value in new.accuracy.items()
        }
        section.values |= {
            f"generalise.chance.{split}": value for split, value in new.chance.items()
        }
        section.values |= {
            f"generalise.change.{a}.{name}": value for a, value in new.change.items()
        }
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
    section.numbers("fig5_new", **{name: vars(new) for name, new in data.items()})
