"""Many scenes at once, on all cores, in any order, with the same numbers as one by one."""

from collections.abc import Callable, Iterable
from functools import partial

from feeler.errors import InvalidInput
from feeler.execute import CRASHES, Executor, ThreadExecutor, run_batch
from feeler.physics.accuracy import run_accurately
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, get_engine
from feeler.physics.run import Result, make_groups, run_group
from feeler.physics.scene import Scene

Finished = Callable[[int, Result], None]


def simulate(
    scenes: Iterable[Scene],
    clock: Clock,
    *,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    executor: Executor | None = None,
    accuracy: float | None = None,
    keep: bool = True,
    finished: Finished = lambda index, result: None,
) -> list[Result | None]:
    """Motions in the order of ``scenes``; a scene that failed gives its error (mostly SimulationDiverged) instead.

    Engines release Python's lock while they step, so workers are threads unless an ``executor`` (processes, a Dask
    client) is handed in. ``finished`` is called in the caller's thread as scenes end; with ``keep=False`` the motions
    go only there, and None stands in the list. With ``accuracy`` each scene's timestep is chosen by it and not by the
    clock. On Ctrl-C no new scene starts and what ``finished`` was told stays told.
    """
    scenes = list(scenes)
    groups = make_groups(scenes, get_engine(engine))
    results: list[Result | None] = [None] * len(scenes)
    own = _make_threads(workers) if executor is None else None
    try:
        while groups:
            items = ((number, [scenes[i] for i in group]) for number, group in enumerate(groups))
            alone = []  # scenes of groups that crashed: run again one by one, so that only the guilty one is lost
            for done in run_batch(partial(_run_group, engine, clock, accuracy), items, executor=executor or own):
                group = groups[done.index]
                if isinstance(done.error, CRASHES) and len(group) > 1:
                    alone += [[index] for index in group]
                    continue
                values = done.value if done.error is None else [done.error] * len(group)
                for index, result in zip(group, values, strict=True):
                    results[index] = result if keep or isinstance(result, Exception) else None
                    finished(index, result)
            groups = alone
    finally:
        if own is not None:
            own.kill()
    return results


def _run_group(engine: str, clock: Clock, accuracy: float | None, scenes: list[Scene]) -> list[Result]:
    if accuracy is None:
        return run_group(scenes, clock, engine)
    return run_accurately(scenes, clock.duration, clock.sample_interval, engine, accuracy)


def _make_threads(workers: int | None) -> ThreadExecutor:
    if workers is not None and not (isinstance(workers, int) and workers >= 1):
        raise InvalidInput(f"workers must be a whole number ≥ 1 or None (one per core), got {workers!r}.")
    return ThreadExecutor() if workers is None else ThreadExecutor(workers)
