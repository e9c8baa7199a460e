"""Many trials: handed out in groups, simulated, reduced to sensors, and collected in a store or in
memory.
"""

import json
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from feeler.antenna.animals import SampledAntennas
from feeler.antenna.segments import Antenna
from feeler.errors import StoreError
from feeler.execute import Executor, run_groups
from feeler.files import check_room, measure_folder
from feeler.objects.motion import BaseMotion, Flow
from feeler.objects.trials import Trial
from feeler.physics.contact import Contact
from feeler.physics.engine import get_engine
from feeler.physics.run import TOGETHER, Result, make_groups, run_accurately, run_with_error
from feeler.physics.scene import Clock, Motion, Scene, make_scene
from feeler.provenance import PHYSICS, compute_digest, find_version, to_jsonable
from feeler.tensors.schema import (
    MAX_LISTED,
    choose_quantities,
    find_dims,
    reduce_motion,
    stack_readings,
)

if TYPE_CHECKING:
    from feeler.tensors.store import Store

# What a worker does with the trials it is given, wherever it runs: simulate, reduce to sensors,
# store.

_LABELS = (
    "location",
    "speed",
    "approach",
    "side",
    "lead",
    "friction",
)  # fields of a Trial that become coordinates
Reading = Mapping[str, np.ndarray]
Share = tuple[Sequence[int], Sequence[Trial], Path | None]
"""Some trials of a set for one worker: their numbers, themselves, and the store to write to."""


_ShareResult = tuple[dict[int, Reading], dict[int, Exception], xr.Dataset | None, int]
"""Readings and errors by trial; of trials that the worker has written to the store in place of
readings their labels, and the bytes that they take there."""


