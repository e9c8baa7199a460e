"""A word to whoever waits for the compiler."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer

PATIENCE = 1.5  # s; loading compiled code from the cache is faster


_known: set[object] = set()


@contextmanager
def announce_compiling(engine: str, lanes: int = 1) -> Iterator[None]:
    """Around an engine's first call for a number of lanes: log that it compiles, if that takes
    longer than PATIENCE.
    """
    message = (
        f"compiling the {engine} engine for this machine; it happens once and takes about 15 s"
    )
    timer = Timer(PATIENCE, lambda: logging.getLogger("feeler").warning(message))
    timer.daemon = True
    if (engine, lanes) not in _known:
        timer.start()
    try:
        yield
        _known.add((engine, lanes))
    finally:
        timer.cancel()
