"""Any antennas side by side on the same touches, recorded until the last has let go: dispersion,
entropy and accuracy against noise, as numbers and as a page.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from annotated_types import Len
from matplotlib.figure import Figure
from sklearn.base import clone

from feeler.analysis import (
    INDICES,
    Dispersion,
    Interval,
    bootstrap_difference,
    compute_dispersion,
)
from feeler.antenna.segments import Antenna
from feeler.decoding import Classifier, list_groups, make_codes
from feeler.decoding.curves import Curves, Group, compute_curves
from feeler.decoding.sweeps import Plan
from feeler.encoding import LABELS, ConvolutiveNMF, compute_histogram_entropy, hoyer_sparseness
from feeler.errors import InvalidInput, ModelValidityWarning
from feeler.experiments.tactile import DURATION, touch
from feeler.files import temporary_folder
from feeler.objects.trials import Trial
from feeler.plotting.results import plot_curves, plot_index
from feeler.records import Registry
from feeler.renamed import rename_arguments
from feeler.report import Section, write_page
from feeler.tensors.transforms import in_unit, measure_peak
from feeler.validation import Seed, checked

EFFORTS: Registry["Effort"] = Registry("scale")
COMPARED_CODES = ("sparse", "raw")
_DISTANCE = (
    48.0  # mm that an object goes at first; the last slow touch of the paper ends before 42
)
_FACTORS = (1, 2, 4, 8)


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much of a comparison is computed: the noise sweeps, and how the encoder is fitted."""

    plan: Plan
    encoder: Mapping[str, Any]

    def make_encoder(self, random_state: int = 0) -> ConvolutiveNMF:
        """An unfitted encoder with the paper's M = 3, T = 40 and sparseness 0.8."""
        return ConvolutiveNMF(**{"n_jobs": -1, **self.encoder}, random_state=random_state)


_PAPER: dict[str, Any] = {
    "ratios": (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3),
    "n_repeats": 10,
    "other_repeats": 3,
    "before_copies": 3,
    "before_all": True,
}
_QUICK: dict[str, Any] = {
    "n_copies": 5,
    "other_copies": (),
    "before_repeats": 0,
    "null_restarts": 1,
    "twins": "ends",
}
EFFORTS.register(
    "smoke",
    Effort(
        plan=Plan(
            **_QUICK | {"ratios": (0.2,), "n_repeats": 1, "n_copies": 3, "twins": "none"},
            null_iter=5,
        ),
        encoder={"n_restarts": 1, "max_iter": 5, "tol": 1e-3, "warn": False},
    ),
)
EFFORTS.register(
    "quick",
    Effort(
        plan=Plan(**_QUICK, ratios=(0.1, 0.3), n_repeats=2, null_iter=20),
        encoder={"n_restarts": 1, "max_iter": 20, "tol": 1e-3, "warn": False},
    ),
)
_ENCODER = {"n_restarts": 3, "max_iter": 60, "tol": 3e-4}
EFFORTS.register(
    "published",
    Effort(
        plan=Plan(
            **_PAPER | {"before_repeats": 0, "twins": "ends"},
            control_repeats=3,
            other_copies=(),
        ),
        encoder=_ENCODER,
    ),
)
EFFORTS.register("paper", Effort(plan=Plan(**_PAPER), encoder=_ENCODER))


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """What the page shows.

    Attributes
    ----------
    dispersion : dict[str, Dispersion]
        By kind of code: sparse activations and tensors.
    entropy : dict[str, float]
        Mean grey-level histogram entropy of each antenna's bases [bits].
    sparseness : dict[str, float]
        Mean Hoyer sparseness of each antenna's tensors.
    differences : dict[tuple[str, str], Interval]
        (measure, antenna): first antenna minus this one over the same stimuli.
    peak : dict[str, float]
        Greatest angle [rad].
    """

    names: tuple[str, ...]
    dispersion: dict[str, Dispersion]
    curves: Curves
    entropy: dict[str, float]
    sparseness: dict[str, float]
    differences: dict[tuple[str, str], Interval]
    peak: dict[str, float]

    def to_plain(self) -> dict[str, Any]:
        """As JSON: each measure by antenna; intervals as [value, low, high]."""
        found: dict[str, Any] = {
            "antennas": list(self.names),
            "entropy": self.entropy,
            "sparseness": self.sparseness,
        }
        found |= {"peak": self.peak, "units": {"entropy": "bit", "peak": "rad"}}
        for index, average in self.dispersion["raw"].average.items():
            found[f"{index} with the closest match"] = {
                name: [interval.estimate, interval.low, interval.high]
                for name, interval in average.items()
            }
        for kind in COMPARED_CODES:
            for noise in self.curves.noises:
                curves = self.curves.find(kind, noise)
                found[f"accuracy, {kind}, {noise} noise"] = {
                    n: float(curves[n].noisy.mean()) for n in self.names
                }
        return found

    def list_rows(self) -> list[tuple[str, ...]]:
        """The table: a row per measure, a column per antenna."""
        measures = {
            "greatest angle (°)": {name: np.degrees(peak) for name, peak in self.peak.items()},
            "entropy of the bases (bits)": self.entropy,
            "Hoyer sparseness of the tensors": self.sparseness,
        }
        rows = [
            (title, *(f"{values[n]:.2f}" for n in self.names))
            for title, values in measures.items()
        ]
        for index in INDICES:
            average = self.dispersion["raw"].average[index]
            title = f"{INDICES[index].label} with the closest match, tensors"
            rows.append((title, *(str(average[n]) for n in self.names)))
        for kind in COMPARED_CODES:
            for noise in self.curves.noises:
                found = self.curves.find(kind, noise)
                title = f"accuracy, {LABELS[kind]}, {noise} noise (%)"
                rows.append(
                    (title, *(f"{100 * found[n].noisy.mean():.1f}" for n in self.names))
                )
        return rows


