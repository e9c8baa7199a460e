"""Many scenes at once, on all cores, in any order, with the same numbers as one by one."""

import os
import threading
from collections.abc import Callable, Iterable
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait

from feeler.errors import InvalidInput
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, Outcome, get_engine
from feeler.physics.scene import Scene


def count_workers(workers: int | None) -> int:
    """Number of workers: as asked, or one per core this process may use."""
    if workers is None:
        return len(os.sched_getaffinity(0))
    if not (isinstance(workers, int) and workers >= 1):
        raise InvalidInput(f"workers must be a whole number ≥ 1 or None (one per core), got {workers!r}.")
    return workers


def simulate(
    scenes: Iterable[Scene],
    clock: Clock,
    *,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    finished: Callable[[int, Outcome], None] = lambda index, outcome: None,
) -> list[Outcome]:
    """Motions in the order of ``scenes``; a scene that diverged gives its SimulationDiverged instead.

    Both engines release Python's lock while they step, so workers are threads. ``finished`` is called in the caller's
    thread as each scene ends. On Ctrl-C no new scene starts and what ``finished`` was told stays told.
    """
    scenes, run = list(scenes), get_engine(engine)
    outcomes: list[Outcome | None] = [None] * len(scenes)
    stop = threading.Event()

    def task(index: int) -> tuple[int, Outcome | None]:
        return index, None if stop.is_set() else run([scenes[index]], clock)[0]

    with ThreadPoolExecutor(count_workers(workers)) as pool:
        pending = {pool.submit(task, index) for index in range(len(scenes))}
        try:
            while pending:
                done, pending = wait(pending, return_when=FIRST_COMPLETED)
                for future in done:
                    index, outcomes[index] = future.result()
                    finished(index, outcomes[index])
        except BaseException:
            stop.set()
            pool.shutdown(wait=False, cancel_futures=True)
            raise
    return outcomes
