"""Workers: threads, the default, since compiled code releases the interpreter's lock; processes,
which may crash or run out of memory without taking the batch with them; and a Dask client in their
place, on many machines.
"""

import gc
import logging
import multiprocessing
import os
import pickle
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import AbstractContextManager, contextmanager, suppress
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import forkserver, resource_tracker
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from threadpoolctl import ThreadpoolController

from feeler.errors import (
    FeelerError,
    InvalidInput,
    ModelValidityWarning,
    OutOfMemory,
    StoreError,
    lacks_memory,
    require_extra,
    say_warnings,
)
from feeler.validation import checked

try:
    import resource
except ImportError:  # Windows
    resource = None  # type: ignore[assignment]

# Threads.

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


# Processes.

# The BLAS of the last two, loaded where memory lacks, would end a worker without a word.
USUAL = (__name__, "numpy", "scipy.linalg")
_NAME = "feeler worker"
_MEMORY_SHARE = (
    0.8  # [C] of what is free when the executor is made, shared out among its workers
)
# Workers are forked from a process that only imports: a fork of this one would copy threads' locks
# and the store's open
# files, and a new interpreter for each would import everything again.
_CONTEXT = multiprocessing.get_context("forkserver")


class WorkerCrashed(FeelerError, RuntimeError):
    """A worker process ended before it had answered."""


_GUARD = 'In a script, start batches under `if __name__ == "__main__":`.'
OPENINGS = 3  # [C] workers in a row that may end as they begin
CRASHES = (WorkerCrashed, MemoryError)
"""Errors that tell of the machine rather than of the task, so that a second try makes sense."""


def prepare_workers(modules: Sequence[str] = USUAL) -> None:
    """Start the process that workers are forked from, if none is there; what it imports now, no
    worker imports again.

    Returns at once: the imports run beside the caller's own.
    """
    _CONTEXT.set_forkserver_preload(
        [*modules]
    )  # in place of the script, which is not to run there
    with _uninterrupted():
        forkserver.ensure_running()


@checked
class ProcessExecutor(AbstractContextManager):
    """``workers`` processes, one task each at a time; a process that dies fails its one task and is
    replaced.

    Workers end when their parent ends, however that happens, and ignore Ctrl-C, which is the
    parent's business. Each may hold at most ``memory_limit`` bytes (default: an equal share of 80 %
    of the free memory; not on Windows).
    """

    def __init__(self, workers: int | None = None, *, memory_limit: int | None = None) -> None:
        if getattr(multiprocessing.current_process(), "_inheriting", False):
            raise InvalidInput(
                f"a worker that imports its script starts no processes. {_GUARD}"
            )
        self.workers = check_workers(workers)
        if memory_limit is not None and memory_limit < 2**26:
            raise InvalidInput(
                f"memory_limit must be at least {2**26:,} bytes (64 MiB), got {memory_limit}."
            )
        self.memory_limit = memory_limit or int(
            _MEMORY_SHARE * find_free_memory() / self.workers
        )
        self._threads = ThreadExecutor(self.workers)  # each hands tasks to a process of its own
        self._own = threading.local()
        # another set after each kill: tasks of the one before start no more
        self._processes: set[Any] = set()
        self._breaks = 0

    def submit(self, function: Callable, /, *args: Any) -> Future:
        """Queue ``function(*args)``; both must be picklable. Processes start with the first
        task.
        """
        if self._breaks >= OPENINGS:
            raise _explain_start()
        message = pickle.dumps((function, args))
        return self._threads.submit(self._ask, message, self._processes)

    def _ask(self, message: bytes, peers: set[Any]) -> Any:
        """A worker's answer, or what became of the worker."""
        process, pipe = self._find_worker(peers)
        try:
            pipe.send_bytes(message)
            good, value = pickle.loads(pipe.recv_bytes())
        except (EOFError, OSError) as error:
            with _starting:
                process.join()
            raise _explain_end(process.exitcode) from error
        if good:
            return value
        raise value

    def _find_worker(self, peers: set[Any]) -> tuple[Any, Any]:
        """This thread's process and the pipe to it; a new one in the place of one that ended, among
        its ``peers`` unless these have been killed.
        """
        process, pipe = getattr(self._own, "worker", (None, None))
        with _starting:
            if process is not None and process.is_alive():
                return process, pipe
        prepare_workers()
        while self._breaks < OPENINGS:
            pipe, theirs = _CONTEXT.Pipe()
            with _starting:
                if peers is not self._processes:
                    raise CancelledError
                process = _CONTEXT.Process(
                    target=_serve, args=(theirs, self.memory_limit), name=_NAME
                )
                process.start()
                peers.add(process)
            theirs.close()
            try:
                pipe.recv_bytes()
            except (EOFError, OSError):
                self._breaks += 1
            else:
                self._breaks, self._own.worker = 0, (process, pipe)
                return process, pipe
        raise _explain_start()

    def kill(self) -> None:
        """End every process at once; unanswered tasks are dropped. The executor can be used
        again.
        """
        self._threads.kill()
        with _starting:
            ended, self._processes, self._breaks = self._processes, set(), 0
            for process in ended:
                process.kill()
            for process in ended:
                process.join()

    def __exit__(self, *_: object) -> None:
        self.kill()

    def describe(self) -> str:
        """One line for a person: how many workers, and how much memory each may take."""
        kind = "processes" if self.workers > 1 else "process"
        return f"{self.workers} {kind}, at most {self.memory_limit / 2**30:.1f} GiB each"


