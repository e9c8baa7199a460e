"""A desk: work of several kinds at once, and of each kind only what was wished for last."""

from collections.abc import Callable
from threading import Event, Lock, Thread, current_thread

Work = Callable[[Event], None]


class Desk:
    """One thread per kind of work; new work of a kind stops the older, and begins when it has
    ended.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._now: dict[str, tuple[Event, Thread]] = {}

    def give(self, kind: str, work: Work) -> None:
        """Run ``work(stop)`` in its thread; it should end within milliseconds of ``stop``."""
        stop = Event()
        with self._lock:
            before = self._now.get(kind)
            if before is not None:
                before[0].set()
            thread = Thread(
                target=_run, args=(work, stop, before), daemon=True, name=f"feeler studio {kind}"
            )
            self._now[kind] = (stop, thread)
            thread.start()

    def stop(self, kind: str) -> None:
        """End the work of one kind."""
        with self._lock:
            if kind in self._now:
                self._now[kind][0].set()

    def clear(self, wait: float = 0.0) -> None:
        """End all work, and wait for it up to so many seconds."""
        with self._lock:
            running = list(self._now.values())
            for stop, _ in running:
                stop.set()
        for _, thread in running:
            if (
                thread is not current_thread()
            ):  # who finds that its page is gone clears the desk from within
                thread.join(wait)

    @property
    def busy(self) -> bool:
        """Whether anything still runs."""
        with self._lock:
            return any(thread.is_alive() for _, thread in self._now.values())


def _run(work: Work, stop: Event, before: tuple[Event, Thread] | None) -> None:
    if before is not None:
        before[1].join()
    if not stop.is_set():
        work(stop)
