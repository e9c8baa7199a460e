"""A public task: name the family of an object that was never touched before, from noisy touches.

The task was fixed, and committed, before any method was scored; see docs/challenge.md.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from feeler.antenna.animals import cockroach
from feeler.decoding import CLASSIFIERS, IdealObserver
from feeler.decoding.classifiers import adopt
from feeler.draw import LogRange
from feeler.errors import InvalidInput
from feeler.experiments.tactile import touch
from feeler.files import write_text
from feeler.objects import Box, Common, Feature, Mixed, Noise, Outline, Relative, Triangle
from feeler.objects.task import SampledTrials, sample_trials

VERSION = 2
N_TOUCHES, N_EACH = 10_000, 40  # touches; objects of each family
FAMILIES = ("round", "flat", "pointed", "notched", "stepped")
SPLITS = {"train": range(24), "validate": range(24, 32), "test": range(32, N_EACH)}
DURATION, SAMPLE_INTERVAL = 124.0, 2.0  # ms, of which 5 before contact
NOISES: dict[str, Noise] = {
    "absolute": Common(0.03),  # rad
    "relative": Relative(0.1),  # of the greatest angle of each touch
    "weber": Mixed(size=0.01, share=0.2),  # rad, and of each sample
}
_SEED, _DRAWS = 2026, 2000
_COLUMNS = ("method", "noise", "accuracy", "low", "high", "version", "by")


def make_objects() -> list[Feature]:
    """The 200 objects, ``round-00`` to ``stepped-39``: each another size and proportion.

    Half-widths are 1 to 3 mm in every family, so that size does not tell the family [C].
    """
    return [_make(family, number) for family in FAMILIES for number in range(N_EACH)]


def _make(family: str, number: int) -> Feature:
    rng = np.random.default_rng([_SEED, FAMILIES.index(family), number])
    w = float(np.exp(rng.uniform(np.log(1.0), np.log(3.0))))  # half-width, mm
    deep, front = w * rng.uniform(0.6, 1.4), w * rng.uniform(0.3, 0.9)  # mm along the motion
    name = f"{family}-{number:02d}"
    if family == "flat":
        return Box(half_width=w, half_height=deep, name=name)
    if family == "pointed":
        return Triangle(half_width=w, half_height=deep, name=name)
    if family == "round":
        turn = np.linspace(0, 2 * np.pi, 48, endpoint=False)
        corners = np.column_stack([deep * np.cos(turn), w * np.sin(turn)])
    elif family == "notched":
        back = -front - deep
        corners = np.array([(0, w), (back, w), (back, -w), (0, -w), (-front, 0)])
    else:
        back, s = -front - deep, rng.choice([-1, 1])
        corners = np.array([(0, -w), (0, 0), (-front, 0), (-front, w), (back, w), (back, -w)])
        corners = corners * (1, s)
    return Outline(vertices=corners, name=name)


def make_trials(n: int = N_TOUCHES) -> SampledTrials:
    """Touches of the 200 objects by the cockroach's antenna; the k-th is the same for any ``n``.

    Places from 0.3 to 0.85 of the length, 0.1 to 0.5 m/s, approach of 75 to 105 degrees,
    friction 1 [C].
    """
    return sample_trials(
        n,
        features=make_objects(),
        sizes=None,
        locations=(0.3, 0.85),
        speeds=LogRange(0.1, 0.5),
        approach=(75.0, 105.0),
        friction=1.0,
        sides=("left",),
        seed=_SEED,
    )


def make(path: str | os.PathLike, **options: Any) -> xr.Dataset:
    """Simulate the task's touches into a store; an interrupted call goes on from what is there.

    Parameters
    ----------
    path
        The store (``.zarr``): ``angle`` (trial, sensor, time) [rad] without noise, as float32.
    options
        Of :func:`feeler.touch`: ``workers``, ``progress``, ``executor``.

    Returns
    -------
    xr.Dataset
        The touches, lazy; the coordinate ``feature`` names each object.
    """
    return touch(
        cockroach(),
        make_trials(),
        duration=DURATION,
        sample_interval=SAMPLE_INTERVAL,
        save=("angle",),
        dtype="float32",
        store=path,
        load=False,
        **options,
    )


class Task:
    """The touches, split so that no object is in two parts, and noisy in three ways.

    Parameters
    ----------
    tensors
        What :func:`make` gives, or ``feeler.load`` of its store.

    Attributes
    ----------
    objects, labels, split
        Of each touch (trial,): its object, family and part (``train``, ``validate``, ``test``).

    Raises
    ------
    InvalidInput
        Touches of other objects, or not as many as the task has.
    """

    def __init__(self, tensors: xr.Dataset) -> None:
        known = {item.name for item in make_objects()}
        names = tensors.get("feature")
        if names is None or "angle" not in tensors or not {*names.values.tolist()} <= known:
            raise InvalidInput(
                "these are not the task's touches; make them: feeler challenge make touches.zarr"
            )
        self._angle = tensors["angle"]
        self.objects = names.values.astype(str)
        self.labels = np.array([name.partition("-")[0] for name in self.objects])
        number = np.array([int(name.partition("-")[2]) for name in self.objects])
        part = {k: name for name, members in SPLITS.items() for k in members}
        self.split = np.array([part[k] for k in number])
        if {*self.labels[self.split == "train"]} != {*FAMILIES} or "test" not in self.split:
            raise InvalidInput(
                f"the task has {N_TOUCHES:,} touches of {len(known)} objects, got"
                f" {len(self.objects):,} touches of {len({*self.objects})}."
            )

    def read(self, part: str, noise: str | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Tensors (trial, sensor, time) [rad] of a part, and their families (trial,).

        ``noise`` is ``absolute``, ``relative`` or ``weber``, always the same draw of each; None
        for tensors without noise.
        """
        chosen = np.flatnonzero(self.split == part)
        clean = self._angle[chosen].values
        if noise is not None:
            if noise not in NOISES:
                raise InvalidInput(f"noise must be one of {', '.join(NOISES)}, got {noise!r}.")
            seed = [_SEED, [*SPLITS].index(part), [*NOISES].index(noise)]
            clean = NOISES[noise].add(clean, np.random.default_rng(seed)).astype(clean.dtype)
        return clean, self.labels[chosen]

    def score(self, make: Callable[[], Any], noise: str) -> dict[str, Any]:
        """Accuracy of a method on the test part, with the 95 % interval of its objects.

        Parameters
        ----------
        make
            Gives something with ``fit(tensors, labels)`` and ``predict(tensors)``, or a
            scikit-learn estimator of tables; it learns from the noisy training part.

        Returns
        -------
        dict
            ``noise``, ``accuracy``, ``low``, ``high``: test objects are drawn again, each with all
            its touches.
        """
        method = adopt(make(), "make")
        method.fit(*self.read("train", noise))
        return self._judge(method, noise)

    def score_known(self, noise: str) -> dict[str, dict[str, Any]]:
        """Two observers that know the noise, and touches without it.

        ``observer of the training touches`` takes each met touch for one of the training touches
        in noise. ``ceiling`` knows the test touches themselves, each of them equally likely: no
        method does better on average.
        """
        found = {}
        for name, part in (("observer of the training touches", "train"), ("ceiling", "test")):
            observer = IdealObserver(NOISES[noise]).fit(*self.read(part))
            found[name] = self._judge(observer, noise)
        return found

    def _judge(self, method: Any, noise: str) -> dict[str, Any]:
        tensors, labels = self.read("test", noise)
        answers = np.asarray(method.predict(tensors))
        if answers.shape != labels.shape:
            raise InvalidInput(
                f"predict must give a label for each of {len(labels)} tensors, got shape"
                f" {answers.shape}."
            )
        right = xr.DataArray(answers == labels, dims="trial")
        by = right.groupby(xr.DataArray(self.objects[self.split == "test"], dims="trial"))
        hits, touches = by.sum().values, by.count().values
        drawn = np.random.default_rng(0).integers(len(hits), size=(_DRAWS, len(hits)))
        shares = hits[drawn].sum(axis=1) / touches[drawn].sum(axis=1)
        low, high = np.quantile(shares, [0.025, 0.975])
        return {
            "noise": noise,
            "accuracy": float(right.mean()),
            "low": float(low),
            "high": float(high),
        }


