"""What spikes tell: the study of declared.toml, set by set, and recorded sensilla.

    python -m studies.spikes.measure ideal --journal build/ideal.jsonl --until 60
    python -m studies.spikes.measure learn --journal build/learn.jsonl --until 60
    python -m studies.spikes.measure write build/ideal.jsonl build/learn.jsonl
    python -m studies.spikes.measure recordings FOLDER

**ideal** and **learn** go through the sets in their order until the minutes are over, and go on
from their journals. **write** keeps the sets that are whole as results.json, and
the report's section with its numbers, which the docs read. **recordings** holds the sensillum
against recordings by Szczecinski et al. 2021 (doi:10.1088/1748-3190/ac1ced), which are theirs and
no part of feeler: in the folder, ``sameAmplitudeDifferentRate.csv``, ``CTrTorqueWaveform.csv`` and,
if there, ``rampAndHold.mat`` and ``torqueWaveform.mat``; misfits are printed and drawn.
"""

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Iterator
from datetime import date
from itertools import count, product, takewhile
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from scipy.io import loadmat

from benchmarks.kept import write_kept
from feeler.execute import ThreadExecutor, run_batch
from feeler.execute.threads import hold_blas
from feeler.presets import cockroach
from feeler.provenance import Journal, make_key, to_json
from feeler.spikes import CAMPANIFORM, place_sensilla
from feeler.spikes.sensilla import step_units
from paper.context import Context
from paper.kept import keep_sections
from paper.reproduce import STAGES
from paper.stage import run_stage
from studies.spikes.study import SpikeStudy, load_spiking

PROFILES = ("exponential", "uniform", "linear")  # the last is read by two variants only
RUNS: dict[str, dict[str, Any]] = {
    "ideal": {"codes": ("ideal",), "each": 1},
    "learn": {"codes": ("counts", "first", "onset")},
}
FEW = ("own", "shared")
REPRODUCED = Path(__file__).parents[2] / "benchmarks" / "results" / "reproduce.json"
SPEEDS = {0.06: "slow", 0.3: "medium", 0.6: "fast"}  # m/s
_LEAST = 8  # sets
_STEP = 0.1  # ms


def list_jobs(study: SpikeStudy) -> list[tuple[str, int, float]]:
    """Profile, set and speed: eight sets of two profiles, eight of the third, then the rest."""
    sets = [range(_LEAST), range(_LEAST, study.sets)]
    return [
        (name, number, speed)
        for part in sets
        for profiles in (PROFILES[:2], PROFILES[2:])
        for number, name, speed in product(part, profiles, study.task.speeds)
    ]


def run_study(journal: Path, minutes: float, workers: int, **changes: Any) -> None:
    """Sets in their order until the clock says stop."""
    whole = load_spiking(**changes)
    few = load_spiking(variants=FEW, **changes)
    key = make_key({"study": whole})
    end = time.monotonic() + 60 * minutes

    def measure(job: tuple[str, int, float]) -> Any:
        name, number, speed = job
        if time.monotonic() > end:
            return None
        study = few if name == PROFILES[2] else whole
        return study.measure_set(cockroach(name), number, speed, {"workers": 1})

    with hold_blas(), ThreadExecutor(workers) as own, Journal(journal, key, of="study") as kept:
        todo = [(k, job) for k, job in enumerate(list_jobs(whole)) if kept.find(*job) is None]
        jobs = dict(todo)
        for outcome in run_batch(measure, todo, executor=own, window=own.workers):
            if outcome.error is not None:
                raise outcome.error
            if outcome.value is not None:
                kept.add(outcome.value, *jobs[outcome.index])
                print(*jobs[outcome.index], flush=True)


def write_found(journals: list[Path]) -> None:
    """The sets that are whole, as numbers by set, for each profile, speed, code, variant and
    window.
    """
    cells: dict[str, Any] = {}
    for path in journals:
        lines = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
        results = {tuple(entry["name"]): entry["result"] for entry in lines[1:]}
        for profile in PROFILES:
            cells |= dict(_list_cells(results, profile, RUNS[path.stem]))
    study = load_spiking()
    about = {"date": f"{date.today():%Y-%m-%d}", "seed": study.seed, "most": study.sets}
    target = Path(__file__).with_name("results.json")
    write_kept(target, json.dumps({"about": about, "cells": cells}) + "\n")
    # in another process: this one has read the numbers before
    subprocess.run([sys.executable, "-m", "studies.spikes.measure", "section"], check=True)


