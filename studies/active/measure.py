"""Does it pay to steer? Policies against each other as contests.toml says, and the pairs that were
chosen once more on fresh sets: ``python -m studies.active.measure``. An ended run goes on from its
journal.
"""

from pathlib import Path
from typing import Any

from benchmarks.kept import note_kept
from feeler.active.contests import confirm_steering, judge_steering, load_contest
from feeler.presets import cockroach
from studies.stored import store

JOURNAL = Path(__file__).parents[2] / "build" / "active.jsonl"


def main() -> None:
    JOURNAL.parent.mkdir(exist_ok=True)
    contest, how = load_contest(), dict[str, Any](journal=JOURNAL)
    measured = contest.run(cockroach(), **how)
    verdict = judge_steering(measured, contest)
    first = contest.confirm["first"]
    more = contest.replace(sets=first + contest.confirm["sets"])
    chosen = {str(name) for kind in ("fixed", "steered") for name in verdict[kind].values}
    confirmed = confirm_steering(more.run(cockroach(), sorted(chosen), **how), verdict, first)
    confirmed = confirmed.assign_attrs(sets=contest.confirm["sets"])
    found = {"measured": measured.to_dict(), "confirmed": confirmed.to_dict()}
    found["declared"] = contest.to_plain()
    note_kept(store("active", found, contest.seed, digits=17))


if __name__ == "__main__":
    main()
