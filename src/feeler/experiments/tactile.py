"""Touch an antenna and get its tactile tensors."""

import os
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
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
)
from feeler.execute import Executor, ThreadExecutor
from feeler.execute.threads import check_workers
from feeler.experiments.runner import Progress, _run_trials, _WorkerTask, collect
from feeler.files import sweep_old
from feeler.objects.motion import Flow
from feeler.objects.sampling import SampledTrials
from feeler.objects.trials import Trial, place
from feeler.physics.contact import (
    DEEP,
    DOUBT,
    Contact,
    describe_sink,
    get_contact,
    list_validity_warnings,
)
from feeler.physics.engine import DEFAULT_ENGINE, choose_timestep
from feeler.physics.run import check_accuracy, find_coarsest
from feeler.physics.scene import Clock, make_scene
from feeler.progress import show_progress
from feeler.provenance import LICENCE, PHYSICS, list_versions, to_jsonable
from feeler.tensors.schema import choose_quantities
from feeler.validation import Seed, checked

if TYPE_CHECKING:
    from feeler.tensors.store import Store

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
        _warn_of_speed(job.antenna, trials, contact, clock, fixed=timestep is not None)
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
        attrs=_describe_attributes(antenna, clock, contact, engine, seed, accuracy, more),
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
    chosen = choose_quantities(save)
    return [*(chosen if save is None else save), *more]


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


def _warn_of_speed(
    antenna: Antenna, trials: Sequence[Trial], contact: Contact, clock: Clock, *, fixed: bool
) -> None:
    """Warn of objects that are faster than the timestep can follow."""
    if isinstance(trials, SampledTrials):
        speed = float(np.max(trials.columns.get("speed", 0.0)))
    else:
        speed = max(trial.speed for trial in trials)
    for doubt in list_validity_warnings(antenna, contact, speed, clock.timestep, fixed=fixed):
        warnings.warn(ModelValidityWarning(DOUBT, doubt), stacklevel=3)


def _open(store: str | os.PathLike, job: _WorkerTask, trials: Sequence[Trial]) -> "Store":
    """The store of this configuration."""
    from feeler.tensors.store import open_store  # loads zarr, which is an extra

    origin = {"save": job.save, "dtype": job.dtype}

    def make(index: int) -> dict[str, Any]:
        return job.list_made([index], [trials[index]])[0]

    made = None if job.sampled else make
    return open_store(store, job.attrs["configuration"] | origin, len(trials), made=made)


def _describe_attributes(
    antenna: Antenna,
    clock: Clock,
    contact: Contact,
    engine: str,
    seed: Seed,
    accuracy: float | None = None,
    more: Mapping[str, object] | None = None,
) -> dict[str, object]:
    """The attributes of each Dataset of such touches: configuration, engine, versions, timestep,
    licence.
    """
    made_with = {
        "antenna": antenna,
        "clock": clock,
        "contact": contact,
        "engine": engine,
    }  # trials: coordinates
    made_with |= {"accuracy": accuracy} if accuracy is not None else {}
    made_with |= more or {}
    return {
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
    }


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
