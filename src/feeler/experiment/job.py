"""Job: what a worker does with the trials it is given, wherever it runs: simulate, reduce to
sensors, store.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.antenna.sample import SampledAntennas
from feeler.disk.provenance import compute_digest, describe_code, list_versions, make_plain
from feeler.errors import StoreError
from feeler.physics.accuracy import TOGETHER, run_accurately, run_with_error
from feeler.physics.clock import Clock
from feeler.physics.contact import Contact
from feeler.physics.engine import get_engine
from feeler.physics.run import Result, make_groups
from feeler.physics.scene import Motion, Scene, make_scene
from feeler.stimulus.base import BaseMotion
from feeler.stimulus.flow import Flow
from feeler.stimulus.trial import Trial
from feeler.tensors.dataset import choose_quantities, reduce_motion, stack_readings
from feeler.tensors.group import StoredGroup, write_group
from feeler.tensors.quantities import find_dims

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
    code : str
        Fingerprint of the code that must run, where the numbers are stored; and the modules that it
        is made of.
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

    code: str = ""
    modules: tuple[str, ...] = ()

    def get_antenna(self, index: int) -> Antenna:
        """The antenna that a trial touches."""
        return (
            self.antenna if self.variants is None else self.variants[index % len(self.variants)]
        )

    def perform(self, share: Share) -> ShareResult:
        """Simulate the trials of a share, keep what the sensors felt, and store it where the share
        says so.
        """
        if self.code:
            check_origin(self.attrs["versions"], self.code, self.modules)
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


@cache
def fingerprint_code(modules: tuple[str, ...]) -> str:
    """One short text for all code that ``modules`` can run."""
    return compute_digest(describe_code(*modules))[:16]


def check_origin(versions: dict[str, str], code: str, modules: tuple[str, ...]) -> None:
    """Refuse to work where other versions or other code would make other numbers: on a cluster each
    worker has its own.

    Raises
    ------
    StoreError
        Naming what differs.
    """
    own = list_versions()
    other = [
        f"{name} {own.get(name, '')} (wanted: {wanted})"
        for name, wanted in versions.items()
        if own.get(name) != wanted
    ]
    if other or fingerprint_code(modules) != code:
        what = ", ".join(other) or "other code under the same version of feeler"
        raise StoreError(
            f"a worker runs {what}. Install the same wherever workers run; finished trials are"
            " safe."
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
