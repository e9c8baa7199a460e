"""Regression instead of thirty classes: place, size and speed, beside the Cramér–Rao bound (no
figure of the paper).
"""

from collections.abc import Mapping
from itertools import count
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from sklearn.decomposition import PCA
from sklearn.kernel_ridge import KernelRidge
from sklearn.linear_model import RidgeCV
from sklearn.model_selection import GridSearchCV
from sklearn.neighbors import KNeighborsRegressor
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler

from feeler import touch
from feeler.analysis import (
    compute_bounds,
    compute_fisher,
    differentiate_touches,
    scale_derivatives,
    scale_peaks,
)
from feeler.antenna.segments import Antenna
from feeler.draw import LogRange
from feeler.objects import Nuisances, Task, Trial, make_feature
from feeler.plotting.style import PALETTE, mark_places
from feeler.report import Section, make_spread
from feeler.tradeoff import UNITS_OF_NOISE
from paper.context import Context
from studies.stored import read_declared

_TARGETS = {"location": "mm", "size": "mm", "speed": "%"}
_RESAMPLES = 1000  # bootstrap
_TICKS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100)
_ESTIMATORS = {
    "ridge": lambda: RidgeCV(alphas=np.logspace(-4, 4, 9)),
    "kernel ridge": lambda: GridSearchCV(
        KernelRidge(kernel="rbf"),
        {"alpha": [1e-3, 1e-2, 0.1], "gamma": [3e-3, 1e-2, 3e-2]},
        cv=3,
    ),
    "nearest neighbours": lambda: KNeighborsRegressor(5, weights="distance"),
}


def _make_task(shape: str, asked: Mapping[str, Any], number: int) -> Task:
    """One object anywhere in the ranges, at any speed of its range (uniform in its logarithm)."""
    ranges = Nuisances.only(
        location=tuple(asked["location"]),
        size=tuple(asked["size"]),
        speed=LogRange(*asked["speed"]),
    )
    seed = 10 * asked["seed"] + 2 * number
    return Task(
        objects=[make_feature(shape, asked["size"][0])],
        locations=(float(np.mean(asked["location"])),),
        speeds=(float(np.mean(asked["speed"])),),
        nuisances=ranges,
        seeds={"train": seed, "test": seed + 1},
    )


def _draw_trials(
    task: Task, antenna: Antenna, asked: Mapping[str, Any], purpose: str
) -> list[Trial]:
    """Touches to train on, none in a held-out band, or to test with, each in one."""
    trials: list[Trial] = []
    for number in count():
        drawn, _ = task.draw(antenna, purpose, set=number, each=asked[purpose])
        trials += [trial for trial in drawn if _is_held(trial, asked) == (purpose == "test")]
        if len(trials) >= asked[purpose]:
            break
    return trials[: asked[purpose]]


def _is_held(trial: Trial, asked: Mapping[str, Any]) -> bool:
    return any(
        low <= value <= high
        for value, bands in (
            (trial.location, asked["held_location"]),
            (trial.feature.size, asked["held_size"]),
        )
        for low, high in bands
    )


def _list_targets(antenna: Antenna, trials: list[Trial]) -> np.ndarray:
    """Place [mm], size [mm] and speed [% of 1 m/s, in its logarithm] (trial, target)."""
    return np.array(
        [[t.location * antenna.length, t.feature.size, 100 * np.log(t.speed)] for t in trials]
    )


