"""A batch: one function over many items, results as they come, crashes retried, Ctrl-C
understood.
"""

import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import CancelledError, Future
from dataclasses import dataclass
from queue import Empty, SimpleQueue
from types import FrameType
from typing import Any, Protocol

from feeler.errors import InvalidInput, OutOfMemory
from feeler.execute.workers import CRASHES, ThreadExecutor
from feeler.validation import checked

_RETRIES = 1  # [C] a crash that repeats itself is the item's fault, not the machine's
_WINDOW = (
    2  # [C] items in flight per worker: enough to keep it busy, few enough to bound memory
)
_GRACE = 2.0  # [C] s that a trial has to end after Ctrl-C: a person should not wait longer
_UNKNOWN_WORKERS = 64  # [C] for executors that do not say how many workers they have


class Executor(Protocol):
    """What a batch needs: ``concurrent.futures`` executors and a Dask ``Client`` both fit.

    Futures need ``result()`` and ``add_done_callback(function)``. Optional: ``workers`` (how many),
    ``kill()``.
    """

    def submit(self, function: Callable, /, *args: Any) -> Any:
        """Start ``function(*args)`` somewhere and return its future."""
        ...


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """One finished item: its number, and either its value or the error that ended it."""

    index: int
    value: Any = None
    error: Exception | None = None


@checked
def run_batch(
    function: Callable[[Any], Any],
    items: Iterable[tuple[int, Any]],
    *,
    executor: Executor | None = None,
    retries: int = _RETRIES,
    window: int | None = None,
) -> Iterator[Outcome]:
    """Outcomes of ``function(item)`` for numbered items, in the order in which they finish.

    A crashed worker or a lack of memory costs its item one of ``retries``; every other error is the
    item's outcome and the batch goes on. At most ``window`` items are in flight (default two per
    worker), so results cannot pile up. The first Ctrl-C hands out nothing more, waits 2 s at most
    for what is running and then raises KeyboardInterrupt; the second stops at once.

    Parameters
    ----------
    executor
        Default: one thread per core, for engines that release the interpreter's lock.

    Raises
    ------
    InvalidInput
        ``retries`` < 0 or ``window`` < 1.
    KeyboardInterrupt
        After Ctrl-C.
    """
    if retries < 0 or (window is not None and window < 1):
        raise InvalidInput(f"retries must be ≥ 0 and window ≥ 1, got {retries} and {window}.")
    own = ThreadExecutor() if executor is None else None
    chosen: Any = executor or own
    batch = _Batch(function, chosen, retries)
    try:
        with _Interrupt(on_first=batch.call_back, on_second=batch.stop) as interrupt:
            yield from batch.run(iter(items), window, interrupt)
            if interrupt.asked:
                raise KeyboardInterrupt
    finally:
        batch.cancel()
        if own is not None:
            own.kill()


def _window(executor: Any) -> int:
    workers = getattr(executor, "workers", None) or getattr(executor, "_max_workers", None)
    return _WINDOW * (workers if isinstance(workers, int) and workers > 0 else _UNKNOWN_WORKERS)


def _name_memory(error: Exception) -> Exception:
    """The error, as feeler's own where Python or NumPy ran out of memory."""
    if isinstance(error, MemoryError) and not isinstance(error, OutOfMemory):
        return OutOfMemory(
            f"not enough memory ({error or 'no more to be had'}); use fewer workers or shorter"
            " trials."
        )
    return error


