"""Touch an antenna, once or many times: trials are handed out in groups, simulated, reduced to
sensors, and collected in a store or in memory.
"""

import json
import os
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr

from feeler.antenna.animals import SampledAntennas
from feeler.antenna.segments import Antenna
from feeler.errors import (
    AccuracyWarning,
    InvalidInput,
    ModelValidityWarning,
    SimulationDivergedError,
    StoreError,
)
from feeler.execute import Executor, ThreadExecutor, run_groups
from feeler.execute.workers import check_workers
from feeler.files import check_room, measure_folder, sweep_old
from feeler.objects.motion import BaseMotion, Flow
from feeler.objects.task import SampledTrials
from feeler.objects.trials import Trial, place
from feeler.physics.contact import (
    DEEP,
    DOUBT,
    Contact,
    describe_sink,
    get_contact,
    list_validity_warnings,
)
from feeler.physics.engine import DEFAULT_ENGINE, ENGINES, choose_timestep
from feeler.physics.run import (
    TOGETHER,
    Result,
    check_accuracy,
    find_coarsest,
    make_groups,
    run_accurately,
    run_with_error,
)
from feeler.physics.scene import Clock, Motion, Scene, make_scene
from feeler.progress import show_progress
from feeler.provenance import (
    LICENCE,
    PHYSICS,
    compute_digest,
    find_version,
    list_versions,
    to_jsonable,
)
from feeler.tensors.schema import (
    MAX_LISTED,
    choose_quantities,
    find_dims,
    reduce_motion,
    stack_readings,
)
from feeler.validation import Seed, checked

# Many trials: handed out in groups, simulated, reduced to sensors, and collected in a store
# or in memory.

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
        Whether the attributes say how all trials are drawn, so that none is described alone.
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
        for lanes in make_groups(scenes, ENGINES[self.engine], TOGETHER):
            results = _run_lanes(
                [scenes[k] for k in lanes], self.clock, self.engine, self.accuracy
            )
            for k, result in zip(lanes, results, strict=True):
                if isinstance(result, Motion):
                    readings[indices[k]] = reduce_motion(
                        self.antenna, result, self.save, self.dtype
                    )
                else:
                    errors[indices[k]] = result
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
        engine = ENGINES[job.engine]  # neighbours together, and enough groups for all workers
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


# Touch an antenna and get its tactile tensors.


OFF = 0.05  # [C] what a touch may err by, over its peak, without a warning
_NAMED = 20  # touches in one warning
DURATION = 380.0  # ms, the size of the slow tensors [P]

_DTYPES = ("float64", "float32")
_KEEP = 5  # [C] files with the state of diverged simulations; older ones go


