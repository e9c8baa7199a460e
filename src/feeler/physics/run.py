"""Scenes stepped from beginning to end, to a clock or to an accuracy."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from threading import Event
from typing import Any

import numpy as np

from feeler.antenna.segments import Antenna
from feeler.errors import InvalidInput, SimulationDivergedError
from feeler.execute import Executor, ThreadExecutor, run_groups
from feeler.objects.bodies import Object
from feeler.objects.motion import Vector
from feeler.physics.contact import Contact
from feeler.physics.engine import (
    DEFAULT_ENGINE,
    ENGINES,
    Engine,
    Stepper,
    make_row,
    split_rows,
)
from feeler.physics.scene import Clock, Motion, Scene

# From the beginning to the end: scenes stepped to a clock and sampled, one group or many at
# once.

Result = Motion | Exception
_CHUNK = (
    400_000  # segment·lane steps between looks for Ctrl-C: some 5 ms, or 50 in deep contact
)


def run_scene(scene: Scene, clock: Clock, engine: str = DEFAULT_ENGINE) -> Motion:
    """The motion of one scene.

    Raises
    ------
    SimulationDivergedError
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
    kind = ENGINES[engine]
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
    antenna, k, turns = stepper.scenes[0].antenna, 1, _list_turns(stepper)
    shape, n = antenna.rest_angle.shape, antenna.rest_angle.size
    while k < clock.n_samples and not all(failed):
        k, ended = _record_some(stepper, tape, k, clock.steps_per_sample, turns, stop)
        for lane in np.flatnonzero(stepper.find_broken() if ended else ()):
            before = tape[lane, max(k - 2, 0)].copy()
            failed[lane] = failed[lane] or _explain_end(
                stepper,
                int(lane),
                clock.time[k - 1],
                before[:n].reshape(shape),
                before[n : 2 * n].reshape(shape),
            )
    pairs = zip(failed, tape, strict=True)
    return [error or _make_motion(clock, rows, shape) for error, rows in pairs]


def _make_motion(
    clock: Clock, rows: np.ndarray, hinges: tuple[int, ...], error: float = float("nan")
) -> Motion:
    """The motion that rows (sample, column) of a tape hold; ``hinges`` is the shape of angles."""
    kept: dict[str, Any] = split_rows(rows, hinges)
    return Motion(time=clock.time, timestep=clock.timestep, error=error, **kept)


