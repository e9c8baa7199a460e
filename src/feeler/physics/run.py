"""From the beginning to the end: scenes stepped to a clock and sampled, one group or many at
once.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from threading import Event
from typing import Any

import numpy as np

from feeler.errors import SimulationDiverged
from feeler.execute import Executor, ThreadExecutor, run_groups
from feeler.physics.clock import Clock
from feeler.physics.engine import DEFAULT_ENGINE, Engine, get_engine
from feeler.physics.scene import Motion, Scene
from feeler.physics.stepper import Stepper, make_row, split_rows
from feeler.stimulus.base import Vector

Result = Motion | Exception
_CHUNK = (
    400_000  # segment·lane steps between looks for Ctrl-C: some 5 ms, or 50 in deep contact
)


def run_scene(scene: Scene, clock: Clock, engine: str = DEFAULT_ENGINE) -> Motion:
    """The motion of one scene.

    Raises
    ------
    SimulationDiverged
        Angles left the finite numbers.
    """
    result = run_group([scene], clock, engine)[0]
    if isinstance(result, Exception):
        raise result
    return result


def run_group(
    scenes: Sequence[Scene],
    clock: Clock,
    engine: str = DEFAULT_ENGINE,
    stop: Event | None = None,
) -> list[Result]:
    """One Motion per scene of a group from :func:`make_groups`, or the error that ended it; the
    others go on.

    A group that is neither one nor full is filled up with copies of its last, so that only two
    numbers of lanes are ever compiled. Setting ``stop`` from another thread raises
    KeyboardInterrupt within a chunk.
    """
    kind = get_engine(engine)
    lanes = 1 if len(scenes) == 1 else kind.lanes
    filled = [*scenes, *[scenes[-1]] * (lanes - len(scenes))]
    return _record(kind.make(filled, clock.timestep), clock, stop or Event())[: len(scenes)]


def make_groups(scenes: Sequence[Scene], engine: Engine, times: int = 1) -> list[list[int]]:
    """Indices of scenes that share lanes: equal segment counts, and neighbours in when and how fast
    they touch; antennae in the plane and in space do not mix.

    A group holds at most ``times`` as many as there are lanes.
    """
    shapes = [scene.antenna.rest_angle.shape[::-1] for scene in scenes]
    order = sorted(range(len(scenes)), key=lambda i: (shapes[i], *_phase(scenes[i]), i))
    groups: list[list[int]] = []
    for i in order:
        group = groups[-1] if groups else []
        same = group and shapes[group[0]] == shapes[i]
        if same and len(group) < times * engine.lanes:
            group.append(i)
        else:
            groups.append([i])
    return groups


def _phase(scene: Scene) -> tuple[float, float]:
    """Speed of the first object, and how far it starts from the base: what decides when contact
    begins and ends.
    """
    if not scene.objects:
        return 0.0, 0.0
    item = scene.objects[0]
    return float(np.hypot.reduce(item.velocity)), float(np.hypot.reduce(item.place))


def advance(stepper: Stepper, now: list[int], n_steps: int, stop: Event) -> bool:
    """Take steps, lane i from its own step number ``now[i]`` on, which is counted up, with looks at
    ``stop`` in between; whether some lane has come to an end.

    Each path's next leg begins where the one before ends, and bases with a recorded path follow it.
    """
    scenes, left, ended = stepper.scenes, n_steps, False
    chunk = count_chunk(scenes)
    driven = [lane for lane, scene in enumerate(scenes) if scene.follows]
    legs = [
        (lane, list(_list_legs(scene, stepper.timestep)))
        for lane, scene in enumerate(scenes)
        if scene.paths
    ]
    while left:
        count = min(left, chunk)
        for lane, turns in legs:
            for at, o, velocity in turns:
                if at == now[lane]:
                    stepper.move_object(lane, o, velocity, 0.0)
                elif at > now[lane]:
                    count = min(count, at - now[lane])
        drives = {
            lane: scenes[lane].compute_drive(now[lane], count, stepper.timestep)
            for lane in driven
        }
        ended = advance_freely(stepper, now, count, stop, drives)
        left -= count
    return ended


def count_chunk(scenes: Sequence[Scene]) -> int:
    """Steps between looks for Ctrl-C."""
    return max(1, _CHUNK // (scenes[0].antenna.n_segments * len(scenes)))


def advance_freely(
    stepper: Stepper,
    now: list[int],
    n_steps: int,
    stop: Event,
    drives: Mapping[int, np.ndarray] | None = None,
) -> bool:
    """Take few steps, in which no object turns and no base follows a path but by ``drives``; as
    :func:`advance`.
    """
    if stop.is_set():
        raise KeyboardInterrupt
    ended = stepper.step(n_steps, drives)
    for lane, before in enumerate(now):
        now[lane] = before + n_steps
    return ended


def _list_legs(scene: Scene, timestep: float) -> Iterator[tuple[int, int, Vector]]:
    """(step, object, velocity) at which each object's velocity changes."""
    for o, path in enumerate(scene.paths):
        if path is not None:
            for start, velocity in zip((0.0, *path.end), path.velocity, strict=True):
                yield round(start / timestep), o, velocity


