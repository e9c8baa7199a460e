"""The first page's result: which of thirty touches it was, against absolute and relative noise, for
known and for held-out touches, by a linear classifier and by the best observer.
"""

from collections.abc import Mapping
from types import SimpleNamespace
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from feeler import touch
from feeler.analysis.information import compute_energy, measure_information
from feeler.antenna.segments import Antenna
from feeler.decoding.classifiers import make_lda
from feeler.decoding.observers import TemplateClassifier
from feeler.objects import NOISES, Noise, Nuisances, Task
from feeler.objects.trials import LEAD, SPEEDS, make_features
from feeler.plotting.style import pick_colours
from feeler.report import Section, make_interval
from feeler.tensors.transforms import in_unit
from feeler.tradeoff import average_sets
from paper.context import Context
from paper.data import list_profiles
from paper.table import read_declared

CASES = (
    "known touches, linear classifier",
    "known touches, ideal observer",
    "held-out touches, linear classifier",
    "held-out touches, quadratic classifier",
)
"""Known touches are met again in new noise; of held-out ones other draws of the class were learned.
An ideal observer knows every touch, so there is none of held-out ones: the quadratic classifier
knows the size of the noise and learns each class's mean and scatter.
"""
_KINDS = {"absolute": "common", "relative": "relative"}
_UNITS = {"absolute": "rad", "relative": "of each touch's own peak"}
_TAIL = 100.0  # [C] ms recorded after the object has gone by


def list_noises(asked: Mapping[str, Any]) -> dict[str, Noise]:
    """Every level of noise by what it is called, such as ``"absolute 0.03"``."""
    return {
        f"{kind} {size:g}": NOISES[known](float(size))
        for kind, known in _KINDS.items()
        for size in asked[kind]
    }


def measure(
    antennas: Mapping[str, Antenna],
    speeds: Mapping[str, float],
    asked: Mapping[str, Any],
    **options: Any,
) -> xr.DataArray:
    """Accuracy (antenna, speed, set, level, case) over sets of touches, each resampled; all
    antennas and speeds meet the same draws. ``asked``: what declared.toml declares, with the
    ``shapes`` and ``locations`` of the scale.
    """
    task = Task(
        objects=[one for one in make_features() if one.kind in asked["shapes"]],
        locations=asked["locations"],
        speeds=tuple(speeds.values()),
        nuisances=Nuisances(),
        seeds={"test": asked["seed"], "train": asked["seed"] + 1_000_000},
    )
    noises = list_noises(asked)
    found = [
        _measure_set(task, antenna, speed, number, noises, asked, options)
        for antenna in antennas.values()
        for speed in speeds.values()
        for number in range(asked["sets"])
    ]
    shape = (len(antennas), len(speeds), asked["sets"], len(noises), len(CASES))
    coords = {"antenna": [*antennas], "speed": [*speeds]} | {
        "level": [*noises],
        "case": [*CASES],
    }
    dims = ("antenna", "speed", "set", "level", "case")
    return xr.DataArray(np.reshape(found, shape), coords, dims)


def _measure_set(
    task: Task,
    antenna: Antenna,
    speed: float,
    number: int,
    noises: Mapping[str, Noise],
    asked: Mapping[str, Any],
    options: Mapping[str, Any],
) -> np.ndarray:
    """Accuracy (level, case) of one set of touches."""
    met, true = task.draw(antenna, "test", set=number, speed=speed)
    learned, taught = task.draw(antenna, "train", set=number, speed=speed, each=asked["train"])
    tensors = touch(
        antenna,
        [*met, *learned],
        duration=np.ceil(LEAD + antenna.length / speed + _TAIL),
        save=("angle",),
        **options,
    )
    known, training = np.split(in_unit(tensors["angle"], "rad").values, [len(met)])
    rng, copies = np.random.default_rng([asked["seed"], number]), asked["copies"]
    truth, many = np.tile(true, copies), copies * asked["train"]
    rows = []
    for noise in noises.values():
        seen = noise.add(known, rng, copies)
        again = make_lda().fit(noise.add(known, rng, many), np.tile(true, many))
        other = make_lda().fit(noise.add(training, rng, copies), np.tile(taught, copies))
        told = TemplateClassifier(noise).fit(training, taught)
        ideal = measure_information(
            compute_energy(noise.whiten(known)),
            noise.size,
            n_draws=asked["draws"],
            random_state=number,
        )
        first, *held = (np.mean(one.predict(seen) == truth) for one in (again, other, told))
        rows.append([first, ideal.accuracy, *held])
    return np.array(rows)