@dataclass(frozen=True, kw_only=True)
class _WorkerTask:
    """How trials become what is kept of them; the same for all of a set.

    Attributes
    ----------
    variants : SampledAntennas | None
        What takes the antenna's place, trial by trial.
    sampled : bool
        Whether the attributes say how all trials are drawn, so that none is described by itself.
    """

    antenna: Antenna
    variants: SampledAntennas | None = None
    contact: Contact
    flow: Flow | None = None
    clock: Clock
    engine: str
    accuracy: float | None
    save: Sequence[str] | None
    dtype: str
    seed: int
    attrs: dict[str, Any]
    sampled: bool = False

    def get_antenna(self, index: int) -> Antenna:
        """The antenna that a trial touches."""
        return (
            self.antenna if self.variants is None else self.variants[index % len(self.variants)]
        )

    def perform(self, share: Share) -> _ShareResult:
        """Simulate the trials of a share, keep what the sensors felt, and write it to the store
        where there is one.
        """
        indices, trials, store = share
        if store is not None:
            _check_origin(self.attrs["configuration"]["physics"], self.attrs["versions"])
        readings, errors = self.simulate(indices, trials)
        if store is None or not readings:
            return readings, errors, None, 0
        from feeler.tensors.store import write_group

        own, order = dict(zip(indices, trials, strict=True)), sorted(readings)
        tensors = self.make_tensors(order, [own[index] for index in order], readings)
        n_bytes = write_group(store, order, self.drop_derived(tensors))
        numbers = [name for name, v in tensors.variables.items() if v.dims != ("trial",)]
        return {}, errors, tensors.drop_vars(numbers), n_bytes

    def simulate(
        self, indices: Sequence[int], trials: Sequence[Trial]
    ) -> tuple[dict[int, Reading], dict[int, Exception]]:
        """What the sensors felt in each of these trials, and what ended the others."""
        pairs = zip(indices, trials, strict=True)
        scenes = [
            make_scene(self.get_antenna(index), trial, self.contact, self.flow)
            for index, trial in pairs
        ]
        readings: dict[int, Reading] = {}
        errors: dict[int, Exception] = {}
        for lanes in make_groups(scenes, get_engine(self.engine), TOGETHER):
            results = _run_lanes(
                [scenes[place] for place in lanes], self.clock, self.engine, self.accuracy
            )
            for place, result in zip(lanes, results, strict=True):
                if isinstance(result, Motion):
                    readings[indices[place]] = reduce_motion(
                        self.antenna, result, self.save, self.dtype
                    )
                else:
                    errors[indices[place]] = result
        return readings, errors

    def drop_derived(self, tensors: xr.Dataset) -> xr.Dataset:
        """The Dataset without what a store derives when it is read."""
        return tensors.drop_vars({"curvature"} - {*(self.save or ())})

    def make_blank(self) -> Reading:
        """What is kept of a trial in which nothing happens."""
        spatial = self.antenna.spatial
        sizes = {
            "sensor": len(self.antenna.sensors),
            "time": self.clock.n_samples,
            "axis": 3 if spatial else 2,
            "pose": 6 if spatial else 3,
            "plane": len(self.antenna.planes),
        }
        return {
            name: np.zeros(
                [sizes.get(dim, 2) for dim in find_dims(name, spatial)[1:]], self.dtype
            )
            for name in choose_quantities(self.save)
        }

    def list_made(
        self, indices: Sequence[int], trials: Sequence[Trial]
    ) -> list[dict[str, Any]]:
        """Everything that each trial's numbers depend on, beside what all share."""
        if self.sampled:
            return []
        pairs = zip(indices, trials, strict=True)
        return [
            to_jsonable(trial) | {"seed": _spawn_seed(self.seed, index)}
            for index, trial in pairs
        ]

    def make_tensors(
        self, indices: Sequence[int], trials: Sequence[Trial], readings: Mapping[int, Reading]
    ) -> xr.Dataset:
        """The Dataset of these trials from their readings."""
        labels = (*_LABELS, "azimuth") if self.antenna.spatial else _LABELS
        coordinates = {
            "trial": indices,
            "feature": [trial.name for trial in trials],
            "kind": [trial.feature.kind for trial in trials],
            "size": [trial.feature.size for trial in trials],
            **{name: [getattr(trial, name) for trial in trials] for name in labels},
            "base": [_describe_base(trial.base) for trial in trials],
            **self._label_antennas(indices),
            "source": ["simulation"] * len(trials),
            "seed": [_spawn_seed(self.seed, index) for index in indices],
        }
        return stack_readings(
            self.antenna,
            self.clock.time,
            [readings[index] for index in indices],
            trials=coordinates,
            attrs=self.attrs,
        )

    def _label_antennas(self, indices: Sequence[int]) -> dict[str, list[Any]]:
        if self.variants is None:
            return {"antenna": [self.antenna.name] * len(indices)}
        numbers = [index % len(self.variants) for index in indices]
        columns = {
            f"antenna_{name}": values[numbers].tolist()
            for name, values in self.variants.columns.items()
        }
        return {"antenna": [f"{self.antenna.name} {number}" for number in numbers], **columns}


def _check_origin(physics: int, versions: Mapping[str, str]) -> None:
    """Refuse to work where another feeler would make other numbers: on a cluster each worker has
    its own.

    Raises
    ------
    StoreError
        Naming what differs.
    """
    if physics != PHYSICS or versions["feeler"] != find_version("feeler"):
        raise StoreError(
            f"a worker runs feeler {find_version('feeler')} with physics {PHYSICS} (wanted: feeler"
            f" {versions['feeler']} with physics {physics}). Install the same wherever workers run;"
            " finished trials are safe."
        )


def _describe_base(base: BaseMotion | None) -> str:
    """A base motion in one line: nothing where it is clamped, a recorded path by its
    fingerprint.
    """
    if base is None:
        return ""
    if base.time is not None:
        return f"path {compute_digest(base)[:8]}"
    velocity, turn = (
        " ".join(f"{x:g}" for x in np.ravel(part)) for part in (base.velocity, base.turn)
    )
    return f"velocity {velocity} mm/ms, turn {turn} rad/ms"


def _run_lanes(
    scenes: list[Scene], clock: Clock, engine: str, accuracy: float | None = None
) -> list[Result]:
    """Motions of scenes that fit the lanes of an engine, and what they err by; with ``accuracy``
    each timestep is chosen by it, not the clock.
    """
    if accuracy is None:
        return run_with_error(scenes, clock, engine)
    return run_accurately(scenes, clock.duration, clock.sample_interval, engine, accuracy)