def compute(antenna: Antenna, asked: Mapping[str, Any], **options: Any) -> dict[str, Any]:
    """Squared errors and bounds of every touch by shape, noise and target, and the derivatives'
    changes by halving the step.

    ``errors`` and ``bounds`` {(shape, kind, size): …}: {estimator: (touch, target)} and
    (touch, target).
    """
    errors, bounds, changes = {}, {}, {}
    options = options | {"duration": asked["duration"]}
    for number, shape in enumerate(asked["shapes"]):
        rng = np.random.default_rng([asked["seed"], number])
        task = _make_task(shape, asked, number)
        sets = [_draw_trials(task, antenna, asked, purpose) for purpose in ("train", "test")]
        targets = [_list_targets(antenna, trials) for trials in sets]
        angles = [
            touch(antenna, trials, save=("angle",), **options)["angle"].values
            for trials in sets
        ]
        derived = differentiate_touches(antenna, sets[1], tuple(_TARGETS), **options)
        changes[shape] = derived["change"].values
        for kind in UNITS_OF_NOISE:
            clean, moves = angles, derived["derivative"].values
            if kind == "relative":
                clean, moves = (
                    [scale_peaks(angle) for angle in angles],
                    scale_derivatives(moves, angles[1]),
                )
            for size in asked[kind]:
                least = np.array(
                    [
                        compute_bounds(compute_fisher(move, size))
                        for move in moves.swapaxes(0, 1)
                    ]
                )
                bounds[shape, kind, size] = least**2
                errors[shape, kind, size] = _read(clean, targets, size, asked, rng)
    return {"errors": errors, "bounds": bounds, "changes": changes}


def _read(
    clean: list[np.ndarray],
    targets: list[np.ndarray],
    size: float,
    asked: Mapping[str, Any],
    rng: np.random.Generator,
) -> dict[str, np.ndarray]:
    """Squared error (touch, target) of each estimator, averaged over noisy copies of the test
    tensors; trained on those of the training tensors.
    """
    copies = asked["copies"]
    known, asking = (
        np.concatenate(
            [c + size * rng.standard_normal(c.shape) for _ in range(copies)]
        ).reshape(copies * len(c), -1)
        for c in clean
    )
    parts = PCA(
        min(asked["components"], len(known) - 1), random_state=0, svd_solver="randomized"
    ).fit(known)
    known, asking = parts.transform(known), parts.transform(asking)
    truth = [np.tile(t, (copies, 1)) for t in targets]
    scale = StandardScaler().fit(truth[0])
    found = {}
    for name in asked["estimators"]:
        estimator = make_pipeline(StandardScaler(), _ESTIMATORS[name]()).fit(
            known, scale.transform(truth[0])
        )
        squares = (scale.inverse_transform(estimator.predict(asking)) - truth[1]) ** 2
        found[name] = squares.reshape(copies, *targets[1].shape).mean(axis=0)
    return found


def plot(data: Mapping[str, Any], asked: Mapping[str, Any], figure: Figure) -> None:
    """Error of the estimators, and the bound, against noise; first shape."""
    shape = asked["shapes"][0]
    for row, kind in zip(figure.subplots(2, 3), UNITS_OF_NOISE, strict=True):
        for k, (ax, (target, unit)) in enumerate(zip(row, _TARGETS.items(), strict=True)):
            sizes = asked[kind]
            for colour, name in zip(PALETTE, asked["estimators"], strict=False):
                ax.plot(
                    sizes,
                    [_average(data["errors"][shape, kind, s][name])[k] for s in sizes],
                    ".-",
                    color=colour,
                    label=name,
                )
            ax.plot(
                sizes,
                [_average(data["bounds"][shape, kind, s])[k] for s in sizes],
                "kx--",
                label="Cramér–Rao bound",
            )
            ax.set(
                xscale="log",
                yscale="log",
                xlabel=f"noise [{UNITS_OF_NOISE[kind]}]",
                ylabel=f"error of {target} [{unit}]",
            )
            mark_places(ax.xaxis, sizes)
            mark_places(
                ax.yaxis,
                [tick for tick in _TICKS if ax.get_ylim()[0] <= tick <= ax.get_ylim()[1]],
            )
    marks = figure.axes[3].get_legend_handles_labels()
    figure.legend(*marks, loc="outside lower center", ncols=len(marks[1]))


def _average(squares: np.ndarray) -> np.ndarray:
    """Root mean square over touches (touch, target)."""
    return np.sqrt(squares.mean(axis=0))