class _Batch:
    def __init__(self, function: Callable, executor: Executor, retries: int) -> None:
        self.function, self.executor, self.retries = function, executor, retries
        self.done: SimpleQueue = SimpleQueue()
        self.flying: dict[int, tuple[Any, Any, int]] = {}

    def run(
        self, items: Iterator[tuple[int, Any]], window: int | None, interrupt: "_Interrupt"
    ) -> Iterator[Outcome]:
        more = True
        while more or self.flying:
            room = window or _window(
                self.executor
            )  # each time: a cluster's workers come and go
            while more and not interrupt.asked and len(self.flying) < room:
                following = next(items, None)
                more = following is not None
                if following is not None:
                    self._submit(*following, 0)
            more = more and not interrupt.asked
            if self.flying:
                # The number of the next finished item and its future; after Ctrl-C, for a
                # while only.
                finished = None
                while finished is None:
                    try:
                        finished = self.done.get(timeout=interrupt.find_left())
                    except Empty:
                        self.stop()
                        raise KeyboardInterrupt from None
                outcome = self._settle(*finished)
                if outcome is not None:
                    yield outcome

    def _submit(self, index: int, item: Any, failures: int) -> None:
        future = self.executor.submit(self.function, item)
        self.flying[index] = (future, item, failures)
        future.add_done_callback(lambda finished: self.done.put((index, finished)))

    def _settle(self, index: int, future: Any) -> Outcome | None:
        """The outcome of a finished future, or None where its item was sent out again."""
        _, item, failures = self.flying.pop(index)
        try:
            return Outcome(index=index, value=future.result())
        except CancelledError:  # after Ctrl-C: it never began
            return None
        except CRASHES as error:
            if failures >= self.retries:
                return Outcome(index=index, error=_name_memory(error))
        except Exception as error:
            return Outcome(index=index, error=error)
        self._submit(index, item, failures + 1)
        return None

    def cancel(self) -> None:
        """Call back what has not started."""
        for future, _, _ in list(self.flying.values()):
            if isinstance(future, Future):  # a Dask future would also stop what is running
                future.cancel()

    def call_back(self) -> None:
        """Call back what has not started, and let the batch see that it was asked to end."""
        self.cancel()
        self.done.put(None)

    def stop(self) -> None:
        """End workers at once, where the executor can."""
        self.cancel()
        if hasattr(self.executor, "kill"):
            self.executor.kill()


class _Interrupt:
    """While active, the first SIGINT sets ``asked`` and calls ``on_first``; the second calls
    ``on_second`` and raises KeyboardInterrupt.

    Outside the main thread, where Python delivers no signals, it does nothing.
    """

    def __init__(self, on_first: Callable[[], None], on_second: Callable[[], None]) -> None:
        self.asked = False
        self._end = 0.0
        self._on_first, self._on_second = on_first, on_second
        self._before: Any = None

    def __enter__(self) -> "_Interrupt":
        if threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def find_left(self) -> float | None:
        """How long [s] a running item may still take; None: as long as it likes."""
        return max(0.0, self._end - time.monotonic()) if self.asked else None

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        if self.asked:
            self._on_second()
            raise KeyboardInterrupt
        self._end = time.monotonic() + _GRACE
        self.asked = True
        self._on_first()
        print(
            "\nstopping after the trials that are running, which have"
            f" {_GRACE:g} s; press Ctrl-C again to stop at once",
            file=sys.stderr,
        )


@checked
def run_groups(
    function: Callable[[Any], Any],
    groups: Sequence[Sequence[int]],
    pick: Callable[[Sequence[int]], Any],
    *,
    executor: Executor | None = None,
) -> Iterator[tuple[Sequence[int], Any]]:
    """(group, ``function(pick(group))`` or the error that ended it), as groups finish.

    ``pick`` is called when a group is handed out, so that what it makes does not pile up. Items of
    a group that crashes its worker twice are run again one by one, so that only the guilty one is
    lost.
    """
    while groups:
        items = ((number, pick(group)) for number, group in enumerate(groups))
        alone: list[Sequence[int]] = []
        for done in run_batch(function, items, executor=executor):
            group = groups[done.index]
            if isinstance(done.error, CRASHES) and len(group) > 1:
                alone += [[index] for index in group]
            else:
                yield group, done.value if done.error is None else done.error
        groups = alone