def _spawn_seed(seed: int, index: int) -> int:
    """The child seed of trial number ``index``, whatever the others are."""
    return int(np.random.SeedSequence(seed, spawn_key=(index,)).generate_state(1, np.uint32)[0])


_GROUPS = (
    5  # [C] before groups grow beyond the lanes: those to be run anew then fill fewer lanes
)

# Trials handed out in groups, and what comes back kept, in a store or in memory.

Progress = Callable[[int, int], object]


def _run_trials(
    job: _WorkerTask,
    trials: Sequence[Trial],
    store: "Store | None",
    executor: Executor,
    progress: Progress,
) -> tuple[dict[int, Reading], dict[int, Exception]]:
    """Run what a store lacks of a set of trials, or all of it.

    With a store, a worker takes one of its groups and writes the numbers; this process writes the
    labels and counts the trials as finished. Without one, it takes what fills the engine's lanes.

    Returns
    -------
    tuple
        Readings of the trials that were not stored, and the errors of those that failed.

    Raises
    ------
    StoreError
        The disk has no room for them; nothing has been simulated then.
    """
    readings: dict[int, Reading] = {}
    errors: dict[int, Exception] = {}
    done, n_bytes, path = 0, 0, None
    groups: list[Sequence[int]] = []
    if store is None:
        scenes = [make_scene(job.antenna, trial, job.contact, job.flow) for trial in trials]
        engine = get_engine(
            job.engine
        )  # neighbours together, and enough groups for all workers
        times = len(trials) // (_GROUPS * engine.lanes)
        groups = [*make_groups(scenes, engine, min(max(times, 1), TOGETHER))]
    else:
        done, path, blank = int(store.finished.sum()), store.path, job.make_blank()
        need = (len(trials) - done) * sum(values.nbytes for values in blank.values())
        check_room(path, need, f"{len(trials) - done:,} trials")
        store.create(job.drop_derived(job.make_tensors([0], [trials[0]], {0: blank})))
        n_bytes = measure_folder(path) if done else 0
        groups = _list_missing(store.finished, store.group_size)

    def pick(group: Sequence[int]) -> Share:
        if isinstance(group, range):
            return group, trials[group.start : group.stop], path
        return group, [trials[index] for index in group], path

    for group, found in run_groups(job.perform, groups, pick, executor=executor):
        if isinstance(found, StoreError):
            raise found
        if isinstance(found, Exception):
            found = {}, dict.fromkeys(group, found), None, 0
        new, failed, labels, written = found
        if store is not None and labels is not None:
            store.admit(labels["trial"].values.tolist(), labels)
        readings |= new
        errors |= failed
        done, n_bytes = done + len(group), n_bytes + written
        if hasattr(progress, "tell"):
            reasons = Counter(type(error).__name__ for error in errors.values())
            progress.tell(failed=dict(reasons), stored=n_bytes)
        progress(done, len(trials))
    return readings, errors


def _list_missing(finished: np.ndarray, size: int) -> list[Sequence[int]]:
    """For each group of ``size`` trials those that are not finished; all of a group as a range."""
    groups: list[Sequence[int]] = []
    for start in range(0, len(finished), size):
        some = finished[start : start + size]
        if not some.any():
            groups.append(range(start, start + len(some)))
        elif not some.all():
            groups.append((start + np.flatnonzero(~some)).tolist())
    return groups


def collect(
    job: _WorkerTask, trials: Sequence[Trial], readings: Mapping[int, Reading]
) -> xr.Dataset | None:
    """The Dataset of trials that were not stored; None where there are none."""
    if not readings:
        return None
    indices = sorted(readings)
    some = [trials[index] for index in indices]
    tensors = job.make_tensors(indices, some, readings)
    if len(indices) <= MAX_LISTED and not job.sampled:
        tensors.attrs["trials"] = json.dumps(job.list_made(indices, some), sort_keys=True)
    return tensors
