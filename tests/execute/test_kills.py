"""Workers that are killed as they begin and while they work: the command finishes, or ends in one
line; what was finished stays.
"""

import os
import subprocess
import sys
import threading
import time
from multiprocessing import active_children

import numpy as np
import psutil
import pytest

import feeler
from feeler.execute import ProcessExecutor, WorkerCrashed, run_batch

from . import _tasks

pytestmark = pytest.mark.long

COMMAND = [sys.executable, "-m", "tests.execute._touches"]
DELAYS = (0.0, 0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.6)  # s after a process has appeared
PATIENCE = 300.0  # s until a command counts as hanging, however busy the machine is


def kill_workers(most, stop):
    """Kill the first so many workers of this process, as soon as they are there."""
    killed = set()
    while not stop.is_set() and len(killed) < most:
        for child in active_children():
            if child.name == "pebble_pool_worker" and child.pid not in killed:
                killed.add(child.pid)
                child.kill()
        time.sleep(0.001)


def run_while_killing(most):
    stop = threading.Event()
    thread = threading.Thread(target=kill_workers, args=(most, stop))
    thread.start()
    try:
        with ProcessExecutor(2) as executor:
            return list(
                run_batch(_tasks.double, ((k, k) for k in range(20)), executor=executor)
            )
    finally:
        stop.set()
        thread.join()


def test_workers_that_end_as_they_begin_cost_nothing():
    outcomes = run_while_killing(most=2)
    assert sorted(outcome.value for outcome in outcomes) == [2 * k for k in range(20)]


def test_where_no_worker_can_begin_the_batch_says_so():
    with pytest.raises(WorkerCrashed, match=r"3 times in a row worker processes ended as they"):
        run_while_killing(most=10**6)


def is_target(process, kind):
    """Whether a process of the command's tree is one that this kind of kill is meant for."""
    try:
        words, above = " ".join(process.cmdline()), process.parent()
        below = above is not None and "forkserver" in above.cmdline()
    except psutil.Error:  # it has gone
        return False
    # the tracker is Python's own bookkeeping, which simulates nothing
    return "resource_tracker" not in words and not (kind == "fork server" and below)


def kill_one(command, kind, place, delay, root):
    """Kill the process below ``root`` that comes as number ``place``, ``delay`` s after it has
    appeared; what it was, and how long [s] the command went on.
    """
    root, seen, killed, when = psutil.Process(root), {}, None, time.monotonic()
    end = time.monotonic() + PATIENCE
    while command.poll() is None and time.monotonic() < end:
        try:
            for child in root.children(recursive=True) if killed is None else ():
                if is_target(child, kind):
                    seen.setdefault(child.pid, (time.monotonic(), child))
            # a process is its parent's copy until it runs another program
            seen = {pid: one for pid, one in seen.items() if is_target(one[1], kind)}
            ready = [*seen.values()][place : place + 1]
            if killed is None and ready and time.monotonic() - ready[0][0] >= delay:
                killed = " ".join(ready[0][1].cmdline())[-80:]
                ready[0][1].kill()
                when = time.monotonic()
        except psutil.Error:
            pass
        time.sleep(0.005)
    return killed, time.monotonic() - when


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    store = tmp_path_factory.mktemp("whole") / "a.zarr"
    subprocess.run([*COMMAND, "processes", store], check=True, capture_output=True)
    return feeler.load(store)


@pytest.fixture(scope="module")
def scheduler(tmp_path_factory):
    """A scheduler with two workers, as a cluster's operator starts them: its file, and a function
    that gives the process of the worker that is to lose its own; it is started anew where it has
    ended, as Dask's does when what it started ends before it has said a word.
    """
    pytest.importorskip("distributed", reason="needs the extra `cluster`")
    file = tmp_path_factory.mktemp("cluster") / "scheduler.json"
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    dask = [sys.executable, "-m", "dask"]
    where = ["--scheduler-file", str(file), "--no-dashboard"]
    running = [subprocess.Popen([*dask, "scheduler", "--port", "0", *where], **quiet)]
    worker = [*dask, "worker", "--nthreads", "1", *where]
    running += [subprocess.Popen(worker, **quiet) for _ in range(2)]
    end = time.monotonic() + 60
    while not file.exists() and time.monotonic() < end:
        time.sleep(0.05)

    def find_worker():
        if running[-1].poll() is not None:
            running.append(subprocess.Popen(worker, **quiet))
        return running[-1].pid

    yield str(file), find_worker
    for process in reversed(running):
        process.kill()
        process.wait()


def check(command, store, undisturbed, killed):
    """What is right after a kill: finished, or one line of ours; no trial wrong or lost."""
    assert command.poll() is not None, f"hangs after {killed} was killed"
    said = command.stdout.read()
    assert "Traceback" not in said, f"after {killed}: {said[-3000:]}"
    assert command.returncode in (0, 2), f"after {killed}: {said[-3000:]}"
    if command.returncode == 2:
        assert len([line for line in said.splitlines() if line.startswith("feeler: ")]) == 1
        assert subprocess.run([*COMMAND, "processes", store], check=False).returncode == 0
    kept = feeler.load(store)
    np.testing.assert_array_equal(kept["angle"].values, undisturbed["angle"].values)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["processes", "fork server", "local:2", "scheduler"])
def test_a_killed_worker_ends_no_command(kind, tmp_path, undisturbed, request):
    n, rng = request.config.getoption("--kills"), np.random.default_rng(1)
    where, find_root = {"fork server": "processes"}.get(kind, kind), None
    if kind == "scheduler":
        where, find_root = request.getfixturevalue("scheduler")
    ends = []
    for k in range(n):
        store, delay = tmp_path / f"{k}.zarr", rng.choice(DELAYS)
        place = 0 if kind in ("fork server", "scheduler") else int(rng.integers(4))
        command = subprocess.Popen(
            [*COMMAND, where, store],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            start_new_session=True,
        )
        root = find_root() if find_root else command.pid
        killed, after = kill_one(command, kind, place, delay, root)
        check(command, store, undisturbed, killed)
        ends.append((command.returncode, bool(killed), after if killed else 0.0))
        if killed and after > 10:
            print(
                f"{kind}, command {k}: {after:.1f} s; after {delay} s, place {place}, {killed}"
            )
    codes, lost, after = zip(*ends, strict=True)
    print(
        f"\n{kind}: {n} commands, {sum(lost)} of them lost a process, {codes.count(2)} ended in a"
        f" line; from the kill to the end {np.median(after):.1f} s, at most {max(after):.1f} s;"
        f" load {os.getloadavg()[0]:.0f}"
    )
