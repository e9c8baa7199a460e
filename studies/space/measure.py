"""Three questions of our own, computed whole: which receptor noise makes the published gradient the
best, an antenna designed for sizes and places never met, and contact out of the plane.

    python benchmarks/questions.py [receptor unseen space]

What is asked stands in src/feeler/studies/paper/open_receptor.toml, open_unseen.toml and
open_space.toml, declared before anything was run. What is found is stored beside them as JSON, with
date and seed; the report shows it, and made.json notes the code. The first two take some ten
minutes of one core, the third about ten minutes a set; with a journal it goes on where it stopped:
out/open_space.jsonl.
"""

import json
import sys
import time
from collections.abc import Iterator, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr
from kept import note_kept

from feeler.antenna.segments import Antenna
from feeler.decoding.classifiers import READERS, measure_reader
from feeler.design import (
    Constraints,
    DesignTask,
    Score,
    Space,
    match_compliance,
    optimise,
    score,
)
from feeler.execute.threads import hold_blas
from feeler.objects import Nuisances, Task
from feeler.presets import cockroach
from feeler.provenance import Journal, make_key
from feeler.records import Ge, Lt, Record, Unit
from feeler.report.page import to_json
from feeler.studies.paper.declared import read_declared
from feeler.studies.paper.open_receptor import compute as compute_receptor
from feeler.studies.paper.open_space import FEW
from feeler.studies.study import Study
from feeler.tensors.transforms import in_unit, project_planes

_JOURNAL = Path("out/open_space.jsonl")
_STORED = Path(__file__).parents[1] / "src" / "feeler" / "studies" / "paper"
_DIGITS = 5
NEW = {"unseen": ("location", "size"), "known": (), "size": ("size",), "place": ("location",)}
"""Kinds of questions: which of their nuisances are those of touches never met."""


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
    """Share named wrong on the final draws, by antenna and kind: a number for each set."""
    found: dict[str, dict[str, list[float]]] = {name: {} for name in antennas}
    for name, kind, count, sets, reader in _list_trials(antennas, asked["final"]):
        task = make_task(asked, kind.partition(",")[0]).replace(test=count)
        found[name][kind] = [
            _ask(antennas[name], task, number, reader, options).errors for number in range(sets)
        ]
    return found


def _list_trials(antennas: Mapping[str, Antenna], final: Mapping[str, Any]) -> Iterator[tuple]:
    """Antenna, kind, questions of each class, sets and reader of everything that is judged."""
    few = ("unseen, few", final["other_test"], final["sets"], None)
    reader = final["reader"]
    for name in antennas:
        if name.endswith("_tip"):
            yield name, *few
            continue
        yield name, "unseen", final["test"], final["sets"], None
        yield name, "known", final["other_test"], final["sets"], None
        for kind in ("size", "place"):
            yield name, kind, final["other_test"], final["other_sets"], None
        yield name, f"unseen, {reader}", final["reader_test"], final["reader_sets"], reader
    yield "published", *few  # those that scaled antennas are asked


def _ask(
    antenna: Antenna, task: DesignTask, number: int, reader: str | None, options: dict
) -> Score:
    """The score on final draws of one set."""
    seeds = dict(task.seeds)
    seeds["final"] += number
    return score(antenna, task.replace(seeds=seeds), "final", reader=reader, **options)


def compute_unseen(reference: Antenna, **options: Any) -> dict[str, Any]:
    """Both searches, and what was named wrong on the final draws."""
    asked = read_declared("open_unseen.toml")
    found = {
        kind: search_unseen(reference, asked, kind, **options) for kind in ("unseen", "known")
    }
    return {
        "found": found,
        "wrong": judge(list_antennas(reference, found), asked, **options),
    }


class Layout(Record):
    """Where sensors sit around the antenna, and what each of them feels.

    Attributes
    ----------
    around : tuple[float, ...]
        Sides of each place that carry a sensor, 0 towards x and 90 towards z.
    turn : float
        How much farther around the next place's sensors sit.
    places : int
        Places along the antenna, evenly.
    one_way : bool
        Whether they feel bending towards their side only, or away from it too.
    """

    around: tuple[Annotated[float, Ge(0), Lt(360), Unit("degrees")], ...] = (0.0,)
    turn: Annotated[float, Ge(0), Lt(360), Unit("degrees")] = 0.0
    places: Annotated[int, Ge(1)] = 56
    one_way: bool = False

    def feel(self, angle: xr.DataArray) -> np.ndarray:
        """What its sensors feel (trial, sensor, time) of angles (trial, plane, sensor, time)."""
        last = angle.sizes["sensor"] - 1
        kept = np.round(np.linspace(0, last, self.places)).astype(int)
        bent = project_planes(angle.isel(sensor=kept), self.around, self.turn).values
        felt = bent.reshape(len(bent), -1, bent.shape[-1])
        return np.maximum(felt, 0.0) if self.one_way else felt


