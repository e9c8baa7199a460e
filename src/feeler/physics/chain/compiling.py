"""A word to whoever waits for the compiler."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer

PATIENCE = 1.5  # s; loading compiled code from the cache is faster


_known: set[int] = set()


@contextmanager
def announce_compiling(lanes: int) -> Iterator[None]:
    """Around the first call for a number of lanes: log that it compiles, if it does and takes longer than PATIENCE."""
    message = "compiling the chain engine for this machine; it happens once and takes about 15 s"
    timer = Timer(PATIENCE, lambda: logging.getLogger("feeler").warning(message))
    timer.daemon = True
    if lanes not in _known:
        timer.start()
    try:
        yield
        _known.add(lanes)
    finally:
        timer.cancel()
