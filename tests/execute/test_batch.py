"""Batches: every item answered once, whatever happens to the workers."""

import os
import signal
import subprocess
import sys
import textwrap
import time
from concurrent.futures import CancelledError, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg
from threadpoolctl import threadpool_info

import feeler
from feeler.errors import InvalidInput
from feeler.execute import ProcessExecutor, ThreadExecutor, run_batch
from feeler.execute.workers import WorkerCrashed, hold_blas

from . import _tasks


def collect(function, items, **options):
    return {
        outcome.index: outcome for outcome in run_batch(function, enumerate(items), **options)
    }


@pytest.fixture(scope="module")
def processes():
    with ProcessExecutor(2) as executor:
        yield executor


@pytest.mark.parametrize(
    "make", [lambda: ThreadExecutor(2), lambda: ThreadPoolExecutor(2), lambda: None]
)
def test_each_item_is_answered_once(make):
    executor = make()
    outcomes = collect(_tasks.double, range(57), executor=executor)
    assert {i: o.value for i, o in outcomes.items()} == {i: 2 * i for i in range(57)}


def test_processes_answer_the_same(processes):
    outcomes = collect(_tasks.double, range(20), executor=processes)
    assert {i: o.value for i, o in outcomes.items()} == {i: 2 * i for i in range(20)}


def test_an_error_is_the_outcome_of_its_item_alone():
    outcomes = collect(lambda x: 1 / x, [1, 0, 2], executor=ThreadExecutor(2))
    assert isinstance(outcomes[1].error, ZeroDivisionError)
    assert (outcomes[0].value, outcomes[2].value) == (1.0, 0.5)


def test_a_crash_costs_its_item_one_retry(processes, tmp_path):
    items = [(i, str(tmp_path / f"{i}") if i in (2, 5) else "") for i in range(8)]
    outcomes = collect(_tasks.crash_once, items, executor=processes)
    assert {i: o.value for i, o in outcomes.items()} == {i: 2 * i for i in range(8)}
    assert sorted(path.name for path in tmp_path.iterdir()) == ["2", "5"]


def test_an_item_that_always_crashes_fails_alone_and_says_how(processes):
    outcomes = collect(_tasks.crash_always, range(6), executor=processes)
    assert isinstance(outcomes.pop(3).error, WorkerCrashed)
    assert {i: o.value for i, o in outcomes.items()} == {i: 2 * i for i in (0, 1, 2, 4, 5)}
    with pytest.raises(WorkerCrashed, match="killed by SIGSEGV"):
        processes.submit(_tasks.crash_always, 3).result()


def test_a_worker_cannot_take_more_than_its_memory():
    with ProcessExecutor(1, memory_limit=2**29) as executor:
        outcomes = collect(_tasks.eat, [2**20, 2**31], executor=executor)
        assert outcomes[0].value == 2**20
        with pytest.raises(MemoryError, match="memory limit"):
            raise outcomes[1].error
        assert "at most 0.5 GiB each" in executor.describe()


def test_an_error_that_cannot_be_pickled_arrives_as_words(processes):
    with pytest.raises(RuntimeError, match="Untravelled: local words"):
        processes.submit(_tasks.raise_untravelled, 0).result()


@pytest.mark.parametrize("workers", [0, -1, 1.5, True, "2"])
@pytest.mark.parametrize("kind", [ThreadExecutor, ProcessExecutor])
def test_a_wrong_number_of_workers_is_refused(kind, workers):
    with pytest.raises(InvalidInput, match="workers must be a whole number"):
        kind(workers)


@pytest.mark.parametrize("options", [{"retries": -1}, {"window": 0}])
def test_wrong_options_are_refused(options):
    with pytest.raises(InvalidInput, match="retries must be"):
        collect(_tasks.double, [1], **options)


SCRIPT = """
    import sys, time
    sys.path.insert(0, {tests!r})
    from feeler.execute import ProcessExecutor, ThreadExecutor, run_batch
    from execute import _tasks
    if __name__ == "__main__":
        items = [(i, {item}) for i in range(40)]
        print("ready", flush=True)
        try:
            for outcome in run_batch({function}, items, executor={executor}):
                print("done", outcome.index, flush=True)
        except KeyboardInterrupt:
            print("interrupted", flush=True)
"""