def make_smooth_svm() -> Any:
    """Gaussian smoothing (1.5 sensors, 8 ms), 40 principal components, SVM of a radial kernel."""
    from scipy.ndimage import gaussian_filter
    from sklearn.pipeline import make_pipeline
    from sklearn.preprocessing import FunctionTransformer

    def smooth(tensors: np.ndarray) -> np.ndarray:
        return gaussian_filter(tensors, (0, 1.5, 4)).reshape(len(tensors), -1)

    return make_pipeline(FunctionTransformer(smooth), CLASSIFIERS["svm"](40, kernel="rbf"))


BASELINES: Mapping[str, Callable[[], Any]] = {
    "LDA on 30 components": lambda: CLASSIFIERS["lda"](),
    "smoothing, 40 components, RBF-SVM": make_smooth_svm,
    "convolutional network": lambda: CLASSIFIERS["cnn"](),
}
"""Methods to beat; the network needs PyTorch."""


def write_results(path: str | os.PathLike, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add rows to a results file (CSV), in place of those of the same method, noise and author.

    Columns: method, noise, accuracy, low, high (95 %), version (of the task), by (who).
    """
    table = pd.DataFrame(rows, columns=_COLUMNS)
    if Path(path).exists():
        old = pd.read_csv(path)
        if [*old.columns] != [*_COLUMNS]:
            raise InvalidInput(
                f"{path} has other columns than a results file: {', '.join(old.columns)}."
                f" It needs {', '.join(_COLUMNS)}."
            )
        table = pd.concat([old, table]).drop_duplicates(["method", "noise", "by"], keep="last")
    write_text(path, table.to_csv(index=False, float_format="%.4f"))