class SpaceStudy(Study):
    """What is asked of touches in space; :func:`load_space` reads what was declared.

    ``levels`` are the layouts, by name.

    Attributes
    ----------
    each : int
        Touches of each class in a set: readers learn one half and are asked about the other.
    """

    levels: dict[str, Layout]  # type: ignore[assignment]
    readers: tuple[str, ...] = ("lda", "templates")
    each: Annotated[int, Ge(4)] = 8

    @property
    def noises(self) -> dict[str, Any]:
        """The layouts by name."""
        return dict(self.levels)

    def measure_set(
        self, antenna: Antenna, number: int, speed: float, options: dict[str, Any]
    ) -> dict[str, Any]:
        """Accuracy and bits (reader, layout) of one set of whole touches of an antenna."""
        trials, labels = self.task.draw(
            antenna, "test", set=number, speed=speed, each=self.each
        )
        touches = self.touch(antenna, trials, ("angle",), **options)
        first = round(trials[0].lead / self.sample_interval) + 1
        angle = in_unit(touches["angle"], "rad")[..., first:]
        half = np.arange(len(labels)) % self.each < self.each // 2
        found = np.empty((2, len(self.readers), len(self.levels)))
        for k, layout in enumerate(self.levels.values()):
            felt = layout.feel(angle)
            for j, name in enumerate(self.readers):
                folds = [
                    self._ask_half(name, felt, labels, own, number) for own in (half, ~half)
                ]
                found[:, j, k] = np.mean(folds, axis=0)
        return dict(zip(("accuracy", "bits"), found, strict=True))

    def _ask_half(
        self, name: str, felt: np.ndarray, labels: np.ndarray, taught: np.ndarray, number: int
    ) -> tuple[float, float]:
        """Accuracy and bits of a reader that learns the touches ``taught`` and reads the others."""
        rng, noise = np.random.default_rng([self.seed, number]), self.task.noise
        known, true = felt[taught], labels[taught]
        reader = READERS[name]()
        if reader.knows_noise:
            reader.set_params(noise=noise).fit(known, true)
        else:
            reader.fit(noise.add(known, rng, self.draws), np.tile(true, self.draws))
        met = noise.add(felt[~taught], rng, self.draws)
        return measure_reader(reader, met, np.tile(labels[~taught], self.draws))


def load_space(
    kind: str = "space", layouts: tuple[str, ...] = (), **changes: Any
) -> SpaceStudy:
    """The study of open_space.toml, of touches in ``space`` or in the ``plane``.

    ``layouts`` are the names of those kept, default all; ``changes`` replace what was declared.
    """
    asked = read_declared("open_space.toml") | changes
    nuisances = dict(asked["nuisances"])
    if kind == "plane":
        nuisances.pop("azimuth")
    task = Task(
        objects=asked["objects"],
        speeds=(asked["speed"],),
        nuisances=Nuisances(**nuisances),
        noise=asked["noise"],
        seeds={"test": asked["seed"]},
    )
    names = layouts or tuple(asked["layouts"])
    return SpaceStudy(
        task=task,
        levels={name: Layout(**asked["layouts"][name]) for name in names},
        readers=tuple(asked["readers"]["names"]),
        headline={},
        windows={},
        **{name: asked[name] for name in ("each", "sample_interval", "draws", "sets")},
    )


def run_space(
    journal: Path | None = None, minutes: float = np.inf, **changes: Any
) -> dict[str, dict[str, list]]:
    """By "kind/antenna" the accuracy (set, reader, layout) of the sets that are whole.

    Sets are gone through in their order until the minutes are over, and on from the journal.
    """
    asked, end = read_declared("open_space.toml") | changes, time.monotonic() + 60 * minutes
    cells = [(kind, name) for kind in ("space", "plane") for name in asked["antennas"][kind]]
    whole = load_space(**changes)
    sets: list[list[Any]] = []
    key = make_key({"asked": asked})
    with hold_blas(), Journal(journal, key, "study") as kept:
        for number in range(whole.sets):
            names = [(*cell, number) for cell in cells]
            for kind, name, _ in names:
                if kept.find(kind, name, number) is None and time.monotonic() < end:
                    full = (kind, name) == cells[0]
                    study = whole if full else load_space(kind, FEW, **changes)
                    own = cockroach(name).unflatten()
                    found = study.measure_set(own, number, asked["speed"], {"workers": 2})
                    kept.add(found, kind, name, number)
            results = [kept.find(*name) for name in names]
            if any(one is None for one in results):
                break
            sets.append([np.array(one["accuracy"], float) for one in results])
    return {
        "/".join(cell): np.array(own).tolist() for cell, *own in zip(cells, *sets, strict=True)
    }


def store(name: str, found: Any, seed: int) -> Path:
    """Write this file beside the section that reads it: what was found, when, with which seed."""
    about = {"date": f"{datetime.now(UTC):%Y-%m-%d}", "seed": seed}
    text = json.dumps({"about": about, "found": to_json(found)}, sort_keys=True)
    lean = json.loads(text, parse_float=lambda number: float(f"{float(number):.{_DIGITS}g}"))
    path = _STORED / name
    path.write_text(json.dumps(lean, sort_keys=True) + "\n", encoding="utf-8")
    return path


def compute(name: str) -> Path:
    """Compute a question and store what is found."""
    asked = read_declared(f"open_{name}.toml")
    found: Mapping[str, Any]
    if name == "space":
        found, seed = run_space(_JOURNAL), asked["seed"]
    elif name == "unseen":
        found, seed = compute_unseen(cockroach(), workers=1), asked["task"]["seeds"]["final"]
    else:
        whole = compute_receptor(cockroach(), workers=1)
        found, seed = {run: data.to_dict() for run, data in whole.items()}, asked["seed"]
    return store(f"open_{name}.json", found, seed)


def main() -> None:
    for name in sys.argv[1:] or ("receptor", "unseen", "space"):
        began = time.process_time()
        note_kept(compute(name))
        print(f"{name}: {time.process_time() - began:.0f} s of a core", flush=True)


if __name__ == "__main__":
    main()
