"""An antenna designed for held-out sizes and locations, computed whole: minutes of a core.

    python -m studies.unseen.measure

What is asked stands in declared.toml, written down before anything was run; what is found is
stored as results.json, with date and seed, and the report shows it.
"""

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from benchmarks.kept import note_kept
from feeler.antenna.segments import Antenna
from feeler.design import (
    Constraints,
    DesignTask,
    Score,
    Space,
    match_compliance,
    optimise,
    score,
)
from feeler.objects import Nuisances
from feeler.presets import cockroach
from studies.stored import read_declared, store

NEW = {"unseen": ("location", "size"), "known": (), "size": ("size",), "place": ("location",)}
"""Kinds of questions: which of their nuisances are those of held-out touches."""


def make_task(asked: Mapping[str, Any], kind: str) -> DesignTask:
    """The declared task with questions of one kind."""
    task = DesignTask(**{name: _read(name, value) for name, value in asked["task"].items()})
    assert task.unseen is not None
    new = {name: getattr(task.unseen, name) for name in NEW[kind]}
    return task.replace(unseen=task.nuisances.replace(**new) if new else None)


def _read(name: str, value: Any) -> Any:
    return Nuisances(**value) if name in ("nuisances", "unseen") else value


def search_unseen(
    reference: Antenna, asked: Mapping[str, Any], kind: str, **options: Any
) -> dict:
    """The antenna with the fewest errors of its kind on the "test" draws, of one end per seed."""
    task, how = make_task(asked, kind), dict(asked["search"])
    seeds, limits = how.pop("seeds"), Constraints(**asked["constraints"])
    space = Space(reference=reference, **asked["space"])
    ends = [optimise(task, space, limits, seed=seed, **how, **options)[0] for seed in seeds]
    wrong = [score(end.design.antenna, task, "test", **options).errors for end in ends]
    best = ends[int(np.argmin(wrong))].design.antenna
    return {
        "stiffness": best.stiffness,
        "damping": best.damping,
        "x": [end.best.x for end in ends],
        "searched": [end.best.errors for end in ends],
        "tested": wrong,
        "published": score(reference, task, "test", **options).errors,
        "history": [end.history for end in ends],
    }


def list_antennas(reference: Antenna, found: Mapping[str, Mapping]) -> dict[str, Antenna]:
    """The published antenna, each design, and each scaled to the published tip compliance."""
    antennas = {"published": reference}
    for kind, one in found.items():
        own = {name: np.asarray(one[name]) for name in ("stiffness", "damping")}
        tip = match_compliance(own["stiffness"], reference, "tip")
        antennas[kind] = reference.replace(**own)
        antennas[f"{kind}_tip"] = reference.replace(
            stiffness=tip, damping=own["damping"] * tip / own["stiffness"]
        )
    return antennas


def judge(
    antennas: Mapping[str, Antenna], asked: Mapping[str, Any], **options: Any
) -> dict[str, dict[str, list[float]]]:
    """Share classified incorrectly on the final draws, by antenna and kind: a number for
    each set.
    """
    found: dict[str, dict[str, list[float]]] = {name: {} for name in antennas}
    for name, kind, count, sets, classifier in _list_trials(antennas, asked["final"]):
        task = make_task(asked, kind.partition(",")[0]).replace(test=count)
        found[name][kind] = [
            _ask(antennas[name], task, number, classifier, options).errors
            for number in range(sets)
        ]
    return found


def _list_trials(antennas: Mapping[str, Antenna], final: Mapping[str, Any]) -> Iterator[tuple]:
    """Antenna, kind, questions of each class, sets and classifier of everything that is judged."""
    few = ("unseen, few", final["other_test"], final["sets"], None)
    classifier = final["classifier"]
    for name in antennas:
        if name.endswith("_tip"):
            yield name, *few
            continue
        yield name, "unseen", final["test"], final["sets"], None
        yield name, "known", final["other_test"], final["sets"], None
        for kind in ("size", "place"):
            yield name, kind, final["other_test"], final["other_sets"], None
        yield (
            name,
            f"unseen, {classifier}",
            final["classifier_test"],
            final["classifier_sets"],
            classifier,
        )
    yield "published", *few  # those that scaled antennas are asked


def _ask(
    antenna: Antenna, task: DesignTask, number: int, classifier: str | None, options: dict
) -> Score:
    """The score on final draws of one set."""
    seeds = dict(task.seeds)
    seeds["final"] += number
    return score(antenna, task.replace(seeds=seeds), "final", classifier=classifier, **options)


def compute(reference: Antenna, **options: Any) -> dict[str, Any]:
    """Both searches, and what was classified incorrectly on the final draws."""
    asked = read_declared("unseen")
    found = {
        kind: search_unseen(reference, asked, kind, **options) for kind in ("unseen", "known")
    }
    return {
        "found": found,
        "wrong": judge(list_antennas(reference, found), asked, **options),
    }


def main() -> None:
    seed = read_declared("unseen")["task"]["seeds"]["final"]
    note_kept(store("unseen", compute(cockroach(), workers=1), seed))


if __name__ == "__main__":
    main()
