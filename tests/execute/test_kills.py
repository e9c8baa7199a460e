"""Workers that are killed as they begin and while they work: the command finishes, or ends in one
line; what was finished stays.
"""

import threading
import time
from multiprocessing import active_children

import pytest

from feeler.execute import ProcessExecutor, run_batch
from feeler.execute.workers import WorkerCrashed

from . import _tasks

pytestmark = pytest.mark.long


def kill_workers(most, stop):
    """Kill the first so many workers of this process, as soon as they are there."""
    killed = set()
    while not stop.is_set() and len(killed) < most:
        for child in active_children():
            if child.name == "feeler worker" and child.pid not in killed:
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
