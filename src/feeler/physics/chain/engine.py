"""Running scenes on the chain engine, one at a time or many in SIMD lanes."""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from threading import Event

import numpy as np

from feeler.errors import InvalidInput
from feeler.execute.threads import ThreadExecutor
from feeler.physics.chain.batch import LANES, Batch
from feeler.physics.chain.model import make_model
from feeler.physics.clock import Clock
from feeler.physics.scene import Motion, Scene

SCHEMES = ("parity", "consistent")


def run(scene: Scene, clock: Clock, *, scheme: str = "parity") -> Motion:
    """Simulate one scene.

    Returns
    -------
    Motion
        Angles, velocities and the contact force on the antenna at each sample: MuJoCo's answer for the same scene and
        timestep, to rounding.

    Raises
    ------
    SimulationDiverged
        Angles left the finite numbers; names the scene and the time.
    InvalidInput
        The timestep is too large for the contact's time constant.
    """
    result = _run_lanes([scene], clock, _check_scheme(scheme))[0]
    if isinstance(result, Exception):
        raise result
    return result


def run_batch(
    scenes: Sequence[Scene], clock: Clock, *, workers: int = 1, scheme: str = "parity"
) -> list[Motion | Exception]:
    """Simulate many scenes, eight at a time in SIMD lanes, in the order given.

    Every result has the same bits as ``run`` of that scene alone, whatever its neighbours and ``workers`` (threads).
    A scene that diverges gives its SimulationDiverged in place of a Motion; the others go on.

    Raises
    ------
    InvalidInput
        ``workers`` below 1, or a timestep too large for a scene's contact.
    """
    if workers < 1:
        raise InvalidInput(f"workers must be at least 1, got {workers}. Use the number of cores.")
    damped = _check_scheme(scheme)
    groups = make_groups(scenes)
    results: list[Motion | Exception | None] = [None] * len(scenes)
    jobs = [partial(_run_lanes, [scenes[i] for i in group], clock, damped) for group in groups]
    done = (job() for job in jobs) if workers == 1 else _run_threads(jobs, workers)
    for group, outcomes in zip(groups, done, strict=True):
        for i, outcome in zip(group, outcomes, strict=True):
            results[i] = outcome
    return results


def _run_threads(jobs: list[Callable[..., list]], workers: int) -> Iterator[list]:
    """Results in order; an interrupt stops the threads at their next sample."""
    stop = Event()
    with ThreadExecutor(workers) as pool:
        try:
            yield from pool.map(lambda job: job(stop), jobs)
        finally:
            stop.set()


def make_groups(scenes: Sequence[Scene]) -> list[list[int]]:
    """Indices of scenes that share lanes: equal segment counts, and neighbours in when and how fast they touch."""
    order = sorted(range(len(scenes)), key=lambda i: (scenes[i].antenna.n_segments, *_phase(scenes[i]), i))
    groups: list[list[int]] = []
    for i in order:
        group = groups[-1] if groups else []
        same = group and scenes[group[0]].antenna.n_segments == scenes[i].antenna.n_segments
        if same and len(group) < LANES:
            group.append(i)
        else:
            groups.append([i])
    return groups


def _check_scheme(scheme: str) -> bool:
    """Whether contact is solved with the implicit damping in it."""
    if scheme not in SCHEMES:
        raise InvalidInput(f"unknown scheme {scheme!r}; valid: {', '.join(SCHEMES)}.")
    return scheme == "consistent"


def _phase(scene: Scene) -> tuple[float, float]:
    """Speed of the object, and how far it starts from the antenna's base: what decides when contact begins and ends."""
    if scene.feature is None:
        return 0.0, 0.0
    return float(np.hypot(*scene.path.velocity[0])), float(np.hypot(*scene.origin))


def _run_lanes(scenes: list[Scene], clock: Clock, damped: bool, stop: Event | None = None) -> list[Motion | Exception]:
    """Up to LANES scenes together; a group that is neither one nor full is filled up with copies of its last."""
    lanes = 1 if len(scenes) == 1 else LANES
    filled = [*scenes, *[scenes[-1]] * (lanes - len(scenes))]
    models = [make_model(scene, clock.timestep) for scene in filled]
    return Batch(filled, models, clock, damped).run(stop)[: len(scenes)]
