"""Touch an antenna and get its tactile tensors."""

import os
import tempfile
from collections.abc import Callable, Sequence
from contextlib import ExitStack

import numpy as np
import xarray as xr

from feeler.antenna.antenna import Antenna
from feeler.errors import InvalidInput, SimulationDiverged
from feeler.execute import Executor
from feeler.experiment.seed import spawn_seeds
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, TIMESTEP, get_engine
from feeler.physics.scene import Contact, Motion, make_scene
from feeler.physics.simulate import simulate
from feeler.provenance import LICENCE, describe_code, list_versions, make_plain
from feeler.stimulus.trial import Trial
from feeler.tensors.dataset import make_motion_tensors
from feeler.tensors.store import Store, open_store

DURATION = 380.0  # ms, the size of the slow tensors [P]

LABELS = ("location", "speed", "approach", "side", "lead", "friction")  # fields of a Trial that become coordinates

Progress = Callable[[int, int], None]


def touch(
    antenna: Antenna,
    trials: Sequence[Trial] | Trial,
    *,
    duration: float = DURATION,
    sample_interval: float = 1.0,
    timestep: float = TIMESTEP,
    engine: str = DEFAULT_ENGINE,
    contact: Contact | None = None,
    all_hinges: bool = False,
    store: str | os.PathLike | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    seed: int = 0,
    progress: Progress | None = None,
) -> xr.Dataset:
    """Simulate every trial and return the tactile tensors.

    Parameters
    ----------
    antenna, trials
        What is touched, and how.
    duration, sample_interval, timestep
        Recorded time, time between samples, and integration step [ms]; samples at 0, sample_interval, … < duration.
    engine
        ``chain-consistent`` (fast and accurate at the default timestep), ``chain`` (fast, MuJoCo's equations step for
        step) or ``mujoco`` (reference).
    contact
        Softness of contact; it does not depend on the timestep.
    all_hinges
        Record every hinge instead of the antenna's sensors.
    store
        Folder of a Zarr store that receives each trial as it finishes; whatever ends the process, the same call resumes
        it and gives the same numbers.
    workers
        Threads; default one per core. The numbers do not depend on it.
    executor
        Something else that runs trials: a ``feeler.execute.ProcessExecutor``, a Dask client, any ``submit``.
    seed
        Root of one child seed per trial, stored with it.
    progress
        Called with (trials done, trials in all).

    Returns
    -------
    xarray.Dataset
        ``angle`` [rad] and ``curvature`` [1/mm] (trial, sensor, time), ``tip`` [mm] and ``force`` [N]
        (trial, time, axis).

    Raises
    ------
    InvalidInput
        Before anything is simulated.
    StoreError
        The store is in use, was made by another configuration, version or code, or the disk is full; finished trials
        are safe.
    SimulationDiverged
        After all trials ended; ``error.tensors`` holds the others' Dataset (and the store keeps them).
    """
    trials = [trials] if isinstance(trials, Trial) else list(trials)
    if not trials:
        raise InvalidInput("trials is empty; give at least one Trial.")
    contact = contact or Contact()
    contact.check_timestep(timestep)
    clock = Clock(duration=duration, sample_interval=sample_interval, timestep=timestep)
    get_engine(engine)
    if all_hinges:
        antenna = antenna.replace(sensors=np.arange(1, antenna.n_segments + 1))
    seeds = spawn_seeds(seed, len(trials))
    attrs = describe_attributes(antenna, trials, clock, contact, engine, seed)
    scenes = [make_scene(antenna, trial, contact) for trial in trials]
    with ExitStack() as stack:
        kept = stack.enter_context(_open(store, attrs, trials)) if store else None
        pending = [index for index in range(len(trials)) if kept is None or index not in kept.finished]
        done = len(trials) - len(pending)

        def finished(place: int, outcome: object) -> None:
            nonlocal done
            index = pending[place]
            if kept is not None and isinstance(outcome, Motion):
                one = make_touch_tensors(antenna, [trials[index]], [outcome], [seeds[index]], attrs)
                kept.append(index, one.assign_coords(trial=[index]))
            done += 1
            if progress:
                progress(done, len(trials))

        todo = [scenes[index] for index in pending]
        options = {"engine": engine, "workers": workers, "executor": executor, "finished": finished}
        outcomes = simulate(todo, clock, keep=kept is None, **options)
        return _collect_stored(kept, outcomes) if kept else _collect(antenna, trials, outcomes, seeds, attrs)