def list_values(found: xr.DataArray) -> dict[str, dict[str, float]]:
    """Mean accuracy and its 95 % interval over sets, by name."""
    mean = average_sets(found).stack(row=("case", "level", "antenna", "speed"))
    return {
        _name(case, level, antenna, speed): make_interval(*one, n=found.sizes["set"])
        for (case, level, antenna, speed), *one in zip(
            mean["row"].values, mean["mean"].values, mean["half"].values, strict=True
        )
    }


def _name(case: str, level: str, antenna: str, speed: str) -> str:
    return f"front.accuracy.{case}, {level} {_UNITS[level.split()[0]]}.{antenna}.{speed}"


def compute(context: Context) -> SimpleNamespace:
    """``rows``: accuracy against noise of the ``names`` of every antenna at the slow speed, and of
    the first at the fastest; ``asked``: what declared.toml and the scale declare.
    """
    effort = context.effort
    asked = read_declared("declared.toml")["front"] | dict(effort.front)
    asked |= {"shapes": effort.shapes, "locations": effort.locations}
    antennas = {name: context.profiles[name] for name in list_profiles(context)}
    first, *_ = antennas
    found = measure(antennas, {"slow": SPEEDS["slow"]}, asked, **context.physics)
    few = asked | {kind: [asked["headline"][kind]] for kind in _KINDS}
    fast = measure({first: antennas[first]}, {"fast": SPEEDS["fast"]}, few, **context.physics)
    return SimpleNamespace(
        rows=list_values(found) | list_values(fast), names=[*antennas], asked=asked
    )


def plot(data: SimpleNamespace, figure: Figure) -> None:
    """Accuracy of slow touches against noise: a row per kind of noise, a column per case."""
    asked = data.asked
    chance = 100 / (len(asked["locations"]) * 2 * len(asked["shapes"]))
    axes = figure.subplots(len(_KINDS), len(CASES), sharey=True, sharex="row")
    colours = pick_colours(data.names)
    for row, kind in zip(axes, _KINDS, strict=True):
        levels = [f"{kind} {size:g}" for size in asked[kind]]
        for ax, case in zip(row, CASES, strict=True):
            for name in data.names:
                own = [data.rows[_name(case, level, name, "slow")] for level in levels]
                mean = 100 * np.array([one["value"] for one in own])
                half = 100 * np.array([one["high"] for one in own]) - mean
                look = {"marker": "o", "ms": 3, "ls": "-", "lw": 1, "capsize": 2}
                ax.errorbar(asked[kind], mean, half, color=colours[name], label=name, **look)
            ax.axhline(chance, color="#888888", ls=":", lw=0.8)
            ax.set(xscale="log", ylim=(0, 103))
            ax.set_xlabel(f"SD [{'rad' if kind == 'absolute' else 'of the peak'}]")
        row[0].set_ylabel(f"accuracy [%]\n{kind} noise")
    for ax, case in zip(axes[0], CASES, strict=True):
        ax.set_title(case.replace(", ", ",\n"), fontsize=8)
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=len(names))


def show(data: SimpleNamespace, section: Section) -> None:
    """Accuracy against noise, and the declared levels as a table."""
    section.figure(
        "front",
        f"Accuracy of slow touches (0.06 m/s) against noise on every sample, {data.asked['sets']}"
        " sets of touches, one of each class, each resampled (placement, size, approach, friction);"
        " mean and 95 % confidence interval over the sets, chance dotted. Noise: the same on every"
        " antenna (above), or in proportion to each touch's own peak (below). Linear classifier:"
        " LDA on 30 principal components; the ideal observer knows every touch and the noise; the"
        f" quadratic classifier learned {data.asked['train']} other draws of each class."
        " Exponential is the graded antenna; 'matched' is uniform in stiffness, as compliant in all"
        " as that.",
        lambda figure: plot(data, figure),
        height=4.4,
        numbers=data.rows,
    )
    levels = [f"{kind} {size:g}" for kind, size in data.asked["headline"].items()]
    section.table(
        ["antenna", "speed", "touches, observer", *levels],
        [
            [
                name,
                speed,
                case,
                *(_say(data.rows, case, level, name, speed) for level in levels),
            ]
            for speed, names in (("slow", data.names), ("fast", data.names[:1]))
            for name in names
            for case in CASES
        ],
        "Accuracy at the declared levels; ± is half the 95 % confidence interval over sets.",
    )


def _say(values: Mapping[str, Any], *name: str) -> str:
    one = values[_name(*name)]
    return f"{one['value']:.3f} ± {one['high'] - one['value']:.3f}"
