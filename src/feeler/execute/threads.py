"""Threads: the default workers, since compiled code releases the interpreter's lock."""

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager
from functools import cache
from typing import Any

from threadpoolctl import ThreadpoolController

from feeler.errors import InvalidInput
from feeler.validation import checked

_MAX_WORKERS = 1024  # [C] more than any machine has cores for


def count_cores() -> int:
    """Cores that this process may use."""
    return (
        len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count() or 1
    )


def check_workers(workers: int | None) -> int:
    """The number of workers: one per core by default; anything but a whole number from 1 to
    MAX_WORKERS is refused.
    """
    if workers is None:
        return count_cores()
    if (
        isinstance(workers, bool)
        or not isinstance(workers, int)
        or not 1 <= workers <= _MAX_WORKERS
    ):
        raise InvalidInput(
            f"workers must be a whole number ≥ 1 and ≤ {_MAX_WORKERS}, got {str(workers)[:40]};"
            " None uses one per core."
        )
    return workers


@contextmanager
def hold_blas() -> Iterator[None]:
    """One thread within BLAS: its sums depend on their number, and small matrices gain nothing from
    more.
    """
    with _find_blas().limit(limits=1, user_api="blas"):
        yield


@cache
def _find_blas() -> ThreadpoolController:
    import numpy  # noqa: F401  each brings a BLAS of its own, which is to be found
    import scipy.linalg  # noqa: F401

    return ThreadpoolController()


@checked
class ThreadExecutor(AbstractContextManager):
    """``workers`` threads, and none where one is asked for ``map``. The interpreter's end waits for
    the tasks that are running: an engine cannot be left in the middle of its work.
    """

    def __init__(self, workers: int | None = None) -> None:
        self.workers = check_workers(workers)
        self._pool: ThreadPoolExecutor | None = None

    def submit(self, function: Callable, /, *args: Any) -> Future:
        """Queue ``function(*args)``; threads start with the first task."""
        self._pool = self._pool or ThreadPoolExecutor(self.workers)
        return self._pool.submit(function, *args)

    def map(self, function: Callable, /, *iterables: Iterable) -> Iterator[Any]:
        """Results of ``function`` in order, as from the built-in ``map``, but side by side; the
        first error ends it.
        """
        if self.workers == 1:
            yield from map(function, *iterables)
            return
        futures = [self.submit(function, *args) for args in zip(*iterables, strict=True)]
        try:
            for future in futures:
                yield future.result()
        finally:
            for future in futures:
                future.cancel()

    def kill(self) -> None:
        """Send every thread home after its present task; queued tasks are dropped. The executor can
        be used again.
        """
        if self._pool is not None:
            self._pool.shutdown(wait=False, cancel_futures=True)
        self._pool = None

    def __exit__(self, *_: object) -> None:
        self.kill()

    def describe(self) -> str:
        """One line for a person: how many workers of which kind."""
        return f"{self.workers} thread{'s' if self.workers > 1 else ''} in this process"