_starting = threading.Lock()
"""When one starts, multiprocessing looks at all, and may ask each for its end only once."""


def _explain_start() -> WorkerCrashed:
    return WorkerCrashed(
        f"{OPENINGS} times in a row worker processes ended as they began. The system may have run"
        f" out of memory: use fewer workers. {_GUARD}"
    )


def _explain_end(code: int | None) -> Exception:
    if code == -signal.SIGABRT:  # how compiled libraries end a process that gets no memory
        return OutOfMemory(
            "a worker reached its memory limit, or a compiled library in it aborted; use fewer"
            " workers or shorter trials"
        )
    how = (
        f"killed by {signal.Signals(-code).name}"
        if code and code < 0
        else f"with exit code {code}"
    )
    hint = " The system may have run out of memory: use fewer workers." if code == -9 else ""
    return WorkerCrashed(f"a worker process ended {how} before it had answered.{hint}")


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """What starts here never sees Ctrl-C, which a terminal sends to it too: the parent decides what
    is to end.
    """
    resource_tracker.ensure_running()  # it would lift the block while it starts itself
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _serve(pipe: Any, memory_limit: int) -> None:
    """What a worker does: answer task after task until its parent lets go of the pipe."""
    multiprocessing.set_start_method(
        "spawn", force=True
    )  # said not to fork, numba takes no semaphore that a kill leaks
    threading.Thread(target=_die_with_parent, daemon=True).start()
    say_warnings()  # a worker has no other way to tell
    gc.freeze()  # what was imported stays
    gc.set_threshold(50_000)  # [C] to look through figures, which live on, costs a twentieth
    if resource is not None:
        _, hard = resource.getrlimit(resource.RLIMIT_DATA)
        limit = memory_limit if hard == resource.RLIM_INFINITY else min(memory_limit, hard)
        resource.setrlimit(resource.RLIMIT_DATA, (limit, hard))
    with suppress(EOFError, OSError):
        pipe.send_bytes(b"ready")
        while True:
            pipe.send_bytes(_answer(pipe.recv_bytes()))


def _answer(message: bytes) -> bytes:
    try:
        function, args = pickle.loads(message)
        return pickle.dumps((True, function(*args)))
    except Exception as error:
        if lacks_memory(error):
            words = "a worker reached its memory limit; use fewer workers or shorter trials"
            return pickle.dumps((False, OutOfMemory(words)))
        try:
            pickle.loads(
                pickle.dumps(error)
            )  # an error that cannot travel is reported by its words
            return pickle.dumps((False, error))
        except Exception:
            return pickle.dumps((False, RuntimeError(f"{type(error).__name__}: {error}")))


def _die_with_parent() -> None:
    parent: Any = multiprocessing.parent_process()
    wait([parent.sentinel])
    os._exit(1)


def find_free_memory() -> int:
    """Bytes that can still be taken: what the system calls available, or what the control group
    leaves, if less.
    """
    free = sys.maxsize
    try:
        free = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
        lines = Path("/proc/meminfo").read_text().splitlines()
        free = next(
            int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable")
        )
        limit = Path("/sys/fs/cgroup/memory.max").read_text().strip()
        if limit != "max":
            free = min(
                free, int(limit) - int(Path("/sys/fs/cgroup/memory.current").read_text())
            )
    except (AttributeError, OSError, ValueError, StopIteration):
        pass
    return max(free, 2**28)


# Clusters: a Dask client in the place of workers, on many machines.

