"""Real simulations killed at random moments: the store opens, holds what was reported, and ends the
same.
"""

import multiprocessing
import os
import py_compile
import shutil
import signal
import sys
import tempfile
import threading
import time
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import feeler
from feeler.errors import FeelerError
from feeler.execute import OutOfMemory, ProcessExecutor, WorkerCrashed
from feeler.execute.processes import USUAL, prepare_workers
from feeler.experiments import runner as job
from feeler.tensors.formats import load

from ._sets import find_finished, forget
from ._touches import N_TRIALS, antenna, options, pick, run, trials, work

pytestmark = pytest.mark.long

LANES = 8  # trials that are stepped, stored and told of together


@pytest.fixture(scope="module")
def undisturbed():
    return run()


@pytest.fixture
def folder():
    """In memory where there is any: waiting for the disk would take most of the time."""
    path = Path(tempfile.mkdtemp(dir="/dev/shm" if os.access("/dev/shm", os.W_OK) else None))
    yield path
    shutil.rmtree(path)


def start(store, workers):
    """A process that fills the store, and what it tells; forked where everything is imported, else
    it would do little else.
    """
    context = multiprocessing.get_context("forkserver")
    prepare_workers(
        [*USUAL, "feeler.experiments.runner", "feeler.physics.chain", "feeler.tensors.store"]
    )
    told, theirs = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(theirs, store, workers))
    process.start()
    theirs.close()
    return process, told


def hear(told):
    """The next number that it tells, None once it has ended."""
    try:
        return told.recv()
    except EOFError:
        return None


def kill_somewhere(process, told, rng):
    """SIGKILL a process at a random moment of its work; the last number of finished trials that it
    told.
    """
    numbers = [hear(told)]
    if rng.random() < 0.3:
        time.sleep(
            rng.uniform(0, 0.5)
        )  # somewhere: mostly while it loads, simulates or opens the store
    else:
        # after some of the groups that are stepped together were told, but not the last: within the
        # next one
        numbers += [hear(told) for _ in range(int(rng.integers(1, N_TRIALS // LANES)))]
        time.sleep(rng.uniform(0, 0.02))
    process.kill()
    numbers += iter(lambda: hear(told), None)
    process.join()
    return max(number for number in numbers if number is not None)


@dataclass
class Tally:
    """What the killed processes left."""

    kills: int = 0
    ended: int = 0
    finished: list[int] = field(default_factory=list)


def kill_often(folder, n_kills, undisturbed):
    rng, tally, store = np.random.default_rng(n_kills), Tally(), folder / "0.zarr"
    while tally.kills < n_kills:
        process, told = start(store, int(rng.choice([0, 1, 2, 3])))
        last = kill_somewhere(process, told, rng)
        tally.kills += process.exitcode == -signal.SIGKILL
        tally.ended += process.exitcode == 0
        finished = find_finished(store)
        tally.finished.append(len(finished))
        assert len(finished) >= last
        if finished:
            part = load(store).load()
            assert part.trial.values.tolist() == finished
            xr.testing.assert_identical(part, pick(undisturbed, finished))
        if len(finished) == N_TRIALS:
            store = folder / f"{len(tally.finished)}.zarr"
    return tally, store


@pytest.mark.parametrize("n_kills", [5, pytest.param(60, marks=pytest.mark.slow)])
def test_killed_at_random_moments_the_same_command_ends_with_the_same_numbers(
    folder, undisturbed, n_kills
):
    tally, store = kill_often(folder, n_kills, undisturbed)
    print(f"\n{tally}")
    assert any(0 < n < N_TRIALS for n in tally.finished)  # else nothing was resumed
    process, told = start(store, 2)
    while hear(told) is not None:
        pass
    process.join()
    assert process.exitcode == 0
    xr.testing.assert_identical(load(store), undisturbed)
    xr.testing.assert_identical(run(store=store), undisturbed)
    assert not [path for path in store.rglob("*") if path.name.endswith(".tmp")]


def kill_worker(executor, number):
    """SIGKILL whichever worker processes live."""
    killed = [child.pid for child in multiprocessing.active_children()]
    for pid in killed[:number]:
        os.kill(pid, signal.SIGKILL)
    return len(killed[:number])


@pytest.mark.parametrize(
    "delay", [0.8, *(pytest.param(0.3 * n, marks=pytest.mark.slow) for n in range(10))]
)
def test_a_killed_worker_costs_nothing(folder, undisturbed, delay):
    killed = []
    with ProcessExecutor(2) as executor:
        timer = threading.Timer(delay, lambda: killed.append(kill_worker(executor, 1)))
        timer.start()
        result = run(store=folder / "a.zarr", executor=executor)
        timer.join()
        while not sum(
            killed
        ):  # too early or too late to hit one: once more, between two trials
            forget(folder / "a.zarr", 16, 23)
            killed.append(kill_worker(executor, 1))
            result = run(store=folder / "a.zarr", executor=executor)
    xr.testing.assert_identical(result, undisturbed)


@pytest.mark.parametrize(
    "error", [MemoryError("Unable to allocate 9 GiB"), WorkerCrashed("a worker process ended")]
)
def test_a_trial_that_crashes_its_worker_costs_only_itself(
    folder, undisturbed, monkeypatch, error
):
    real = job.run_lanes

    def crash(scenes, *how):
        if any("0.56 L" in scene.label for scene in scenes):
            raise error
        return real(scenes, *how)

    monkeypatch.setattr(job, "run_lanes", crash)
    with pytest.raises(
        (OutOfMemory, WorkerCrashed), match=r"not enough memory|a worker process ended"
    ) as caught:
        run(store=folder / "a.zarr")
    assert isinstance(caught.value, FeelerError)
    rest = [index for index in range(N_TRIALS) if index != 6]
    xr.testing.assert_identical(caught.value.tensors, pick(undisturbed, rest))
    assert find_finished(folder / "a.zarr") == rest
    monkeypatch.setattr(job, "run_lanes", real)
    xr.testing.assert_identical(run(store=folder / "a.zarr"), undisturbed)


def keep_bytecode():
    """As installed packages have it: a worker without memory then need not parse, for Python calls
    a parser that lacks memory a syntax error.
    """
    for name, module in list(sys.modules.items()):
        if name.startswith("feeler") and getattr(module, "__file__", None):
            py_compile.compile(module.__file__, quiet=2)


def test_workers_without_memory_fail_by_name_and_the_store_goes_on(folder):
    keep_bytecode()

    def touch(**more):
        return feeler.touch(antenna, trials[:2], store=folder / "a.zarr", **options, **more)

    with (
        ProcessExecutor(1, memory_limit=2**26) as executor,
        pytest.raises(OutOfMemory, match="reached its memory"),
    ):
        touch(executor=executor)
    assert find_finished(folder / "a.zarr") == []
    xr.testing.assert_identical(touch(), feeler.touch(antenna, trials[:2], **options))
