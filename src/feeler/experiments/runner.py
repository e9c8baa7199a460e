"""Many trials: handed out in groups, simulated, reduced to sensors, and collected in a store or in
memory.
"""

import json
import operator
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.antenna.segments import Antenna
from feeler.antenna.variants import SampledAntennas
from feeler.errors import StoreError
from feeler.execute import Executor, run_groups
from feeler.files import check_room, measure_folder
from feeler.objects.motion import BaseMotion, Flow
from feeler.objects.trials import Trial
from feeler.physics.contact import Contact
from feeler.physics.engine import get_engine
from feeler.physics.run import TOGETHER, Result, make_groups, run_accurately, run_with_error
from feeler.physics.scene import Clock, Motion, Scene, make_scene
from feeler.provenance import PHYSICS, compute_digest, find_version, make_plain
from feeler.tensors.schema import choose_quantities, find_dims, reduce_motion, stack_readings
from feeler.tensors.store import Store, StoredGroup, write_group
from feeler.tensors.stored import MAX_LISTED

# Job: what a worker does with the trials it is given, wherever it runs: simulate, reduce to
# sensors, store.

_LABELS = (
    "location",
    "speed",
    "approach",
    "side",
    "lead",
    "friction",
)  # fields of a Trial that become coordinates
Reading = Mapping[str, np.ndarray]


@dataclass(frozen=True, kw_only=True)
class Share:
    """Some trials of a set, for one worker.

    Attributes
    ----------
    store : Path | None
        The store to which the worker adds them as a group of its own; None: they go back to the
        caller.
    """

    indices: Sequence[int]
    trials: Sequence[Trial]
    store: Path | None = None
    group_size: int = 0


@dataclass(frozen=True, kw_only=True)
class ShareResult:
    """What became of a share.

    Attributes
    ----------
    stored : StoredGroup | None
        What the worker has written in place of the readings.
    """

    readings: dict[int, Reading] = field(default_factory=dict)
    errors: dict[int, Exception] = field(default_factory=dict)
    stored: StoredGroup | None = None