def _record_some(
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


def _list_turns(stepper: Stepper) -> list[int]:
    """The steps, rising, at which the velocity of some object changes."""
    return sorted(
        {at for scene in stepper.scenes for at, _, _ in _list_legs(scene, stepper.timestep)}
    )


def _explain_end(
    stepper: Stepper,
    lane: int,
    time: float,
    angle: np.ndarray | None = None,
    velocity: np.ndarray | None = None,
) -> Exception:
    """The error of a lane that has come to an end, with its last finite state where there is
    one.
    """
    return stepper.explain(lane) or SimulationDivergedError(
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
    SimulationDivergedError) instead.

    Engines release Python's lock while they step, so workers are threads unless an ``executor``
    (processes, a Dask client) is handed in. On Ctrl-C no new scene starts.
    """
    scenes = list(scenes)
    groups = make_groups(scenes, ENGINES[engine])
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


# Small steps only where a run needs them: two runs side by side, one with half of the other's
# steps.

_WINDOW = 5  # [C] samples that are gone through with one timestep
_SHARES = (
    4,
    16,
)  # [C] the accuracy over these is how much further the runs may part in a window
# [C] steps are halved again while that brings what they part by below this share of itself
_HELPS = 0.8


_Track = tuple[np.ndarray, np.ndarray]


def track(antenna: Antenna, angle: np.ndarray) -> _Track:
    """What runs are compared by: angles (sample, segment) [rad] and the tip (sample, 2) [mm]."""
    return angle, antenna.tip(angle)


def _compute_gap(coarse: _Track, fine: _Track, peaks: np.ndarray) -> float:
    """Greatest difference of angles, or of the tips, over the :func:`_compute_peaks`."""
    gaps = [float(np.abs(b - a).max()) for a, b in zip(coarse, fine, strict=True)]
    return max(
        gap / float(size) if size > 0 else 0.0 for gap, size in zip(gaps, peaks, strict=True)
    )


def _compute_peaks(found: _Track) -> np.ndarray:
    """(2,): how far the angles go from the first sample [rad], and how far the tip does [mm]."""
    return np.array([np.abs(values - values[0]).max() for values in found])


def refine(
    scene: Scene,
    clock: Clock,
    engine: str,
    accuracy: float,
    peaks: np.ndarray,
    halvings: int,
) -> Motion | None:
    """The motion whose steps are small where they need to be, with what it errs by; None if it
    cannot be followed.

    Two runs go side by side from the beginning to the end, one with half of the other's steps. A
    window in which they part by more than its share of the ``accuracy`` is gone through again by
    both with half the steps, up to ``halvings`` times and as long as that helps: what does not,
    comes from before. Then all is done again with smaller shares. What the last two runs differ by
    at most, or the ones before from them, over the peaks, is the error; ``timestep`` is the
    smallest taken.
    """
    first, found = (
        _Pair(scene=scene, clock=clock, engine=engine, halvings=halvings).go(
            accuracy / share, peaks
        )
        for share in _SHARES
    )
    if first is None or found is None:
        return None
    before, after = (track(scene.antenna, motion.angle) for motion in (first, found))
    return replace(
        found, error=max(found.error, _compute_gap(before, after, _compute_peaks(after)))
    )


@dataclass
class _Pair:
    """Two runs of one scene, the first with ``clock``'s steps or smaller ones, the second with half
    of those.
    """

    scene: Scene
    clock: Clock
    engine: str
    halvings: int
    steppers: dict[int, Stepper] = field(default_factory=dict)

    def go(self, share: float, peaks: np.ndarray) -> Motion | None:
        first = self._get(0)
        row, ends = make_row(first.read()), [first.save(0)] * 2
        tapes = [np.repeat(row[:, None], self.clock.n_samples, axis=1) for _ in range(2)]
        level, finest, apart = 0, 0, 0.0
        for start in range(1, self.clock.n_samples, _WINDOW):
            stop = min(start + _WINDOW, self.clock.n_samples)
            level, ends, gap = self._pass(
                tapes, start, stop, max(level - 1, 0), ends, apart + share, peaks
            )
            if not np.isfinite(gap):
                return None
            finest, apart = max(finest, level), self._measure(tapes, stop - 1, stop, peaks)
        clock = Clock(
            duration=self.clock.duration,
            sample_interval=self.clock.sample_interval,
            timestep=self._halve(finest + 1),
        )
        own = _compute_peaks(self._track(tapes[1][0]))
        error = self._measure(tapes, 0, self.clock.n_samples, own)
        return _make_motion(clock, tapes[1][0], self.scene.antenna.rest_angle.shape, error)

    def _track(self, rows: np.ndarray) -> _Track:
        rest = self.scene.antenna.rest_angle
        return track(self.scene.antenna, rows[:, : rest.size].reshape(-1, *rest.shape))

    def _pass(
        self,
        tapes: list[np.ndarray],
        start: int,
        stop: int,
        level: int,
        begin: Sequence[Any],
        limit: float,
        peaks: np.ndarray,
    ) -> tuple[int, list[Any], float]:
        """The window's level, where both runs end, and how far apart they then were at most."""
        before = np.inf
        while True:
            ends = [
                self._step(tape, start, stop, level + k, begin[k])
                for k, tape in enumerate(tapes)
            ]
            gap = self._measure(tapes, start, stop, peaks) if None not in ends else np.inf
            if gap <= limit or level >= self.halvings or _HELPS * before < gap < np.inf:
                return level, ends, gap
            level, before = level + 1, gap

    def _step(self, tape: np.ndarray, start: int, stop: int, level: int, begin: Any) -> Any:
        stepper, k, ended = self._get(level), start, False
        stepper.load(0, begin)
        every = round(self.clock.sample_interval / stepper.timestep)
        while k < stop and not ended:
            k, ended = _record_some(
                stepper, tape[:, :stop], k, every, _list_turns(stepper), Event()
            )
        return None if ended else stepper.save(0)

    def _measure(
        self, tapes: list[np.ndarray], start: int, stop: int, peaks: np.ndarray
    ) -> float:
        coarse, fine = (self._track(tape[0, start:stop]) for tape in tapes)
        return _compute_gap(coarse, fine, peaks)

    def _get(self, level: int) -> Stepper:
        if level not in self.steppers:
            self.steppers[level] = ENGINES[self.engine].make([self.scene], self._halve(level))
        return self.steppers[level]

    def _halve(self, level: int) -> float:
        return self.clock.timestep / 2**level


# What a run errs by: estimated for every touch, and brought below what is asked for.
#
# The estimate is that of :func:`run_with_error`. Where an accuracy is asked for,
# :func:`run_accurately` halves the timestep until halving it once more would change no more
# than that.

HALVINGS = 6  # [C] from half the contact's time constant (0.1 ms) down to 1.6 µs
_NARROWINGS = 3  # [C] of the contact's width, the first of which every scene takes
# [C] times that what a halving changes counts: the next changes more than half as much
_CAUTION = 2.0
# [C] how often over the lanes may be filled with scenes run at once; each motion is kept till then
TOGETHER = 8
# [C] of these halvings, how many are tried on the whole run before only parts of it are refined
_WHOLE = 2
# Shares [C] of the accuracy to which two whole runs must agree; where an object slips off, they may
# by chance:
_SURE = 0.5  # to be believed, about a corner if they do so twice
_SURER = 0.2  # to be believed about a corner at once
_NEVER = (
    0.0  # where several parts follow each other: not before the next two runs agree as well
)
# [C] times that a difference from steps of 0.8 µs counts: down to 0.2 µs, runs part by up to 8
# times as much
_DRIFT = 5.0
_FINEST, _COARSEST = 1e-6, 0.5  # what may be asked for
# Of the estimate [C], by 1,500 random touches held against a tenth of their timestep:
_CLEAR = 0.015  # what doubling the timestep may change of the peak before halving it is tried
_MARGIN = 3.0  # times that what halving the timestep changes counts: twice, were it smooth
_AFTER = 30.0  # ms after the last contact in which runs may still part


def check_accuracy(accuracy: float) -> float:
    """The accuracy, if it can be asked for."""
    if not (isinstance(accuracy, int | float) and _FINEST <= accuracy <= _COARSEST):
        raise InvalidInput(
            f"accuracy must be a share of each touch's peak angle from {_FINEST:g} to"
            f" {_COARSEST:g}, such as 0.01, got {accuracy!r}."
        )
    return float(accuracy)


def run_with_error(scenes: Sequence[Scene], clock: Clock, engine: str) -> list[Result]:
    """One Motion per scene, however many, each with an estimate of its ``error``, or what ended it.

    All are run once more with twice the timestep, until ``_AFTER`` ms after the last contact. What
    that changes of the hinge angles at most, over the peak, is the error where it is below
    ``_CLEAR``: the engines are of first order, so that the finer run errs by as much. Where it is
    more, twice the timestep may only be too coarse itself. Those scenes are run with half of it,
    from where the two runs parted by as much, and what that changes counts ``_MARGIN`` times. So it
    does for all, from the beginning, where the contact allows no coarser timestep.
    """
    results = _run_all(scenes, clock, engine)
    errors: dict[int, float] = {}
    todo = {i: result for i, result in enumerate(results) if isinstance(result, Motion)}
    starts = dict.fromkeys(todo, 0)
    for factor, most, margin in ((2.0, _CLEAR, 1.0), (0.5, np.inf, _MARGIN)):
        shortest = min(scene.contact.solref[0] for scene in scenes)
        if not todo or (factor > 1 and factor * clock.timestep > shortest / 2 * (1 + 1e-9)):
            continue
        every = 2 if factor > 1 and clock.steps_per_sample % 2 else 1
        gaps = _compare(scenes, todo, starts, clock, factor, every, engine)
        errors |= {i: margin * float(gap.max()) for i, gap in gaps.items()}
        todo = {i: todo[i] for i, gap in gaps.items() if not gap.max() <= most}
        for i in todo:
            # of which angles, their rates and a time may be all there is to know
            scene = scenes[i]
            if not (
                scene.antenna.spatial or scene.guided or any(o.turn for o in scene.objects)
            ):
                starts[i] = every * max(int(np.argmax(gaps[i] > _CLEAR)) - 1, 0)
    return [
        replace(result, error=errors[i]) if isinstance(result, Motion) else result
        for i, result in enumerate(results)
    ]


def _compare(
    scenes: Sequence[Scene],
    motions: Mapping[int, Motion],
    starts: Mapping[int, int],
    clock: Clock,
    factor: float,
    every: int,
    engine: str,
) -> dict[int, np.ndarray]:
    """What ``factor`` times the timestep changes of each motion at most, over its peak, at each
    sample, or every other one, from where it starts.
    """
    ends = {i: _find_end(scenes[i], motion, clock) for i, motion in motions.items()}
    names, gaps = [*motions], {}
    for lanes in make_groups([scenes[i] for i in names], ENGINES[engine]):
        group = [names[lane] for lane in lanes]
        other = Clock(
            duration=max(ends[i] - starts[i] for i in group) * clock.sample_interval,
            sample_interval=every * clock.sample_interval,
            timestep=factor * clock.timestep,
        )
        begun = [_begin_at(scenes[i], motions[i], starts[i]) for i in group]
        for i, result in zip(group, run_group(begun, other, engine), strict=True):
            gaps[i] = _measure_gap(motions[i], result, slice(starts[i], ends[i], every))
    return gaps


def _find_end(scene: Scene, motion: Motion, clock: Clock) -> int:
    """The number of samples after which nothing drives two runs apart any more."""
    touching = np.flatnonzero(np.isfinite(motion.contact_place))
    if not touching.size or scene.follows or scene.flow is not None:
        return clock.n_samples
    rest = int(np.ceil(_AFTER / clock.sample_interval))
    return min(clock.n_samples, int(touching[-1]) + 1 + rest)


def _begin_at(scene: Scene, motion: Motion, sample: int) -> Scene:
    """The scene that begins as its motion is at a sample."""
    if sample == 0:
        return scene
    time = motion.time[sample]
    return replace(
        scene,
        objects=tuple(
            o.replace(
                place=tuple(p + time * v for p, v in zip(o.place, o.velocity, strict=True))
            )
            for o in scene.objects
        ),
        base=tuple(motion.base[sample]),
        angle=motion.angle[sample],
        velocity=motion.velocity[sample],
    )


def _measure_gap(motion: Motion, other: Result, samples: slice) -> np.ndarray:
    """The greatest difference (sample,) over the peak; infinite where the other run diverged."""
    if not isinstance(other, Motion):
        return np.array([np.inf])
    own = motion.angle[samples]
    gap = np.abs(other.angle[: len(own)] - own).reshape(len(own), -1).max(axis=1)
    peak = float(np.abs(motion.angle - motion.angle[0]).max())
    return gap / peak if gap.any() else gap


def run_accurately(
    scenes: Sequence[Scene],
    duration: float,
    sample_interval: float,
    engine: str,
    accuracy: float,
) -> list[Result]:
    """One Motion per scene whose ``error`` is at most ``accuracy``; infinite, which is to say
    unknown, where ``HALVINGS`` of the timestep and ``_NARROWINGS`` of the contact do not get there.

    Every scene is run as :func:`_run_in_time` does, once with its contact and once with one of half
    the width; what that changes counts as well. Where both together are too much, the width is
    halved again. What does not get there is the motion with the scene's own contact, at the finest
    steps that it was run with.
    """
    results = _run_in_time(scenes, duration, sample_interval, engine, accuracy)
    own = list(results)
    now, todo = list(scenes), [i for i, r in enumerate(results) if isinstance(r, Motion)]
    for _ in range(_NARROWINGS):
        for i in todo:
            now[i] = replace(now[i], contact=now[i].contact.halve())
        found = _run_in_time(
            [now[i] for i in todo], duration, sample_interval, engine, accuracy
        )
        for i, narrow in zip(todo, found, strict=True):
            change = compute_error(now[i], results[i], narrow)
            if isinstance(narrow, Motion):
                results[i] = replace(narrow, error=narrow.error + _CAUTION * change)
        todo = [i for i in todo if _read_error(results[i]) > accuracy]
        if not todo:
            break
    return [
        replace(before, error=np.inf)
        if isinstance(before, Motion) and not _read_error(result) <= accuracy
        else result
        for before, result in zip(own, results, strict=True)
    ]


def _run_in_time(
    scenes: Sequence[Scene],
    duration: float,
    sample_interval: float,
    engine: str,
    accuracy: float,
) -> list[Result]:
    """One Motion per scene whose ``error`` is at most ``accuracy``, or as small as ``HALVINGS`` of
    the timestep get it.

    However many scenes: those that need finer steps share lanes anew, so that few of these stay
    empty.

    A scene is run with timesteps h and h/2; the greatest difference between the two, over the peak,
    estimates the error of the finer one (the engines are of first order, so that its error is as
    large as its distance from the coarser). Only scenes that are not accurate enough go on to h/4,
    and then to :mod:`feeler.physics.run`. Two coarse runs may agree by chance, and are believed
    at half of what is asked for; where an object has corners, off which the antenna can slip, at a
    fifth, or if the next two runs agree as well; and where it has several parts, from one of which
    the antenna can jump to the next, only if these do. What is refined past several parts is held
    against a whole run with steps smaller than all others, and what these differ by counts
    ``_DRIFT`` times.
    """
    if not scenes:
        return []
    timestep = min(find_coarsest(scene.contact, sample_interval) for scene in scenes)
    clock = Clock(duration=duration, sample_interval=sample_interval, timestep=timestep)
    results = _run_all(scenes, clock, engine)
    todo, agreed, settled = list(range(len(scenes))), set[int](), set[int]()
    once = [min(map(_trust, scene.objects), default=_SURE) for scene in scenes]
    for _ in range(_WHOLE):
        clock = replace(clock, timestep=clock.timestep / 2)
        for i, fine in zip(
            todo, _run_all([scenes[i] for i in todo], clock, engine), strict=True
        ):
            error = compute_error(scenes[i], results[i], fine)
            results[i] = replace(fine, error=error) if isinstance(fine, Motion) else fine
            if error <= once[i] * accuracy or (i in agreed and error <= _SURE * accuracy):
                settled.add(i)
            elif error <= _SURE * accuracy:
                agreed.add(i)
        todo = [i for i in todo if i not in settled]
        if not todo:
            return results
    for i in todo:
        results[i] = _refine(scenes[i], results[i], clock, engine, accuracy)
    doubted = [i for i in todo if once[i] == _NEVER and _read_error(results[i]) <= accuracy]
    clock = replace(clock, timestep=timestep / 2 ** (HALVINGS + 1))
    for i, fine in zip(
        doubted, _run_all([scenes[i] for i in doubted], clock, engine), strict=True
    ):
        # the finer motion, with the greater of what the refined one and their difference say
        best = fine if isinstance(fine, Motion) else results[i]
        change = _DRIFT * compute_error(scenes[i], results[i], fine)
        if isinstance(best, Motion):
            results[i] = replace(best, error=max(_read_error(results[i]), change))
    return results


def _refine(scene: Scene, coarse: Result, clock: Clock, engine: str, accuracy: float) -> Result:
    """What refinement finds, unless whole runs promised less error and not enough: what these said
    by chance is unsaid.
    """
    found = refine(
        scene, clock, engine, accuracy, _find_peaks(scene, coarse), HALVINGS - _WHOLE - 1
    )
    before = _read_error(coarse)
    return (
        found if found is not None and (before <= accuracy or found.error < before) else coarse
    )


def _trust(item: Object) -> float:
    """The share of the accuracy to which two whole runs must agree to be believed at once."""
    if len(item.feature.parts) > 1:
        return _NEVER
    return _SURE if item.feature.unbounded or len(item.feature.parts[0]) == 1 else _SURER


def _run_all(scenes: Sequence[Scene], clock: Clock, engine: str) -> list[Result]:
    found: dict[int, Result] = {}
    for lanes in make_groups(scenes, ENGINES[engine]):
        found |= zip(lanes, run_group([scenes[i] for i in lanes], clock, engine), strict=True)
    return [found[i] for i in range(len(scenes))]


def _find_peaks(scene: Scene, result: Result) -> np.ndarray:
    """How far the motion went; half a turn where it diverged."""
    return (
        _compute_peaks(track(scene.antenna, result.angle))
        if isinstance(result, Motion)
        else np.full(2, np.pi)
    )


def _read_error(result: Result) -> float:
    return result.error if isinstance(result, Motion) else float("inf")


def find_coarsest(contact: Contact, sample_interval: float) -> float:
    """The largest whole part of a sample that the contact allows [ms]."""
    return float(
        sample_interval / np.ceil(2 * sample_interval / contact.solref[0] * (1 - 1e-9))
    )


def compute_error(scene: Scene, coarse: Result, fine: Result) -> float:
    """Greatest difference of two motions over the peak of the finer, in hinge angles or at the tip,
    whichever is more.

    Infinite where one of them diverged, 0 where nothing moved.
    """
    if not (isinstance(coarse, Motion) and isinstance(fine, Motion)):
        return float("inf")
    before, after = (track(scene.antenna, motion.angle) for motion in (coarse, fine))
    return _compute_gap(before, after, _compute_peaks(after))
