"""Gathering: trials handed out in groups, and what comes back kept, in a store or in memory."""

import json
import operator
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import xarray as xr

from feeler.errors import StoreError
from feeler.execute import Executor, run_groups
from feeler.experiment.job import Job, Reading, Share, ShareResult
from feeler.physics.engine import get_engine
from feeler.physics.run import make_groups
from feeler.physics.scene import make_scene
from feeler.stimulus.trial import Trial
from feeler.tensors.disk import check_room, measure_folder
from feeler.tensors.store import Store
from feeler.tensors.stored import MAX_LISTED

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