def start(**fields):
    source = textwrap.dedent(SCRIPT.format(tests=str(Path(__file__).parents[1]), **fields))
    process = subprocess.Popen(
        [sys.executable, "-c", source],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stdout.readline() == "ready\n"
    return process


def test_first_interrupt_finishes_what_runs():
    process = start(function="_tasks.slow", item="i", executor="ThreadExecutor(2)")
    process.stdout.readline()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert out.endswith("interrupted\n")
    assert "stopping after the trials" in err
    assert len(out.splitlines()) < 12


@pytest.mark.long
def test_what_runs_for_long_is_not_waited_for_after_the_first_interrupt():
    process = start(function="_tasks.nap", item="1e4", executor="ProcessExecutor(2)")
    time.sleep(0.3)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert (process.returncode, out) == (0, "interrupted\n"), err
    assert "which have 2 s" in err


@pytest.mark.long
def test_two_interrupts_with_threads_inside_an_engine_end_without_a_crash():
    process = start(function="_tasks.step_mujoco", item="1.0", executor="ThreadExecutor(2)")
    time.sleep(0.5)
    process.send_signal(signal.SIGINT)
    process.stderr.readline()
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=30)
    assert (process.returncode, out) == (0, "interrupted\n"), err


@pytest.mark.long
def test_workers_that_are_starting_leave_ctrl_c_to_their_parent():
    process = start(function="_tasks.slow", item="i", executor="ProcessExecutor(2)")
    time.sleep(0.3)
    os.killpg(process.pid, signal.SIGINT)  # as a terminal does
    out, err = process.communicate(timeout=60)  # that tasks end within 2 s is not said here
    assert out.endswith("interrupted\n") and "Traceback" not in err, err


@pytest.mark.long
@pytest.mark.parametrize("delay", [0.0, 0.01, 0.1, 0.3])
def test_a_worker_that_is_starting_is_ended_too(delay):
    """Else its task would begin after the end, and the interpreter would wait for it."""
    with ProcessExecutor(2) as executor:
        for _ in range(3):
            waiting = executor.submit(_tasks.nap, 1e4)
            time.sleep(delay)
            executor.kill()
            with pytest.raises((CancelledError, WorkerCrashed)):
                waiting.result(timeout=30)
        assert executor.submit(_tasks.double, 4).result(timeout=60) == 8


@pytest.mark.long
@pytest.mark.parametrize("end", ["two interrupts", "kill"])
def test_no_orphans_whatever_ends_the_parent(tmp_path, end):
    process = start(
        function="_tasks.sleep_long", item=repr(str(tmp_path)), executor="ProcessExecutor(2)"
    )
    wait_for(lambda: len(list(tmp_path.iterdir())) == 2)
    workers = [int(path.name) for path in tmp_path.iterdir()]
    if end == "kill":
        process.kill()
    else:
        process.send_signal(signal.SIGINT)
        time.sleep(0.3)
        process.send_signal(signal.SIGINT)
    process.communicate(timeout=15)
    wait_for(lambda: not any(alive(pid) for pid in workers))


def wait_for(condition, seconds=30):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.05)


def alive(pid):
    try:
        os.kill(pid, 0)
        return Path(f"/proc/{pid}/stat").read_text().split()[2] != "Z"
    except (ProcessLookupError, FileNotFoundError):
        return False


@pytest.mark.parametrize("workers", [1, 3])
def test_map_keeps_the_order_and_the_first_error_ends_it(workers):
    with ThreadExecutor(workers) as executor:
        assert list(executor.map(lambda a, b: a - b, range(9), range(0, 18, 2))) == [
            -i for i in range(9)
        ]
        with pytest.raises(ZeroDivisionError):
            list(executor.map(lambda x: 1 / x, [1, 0, 2]))


def test_an_executor_can_be_used_again_after_its_end(processes):
    processes.kill()
    assert processes.submit(_tasks.double, 2).result() == 4


def test_one_way_to_run_side_by_side():
    """No room opens a pool of its own."""
    source = Path(feeler.__file__).parent
    pools = ("ThreadPool", "ProcessPool", "import joblib", "multiprocessing.Pool")
    opened = {
        p.relative_to(source).parts[0]
        for p in source.rglob("*.py")
        if any(word in p.read_text() for word in pools)
    }
    assert opened == {"execute"}


