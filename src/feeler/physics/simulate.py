"""Many scenes at once, on all cores, in any order, with the same numbers as one by one."""

from collections.abc import Iterable, Sequence
from functools import partial

from feeler.execute import Executor, ThreadExecutor, run_groups
from feeler.physics.accuracy import run_accurately
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, get_engine
from feeler.physics.run import Result, make_groups, run_group
from feeler.physics.scene import Motion, Scene


def simulate(
    scenes: Iterable[Scene],
    clock: Clock,
    *,
    engine: str = DEFAULT_ENGINE,
    workers: int | None = None,
    executor: Executor | None = None,
) -> list[Result]:
    """Motions in the order of ``scenes``; a scene that failed gives its error (mostly
    SimulationDiverged) instead.

    Engines release Python's lock while they step, so workers are threads unless an ``executor``
    (processes, a Dask client) is handed in. On Ctrl-C no new scene starts.
    """
    scenes = list(scenes)
    groups = make_groups(scenes, get_engine(engine))
    results: list[Result] = [RuntimeError("never run")] * len(scenes)
    own = ThreadExecutor(workers) if executor is None else None
    run = partial(run_lanes, clock=clock, engine=engine)
    try:
        for group, found in run_groups(
            run, groups, lambda group: [scenes[i] for i in group], executor=executor or own
        ):
            values = [found] * len(group) if isinstance(found, Exception) else found
            for index, result in zip(group, values, strict=True):
                results[index] = result
    finally:
        if own is not None:
            own.kill()
    return results


def expect_motions(results: Sequence[Result | None]) -> list[Motion]:
    """All results as motions; the first that is an error is raised."""
    for result in results:
        if isinstance(result, Exception):
            raise result
    return [result for result in results if isinstance(result, Motion)]


def run_lanes(
    scenes: list[Scene], clock: Clock, engine: str, accuracy: float | None = None
) -> list[Result]:
    """Motions of scenes that fit the lanes of an engine; with ``accuracy`` each timestep is chosen
    by it, not the clock.
    """
    if accuracy is None:
        return run_group(scenes, clock, engine)
    return run_accurately(scenes, clock.duration, clock.sample_interval, engine, accuracy)