@rename_arguments(reader="classifier")
@checked
def compare_antennas(
    tensors: Mapping[str, Any],
    encoder: Any,
    *,
    plan: Plan,
    classifier: str | Classifier = "lda",
    random_state: Seed = 0,
    report: Callable[[str], None] = lambda line: None,
) -> Comparison:
    """Compare antennas on the same touches.

    Parameters
    ----------
    tensors
        Datasets by antenna name, each with the same stimuli; only the slowest of their speeds is
        compared.
    encoder
        An unfitted ``ConvolutiveNMF``; each antenna gets its own bases.
    classifier
        Who discriminates the touches, or its name; see :data:`feeler.decoding.CLASSIFIERS`.
    """
    if len(tensors) < 2:
        raise InvalidInput(
            "give at least two antennas to compare, for instance: exponential linear."
        )
    listed = list_groups(tensors, reference=next(iter(tensors)))["profile"]
    groups, entropy = {}, {}
    for name, (array, labels) in listed.items():
        fitted = clone(encoder)
        codes = make_codes(array, fitted, COMPARED_CODES)
        groups[name] = Group(tensors=array, labels=labels, encoder=fitted, codes=codes)
        entropy[name] = float(
            np.mean([compute_histogram_entropy(basis) for basis in fitted.components_])
        )
        report(f"{name}: encoded")
    return Comparison(
        names=tuple(listed),
        dispersion={
            kind: compute_dispersion({n: g.codes[kind] for n, g in groups.items()})
            for kind in COMPARED_CODES
        },
        curves=(
            curves := compute_curves(
                groups,
                plan,
                kinds=COMPARED_CODES,
                classifier=classifier,
                random_state=random_state,
                report=report,
            )
        ),
        entropy=entropy,
        sparseness={
            n: float(np.mean([hoyer_sparseness(t.ravel()) for t in g.tensors]))
            for n, g in groups.items()
        },
        differences=_compute_differences(curves, random_state),
        peak={
            name: measure_peak(in_unit(data["angle"], "rad")) for name, data in tensors.items()
        },
    )


def _compute_differences(curves: Curves, random_state: Seed) -> dict[tuple[str, str], Interval]:
    rng = np.random.default_rng(random_state)
    found = {}
    for kind in COMPARED_CODES:
        for noise in curves.noises:
            (_, reference), *others = curves.find(kind, noise).items()
            for name, sweep in others:
                measure = f"accuracy, {LABELS[kind]}, {noise} noise"
                found[measure, name] = bootstrap_difference(reference.area, sweep.area, rng)
    return found


