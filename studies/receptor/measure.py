"""Which receptor noise makes the published gradient the best, computed whole: minutes of a core.

    python -m studies.receptor.measure

What is asked stands in declared.toml, written down before anything was run; what is found is
stored as results.json, with date and seed, and the report shows it.
"""

from benchmarks.kept import note_kept
from feeler.presets import cockroach
from studies.receptor.section import compute
from studies.stored import read_declared, store


def main() -> None:
    whole = compute(cockroach(), workers=1)
    found = {run: data.to_dict() for run, data in whole.items()}
    note_kept(store("receptor", found, read_declared("receptor")["seed"]))


if __name__ == "__main__":
    main()
