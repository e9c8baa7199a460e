"""Amplitude or geometry, computed whole: minutes of a core.

    python -m studies.amplitude.measure

What is asked stands in declared.toml, written down before anything was run; what is found is
stored as results.json, with date and seed, and the report shows it.
"""

from collections.abc import Mapping
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import xarray as xr
from scipy.ndimage import gaussian_filter

from benchmarks.kept import note_kept
from feeler import touch
from feeler.antenna.segments import Antenna
from feeler.decoding import TemplateClassifier, make_lda
from feeler.objects import NOISES, Common, Mixed, Noise, Nuisances, Task
from feeler.presets import cockroach
from studies.gradient.section import make_graded
from studies.stored import read_declared, store

CLASSIFIERS = ("linear", "smoothed", "template")
AMPLITUDES = ("as_is", "peak", "rms")
"""Of the second antenna of a pair: what of its tensors is made equal to the first's."""
_WHITE = Common(1.0)
Touches = dict[str, tuple[np.ndarray, np.ndarray]]


def make_antennas(reference: Antenna) -> dict[str, Antenna]:
    """The graded antenna, and controls with one stiffness everywhere."""
    return {
        "graded": reference,
        "refitted": cockroach("uniform"),
        "total": make_graded(reference, 0.0),
        "tip": make_graded(reference, 0.0, "tip"),
    }


def make_noise(law: str, size: float, bend_equal: float) -> Noise:
    """The noise of a law: an sd [rad], a share of each touch's own peak, or an sd with a part that
    grows with the bend and equals it at ``bend_equal``.
    """
    if law == "receptor":
        return Mixed(size, share=size / bend_equal)
    return NOISES["common" if law == "absolute" else law](size)


def make_touches(
    antenna: Antenna, asked: Mapping[str, Any], placement: str, number: int
) -> Touches:
    """Clean tensors (trial, sensor, time) and labels that are ``learned`` and ``asked`` about."""
    spread = Nuisances(**asked["placement"][placement])
    seeds = {"asked": asked["seed"], "learned": asked["seed"] + 1_000_000}
    speed, step = asked["speed"], asked["interval"]
    task = Task(speeds=(speed,), nuisances=spread, seeds=seeds)
    each = {"asked": 1} if placement == "known" else {"asked": 1, "learned": asked["train"]}
    drawn = {
        purpose: task.draw(antenna, purpose, set=number, speed=speed, each=count)
        for purpose, count in each.items()
    }
    trials = [trial for some, _ in drawn.values() for trial in some]
    duration = trials[0].lead + antenna.length / speed + asked["tail"]
    found = touch(
        antenna,
        trials,
        duration=step * np.ceil(duration / step),
        sample_interval=step,
        save=("angle",),
        workers=1,
    )
    parts = np.split(found["angle"].values, [len(drawn["asked"][0])])
    made = {name: (part, drawn[name][1]) for name, part in zip(drawn, parts, strict=False)}
    return {"learned": made["asked"]} | made


def multiply(touches: Touches, factor: float) -> Touches:
    """The touches with all tensors multiplied by one number."""
    return {name: (factor * part, labels) for name, (part, labels) in touches.items()}


def measure_amplitude(touches: Touches, amplitude: str) -> float:
    """Mean peak, or root mean square over all samples, of what is learned and asked about; of
    ``as_is`` 1.
    """
    tensors = np.concatenate([part for part, _ in touches.values()])
    if amplitude == "peak":
        return float(np.abs(tensors).max(axis=(1, 2)).mean())
    return float(np.sqrt(np.mean(tensors**2))) if amplitude == "rms" else 1.0