@checked
def touch_whole(
    antenna: Antenna,
    trials: Annotated[Sequence[Trial], Len(1)],
    *,
    seed: Seed = 0,
) -> tuple[xr.Dataset, float]:
    """Touches over the shortest stretch that holds all of them whole.

    Returns
    -------
    angle : xr.Dataset
        ``angle`` (trial, sensor, time) [rad] at as many moments as the paper's window has, by
        linear interpolation.
    end : float
        Where the stretch ends [ms]: one sample after the last contact. A touch that still holds
        after eight times the usual way is cut there, with a warning.
    """
    slowest = min(trial.speed for trial in trials)
    for factor in _FACTORS:
        recorded = touch(antenna, trials, duration=factor * _DISTANCE / slowest, seed=seed)
        held = (recorded["force"] != 0).any(("trial", "axis")).values
        if not held[-1]:
            break
    else:
        warnings.warn(
            f"{antenna.name} is still touched when the recording ends; what follows is cut.",
            ModelValidityWarning,
            stacklevel=2,
        )
    time = recorded["time"].values
    end = float(time[held].max(initial=time[1]) + time[1] - time[0])
    moments = np.linspace(0.0, end, round(DURATION), endpoint=False)
    angle = recorded[["angle"]].transpose("trial", ..., "sensor", "time")
    return angle.interp(time=moments), end


def plot(data: Comparison, figure: Figure) -> None:
    """Dispersion of tensors above, accuracy below."""
    top, bottom = figure.subfigures(2, 1, squeeze=False).flat
    for index, ax in zip(INDICES, top.subplots(1, len(INDICES)), strict=True):
        plot_index(data.dispersion["raw"], index, ax)
        ax.set_title(f"{INDICES[index].label}, tensors", fontsize=8)
    panels = [(kind, noise) for kind in COMPARED_CODES for noise in data.curves.noises]
    axes = bottom.subplots(1, len(panels), sharey=True)
    for (kind, noise), ax in zip(panels, axes, strict=True):
        plot_curves(data.curves, kind, noise, ax)
        ax.set_title(f"{LABELS[kind]}\n{noise} noise", fontsize=7)
        ax.set_xlabel("noise [%]", fontsize=7)
    axes[0].set_ylabel("accuracy [%]", fontsize=7)
    bottom.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=7, fontsize=7
    )


@checked
def write_comparison(data: Comparison, path: str | Path, conditions: str = "") -> Path:
    """One HTML file with everything inside; ``conditions`` says how it was made."""
    title = " against ".join(data.names)
    # how far an interval is from 0, negative where it holds 0
    away = {key: max(one.low, -one.high) for key, one in data.differences.items()}
    measure, name = key = max(away, key=away.__getitem__)
    most, told = data.differences[key], sum(gap > 0 for gap in away.values())
    lead = (
        f"Surest difference: {data.names[0]} minus {name}, {measure},"
        f" {_say_points(most.estimate)} percentage points (95 % CI {_say_points(most.low)} to"
        f" {_say_points(most.high)}). Of {len(data.differences)} differences {told} can be told"
        " from 0; the same touches, at one speed."
    )
    with temporary_folder() as folder:
        section = Section(name="comparison", title="Dispersion and accuracy", folder=folder)
        section.figure(
            "comparison",
            "Above: how alike each tensor and its closest match are (small dots), and their average"
            " with its 95 % bootstrap interval over stimuli; low Pearson r, SSIM and NMI and high"
            " MSE mean more dispersed. Below: accuracy over all classes (object and place) against"
            " noise, with 1 SD; squares: the null, one tensor repeated; crosses: a classifier that"
            " knows only place and time of the peak; dotted: chance.",
            lambda figure: plot(data, figure),
            height=5.4,
        )
        section.table(["measure", *data.names], data.list_rows())
        section.table(
            ["accuracy", f"{data.names[0]} minus", "points", "95 % interval", "effect (d_z)"],
            [
                [
                    measure.removeprefix("accuracy, "),
                    name,
                    _say_points(one.estimate),
                    f"{_say_points(one.low)} to {_say_points(one.high)}",
                    f"{round(one.effect or 0.0, 2) + 0.0:.2f}",  # no −0.00
                ]
                for (measure, name), one in data.differences.items()
            ],
            "Differences over the same touches, in percentage points. An antenna is better where"
            " the interval leaves out 0. d_z: mean of the paired differences over their standard"
            " deviation.",
        )
        section.text(conditions)
        return write_page(path, title, lead, section)


def _say_points(share: float) -> str:
    """Percentage points with their sign; nothing is +0.0."""
    return f"{round(100 * share, 1) + 0.0:+.1f}"
