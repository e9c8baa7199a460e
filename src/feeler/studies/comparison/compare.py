"""Any antennas side by side, on touches recorded until the last has let go: dispersion, entropy,
accuracy against noise.
"""

import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import xarray as xr
from annotated_types import Len

from feeler.analysis import (
    INDICES,
    Dispersion,
    Interval,
    bootstrap_difference,
    compute_dispersion,
)
from feeler.antenna.segments import Antenna
from feeler.decoding import Reader, list_groups, make_codes
from feeler.decoding.curves import Curves, Group, compute_curves
from feeler.decoding.sweeps import Plan
from feeler.encoding import LABELS, compute_histogram_entropy, hoyer_sparseness
from feeler.errors import Doubtful, InvalidInput
from feeler.experiments.tactile import DURATION, touch
from feeler.objects.trials import Trial
from feeler.tensors.transforms import in_unit, measure_peak
from feeler.validation import Seed, checked

COMPARED_CODES = ("sparse", "raw")
_DISTANCE = (
    48.0  # mm that an object goes at first; the last slow touch of the paper ends before 42
)
_FACTORS = (1, 2, 4, 8)


@checked
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

    def __post_init__(self) -> None:
        if lacking := {*COMPARED_CODES} - {*self.dispersion}:
            raise InvalidInput(f"Comparison.dispersion lacks the code {min(lacking)!r}.")
        for name in ("entropy", "sparseness", "peak"):
            if lacking := {*self.names} - {*getattr(self, name)}:
                raise InvalidInput(f"Comparison.{name} lacks the antenna {min(lacking)!r}.")

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


@checked
def compare_antennas(
    tensors: Mapping[str, Any],
    encoder: Any,
    *,
    plan: Plan,
    reader: str | Reader = "lda",
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
    reader
        Who tells the touches apart, or its name; see :data:`feeler.decoding.READERS`.
    """
    if len(tensors) < 2:
        raise InvalidInput(
            "give at least two antennas to compare, for instance: exponential linear."
        )
    listed = list_groups(tensors, reference=next(iter(tensors)))["profile"]
    groups, entropy = {}, {}
    for name, (array, labels) in listed.items():
        fitted = encoder.__class__(**encoder.get_params()).set_params(
            n_restarts=plan.n_restarts
        )
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
                reader=reader,
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
            Doubtful,
            stacklevel=2,
        )
    time = recorded["time"].values
    end = float(time[held].max(initial=time[1]) + time[1] - time[0])
    moments = np.linspace(0.0, end, round(DURATION), endpoint=False)
    angle = recorded[["angle"]].transpose("trial", ..., "sensor", "time")
    return angle.interp(time=moments), end