def _record(stepper: Stepper, clock: Clock, stop: Event) -> list[Result]:
    first = make_row(stepper.read())
    tape = np.empty((len(first), clock.n_samples, first.shape[1]))
    tape[:, 0] = first
    failed: list[Exception | None] = [None] * len(first)
    antenna, k, turns = stepper.scenes[0].antenna, 1, list_turns(stepper)
    shape, n = antenna.rest_angle.shape, antenna.rest_angle.size
    while k < clock.n_samples and not all(failed):
        k, ended = record_some(stepper, tape, k, clock.steps_per_sample, turns, stop)
        for lane in np.flatnonzero(stepper.find_broken() if ended else ()):
            before = tape[lane, max(k - 2, 0)].copy()
            failed[lane] = failed[lane] or explain_end(
                stepper,
                int(lane),
                clock.time[k - 1],
                before[:n].reshape(shape),
                before[n : 2 * n].reshape(shape),
            )
    pairs = zip(failed, tape, strict=True)
    return [error or make_motion(clock, rows, shape) for error, rows in pairs]


def make_motion(
    clock: Clock, rows: np.ndarray, hinges: tuple[int, ...], error: float = float("nan")
) -> Motion:
    """The motion that rows (sample, column) of a tape hold; ``hinges`` is the shape of angles."""
    kept: dict[str, Any] = split_rows(rows, hinges)
    return Motion(time=clock.time, timestep=clock.timestep, error=error, **kept)


def record_some(
    stepper: Stepper,
    tape: np.ndarray,
    sample: int,
    every: int,
    turns: Sequence[int],
    stop: Event,
) -> tuple[int, bool]:
    """Samples from number ``sample`` on, up to the next look for Ctrl-C or turn of an object; as
    ``Stepper.record``.
    """
    if stop.is_set():
        raise KeyboardInterrupt
    scenes, start = stepper.scenes, (sample - 1) * every
    block = _CHUNK // (scenes[0].antenna.n_segments * len(scenes) * every)
    turn = next((at for at in turns if at >= start), np.inf)
    until = int(min(tape.shape[1], sample + block, turn // every + 1))
    if until == sample:  # a turn within this sample, or a sample too long to wait for
        ended = advance(stepper, [start] * len(scenes), every, stop)
        tape[:, sample] = make_row(stepper.read())
        return sample + 1, ended
    count = (until - sample) * every
    drives = {
        k: s.compute_drive(start, count, stepper.timestep)
        for k, s in enumerate(scenes)
        if s.follows
    }
    return stepper.record(tape, sample, until, every, drives)


def list_turns(stepper: Stepper) -> list[int]:
    """The steps, rising, at which the velocity of some object changes."""
    return sorted(
        {at for scene in stepper.scenes for at, _, _ in _list_legs(scene, stepper.timestep)}
    )


def explain_end(
    stepper: Stepper,
    lane: int,
    time: float,
    angle: np.ndarray | None = None,
    velocity: np.ndarray | None = None,
) -> Exception:
    """The error of a lane that has come to an end, with its last finite state where there is
    one.
    """
    return stepper.explain(lane) or SimulationDiverged(
        stepper.scenes[lane].label, time, angle, velocity, stepper.advice
    )


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
    run = partial(run_group, clock=clock, engine=engine)
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