@pytest.mark.parametrize("retries", [0, 1, 3])
def test_what_crashes_is_tried_again_as_often_as_was_said(retries):
    """Each item once, and so many times more; others once."""
    tried = []

    def crash(item):
        tried.append(item)
        if item == 1:
            raise WorkerCrashed("killed")
        return item

    outcomes = collect(crash, range(3), executor=ThreadExecutor(1), retries=retries)
    assert isinstance(outcomes[1].error, WorkerCrashed)
    assert sorted(tried) == [0, *[1] * (retries + 1), 2]


def test_workers_that_join_late_are_given_work_at_once():
    """The window is two for each worker there is now, not for those that there were."""

    class Growing(ThreadExecutor):
        workers = 1

        def submit(self, function, item):
            started.append(item)
            return super().submit(function, item)

    started: list[int] = []
    with Growing(1) as executor:
        results = run_batch(_tasks.double, list(enumerate(range(20))), executor=executor)
        next(results)
        assert len(started) == 2
        executor.workers = 4
        next(results)
        assert len(started) == 1 + 8
        results.close()


def test_a_worker_has_what_was_imported_for_it_and_its_caller_has_not():
    code = (
        "import sys\nfrom feeler.execute.workers import USUAL, ProcessExecutor,"
        " prepare_workers\nfrom tests.execute import _tasks\nprepare_workers([*USUAL,"
        " 'colorsys'])\nwith ProcessExecutor(1) as executor:\n   "
        " print(executor.submit(_tasks.has_loaded, 'colorsys').result(), 'colorsys' in"
        " sys.modules)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False
    )
    assert (done.stdout.split(), done.stderr) == (["True", "False"], "")


def test_workers_are_processes_of_their_own_that_fork_no_further():
    with ProcessExecutor(2) as executor:
        found = [executor.submit(_tasks.name_process, None).result() for _ in range(2)]
    assert {method for _, method in found} == {"spawn"}
    assert os.getpid() not in {number for number, _ in found}


def test_every_blas_is_held_to_one_thread_and_let_go_again():
    before = [lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"]
    with hold_blas():
        held = [lib for lib in threadpool_info() if lib["user_api"] == "blas"]
        assert len(held) >= 2  # NumPy's and SciPy's
        assert {lib["num_threads"] for lib in held} == {1}
    after = [lib["num_threads"] for lib in threadpool_info() if lib["user_api"] == "blas"]
    assert after[: len(before)] == before


distributed = pytest.importorskip("distributed", reason="needs the extra `cluster`")


def test_a_dask_client_runs_a_batch():
    with distributed.Client(
        processes=False, n_workers=1, threads_per_worker=2, dashboard_address=None
    ) as client:
        outcomes = {
            o.index: o.value
            for o in run_batch(_tasks.double, enumerate(range(12)), executor=client)
        }
        assert outcomes == {i: 2 * i for i in range(12)}
        failed = next(iter(run_batch(_tasks.refuse, [(0, 7)], executor=client)))
        assert isinstance(failed.error, ValueError) and "no 7" in str(failed.error)


@pytest.mark.skipif("PYTEST_XDIST_WORKER" not in os.environ, reason="of workers, -n 2")
def test_a_worker_has_one_thread_within_its_libraries():
    """They were set too late: on a busy machine two threads took 4.7 s of processor time for a
    cricket's response, one takes 0.05 s; a network learned in 22.9 s, with one thread in 2.7 s.
    """
    scipy.linalg.solve(np.eye(2), np.ones(2))  # SciPy brings a BLAS of its own
    found = [blas["num_threads"] for blas in threadpool_info() if blas["user_api"] == "blas"]
    assert found and set(found) == {1}
    assert os.environ["OMP_NUM_THREADS"] == "1"  # PyTorch reads it, and takes seconds to load


@pytest.mark.long
def test_a_script_without_a_guard_ends_and_says_what_it_needs(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "from feeler.execute import ProcessExecutor, run_batch\n"
        "print(*run_batch(abs, [(0, -1)], executor=ProcessExecutor(1)))\n"
    )
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=100, check=False
    )
    assert done.returncode == 1
    assert "worker that imports its script starts no processes" in done.stderr
    assert 'start batches under `if __name__ == "__main__":`' in done.stderr.splitlines()[-1]