def _collect_values(data: Mapping[str, Any], asked: Mapping[str, Any]) -> dict[str, Any]:
    """The numbers that claims are held against, with 95 % intervals over touches (bootstrap);
    ``error`` is that of the estimator that is best over all touches, as is each ratio to the bound.
    """
    changes = np.concatenate([values.ravel() for values in data["changes"].values()])
    n = asked["test"] * len(asked["shapes"])
    best = {key: _choose_best(by) for key, by in data["errors"].items()}
    rng = np.random.default_rng(0)
    drawn = [
        _measure(best, data["bounds"], asked, rng.integers(asked["test"], size=asked["test"]))
        for _ in range(_RESAMPLES)
    ]
    found: dict[str, Any] = {"bounds.change": {"value": float(np.median(changes)), "n": n}}
    for key, value in _measure(best, data["bounds"], asked, np.arange(asked["test"])).items():
        low, high = np.quantile([one[key] for one in drawn], [0.025, 0.975])
        found[key] = make_spread(value, low, high, n=n)
    return found


def _choose_best(by: Mapping[str, np.ndarray]) -> np.ndarray:
    """Squared errors (touch, target) of the estimator that is best for each target."""
    every = np.array(list(by.values()))
    winner = every.mean(axis=1).argmin(axis=0)
    return np.stack([every[k, :, target] for target, k in enumerate(winner)], axis=1)


def _measure(
    best: Mapping[tuple, np.ndarray],
    bounds: Mapping[tuple, np.ndarray],
    asked: Mapping[str, Any],
    touches: np.ndarray,
) -> dict[str, float]:
    """Errors and bounds over these touches, all shapes together, and the least ratios of them."""
    error, bound = (
        {key: _average(squares[touches]) for key, squares in by.items()}
        for by in (best, bounds)
    )
    found: dict[str, float] = {}
    for k, name in enumerate(_TARGETS):
        ratio = {key: float(error[key][k] / bound[key][k]) for key in error}
        quiet = [ratio[key] for key in ratio if key[2] == min(asked[key[1]])]
        found |= {
            f"bounds.ratio.{name}": min(ratio.values()),
            f"bounds.ratio.{name}.quiet": min(quiet),
        }
        for kind in UNITS_OF_NOISE:
            for size in asked[kind]:
                keys = [key for key in error if key[1:] == (kind, size)]
                for word, by in (("error", error), ("bound", bound)):
                    mean = float(np.sqrt(np.mean([by[key][k] ** 2 for key in keys])))
                    found[f"bounds.{word}.{name}.{kind}.{size:g}"] = mean
    return found


def show(context: Context, section: Section) -> None:
    """Errors beside bounds, and whether the derivatives have converged."""
    asked = read_declared("bounds") | dict(context.effort.regression)
    data = compute(context.antenna, asked, **context.physics)
    changes = np.concatenate([values.ravel() for values in data["changes"].values()])
    section.text(
        f"Place, size and speed of one touch, read together from {asked['duration']:g} ms of its"
        " noisy tensor by estimators that were not trained on such locations or sizes"
        f" ({asked['train']} touches in training, {asked['test']} in the test, each shape by"
        " itself). The bound holds for unbiased estimators to whom the shape is known; it comes"
        f" from the engine's central differences, which change by {100 * np.median(changes):.2g} %"
        f" (median; 95th percentile {100 * np.quantile(changes, 0.95):.2g} %) when their step is"
        " halved. Where the noise is so strong that an estimator does best by staying near the"
        " middle of the range, it is biased, and may come to lie below the bound."
    )
    section.figure(
        "bounds",
        "Root mean square error of each estimator against noise, and the Cramér–Rao bound of"
        f" unbiased ones, below which biased ones may lie; {asked['shapes'][0]}, n ="
        f" {asked['test']} touches. a–c: relative noise; d–f: absolute.",
        lambda figure: plot(data, asked, figure),
        height=4.4,
        numbers={
            "errors": {
                str(key): {name: _average(squares) for name, squares in by.items()}
                for key, by in data["errors"].items()
            },
            "bounds": {str(key): _average(squares) for key, squares in data["bounds"].items()},
            "changes": data["changes"],
        },
    )
    rows = [
        [shape, f"{kind} {size:g} {UNITS_OF_NOISE[kind]}", name, *map(float, _average(squares))]
        for (shape, kind, size), by in data["errors"].items()
        for name, squares in {**by, "bound": data["bounds"][shape, kind, size]}.items()
    ]
    section.table(
        [
            "shape",
            "noise",
            "estimator",
            *(f"{name} [{unit}]" for name, unit in _TARGETS.items()),
        ],
        rows,
    )
    section.values.update(_collect_values(data, asked))
