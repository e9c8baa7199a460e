"""What counts as surviving an input: only feeler's own errors, in time, in bounded memory, without
a RuntimeWarning.
"""

import resource
import signal
import time
import warnings
from collections import Counter
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

from feeler.errors import FeelerError

SECONDS = 10  # of processor time: a reader that takes longer over a few kilobytes hangs
# s until a reader that waits for something counts as hanging, however busy the machine is
PATIENCE = 600
MEMORY = 2**29  # bytes that reading may add to the process


@dataclass
class Log:
    """What came of the inputs so far."""

    ends: Counter = field(default_factory=Counter)
    slowest: float = 0.0
    """s of processor time."""

    def __str__(self) -> str:
        n = sum(self.ends.values())
        return (
            f"{n} inputs: {self.ends['read'] / max(n, 1):.1%} read, the others refused; slowest"
            f" {self.slowest:.3f} s"
        )


@contextmanager
def survives(data: object, log: Log, *, library: bool = False):
    """Only feeler's own errors may come out, and in time; use it inside ``watched``.

    A ``library`` may ask for memory in vain: the guard bounds what it gets.
    """

    def ring(*_):
        raise AssertionError(f"hangs over {data!r}")

    timers = {
        signal.ITIMER_PROF: (signal.SIGPROF, SECONDS),
        signal.ITIMER_REAL: (signal.SIGALRM, PATIENCE),
    }
    before = {number: signal.signal(number, ring) for number, _ in timers.values()}
    for timer, (_, seconds) in timers.items():
        signal.setitimer(timer, seconds)
    start, end = time.process_time(), "read"
    try:
        yield
    except FeelerError as error:
        end = "refused"
        assert str(error), "an error without words"
        assert library or "llocate" not in str(error), (
            f"memory was asked for before it was refused: {error}\nfrom {data!r}"
        )
    except Exception as error:
        raise AssertionError(
            f"{type(error).__name__}: {error}\nfrom the input {data!r}"
        ) from error
    finally:
        for timer in timers:
            signal.setitimer(timer, 0)
        for number, handler in before.items():
            signal.signal(number, handler)
    log.ends[end] += 1
    log.slowest = max(log.slowest, time.process_time() - start)


@contextmanager
def watched():
    """Inside, the process cannot take more than MEMORY beyond what it has, and a RuntimeWarning is
    an error.
    """
    soft, hard = resource.getrlimit(resource.RLIMIT_DATA)
    before = _status("VmData")
    resource.setrlimit(resource.RLIMIT_DATA, (before + MEMORY, hard))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", RuntimeWarning)
            yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, (soft, hard))


def _status(name: str) -> int:
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith(name + ":"))
