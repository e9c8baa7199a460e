"""Clusters: a Dask client in the place of workers, on this machine or on many."""

import logging
import multiprocessing
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from contextlib import contextmanager, suppress
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import resource_tracker
from typing import Any

from feeler.errors import InvalidInput, ModelValidityWarning, StoreError, require_extra
from feeler.execute.processes import OPENINGS, WorkerCrashed, _uninterrupted
from feeler.validation import checked

_PATIENCE = 8.0  # [C] s to find a scheduler, and to be without workers
_GLANCE = 1.0  # [C] s between two looks at whether there are workers
_WAITING = "Start one, for which this waits, or press Ctrl-C twice."
_ENVIRONMENT = "distributed.nanny.pre-spawn-environ"
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
            time.sleep(_GLANCE)
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
    """A Dask client by where its scheduler is: ``tcp://…``, a scheduler's JSON file, or ``local:4``
    for four processes here; closed at the end, and the processes with it.

    Raises
    ------
    MissingDependencyError
        Dask is not installed.
    InvalidInput
        No scheduler answers, or no such address.
    StoreError
        Processes here end as they begin.
    """
    require_extra("distributed", "cluster", "a cluster")
    from distributed import Client

    kind, _, number = address.partition(":")
    if kind == "local":
        if not number.isdecimal() or not 1 <= int(number) <= 1024:
            raise InvalidInput(
                f"cluster local:N starts N processes, 1 to 1024; got {address!r}."
            )
        cluster = _start_here(int(number))
        try:
            client = Client(cluster, set_as_default=False)
            with _closing_soon(client, cluster):
                yield client
        finally:
            cluster.shutdown_on_close = False  # else Dask closes it again as Python ends
            for process in multiprocessing.active_children():
                if process.name.startswith("Dask"):
                    process.kill()
        return
    where = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        client = Client(**where, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise InvalidInput(
            f"no scheduler answers at {address!r} ({str(error)[:100]}). Start one with `dask"
            " scheduler`, or use local:4."
        ) from error
    with _closing_soon(client):
        yield client


def _start_here(n: int) -> Any:
    """A cluster of processes here; where one of them ends as it begins, all are begun anew."""
    import dask
    from distributed import LocalCluster

    # processes set their own log up, which would show what they meet while they are closed
    dask.config.set({f"{_ENVIRONMENT}.DASK_LOGGING__DISTRIBUTED": "critical"})
    # Python's tracker removes semaphores of processes that were ended, and need not tell of
    # it.
    sys.warnoptions.append("ignore:resource_tracker:UserWarning")
    resource_tracker.ensure_running()
    sys.warnoptions.pop()
    for left in reversed(range(OPENINGS)):
        try:
            with _uninterrupted():  # Ctrl-C is this process's business
                return LocalCluster(
                    n_workers=n, threads_per_worker=1, processes=True, dashboard_address=None
                )
        except (RuntimeError, OSError) as error:
            if left == 0:
                raise StoreError(
                    f"{OPENINGS} times a process of local:{n} ended as it began. The system may"
                    " have run out of memory: use fewer. What is finished is in the store."
                ) from error
    raise AssertionError("unreachable")


@contextmanager
def _closing_soon(*closed: Any) -> Iterator[None]:
    """Close these at the end, in a thread that nobody waits for longer than ``_GRACE``."""
    try:
        yield
    finally:
        thread = threading.Thread(target=lambda: [one.close() for one in closed], daemon=True)
        thread.start()
        thread.join(_GRACE)


def hush() -> None:
    """From now on Dask's log is silent: what matters of it is said in a sentence."""
    if find_spec("distributed") is not None:
        import_module("distributed")  # which sets its log up
    for name in [*logging.root.manager.loggerDict]:
        if name.partition(".")[0] in ("distributed", "tornado", "asyncio"):
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
