"""A word to whoever waits for the compiler."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Timer

PATIENCE = 1.5  # s; loading compiled code from the cache is faster


@contextmanager
def announce_compiling(function: object) -> Iterator[None]:
    """Around a call of a numba function: log that it compiles, if it does and takes longer than PATIENCE."""
    known = len(function.signatures)
    message = "compiling the chain engine for this machine; it happens once and takes about 15 s"
    timer = Timer(PATIENCE, lambda: logging.getLogger("feeler").warning(message))
    timer.daemon = True
    if known == 0:
        timer.start()
    try:
        yield
    finally:
        timer.cancel()
