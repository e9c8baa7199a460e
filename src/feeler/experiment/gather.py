"""Gathering: finished motions, reduced to sensors as they come, and stored group by group."""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.physics.clock import Clock
from feeler.physics.scene import Motion
from feeler.provenance import compute_digest, make_plain
from feeler.stimulus.base import BaseMotion
from feeler.stimulus.trial import Trial
from feeler.tensors.dataset import reduce_motion, stack_readings
from feeler.tensors.store import Store
from feeler.tensors.stored import MAX_LISTED

LABELS = ("location", "speed", "approach", "side", "lead", "friction")  # fields of a Trial that become coordinates
Progress = Callable[[int, int], None]


@dataclass(frozen=True)
class Assignment:
    """What is simulated, and what is kept of it."""

    antenna: Antenna
    trials: list[Trial]
    seeds: list[int]
    clock: Clock
    attrs: dict[str, Any]
    save: Sequence[str] | None
    dtype: str

    def list_made(self) -> list[dict[str, Any]]:
        """Everything that each trial's numbers depend on, beside what all share."""
        return [make_plain(trial) | {"seed": seed} for trial, seed in zip(self.trials, self.seeds, strict=True)]

    def make_tensors(self, indices: Sequence[int], readings: Sequence[dict[str, np.ndarray]]) -> xr.Dataset:
        """The Dataset of these trials from their readings."""
        trials = [self.trials[index] for index in indices]
        labels = {
            "feature": [trial.name for trial in trials],
            "kind": [trial.feature.kind for trial in trials],
            "size": [trial.feature.size for trial in trials],
            **{name: [getattr(trial, name) for trial in trials] for name in LABELS},
            "base": [describe_base(trial.base) for trial in trials],
            "antenna": [self.antenna.name] * len(trials),
            "source": ["simulation"] * len(trials),
            "seed": [self.seeds[index] for index in indices],
        }
        tensors = stack_readings(self.antenna, self.clock.time, readings, trials=labels, attrs=self.attrs)
        return tensors.assign_coords(trial=list(indices))


def describe_base(base: BaseMotion | None) -> str:
    """A base motion in one line: nothing where it is clamped, a recorded path by its fingerprint."""
    if base is None:
        return ""
    if base.time is not None:
        return f"path {compute_digest(base)[:8]}"
    return f"velocity {base.velocity[0]:g} {base.velocity[1]:g} mm/ms, turn {base.turn:g} rad/ms"


class Gathering:
    """Takes outcomes in any order; as a context manager it stores what is left when the simulation ends early."""

    def __init__(self, plan: Assignment, store: Store | None, progress: Progress | None) -> None:
        self.plan, self.store, self.progress = plan, store, progress
        finished = store.finished if store is not None else set()
        self.pending = [index for index in range(len(plan.trials)) if index not in finished]
        self._size = store.label.group if store is not None else 1
        self._missing = Counter(index // self._size for index in self.pending)
        self._count = dict(self._missing)
        self._readings: dict[int, dict[str, np.ndarray]] = {}
        self._done = len(plan.trials) - len(self.pending)

    def add(self, place: int, outcome: object) -> None:
        """The outcome of the pending trial at ``place``."""
        index = self.pending[place]
        if isinstance(outcome, Motion):
            self._readings[index] = reduce_motion(self.plan.antenna, outcome, self.plan.save, self.plan.dtype)
        group = index // self._size
        self._missing[group] -= 1
        if not self._missing[group]:
            self._finish(group)

    def _finish(self, group: int) -> None:
        rows = range(group * self._size, (group + 1) * self._size)
        if self.store is not None:
            self._append([index for index in rows if index in self._readings])
        self._done += self._count[group]
        if self.progress:
            self.progress(self._done, len(self.plan.trials))

    def _append(self, indices: list[int]) -> None:
        if indices and self.store is not None:
            tensors = self.plan.make_tensors(indices, [self._readings.pop(index) for index in indices])
            derived = {"curvature"} - {*(self.plan.save or ())}
            self.store.append(indices, tensors.drop_vars(derived))

    def make_tensors(self) -> xr.Dataset | None:
        """The Dataset of all that was not stored."""
        indices = sorted(self._readings)
        if not indices:
            return None
        tensors = self.plan.make_tensors(indices, [self._readings[index] for index in indices])
        if len(indices) <= MAX_LISTED:
            made = self.plan.list_made()
            tensors.attrs["trials"] = json.dumps([made[index] for index in indices], sort_keys=True)
        return tensors

    def __enter__(self) -> "Gathering":
        return self

    def __exit__(self, *_: object) -> None:
        if self.store is not None:
            for group in sorted({index // self._size for index in self._readings}):
                self._append([index for index in sorted(self._readings) if index // self._size == group])
