"""Ctrl-C during a batch: once to finish what is running, twice to stop at once."""

import signal
import sys
import threading
from collections.abc import Callable
from types import FrameType


class Interrupt:
    """While active, the first SIGINT sets ``asked`` and calls ``on_first``; the second calls ``on_second`` and raises
    KeyboardInterrupt.

    Outside the main thread, where Python delivers no signals, it does nothing.
    """

    def __init__(self, on_first: Callable[[], None], on_second: Callable[[], None]) -> None:
        self.asked = False
        self._on_first, self._on_second = on_first, on_second
        self._before = None

    def __enter__(self) -> "Interrupt":
        if threading.current_thread() is threading.main_thread():
            self._before = signal.signal(signal.SIGINT, self._handle)
        return self

    def __exit__(self, *_: object) -> None:
        if self._before is not None:
            signal.signal(signal.SIGINT, self._before)

    def _handle(self, _number: int, _frame: FrameType | None) -> None:
        if self.asked:
            self._on_second()
            raise KeyboardInterrupt
        self.asked = True
        self._on_first()
        print("\nstopping after the trials that are running; press Ctrl-C again to stop at once", file=sys.stderr)
