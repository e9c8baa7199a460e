"""A plan carried out: searched, judged on tests, the best looked at once on the final draws, all
kept in one folder.
"""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from filelock import FileLock

from feeler.antenna.antenna import Antenna
from feeler.antenna.file import save_antenna
from feeler.antenna.parse import Source
from feeler.design.plan import DesignPlan
from feeler.design.problem import DesignProblem
from feeler.design.scoring import Score, score
from feeler.design.search import Optimum, optimise
from feeler.design.task import DesignTask
from feeler.disk.files import ensure_folder, parse_json, read_bytes, write_text
from feeler.disk.provenance import compute_digest
from feeler.errors import InvalidInput
from feeler.records.checked import checked
from feeler.records.shown import Shown

JOURNAL, _FINALS = "journal.jsonl", "finals.json"
_MAX_BYTES = 2**20  # [C]


@checked
@dataclass(frozen=True, kw_only=True, eq=False)
class DesignOutcome(Shown):
    """What a plan came to.

    Attributes
    ----------
    ends : tuple[Optimum, ...]
        Where each start ended, the best on the test draws first.
    tests : tuple[Score, ...]
        Their scores on the test draws.
    final : Score
        The best one's on the final draws.
    looks : int
        How many designs have been judged on these final draws, this one included: 1 is an honest
        test.
    """

    DRAWN = "draw_outcome"

    plan: DesignPlan
    ends: tuple[Optimum, ...]
    tests: tuple[Score, ...]
    reference_test: Score
    final: Score
    reference_final: Score
    looks: int

    @property
    def best(self) -> Antenna:
        """The antenna to build."""
        return self.ends[0].design.antenna

    @property
    def task(self) -> DesignTask:
        """The task at the best one's own speed."""
        return self.plan.task.at(self.ends[0].design.speed)

    def compare(self, purpose: str = "final") -> tuple[float, float]:
        """Share of the reference's errors that the best one avoids, and its standard error over
        touches met by both.
        """
        mine, other = (
            (self.final, self.reference_final)
            if purpose == "final"
            else (self.tests[0], self.reference_test)
        )
        if other.errors == 0:
            return float("nan"), float("nan")
        touches = (other.wrong - mine.wrong).mean(axis=(0, 1))  # (touch,)
        error = touches.std(ddof=1) / np.sqrt(touches.size) if touches.size > 1 else np.nan
        return float(touches.mean() / other.errors), float(error / other.errors)

    def to_plain(self) -> dict[str, Any]:
        """As JSON: scores, and what each start came to."""
        return {
            "looks": self.looks,
            "fewer_errors": self.compare(),
            "final": _describe(self.final),
            "reference_final": _describe(self.reference_final),
            "reference_test": _describe(self.reference_test),
            "ends": [
                {
                    "x": end.best.x.tolist(),
                    "speed": end.design.speed,
                    "counts": end.counts,
                    "seconds": end.seconds,
                }
                | {
                    "history": end.history,
                    "optimiser_bits": end.best.bits,
                    "test": _describe(test),
                }
                for end, test in zip(self.ends, self.tests, strict=True)
            ],
            "names": self.plan.space.names,
        }


@checked
def carry_out(
    plan: DesignPlan,
    out: str | os.PathLike,
    *,
    watch: Callable[[DesignProblem], None] | None = None,
    **options: Any,
) -> DesignOutcome:
    """Search as the plan says, choose among the ends by the test draws, judge the choice on the
    final ones.

    The folder receives the journal (the same call goes on from it), ``antenna.toml`` and
    ``design.json``.

    Raises
    ------
    InvalidInput
        As :func:`feeler.design.optimise`, which looks at the task before minutes are spent.
    """
    out = Path(out)
    ensure_folder(out)
    asked = {"journal": out / JOURNAL, "watch": watch, **plan.search}
    ends = optimise(plan.task, plan.space, plan.constraints, **asked, **options)
    own = [plan.task.at(end.design.speed) for end in ends]
    tests = [
        score(end.design.antenna, task, "test", **options)
        for end, task in zip(ends, own, strict=True)
    ]
    order = sorted(range(len(ends)), key=lambda k: -tests[k].bits)
    best, task = ends[order[0]].design.antenna, own[order[0]]
    found = DesignOutcome(
        plan=plan,
        ends=tuple(ends[k] for k in order),
        tests=tuple(tests[k] for k in order),
        reference_test=score(plan.reference, plan.task, "test", **options),
        final=score(best, task, "final", **options),
        reference_final=score(plan.reference, plan.task, "final", **options),
        looks=_count_looks(out / _FINALS, task, best),
    )
    _keep(found, out)
    return found


def _count_looks(path: Path, task: DesignTask, antenna: Antenna) -> int:
    """Note that this antenna was judged on the final draws of this seed; how many have been."""
    damaged = InvalidInput(
        f"{path} is damaged; remove it, and take another final seed in the task."
    )
    with FileLock(path.with_name(f".{path.name}.lock")):  # another search in the same folder
        try:
            known = parse_json(read_bytes(path, _MAX_BYTES), str(path)) if path.exists() else {}
        except InvalidInput as error:
            raise damaged from error
        if not all(isinstance(names, list) for names in known.values()):
            raise damaged  # somebody else's file, perhaps
        seen = known.setdefault(str(dict(task.seeds)["final"]), [])
        name = compute_digest(antenna)[:16]
        if name not in seen:
            seen.append(name)
        write_text(path, json.dumps(known))
    return len(seen)


def _keep(found: DesignOutcome, out: Path) -> None:
    note = (
        f"designed: {found.final.bits:.4g} bits on final draws, the reference"
        f" {found.reference_final.bits:.4g}"
    )
    sources = {name: Source(tag="C", note=note) for name in ("stiffness", "damping")}
    save_antenna(found.best, out / "antenna.toml", sources)
    write_text(out / "design.json", json.dumps(found.to_plain(), indent=1, sort_keys=True))


def _describe(one: Score) -> dict[str, Any]:
    names = ("bits", "bits_error", "errors", "errors_error", "peak")
    return {name: getattr(one, name) for name in names}
