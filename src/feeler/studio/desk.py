"""A desk: work of several kinds at once, and of each kind only what was wished for last."""

from collections.abc import Callable
from threading import Event, Lock, Thread, current_thread

_Work = Callable[[Event], None]


class Desk:
    """One thread per kind of work at most; new work of a kind stops the older, begins when it has
    ended, and takes the place of what has not begun.
    """

    def __init__(self) -> None:
        self._lock = Lock()
        self._now: dict[str, tuple[Event, Thread]] = {}
        self._next: dict[str, _Work] = {}

    def give(self, kind: str, work: _Work) -> None:
        """Run ``work(stop)`` in its thread; it should end within milliseconds of ``stop``."""
        with self._lock:
            if kind in self._now:
                self._next[kind] = work
                self._now[kind][0].set()
                return
            thread = Thread(
                target=self._run, args=(kind, work), daemon=True, name=f"feeler studio {kind}"
            )
            self._now[kind] = (Event(), thread)
            thread.start()

    def _run(self, kind: str, work: _Work | None) -> None:
        try:
            while work is not None:
                stop = self._now[kind][0]
                if not stop.is_set():
                    work(stop)
                with self._lock:
                    work = self._next.pop(kind, None)
                    if work is not None:
                        self._now[kind] = (Event(), current_thread())
                    else:
                        del self._now[kind]
        except BaseException:
            with self._lock:
                self._now.pop(kind, None)
            raise

    def stop(self, kind: str) -> None:
        """End the work of one kind."""
        with self._lock:
            self._next.pop(kind, None)
            if kind in self._now:
                self._now[kind][0].set()

    def clear(self, wait: float = 0.0) -> None:
        """End all work, and wait for it up to so many seconds."""
        with self._lock:
            running = list(self._now.values())
            self._next.clear()
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
            return bool(self._now)
