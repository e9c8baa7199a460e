"""What spikes tell: the study of studies/spiking/declared.toml, set by set, and recorded sensilla.

    python benchmarks/spikes.py ideal --journal build/ideal.jsonl --until 60
    python benchmarks/spikes.py learn --journal build/learn.jsonl --until 60
    python benchmarks/spikes.py write build/ideal.jsonl build/learn.jsonl
    python benchmarks/spikes.py recordings FOLDER

**ideal** and **learn** go through the sets in their order until the minutes are over, and go on
from their journals. **write** keeps the sets that are whole as studies/spiking/measured.json, which
report and docs read. **recordings** holds the sensillum against recordings by Szczecinski et al.
2021 (doi:10.1088/1748-3190/ac1ced), which are theirs and no part of feeler: in the folder,
``sameAmplitudeDifferentRate.csv``, ``CTrTorqueWaveform.csv`` and, if there, ``rampAndHold.mat`` and
``torqueWaveform.mat``; misfits are printed and drawn.
"""

import argparse
import time
from itertools import product
from pathlib import Path
from typing import Any

from feeler.antenna.cockroach import cockroach
from feeler.execute import ThreadExecutor, run_batch
from feeler.execute.threads import hold_blas
from feeler.journal import Journal
from feeler.provenance import make_key
from feeler.studies.spiking import SpikeStudy, load_spiking

PROFILES = ("exponential", "constant", "linear")  # the last is read by two variants only
RUNS: dict[str, dict[str, Any]] = {
    "ideal": {"codes": ("ideal",), "each": 1},
    "learn": {"codes": ("counts", "first", "onset")},
}
_LEAST = 8  # sets


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
    few = load_spiking(variants=("own", "shared"), **changes)
    key = make_key({"study": whole}, "feeler.studies.spiking.study")
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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("ideal", "learn"))
    parser.add_argument("--journal", type=Path, default=Path("build/spikes.jsonl"))
    parser.add_argument("--until", type=float, default=60.0, help="minutes")
    parser.add_argument("--workers", type=int, default=2, help="threads")
    asked = parser.parse_args()
    asked.journal.parent.mkdir(parents=True, exist_ok=True)
    run_study(asked.journal, asked.until, asked.workers, **RUNS[asked.part])


if __name__ == "__main__":
    main()