def _open(store: str | os.PathLike, attrs: dict[str, object], trials: list[Trial]) -> Store:
    """The store of this configuration, these versions and this code; shapes from outside bring theirs."""
    modules = {type(trial.feature).__module__ for trial in trials}
    origin = {"versions": attrs["versions"], "code": describe_code(__name__, *sorted(modules))}
    return open_store(store, attrs["configuration"] | origin, len(trials))


def describe_attributes(
    antenna: Antenna, trials: list[Trial], clock: Clock, contact: Contact, engine: str, seed: int
) -> dict[str, object]:
    """The Dataset's attributes: configuration, engine, versions, timestep, licence."""
    made_with = {"antenna": antenna, "trials": trials, "clock": clock, "contact": contact, "engine": engine}
    return {
        "configuration": make_plain(made_with | {"seed": seed, "units": "g, mm, ms"}),
        "engine": engine,
        "versions": list_versions(),
        "timestep": clock.timestep,
        "timestep_units": "ms",
        "licence": LICENCE,
    }


def make_touch_tensors(
    antenna: Antenna, trials: Sequence[Trial], motions: Sequence[Motion], seeds: Sequence[int], attrs: dict
) -> xr.Dataset:
    """Motions of the trials as one Dataset."""
    return make_motion_tensors(antenna, motions, trials=describe_labels(antenna, trials, seeds), attrs=attrs)


def describe_labels(antenna: Antenna, trials: Sequence[Trial], seeds: Sequence[int]) -> dict[str, list]:
    """The trials' coordinates: every parameter of each."""
    return {
        "feature": [trial.feature.name for trial in trials],
        "kind": [trial.feature.kind for trial in trials],
        "size": [trial.feature.size for trial in trials],
        **{name: [getattr(trial, name) for trial in trials] for name in LABELS},
        "antenna": [antenna.name] * len(trials),
        "source": ["simulation"] * len(trials),
        "seed": list(seeds),
    }


def _collect_stored(store: Store, outcomes: list) -> xr.Dataset:
    return _hand_over(store.read() if store.finished else None, outcomes)


def _hand_over(tensors: xr.Dataset | None, outcomes: list) -> xr.Dataset:
    """The tensors, or the first error with the finished trials' tensors on it."""
    error = next((outcome for outcome in outcomes if isinstance(outcome, Exception)), None)
    if error is None:
        return tensors
    error.tensors = tensors
    if isinstance(error, SimulationDiverged):
        _dump_state(error)
    raise error


def _dump_state(error: SimulationDiverged) -> None:
    """Write the last finite state to the system's temporary folder and name the file in the message."""
    with tempfile.NamedTemporaryFile(prefix="feeler-diverged-", suffix=".npz", delete=False) as file:
        np.savez(file, angle=error.angle, velocity=error.velocity, time=error.time)
    error.state_file = file.name
    error.args = (f"{error} The last finite state (angle, velocity) is in {file.name}.",)


def _collect(antenna: Antenna, trials: list[Trial], outcomes: list, seeds: list[int], attrs: dict) -> xr.Dataset:
    good = [i for i, outcome in enumerate(outcomes) if isinstance(outcome, Motion)]
    tensors = None
    if good:
        tensors = make_touch_tensors(
            antenna, [trials[i] for i in good], [outcomes[i] for i in good], [seeds[i] for i in good], attrs
        ).assign_coords(trial=good)
    return _hand_over(tensors, outcomes)
