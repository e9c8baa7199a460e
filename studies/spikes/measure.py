"""What spikes tell: the study of declared.toml, and recorded sensilla.

    python -m studies.spikes.measure
    python -m studies.spikes.measure recordings FOLDER

An ended run goes on from its journals. **recordings** holds the sensillum against recordings by
Szczecinski et al. 2021 (doi:10.1088/1748-3190/ac1ced), which are theirs and no part of feeler: in
the folder, ``sameAmplitudeDifferentRate.csv``, ``CTrTorqueWaveform.csv`` and, if there,
``rampAndHold.mat`` and ``torqueWaveform.mat``; misfits are printed.
"""

import sys
from collections.abc import Iterator
from itertools import chain, product
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from scipy.io import loadmat

from benchmarks.kept import note_kept
from feeler.objects.trials import SPEEDS
from feeler.presets import cockroach
from feeler.spikes import CAMPANIFORM, place_sensilla
from feeler.spikes.sensilla import step_units
from studies.spikes.study import load_spiking
from studies.stored import store

PROFILES = {("exponential", "uniform"): None, ("linear",): ("own", "shared")}
"""Which variants are asked of which profiles; None: all."""
RUNS: dict[str, dict[str, Any]] = {
    "ideal": {"codes": ("ideal",), "each": 1, "sets": 13},
    "learn": {"codes": ("counts", "first", "onset"), "sets": 43},
}
"""Of the sets that were declared at most, as many as an hour of two cores has given."""
_FIELDS = ("accuracy", "bits", "place", "spikes")
_STEP = 0.1  # ms


def measure(journals: Path) -> dict[str, dict[str, list[float]]]:
    """Numbers by set of each profile, speed, code, variant and window that is asked."""
    cells: dict[str, dict[str, list[float]]] = {}
    journals.mkdir(parents=True, exist_ok=True)
    for (name, asked), (profiles, variants) in product(RUNS.items(), PROFILES.items()):
        study = load_spiking(**asked, variants=variants)
        journal = journals / f"{name}_{profiles[0]}.jsonl"
        antennas = {profile: cockroach(profile) for profile in profiles}
        cells |= dict(list_cells(study.run(antennas, journal=journal)))
    return cells


def list_cells(found: xr.Dataset) -> Iterator[tuple[str, dict[str, list[float]]]]:
    """Key and numbers by set of all that was asked."""
    dims = ("antenna", "speed", "classifier", "level", "window")
    names = {value: name for name, value in SPEEDS.items()}
    for place in product(*(found[dim].values for dim in dims)):
        one = found.sel(dict(zip(dims, place, strict=True)))
        if np.isfinite(one["accuracy"]).any():
            key = "/".join(str(names.get(part, part)) for part in place)
            yield key, {field: one[field].values.tolist() for field in _FIELDS}


def hold_recordings(folder: Path) -> None:
    """Misfits of the sensillum to recorded discharges, printed."""
    for name, animal, model in chain(_hold_ramps(folder), _hold_others(folder)):
        off, fit = np.abs(model - animal).mean(), np.corrcoef(model, animal)[0, 1]
        print(
            f"{name}: r {fit:.2f}, {off:.1f} Hz off, {100 * off / animal.mean():.0f} % of the mean;"
            f" peaks {model.max():.0f} and {animal.max():.0f} Hz"
        )


def _drive(force: np.ndarray, excess: float = 0.0) -> np.ndarray:
    """Discharge [Hz] with this force [mN] every 0.1 ms, from a threshold ``excess`` below it."""
    unit = place_sensilla(np.array([0.5]), 1.0)
    state, before, rate = np.full(2, excess), np.array([force[0], 0.0]), np.zeros(2)
    taps, shares = unit.find_taps(np.array([0.4, 0.6]))
    found, gains = np.empty(force.size), unit.side * unit.gain
    for k, one in enumerate(force):
        sample = np.array([one, one])
        step_units(sample, taps, shares, gains, unit.table, _STEP, state, before, rate)
        found[k] = rate[0]
    return found


def _hold_ramps(folder: Path) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Four ramps to 1.66 mN, in twentieths; the two fast ones end early, as in the authors' use."""
    table = np.genfromtxt(folder / "sameAmplitudeDifferentRate.csv", delimiter=",")
    for number, span in enumerate(1e3 * table[0, 1:], start=1):
        rise = {3: 225.0, 4: 125.0}.get(number, span)
        time = np.arange(0, span, _STEP)
        rates = _drive(np.minimum(1.66 * time / rise, 1.66))
        mean = np.array([part.mean() for part in np.array_split(rates, 20)])
        yield f"ramp of {span:.0f} ms", table[1:, number], mean


def _hold_others(folder: Path) -> Iterator[tuple[str, np.ndarray, np.ndarray]]:
    """Ramp and hold, and the torque of a walking leg; what is not there is left out."""
    wave = np.genfromtxt(folder / "CTrTorqueWaveform.csv", delimiter=",", skip_header=1)
    end = 1e3 * wave[-1, 0]
    time = np.arange(0, end, _STEP)
    slope = 1.2 / (0.17 * end)
    hold = np.minimum(1.2, slope * time)
    hold[time >= 620] = np.maximum(0, 1.2 - slope * (time[time >= 620] - 620))
    torque = 0.6 * np.interp(time, 1e3 * wave[:, 0], wave[:, 1])
    silent = -CAMPANIFORM.d / CAMPANIFORM.a  # the state in which the first value is 0
    for name, force, excess in (("rampAndHold", hold, 0.0), ("torqueWaveform", torque, silent)):
        if not (path := folder / f"{name}.mat").exists():
            print(f"{path} is not there: left out")
            continue
        animal = loadmat(path)["heightsMapped"].ravel()
        animal = np.append(0, animal[np.isfinite(animal)])
        at = np.linspace(0, end, animal.size)
        yield name, animal, np.interp(at, time, _drive(force, excess))


def main() -> None:
    if sys.argv[1:2] == ["recordings"]:
        hold_recordings(Path(sys.argv[2]))
        return
    found = measure(Path("build/spikes"))
    note_kept(store("spikes", found, load_spiking().seed, digits=4))


if __name__ == "__main__":
    main()