def _keep_section() -> None:
    """Make the report's section of what is kept now, and put it in the place of the shipped one."""
    stage = next(stage for stage in STAGES if stage.name == "spikes")
    with TemporaryDirectory() as folder:
        context = Context(scale="paper", out=Path(folder))
        section = run_stage(stage, context)
        keep_sections([(stage, section)], context)
    kept = json.loads(REPRODUCED.read_text())
    kept["paper"]["values"]["spikes"] = to_json(section.values)
    REPRODUCED.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n")


def _list_cells(
    results: dict[tuple, Any], profile: str, run: dict[str, Any]
) -> Iterator[tuple[str, dict[str, list[float]]]]:
    """Key and numbers of all that one run asked of a profile, in the sets that it has whole."""
    study = load_spiking(**run, variants=FEW if profile == PROFILES[2] else None)
    numbers = takewhile(
        lambda n: all((profile, n, speed) in results for speed in study.task.speeds), count()
    )
    sets = [*numbers]
    axes = (study.classifiers, study.levels, [name for _, _, name in study.list_windows()])
    for speed, word in SPEEDS.items():
        found = {
            field: np.array([results[profile, n, speed][field] for n in sets], dtype=float)
            for field in ("accuracy", "bits", "place", "spikes")
        }
        for at, names in zip(np.ndindex(*map(len, axes)), product(*axes), strict=True):
            if sets and np.isfinite(found["accuracy"][:, *at]).any():
                plain = {
                    field: [float(f"{one:.4g}") for one in values[:, *at]]
                    for field, values in found.items()
                }
                yield "/".join((profile, word, *names)), plain


def hold_recordings(folder: Path, out: Path) -> None:
    """Misfits of the sensillum to recorded discharges, printed and drawn."""
    rows = [*_hold_ramps(folder), *_hold_others(folder)]
    figure = Figure(figsize=(9, 4.5), layout="constrained")
    axes = figure.subplots(2, -(-len(rows) // 2)).ravel()
    for ax in axes[len(rows) :]:
        ax.remove()
    for ax, (name, at, animal, model) in zip(axes, rows, strict=False):
        off = np.abs(model - animal).mean()
        fit = np.corrcoef(model, animal)[0, 1]
        words = f"r {fit:.2f}, {off:.1f} Hz off, {100 * off / animal.mean():.0f} % of the mean"
        print(f"{name}: {words}; peaks {model.max():.0f} and {animal.max():.0f} Hz")
        ax.plot(at, animal, color="0.5", label="animal")
        ax.plot(at, model, label="model")
        ax.fill_between(at, animal, model, color="tab:red", alpha=0.25, lw=0, label="misfit")
        ax.set_title(f"{name}\n{words}", fontsize=7)
        ax.set_ylim(bottom=0)
        ax.set(xlabel="time [ms]", ylabel="discharge [Hz]")
    axes[0].legend()
    figure.savefig(out / "recordings.png", dpi=160)


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


def _hold_ramps(folder: Path) -> Iterator[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
    """Four ramps to 1.66 mN, in twentieths; the two fast ones end early, as in the authors' use."""
    table = np.genfromtxt(folder / "sameAmplitudeDifferentRate.csv", delimiter=",")
    for number, span in enumerate(1e3 * table[0, 1:], start=1):
        rise = {3: 225.0, 4: 125.0}.get(number, span)
        time = np.arange(0, span, _STEP)
        rates = _drive(np.minimum(1.66 * time / rise, 1.66))
        mean = np.array([part.mean() for part in np.array_split(rates, 20)])
        middle = (np.arange(20) + 0.5) / 20 * span
        yield f"ramp of {span:.0f} ms", middle, table[1:, number], mean


def _hold_others(folder: Path) -> Iterator[tuple[str, np.ndarray, np.ndarray, np.ndarray]]:
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
        yield name, at, animal, np.interp(at, time, _drive(force, excess))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("ideal", "learn", "write", "section", "recordings"))
    parser.add_argument(
        "paths", nargs="*", type=Path, help="journals, or the recordings' folder"
    )
    parser.add_argument("--journal", type=Path, default=Path("build/spikes.jsonl"))
    parser.add_argument("--out", type=Path, default=Path("build"))
    parser.add_argument("--until", type=float, default=60.0, help="minutes")
    parser.add_argument("--workers", type=int, default=2, help="threads")
    asked = parser.parse_args()
    asked.out.mkdir(parents=True, exist_ok=True)
    if asked.part == "write":
        write_found(asked.paths)
    elif asked.part == "section":
        _keep_section()
    elif asked.part == "recordings":
        hold_recordings(asked.paths[0], asked.out)
    else:
        run_study(asked.journal, asked.until, asked.workers, **RUNS[asked.part])


if __name__ == "__main__":
    main()