def classify(
    touches: Touches, noise: Noise, asked: Mapping[str, Any], rng: np.random.Generator
) -> list[float]:
    """Accuracy of each classifier."""
    (learned, taught), (met, true) = touches["learned"], touches["asked"]
    seen, truth = noise.add(met, rng, asked["copies"]), np.tile(true, asked["copies"])
    many = asked["learned"] * len(met) // len(learned)
    known, labels = noise.add(learned, rng, many), np.tile(taught, many)
    sd = np.sqrt(np.mean(noise.sd(learned) ** 2, axis=0))
    told = TemplateClassifier(_WHITE).fit(learned / sd, taught).predict(seen / sd)
    linear = make_lda().fit(known, labels).predict(seen)
    width = (0, asked["smooth"]["sensors"], asked["smooth"]["samples"])
    known, seen = (gaussian_filter(part, width)[:, ::2, ::2] for part in (known, seen))
    smoothed = make_lda().fit(known, labels).predict(seen)
    return [float(np.mean(answer == truth)) for answer in (linear, smoothed, told)]


def compute_run(reference: Antenna, asked: Mapping[str, Any]) -> xr.Dataset:
    """``accuracy`` (set, placement, law, level, pair, part, classifier) of one declared run: of the
    ``first`` antenna of each pair, and of the second with each of AMPLITUDES made equal by a
    ``factor`` (set, placement, pair, amplitude).
    """
    dims = {
        "set": range(asked["sets"]),
        "placement": asked["placements"],
        "law": asked["noise"],
        "level": range(len(asked["noise"]["absolute"])),
        "pair": [" ".join(pair) for pair in asked["pairs"]],
        "part": ["first", *AMPLITUDES],
        "classifier": CLASSIFIERS,
        "amplitude": AMPLITUDES,
    }
    antennas = make_antennas(reference)
    names = antennas.keys() & {name for pair in asked["pairs"] for name in pair}
    found: dict[str, list] = {"accuracy": [], "factor": []}
    for number, placement in product(dims["set"], dims["placement"]):
        touches = {
            name: make_touches(antennas[name], asked, placement, number) for name in names
        }
        touches |= {
            "again": touches["graded"],
            "louder": multiply(touches["refitted"], asked["louder"]),
        }
        factors = [
            [
                measure_amplitude(touches[first], one) / measure_amplitude(touches[second], one)
                for one in AMPLITUDES
            ]
            for first, second in asked["pairs"]
        ]
        found["factor"] += factors
        for law in dims["law"]:
            found["accuracy"] += compare(touches, factors, law, asked, number)
    shown = {"accuracy": [*dims][:-1], "factor": ["set", "placement", "pair", "amplitude"]}
    return xr.Dataset(
        {
            name: (axes, np.reshape(found[name], [len(dims[axis]) for axis in axes]))
            for name, axes in shown.items()
        },
        {name: list(values) for name, values in dims.items()},
    )


def compare(
    touches: Mapping[str, Touches],
    factors: list[list[float]],
    law: str,
    asked: Mapping[str, Any],
    number: int,
) -> list[list[float]]:
    """Accuracy of each classifier, level by level, pair by pair and part by part."""

    @cache
    def ask(size: float, name: str, factor: float) -> list[float]:
        # the same draws for all antennas and levels, so that only the tensors differ
        rng = np.random.default_rng([asked["seed"], number, name == "again"])
        noise = make_noise(law, size, asked["bend_equal"])
        return classify(multiply(touches[name], factor), noise, asked, rng)

    found = []
    for size, k in product(asked["noise"][law], range(len(factors))):
        first, second = asked["pairs"][k]
        found.append(ask(size, first, 1.0))
        # which changes nothing in relative noise
        equal = [1.0 if law == "relative" else factor for factor in factors[k]]
        found += [ask(size, second, factor) for factor in equal]
    return found


def compute(reference: Antenna) -> dict[str, xr.Dataset]:
    """Every declared run, by name."""
    asked = read_declared("amplitude")
    return {one["name"]: compute_run(reference, asked | one) for one in asked["run"]}


def main() -> None:
    found = {name: data.to_dict() for name, data in compute(cockroach()).items()}
    note_kept(store("amplitude", found, read_declared("amplitude")["seed"]))


if __name__ == "__main__":
    main()
