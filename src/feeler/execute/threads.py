"""Threads: the default workers, since both engines release the interpreter's lock while they simulate."""

import atexit
import os
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from contextlib import contextmanager
from functools import cache
from queue import SimpleQueue
from typing import Any

from threadpoolctl import ThreadpoolController

from feeler.errors import InvalidInput

GRACE = 10.0  # s that the interpreter's end waits for tasks that were left running
_leaving: list[threading.Thread] = []


def count_cores() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_workers(workers: int | None) -> int:
    """The number of workers: one per core by default; anything but a whole number ≥ 1 is refused."""
    if workers is None:
        return count_cores()
    if isinstance(workers, bool) or not isinstance(workers, int) or workers < 1:
        raise InvalidInput(f"workers must be a whole number ≥ 1, got {workers!r}; None uses one per core.")
    return workers


@contextmanager
def hold_blas() -> Iterator[None]:
    """One thread within BLAS: its sums depend on their number, and small matrices gain nothing from more."""
    with _find_blas().limit(limits=1, user_api="blas"):
        yield


@cache
def _find_blas() -> ThreadpoolController:
    import numpy  # noqa: F401  each brings a BLAS of its own, which is to be found
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()


class ThreadExecutor:
    """``workers`` threads that do not hold up the interpreter's end (``concurrent.futures`` threads do)."""

    def __init__(self, workers: int | None = None) -> None:
        self.workers = check_workers(workers)
        self._tasks: SimpleQueue = SimpleQueue()
        self._threads: list[threading.Thread] = []

    def submit(self, function: Callable, /, *args: Any) -> Future:
        """Queue ``function(*args)``; threads start as tasks come."""
        future: Future = Future()
        self._tasks.put((future, function, args))
        if len(self._threads) < self.workers:
            thread = threading.Thread(target=_work, args=(self._tasks,), daemon=True, name="feeler worker")
            self._threads.append(thread)
            thread.start()
        return future

    def kill(self) -> None:
        """Send every thread home after its present task; queued tasks are cancelled. The executor can be used again."""
        while not self._tasks.empty():
            task = self._tasks.get()
            if task is not None:
                task[0].cancel()
        for _ in self._threads:
            self._tasks.put(None)
        _leaving[:] = [thread for thread in _leaving if thread.is_alive()] + self._threads
        self._threads, self._tasks = [], SimpleQueue()

    def __enter__(self) -> "ThreadExecutor":
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def describe(self) -> str:
        """One line for a person: how many workers of which kind."""
        return f"{self.workers} thread{'s' if self.workers > 1 else ''} in this process"


def _work(tasks: SimpleQueue) -> None:
    while (task := tasks.get()) is not None:
        future, function, args = task
        if not future.set_running_or_notify_cancel():
            continue
        try:
            future.set_result(function(*args))
        except BaseException as error:
            future.set_exception(error)
        del future, function, args, task


@atexit.register
def _see_off() -> None:
    """Wait for threads sent home: one still inside an engine when the interpreter ends would crash the process."""
    end = time.monotonic() + GRACE
    for thread in _leaving:
        thread.join(max(end - time.monotonic(), 0))