_PATIENCE = 8.0  # [C] s to find a scheduler, and to be without workers
_CLUSTER_GLANCE = 1.0  # [C] s between two looks at whether there are workers
_WAITING = "Start one, for which this waits, or press Ctrl-C twice."
_GRACE = 2.0  # [C] s that a cluster's end may take; what then still runs is killed


class ClusterExecutor:
    """A Dask client as an executor; workers may come and go while it runs.

    Tasks that a lost worker held are run again by Dask. A task that is lost with its worker again
    and again (Dask's ``distributed.scheduler.allowed-failures``) counts as one that crashes its
    worker.
    """

    def __init__(self, client: Any) -> None:
        self.client = client
        self._flying: dict[str, Any] = {}
        self._watch: threading.Thread | None = None

    @property
    def workers(self) -> int:
        """Threads of all workers that are there now."""
        return max(1, sum(int(n) for n in self.client.nthreads().values()))

    def submit(self, function: Callable, /, *args: Any) -> Future:
        """Queue ``function(*args)`` at the scheduler; both must be picklable."""
        try:
            task = self.client.submit(
                function, *args, pure=False
            )  # the same touch may be asked for again after a crash
        except Exception as error:
            raise StoreError(
                f"the cluster takes no more tasks ({str(error)[:150]}). {_SAFE}"
            ) from error
        answer: Future = Future()
        answer.set_running_or_notify_cancel()
        self._flying[task.key] = task
        if self._watch is None or not self._watch.is_alive():
            self._watch = threading.Thread(target=self._look_for_workers, daemon=True)
            self._watch.start()
        task.add_done_callback(lambda done: self._pass_on(done, answer))
        return answer

    def _look_for_workers(self) -> None:
        """Say so once where tasks wait and no worker has been there for a while; one may come."""
        seen, told = time.monotonic(), False
        while self._flying and not told:
            time.sleep(_CLUSTER_GLANCE)
            with suppress(Exception):  # the client is being closed
                seen = time.monotonic() if self.client.nthreads() else seen
            if told := time.monotonic() - seen > _PATIENCE:
                warnings.warn(
                    f"the cluster has no workers. {_WAITING} {_SAFE}", ModelValidityWarning, 2
                )

    def _pass_on(self, task: Any, answer: Future) -> None:
        mine = self._flying.pop(task.key, None) is not None
        try:
            answer.set_result(task.result())
        except Exception as error:
            answer.set_exception(_explain(error) if mine else CancelledError())
        except BaseException:  # Dask's CancelledError is none of Python's exceptions
            answer.set_exception(
                StoreError(f"the scheduler has gone. {_SAFE}") if mine else CancelledError()
            )

    def kill(self) -> None:
        """Call back all tasks."""
        flying, self._flying = self._flying, {}
        self.client.cancel(list(flying.values()), force=True)

    def describe(self) -> str:
        """One line for a person."""
        return f"a cluster of {len(self.client.nthreads())} workers with {self.workers} threads"


_SAFE = "What is finished is in the store, and the same command goes on from there."


def _explain(error: Exception) -> Exception:
    if type(error).__name__ == "KilledWorker":
        return WorkerCrashed(
            "a task was lost with every worker that took it; has one of them too little memory?"
        )
    if type(error).__name__ == "FutureCancelledError":
        return StoreError(f"the scheduler has gone, or has dropped a task. {_SAFE}")
    if isinstance(error, ImportError):
        return StoreError(
            f"a worker cannot load this feeler ({error}). Install the same version wherever workers"
            " run."
        )
    return error


@checked
@contextmanager
def open_cluster(address: str) -> Iterator[Any]:
    """A Dask client by where its scheduler is, ``tcp://…`` or a JSON file; closed at the end.

    Raises
    ------
    MissingDependencyError
        Dask is not installed.
    InvalidInput
        No scheduler answers, or no such address.
    """
    require_extra("distributed", "cluster", "a cluster")
    from distributed import Client

    where = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        client = Client(**where, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InvalidInput(
            f"no scheduler answers at {address!r} ({str(error)[:100]}). Start one with `dask"
            " scheduler`; on this machine alone use --processes."
        ) from error
    try:
        yield client
    finally:  # in a thread that is waited for no longer than this: it may hang
        thread = threading.Thread(target=client.close, daemon=True)
        thread.start()
        thread.join(_GRACE)


def hush() -> None:
    """From now on Dask's log is silent: what matters of it is said in a sentence."""
    if find_spec("distributed") is not None:
        import_module("distributed")  # which sets its log up
    for name in [*logging.root.manager.loggerDict]:
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