@checked
def touch(
    antenna: Antenna | SampledAntennas,
    trials: Sequence[Trial] | Trial,
    *,
    duration: float = DURATION,
    sample_interval: float = 1.0,
    timestep: float | None = None,
    accuracy: float | None = None,
    engine: str = DEFAULT_ENGINE,
    contact: Contact | str | None = None,
    flow: Flow | None = None,
    all_hinges: bool = False,
    store: str | os.PathLike | None = None,
    load: bool = True,
    save: Sequence[str] | None = None,
    dtype: str = "float64",
    workers: int | None = None,
    executor: Executor | None = None,
    seed: Seed = 0,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate every trial and return the tactile tensors.

    Parameters
    ----------
    antenna, trials
        What is touched, and how. Of the antennas of :func:`feeler.sample_antennas`, trial k touches
        number k modulo their number; of the trials of :func:`feeler.sample_trials` only those at
        work are in memory.
    duration, sample_interval, timestep
        Recorded time, time between samples, and integration step [ms]; samples at 0,
        sample_interval, … < duration. The default step is the engine's own, 0.05 ms for
        ``chain-consistent`` and 0.02 ms for the others, divided as the contact's time constant is.
    accuracy
        In place of ``timestep``: the greatest error allowed, as a share of each touch's peak, such
        as 0.01. Every touch is refined until step doubling says that it holds; what was reached is
        kept as ``error`` and ``timestep`` (trial), infinite where it was not.
    engine
        ``chain-consistent`` (fast and accurate at the default timestep), ``chain`` (fast, MuJoCo's
        equations step for step) or ``mujoco`` (reference).
    contact
        Softness of contact, or its name: ``smooth`` (default) or ``hard``; it does not depend on
        the timestep. The time constant of the default, 0.2 ms, is shorter on antennas that are
        thinner than 0.2 mm (docs: Contact); ``smooth:0.05`` gives it in ms.
    flow
        What drags an antenna in space along: a :class:`feeler.objects.motion.Flow`.
    all_hinges
        Record every hinge instead of the antenna's sensors.
    store
        Folder of a Zarr store that receives trials as they finish, group by group; whatever ends
        the process, the same call resumes it and gives the same numbers, and with more trials at
        the end of the list it goes on.
    load
        ``False`` leaves the numbers of a store on disk until they are used, so that memory stays
        small.
    save
        Names of the quantities to record (``feeler.tensors.QUANTITIES``); ``angle`` and ``error``
        always are, and ``curvature`` is derived from ``angle``. Default: all that the engine gives,
        but the optional ones.
    dtype
        ``float64``, or ``float32`` for half the room.
    workers
        Threads; default one per core. The numbers do not depend on it.
    executor
        Something else that runs trials: a ``feeler.execute.ProcessExecutor``, a Dask client, any
        ``submit``. Workers of a cluster write the shards of a store themselves, so that all must
        see its folder under one name.
    seed
        Root of one child seed per trial, stored with it.
    progress
        Called with (trials done, trials in all); with a store, done is on disk. Default: a bar in
        terminals and notebooks, which appears after 5 s.

    Returns
    -------
    xarray.Dataset
        ``angle`` [rad] and ``curvature`` [1/mm] (trial, sensor, time), ``tip`` [mm] and ``force``
        [N] (trial, time, axis), and ``error`` (trial): what the timestep makes the hinge angles err
        by at most, over the touch's peak, as a run with twice the timestep tells, and where that is
        too coarse one with half of it. Touches that err by more than 0.05 are warned of.

    Raises
    ------
    InvalidInput
        Before anything is simulated.
    StoreError
        The store is in use, was made by another configuration, version or code, or the disk is
        full; finished trials are safe.
    SimulationDivergedError
        After all trials ended; ``error.tensors`` holds the others' Dataset (and the store keeps
        them).
    """
    trials = (
        [trials]
        if isinstance(trials, Trial)
        else trials
        if isinstance(trials, Sequence)
        else list(trials)
    )
    if not len(trials):
        raise InvalidInput("trials is empty; give at least one Trial.")
    contact = get_contact(
        contact, antenna.antenna if isinstance(antenna, SampledAntennas) else antenna
    )
    clock = _make_clock(duration, sample_interval, timestep, accuracy, contact, engine)
    options: dict[str, Any] = {
        "engine": engine,
        "accuracy": accuracy,
        "flow": flow,
        "save": save,
        "dtype": dtype,
        "seed": seed,
    }
    job = _make_job(antenna, trials, clock, contact, all_hinges=all_hinges, **options)
    if accuracy is None:
        # warn of objects that are faster than the timestep can follow
        if isinstance(trials, SampledTrials):
            speed = float(np.max(trials.columns.get("speed", 0.0)))
        else:
            speed = max(trial.speed for trial in trials)
        for doubt in list_validity_warnings(
            job.antenna, contact, speed, clock.timestep, fixed=timestep is not None
        ):
            warnings.warn(ModelValidityWarning(DOUBT, doubt), stacklevel=2)
    if workers is not None:
        check_workers(workers)
    alone = store is None and executor is None and len(trials) == 1
    if alone:  # nothing to share out or to resume
        readings, errors = job.simulate([0], trials)
        tensors = collect(job, trials, readings)
        if progress is not None:
            progress(1, 1)
    else:
        with ExitStack() as stack:
            kept = stack.enter_context(_open(store, job, trials)) if store else None
            advance = stack.enter_context(show_progress(progress, "touches"))
            chosen = executor or stack.enter_context(ThreadExecutor(workers))
            readings, errors = _run_trials(job, trials, kept, chosen, advance)
        tensors = collect(job, trials, readings)
        if kept is not None and kept.finished.any():
            from feeler.tensors.store import read_store

            tensors = read_store(kept.path)
    tensors = tensors.load() if load and store and tensors is not None else tensors
    if tensors is not None:
        _warn(tensors, accuracy, contact, fixed=timestep is not None)
    return _hand_over(tensors, errors)


def _make_job(
    antenna: Antenna | SampledAntennas,
    trials: Sequence[Trial],
    clock: Clock,
    contact: Contact,
    *,
    engine: str,
    accuracy: float | None,
    flow: Flow | None,
    all_hinges: bool,
    save: Sequence[str] | None,
    dtype: str,
    seed: Seed,
) -> _WorkerTask:
    """What every trial is simulated with."""
    if dtype not in _DTYPES:
        raise InvalidInput(f"unknown dtype={dtype!r}; valid: {', '.join(_DTYPES)}.")
    variants = antenna if isinstance(antenna, SampledAntennas) else None
    antenna = antenna.antenna if isinstance(antenna, SampledAntennas) else antenna
    moved = _survey(antenna, trials)
    if flow is not None:
        make_scene(antenna, trials[0], contact, flow)  # refuses it in the plane
    save = _choose(save, moved, accuracy)
    if all_hinges:
        antenna = antenna.replace(sensors=np.arange(1, antenna.n_segments + 1))
    more = {
        "trials": getattr(trials, "recipe", None),
        "antennas": variants and variants.recipe,
        "flow": flow,
    }
    more = {name: value for name, value in more.items() if value is not None}
    made_with = {
        "antenna": antenna,
        "clock": clock,
        "contact": contact,
        "engine": engine,
    }  # trials: coordinates
    made_with |= {"accuracy": accuracy} if accuracy is not None else {}
    made_with |= more
    return _WorkerTask(
        antenna=antenna,
        variants=variants,
        contact=contact,
        flow=flow,
        clock=clock,
        engine=engine,
        accuracy=accuracy,
        save=save,
        dtype=dtype,
        seed=int(seed),
        attrs={
            "configuration": to_jsonable(
                made_with | {"seed": seed, "units": "g, mm, ms", "physics": PHYSICS}
            ),
            "engine": engine,
            "versions": list_versions(),
            "timestep": clock.timestep,
            "timestep_units": "ms",
            "contact_time_constant": contact.solref[0],
            "contact_time_constant_units": "ms",
            "licence": LICENCE,
        },
        sampled="trials" in more,
    )


def _make_clock(
    duration: float,
    sample_interval: float,
    timestep: float | None,
    accuracy: float | None,
    contact: Contact,
    engine: str,
) -> Clock:
    """The clock of a run; with an accuracy its timestep is the coarsest that may be tried."""
    if accuracy is not None:
        check_accuracy(accuracy)
        if timestep is not None:
            raise InvalidInput(
                "give either timestep= or accuracy=, which chooses the timestep."
            )
        timestep = find_coarsest(contact, sample_interval)
    clock = Clock(
        duration=duration,
        sample_interval=sample_interval,
        timestep=choose_timestep(timestep, engine, contact),
    )
    contact.check_timestep(clock.timestep)
    return clock


def _survey(antenna: Antenna, trials: Sequence[Trial]) -> bool:
    """Whether some base moves; refuses trials that cannot be placed."""
    if isinstance(trials, SampledTrials) and trials.antenna == antenna:
        return "x" in trials.columns  # their draws have been looked at
    for trial in trials:
        place(antenna, trial)
    return any(trial.base is not None for trial in trials)


def _choose(save: Sequence[str] | None, moved: bool, accuracy: float | None) -> list[str]:
    """What to record: also what each touch errs by, where bases move how, and with an accuracy the
    timestep that reached it.
    """
    more = ["base_pose"] * moved + ["timestep"] * (accuracy is not None) + ["error"]
    return [*(choose_quantities(save) if save is None else save), *more]


def _warn(
    tensors: xr.Dataset, accuracy: float | None, contact: Contact, *, fixed: bool
) -> None:
    missed = tensors["error"].values > (OFF if accuracy is None else accuracy)
    if missed.any() and accuracy is not None:
        text = (
            "touches did not reach the accuracy asked for: what they are off by is unknown, and"
            " their `error` is inf. Leave them out, or use a softer contact or a slower object."
        )
        said = f"They are {missed.sum()} of {missed.size} at accuracy={accuracy:g}:"
    elif missed.any():
        text = (
            "touches may be off, as other timesteps give something else; their `error` says by how"
            " much. Use a smaller timestep= or accuracy=, or leave them out."
        )
        said = (
            f"They are {missed.sum()} of {missed.size} at timestep"
            f" {tensors.attrs['timestep']:g} ms, off by more than {OFF:.0%} of their peak:"
        )
    if missed.any():
        names = _name_touches(tensors, missed)
        warnings.warn(AccuracyWarning(text, f"{said} {names}."), stacklevel=3)
    sink = float(tensors["sink"].values.max()) if "sink" in tensors else 0.0
    if sink > DEEP:
        doubt = describe_sink(sink, contact, fixed=fixed)
        warnings.warn(ModelValidityWarning(DOUBT, doubt), stacklevel=3)


def _name_touches(tensors: xr.Dataset, chosen: np.ndarray) -> str:
    """Number, label and error of each chosen touch, or of the first of many."""
    found = []
    for k in np.flatnonzero(chosen)[:_NAMED]:
        touch = tensors.isel(trial=k)
        words = f"{touch['feature'].item()} at {float(touch['location']):.3g} L"
        error = float(touch["error"])
        by = f", {error:.2g} of the peak" if np.isfinite(error) else ""
        found.append(f"{int(touch['trial'])}: {words}, {float(touch['speed']):.3g} m/s{by}")
    more = int(chosen.sum()) - len(found)
    return "; ".join(found) + (f"; and {more} more" if more else "")


def _open(store: str | os.PathLike, job: _WorkerTask, trials: Sequence[Trial]) -> "Store":
    """The store of this configuration."""
    from feeler.tensors.store import open_store  # loads zarr, which is an extra

    origin = {"save": job.save, "dtype": job.dtype}

    def make(index: int) -> dict[str, Any]:
        return job.list_made([index], [trials[index]])[0]

    return open_store(
        store,
        job.attrs["configuration"] | origin,
        len(trials),
        made=None if job.sampled else make,
    )


def _hand_over(tensors: xr.Dataset | None, errors: dict[int, Exception]) -> xr.Dataset:
    """The tensors, or the first error with the finished trials' tensors on it."""
    if not errors and tensors is not None:
        return tensors
    error: Any = errors[min(errors)]
    error.tensors = tensors
    if isinstance(error, SimulationDivergedError):
        _dump_state(error)
    raise error


def _dump_state(error: SimulationDivergedError) -> None:
    """Write the last finite state to the system's temporary folder and name the file in the
    message.
    """
    sweep_old(Path(tempfile.gettempdir()), "feeler-diverged-*.npz", keep=_KEEP - 1)
    with tempfile.NamedTemporaryFile(
        prefix="feeler-diverged-", suffix=".npz", delete=False
    ) as file:
        np.savez(file, angle=error.angle, velocity=error.velocity, time=error.time)
    error.state_file = file.name
    error.args = (f"{error} The last finite state (angle, velocity) is in {file.name}.",)
