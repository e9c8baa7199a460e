"""Discriminate touches: a scored task with fixed touches, fixed noise and one number per method.

A method is a file with ``make()``, which gives something with ``fit(tensors, labels)`` and
``predict(tensors)``; tensors are (touch, sensor, time), in rad.

    python benchmarks/score.py my_method.py       # enters a method
    python benchmarks/score.py                    # the baselines

Everything below was fixed before any method was scored; see docs/challenge.md.
"""

import argparse
import runpy
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import feeler
from feeler.decoding import READERS
from feeler.objects import Common, Task

NAME, VERSION = "discriminate touches", 1
SPEED, EACH, COPIES = 0.3, 20, {"train": 5, "final": 2}
NOISE = Common(0.03)  # rad, on every sample of every sensor
SEEDS = {"train": 11, "final": 13}
DRAWS = 2000  # of the touches, for the interval
TASK = Task(
    objects=("ball:radius=1.5", "box:half_width=1.5", "triangle:half_width=1.5"),
    locations=(0.3, 0.55, 0.8),
    deadline=100.0,
)
BASELINES: dict[str, Callable[[], Any]] = {
    "nearest mean": lambda: NearestMean(),
    "LDA on 30 components": lambda: READERS["lda"](),
    "linear SVM on 30 components": lambda: READERS["svm"](),
}


class NearestMean:
    """The baseline of twenty lines: the class whose mean tensor is nearest."""

    def fit(self, tensors: np.ndarray, labels: np.ndarray) -> "NearestMean":
        """Keep the mean tensor of every class."""
        self.classes = np.unique(labels)
        self.means = np.stack([tensors[labels == one].mean(axis=0) for one in self.classes])
        return self

    def predict(self, tensors: np.ndarray) -> np.ndarray:
        """The nearest mean's class for each tensor."""
        gaps = tensors[:, None] - self.means
        return self.classes[np.square(gaps).sum(axis=(2, 3)).argmin(axis=1)]


def make_split(purpose: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Noisy tensors, their labels, and which touch each is a copy of."""
    antenna = feeler.presets.cockroach()
    trials, labels = TASK.draw(antenna, purpose, speed=SPEED, each=EACH)
    touches = feeler.touch(antenna, trials, duration=TASK.duration, save=("angle",))
    rng = np.random.default_rng(SEEDS[purpose])
    copies = COPIES[purpose]
    clean = np.repeat(touches["angle"].values, copies, axis=0)
    noisy = clean + NOISE.size * rng.standard_normal(clean.shape)
    return noisy, np.repeat(labels, copies), np.repeat(np.arange(len(trials)), copies)


def score(make: Callable[[], Any], train: tuple, final: tuple) -> tuple[float, float, float]:
    """Share classified correctly, and its 95 % interval: touches are drawn again, with their
    copies.
    """
    method = make().fit(train[0], train[1])
    right = np.asarray(method.predict(final[0])) == final[1]
    each = right.reshape(-1, COPIES["final"]).mean(axis=1)
    rng = np.random.default_rng(0)
    drawn = each[rng.integers(each.size, size=(DRAWS, each.size))].mean(axis=1)
    return (float(each.mean()), *map(float, np.quantile(drawn, [0.025, 0.975])))


def describe(split: tuple) -> str:
    """A digest by which two people see that they have the same touches."""
    return f"{zlib.crc32(np.round(split[0], 6).tobytes()):08x}"


def main() -> None:
    """Score the methods that are named, or the baselines."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("methods", nargs="*", type=Path, help="files with make()")
    methods = parser.parse_args().methods
    entries = {path.stem: runpy.run_path(str(path))["make"] for path in methods} or BASELINES
    train, final = make_split("train"), make_split("final")
    print(
        f"{NAME}, version {VERSION}: {TASK.n_classes} classes, chance {1 / TASK.n_classes:.1%}"
    )
    print(f"train {train[0].shape} {describe(train)}, final {final[0].shape} {describe(final)}")
    for name, make in entries.items():
        share, low, high = score(make, train, final)
        print(f"{name:30} {share:6.1%}  ({low:.1%} to {high:.1%})")


if __name__ == "__main__":
    main()
