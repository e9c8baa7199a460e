"""What spikes tell: the study of studies/spiking/declared.toml, set by set, and recorded sensilla.

    python benchmarks/spikes.py study --journal build/spikes.jsonl --until 60
    python benchmarks/spikes.py write --journal build/spikes.jsonl
    python benchmarks/spikes.py recordings FOLDER

**study** goes through the sets in their order, all profiles and speeds of one before the next,
until the minutes are over; it goes on from its journal. **write** keeps the sets that are whole as
studies/spiking/measured.json, which report and docs read. **recordings** holds the sensillum
against recordings by Szczecinski et al. 2021 (doi:10.1088/1748-3190/ac1ced), which are theirs and
no part of feeler: ``sameAmplitudeDifferentRate.csv``, ``CTrTorqueWaveform.csv`` and, if there,
``rampAndHold.mat`` and ``torqueWaveform.mat``; misfits are printed and drawn.
"""

import argparse
import time
from itertools import product
from pathlib import Path

from feeler.antenna.cockroach import cockroach
from feeler.journal import Journal
from feeler.provenance import make_key
from feeler.studies.spiking import load_spiking

PROFILES = ("exponential", "constant", "linear")
SIDE = ("linear",)  # read by two variants only


def run_study(journal: Path, minutes: float) -> None:
    """Sets in their order until the clock says stop."""
    whole, few = load_spiking(), load_spiking(variants=("own", "shared"))
    end = time.monotonic() + 60 * minutes
    with Journal(journal, make_key({"study": whole}, "feeler.studies.spiking.study")) as kept:
        for number, name, speed in product(range(whole.sets), PROFILES, whole.task.speeds):
            if kept.find(name, number, speed) is not None:
                continue
            if time.monotonic() > end:
                return
            study = few if name in SIDE else whole
            found = study.measure_set(cockroach(name), number, speed, {"workers": 1})
            kept.add(found, name, number, speed)
            print(f"set {number}, {name}, {speed:g} m/s", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", choices=("study",))
    parser.add_argument("--journal", type=Path, default=Path("build/spikes.jsonl"))
    parser.add_argument("--until", type=float, default=60.0, help="minutes")
    asked = parser.parse_args()
    asked.journal.parent.mkdir(parents=True, exist_ok=True)
    run_study(asked.journal, asked.until)


if __name__ == "__main__":
    main()