@dataclass(frozen=True, kw_only=True)
class Job:
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

    def perform(self, share: Share) -> ShareResult:
        """Simulate the trials of a share, keep what the sensors felt, and store it where the share
        says so.
        """
        if share.store is not None:
            check_origin(self.attrs["configuration"]["physics"], self.attrs["versions"])
        done = ShareResult()
        pairs = zip(share.indices, share.trials, strict=True)
        scenes = [
            make_scene(self.get_antenna(index), trial, self.contact, self.flow)
            for index, trial in pairs
        ]
        times = 1 if self.accuracy is None else TOGETHER
        for lanes in make_groups(scenes, get_engine(self.engine), times):
            results = run_lanes(
                [scenes[place] for place in lanes], self.clock, self.engine, self.accuracy
            )
            for place, result in zip(lanes, results, strict=True):
                if isinstance(result, Motion):
                    done.readings[share.indices[place]] = reduce_motion(
                        self.antenna, result, self.save, self.dtype
                    )
                else:
                    done.errors[share.indices[place]] = result
        return self._store(share, done) if share.store is not None and done.readings else done

    def _store(self, share: Share, done: ShareResult) -> ShareResult:
        assert share.store is not None
        kept = [place for place, index in enumerate(share.indices) if index in done.readings]
        indices, trials = (
            [share.indices[place] for place in kept],
            [share.trials[place] for place in kept],
        )
        tensors = self.make_tensors(
            indices, trials, [done.readings[index] for index in indices]
        )
        made = self.list_made(indices, trials)
        stored = write_group(
            share.store, share.group_size, indices, self.drop_derived(tensors), made
        )
        return ShareResult(errors=done.errors, stored=stored)

    def drop_derived(self, tensors: xr.Dataset) -> xr.Dataset:
        """The Dataset without what a store derives when it is read."""
        return tensors.drop_vars({"curvature"} - {*(self.save or ())})

    def count_bytes(self) -> int:
        """What one trial takes in a store, before it is compressed."""
        spatial = self.antenna.spatial
        sizes = {
            "sensor": len(self.antenna.sensors),
            "time": self.clock.n_samples,
            "axis": 3 if spatial else 2,
            "pose": 6 if spatial else 3,
            "plane": len(self.antenna.planes),
        }
        item = np.dtype(self.dtype).itemsize
        dims = [find_dims(name, spatial)[1:] for name in choose_quantities(self.save)]
        return sum(
            item * int(np.prod([sizes.get(dim, 2) for dim in some], initial=1)) for some in dims
        )

    def list_made(
        self, indices: Sequence[int], trials: Sequence[Trial]
    ) -> list[dict[str, Any]]:
        """Everything that each trial's numbers depend on, beside what all share."""
        if self.sampled:
            return []
        pairs = zip(indices, trials, strict=True)
        return [
            make_plain(trial) | {"seed": _spawn_seed(self.seed, index)}
            for index, trial in pairs
        ]

    def make_tensors(
        self, indices: Sequence[int], trials: Sequence[Trial], readings: Sequence[Reading]
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
            self.antenna, self.clock.time, readings, trials=coordinates, attrs=self.attrs
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


def check_origin(physics: int, versions: Mapping[str, str]) -> None:
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


def run_lanes(
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


# Gathering: trials handed out in groups, and what comes back kept, in a store or in memory.

Progress = Callable[[int, int], object]


class Gathering:
    """Runs what a store lacks of a set of trials, or all of it.

    With a store, a share is one of its groups: a worker writes the group's shards, and this process
    its record. Without one, a share fills the engine's lanes once.
    """

    def __init__(
        self, job: Job, trials: Sequence[Trial], store: Store | None, progress: Progress
    ) -> None:
        self.job, self.trials, self.store, self.progress = job, trials, store, progress
        self.errors: dict[int, Exception] = {}
        self._readings: dict[int, Reading] = {}
        self._done = len(store.finished) if store is not None else 0
        self._bytes = measure_folder(store.path) if self._done and store is not None else 0

    def run(self, executor: Executor) -> None:
        """Every trial that is not finished yet.

        Raises
        ------
        StoreError
            The disk has no room for them; nothing has been simulated then.
        """
        if self.store is not None:
            missing = len(self.trials) - self._done
            check_room(self.store.path, missing * self.job.count_bytes(), f"{missing:,} trials")
        try:
            for group, found in run_groups(
                self.job.perform, self._make_groups(), self._pick, executor=executor
            ):
                self._take(group, found)
        finally:
            self._append_rest()

    def _make_groups(self) -> list[Sequence[int]]:
        if self.store is None:
            scenes = [
                make_scene(self.job.antenna, trial, self.job.contact, self.job.flow)
                for trial in self.trials
            ]  # for their order
            return [*make_groups(scenes, get_engine(self.job.engine))]
        n, size, finished = len(self.trials), self.store.label.group, self.store.finished
        rows = (range(start, min(start + size, n)) for start in range(0, n, size))
        return [
            group
            for row in rows
            if (group := [index for index in row if index not in finished])
        ]

    def _pick(self, group: Sequence[int]) -> Share:
        """The share of a group; a group that the store holds a part of comes back, as old and new
        trials share a shard.
        """
        run = range(group[0], group[0] + len(group))
        together = all(
            map(operator.eq, group, run)
        )  # groups of lanes come in the order of their touches, not of their numbers
        trials = (
            self.trials[run.start : run.stop]
            if together
            else [self.trials[index] for index in group]
        )
        if (
            self.store is None
            or self.store.holds(group[0])
            or len(group) < self._count(group[0])
        ):
            return Share(indices=group, trials=trials)
        return Share(
            indices=group,
            trials=trials,
            store=self.store.path,
            group_size=self.store.label.group,
        )

    def _count(self, index: int) -> int:
        """Trials in the group of a trial."""
        size = self.store.label.group  # type: ignore[union-attr]
        return min(size, len(self.trials) - index // size * size)

    def _take(self, group: Sequence[int], found: ShareResult | Exception) -> None:
        if isinstance(found, StoreError):
            raise found
        if isinstance(found, Exception):
            found = ShareResult(errors=dict.fromkeys(group, found))
        self.errors |= found.errors
        if found.stored is not None and self.store is not None:
            self.store.admit(found.stored)
            self._bytes += found.stored.n_bytes
        self._readings |= found.readings
        if self.store is not None and len(self._readings) >= self.store.label.group:
            self._append_rest()
        self._done += len(group)
        if hasattr(self.progress, "tell"):
            reasons = Counter(type(error).__name__ for error in self.errors.values())
            self.progress.tell(failed=dict(reasons), stored=self._bytes)
        self.progress(self._done, len(self.trials))

    def _append_rest(self) -> None:
        """Store what came back without having been stored."""
        if self._readings and self.store is not None:
            indices = sorted(self._readings)
            trials, readings = (
                [self.trials[i] for i in indices],
                [self._readings[i] for i in indices],
            )
            self._readings.clear()
            tensors = self.job.drop_derived(self.job.make_tensors(indices, trials, readings))
            self.store.append(indices, tensors)

    def make_tensors(self) -> xr.Dataset | None:
        """The Dataset of all that was not stored."""
        indices = sorted(self._readings)
        if not indices:
            return None
        trials, readings = (
            [self.trials[i] for i in indices],
            [self._readings[i] for i in indices],
        )
        tensors = self.job.make_tensors(indices, trials, readings)
        if len(indices) <= MAX_LISTED and not self.job.sampled:
            tensors.attrs["trials"] = json.dumps(
                self.job.list_made(indices, trials), sort_keys=True
            )
        return tensors


class Made(Sequence[Any]):
    """What each trial of a set was made with, put together when it is asked for."""

    def __init__(self, job: Job, trials: Sequence[Trial]) -> None:
        self._job, self._trials = job, trials

    def __len__(self) -> int:
        return len(self._trials)

    def __getitem__(self, index: Any) -> Any:
        return self._job.list_made([index], [self._trials[index]])[0]
