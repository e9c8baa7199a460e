"""Contact out of the plane, computed whole: about ten minutes of a core for each set.

    python -m studies.space.measure

What is asked stands in declared.toml, written down before anything was run; what is found is
stored as results.json, with date and seed, and the report shows it. With its journals in out/space
it goes on where it stopped.
"""

from pathlib import Path
from typing import Annotated, Any

import numpy as np
import xarray as xr

from benchmarks.kept import note_kept
from feeler.antenna.segments import Antenna
from feeler.decoding.classifiers import CLASSIFIERS, measure_classifier
from feeler.objects import Nuisances, Task
from feeler.presets import cockroach
from feeler.records import Ge, Lt, Record, Unit
from feeler.study import Study
from feeler.tensors.transforms import in_unit, project_planes
from studies.space.section import FEW
from studies.stored import read_declared, store

_JOURNALS = Path("out/space")
_SETS = 8  # of those that were declared at most, as many as the clock has given


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
        Touches of each class in a set: classifiers learn one half and are asked about the other.
    """

    levels: dict[str, Layout]  # type: ignore[assignment]
    classifiers: tuple[str, ...] = ("lda", "templates")
    each: Annotated[int, Ge(4)] = 8

    @property
    def noises(self) -> dict[str, Any]:
        """The layouts by name."""
        return dict(self.levels)

    def list_windows(self) -> list[tuple[str, float, str]]:
        """The whole touch."""
        return [("whole touch", np.nan, "whole touch")]

    def measure_set(
        self, antenna: Antenna, number: int, speed: float, options: dict[str, Any]
    ) -> dict[str, Any]:
        """Accuracy and bits (classifier, layout, 1) of one set of whole touches of an antenna."""
        trials, labels = self.task.draw(
            antenna, "test", set=number, speed=speed, each=self.each
        )
        touches = self.touch(antenna, trials, ("angle",), **options)
        first = round(trials[0].lead / self.sample_interval) + 1
        angle = in_unit(touches["angle"], "rad")[..., first:]
        half = np.arange(len(labels)) % self.each < self.each // 2
        found = np.empty((2, len(self.classifiers), len(self.levels), 1))
        for k, layout in enumerate(self.levels.values()):
            felt = layout.feel(angle)
            for j, name in enumerate(self.classifiers):
                folds = [
                    self._ask_half(name, felt, labels, own, number) for own in (half, ~half)
                ]
                found[:, j, k, 0] = np.mean(folds, axis=0)
        return dict(zip(("accuracy", "bits"), found, strict=True))

    def _ask_half(
        self, name: str, felt: np.ndarray, labels: np.ndarray, taught: np.ndarray, number: int
    ) -> tuple[float, float]:
        """Accuracy and bits of a classifier trained on the touches ``taught``, for the others."""
        rng, noise = np.random.default_rng([self.seed, number]), self.task.noise
        known, true = felt[taught], labels[taught]
        classifier = CLASSIFIERS[name]()
        if classifier.knows_noise:
            classifier.set_params(noise=noise).fit(known, true)
        else:
            classifier.fit(noise.add(known, rng, self.draws), np.tile(true, self.draws))
        met = noise.add(felt[~taught], rng, self.draws)
        return measure_classifier(classifier, met, np.tile(labels[~taught], self.draws))


def load_space(
    kind: str = "space", layouts: tuple[str, ...] = (), **changes: Any
) -> SpaceStudy:
    """The study of declared.toml, of touches in ``space`` or in the ``plane``.

    ``layouts`` are the names of those kept, default all; ``changes`` replace what was declared.
    """
    asked = read_declared("space") | changes
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
        classifiers=tuple(asked["classifiers"]["names"]),
        headline={},
        windows={},
        **{name: asked[name] for name in ("each", "sample_interval", "draws", "sets")},
    )


def compute(journals: Path | None = None, **changes: Any) -> dict[str, list]:
    """By "kind/antenna" the accuracy (set, classifier, layout); an ended run goes on from the
    folder of its journals.
    """
    cells: dict[str, list] = {}
    for kind, names in read_declared("space")["antennas"].items():
        for name in names:
            study = load_space(kind, FEW if cells else (), **changes)
            journal = journals and journals / f"{kind}_{name}.jsonl"
            found = study.run({name: cockroach(name).unflatten()}, journal=journal)
            right = found["accuracy"].squeeze(("antenna", "speed", "window"))
            cells[f"{kind}/{name}"] = right.transpose("set", ...).values.tolist()
    return cells


def main() -> None:
    _JOURNALS.mkdir(parents=True, exist_ok=True)
    note_kept(store("space", compute(_JOURNALS, sets=_SETS), read_declared("space")["seed"]))


if __name__ == "__main__":
    main()
