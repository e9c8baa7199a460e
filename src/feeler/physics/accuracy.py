"""What a run errs by: estimated for every touch, and brought below what is asked for.

The estimate is that of :func:`run_with_error`. Where an accuracy is asked for,
:func:`run_accurately` halves the timestep until halving it once more would change no more than
that.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from threading import Event

import numpy as np

from feeler.errors import InvalidInput
from feeler.physics.clock import Clock
from feeler.physics.contact import Contact
from feeler.physics.engine import get_engine
from feeler.physics.refine import compute_gap, compute_peaks, refine, track
from feeler.physics.run import Result, make_groups, run_group
from feeler.physics.scene import Motion, Scene
from feeler.stimulus.object import Object

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


def run_with_error(
    scenes: Sequence[Scene], clock: Clock, engine: str, stop: Event | None = None
) -> list[Result]:
    """As :func:`feeler.physics.run.run_group`, each Motion with an estimate of its ``error``.

    All are run once more with twice the timestep, until ``_AFTER`` ms after the last contact. What
    that changes of the hinge angles at most, over the peak, is the error where it is below
    ``_CLEAR``: the engines are of first order, so that the finer run errs by as much. Where it is
    more, twice the timestep may only be too coarse itself. Those scenes are run with half of it,
    and what that changes counts ``_MARGIN`` times. So it does for all where the contact allows no
    coarser timestep.
    """
    results = run_group(scenes, clock, engine, stop)
    errors: dict[int, float] = {}
    todo = {i: result for i, result in enumerate(results) if isinstance(result, Motion)}
    for factor, most, margin in ((2.0, _CLEAR, 1.0), (0.5, np.inf, _MARGIN)):
        if not todo or (factor > 1 and not _allows(scenes, factor * clock.timestep, engine)):
            continue
        gaps = _compare(scenes, todo, clock, factor, engine, stop)
        errors |= {i: margin * gap for i, gap in gaps.items()}
        todo = {i: todo[i] for i, gap in gaps.items() if not gap <= most}
    return [
        replace(result, error=errors[i]) if isinstance(result, Motion) else result
        for i, result in enumerate(results)
    ]


def _allows(scenes: Sequence[Scene], timestep: float, engine: str) -> bool:
    try:
        for scene in scenes:
            get_engine(engine).check(scene.contact, timestep)
    except InvalidInput:
        return False
    return True


def _compare(
    scenes: Sequence[Scene],
    motions: Mapping[int, Motion],
    clock: Clock,
    factor: float,
    engine: str,
    stop: Event | None,
) -> dict[int, float]:
    """What ``factor`` times the timestep changes of each motion at most, over its peak."""
    every = 2 if factor > 1 and clock.steps_per_sample % 2 else 1
    ends = {i: _find_end(scenes[i], motion, clock) for i, motion in motions.items()}
    other = Clock(
        duration=max(ends.values()) * clock.sample_interval,
        sample_interval=every * clock.sample_interval,
        timestep=factor * clock.timestep,
    )
    found = run_group([scenes[i] for i in motions], other, engine, stop)
    return {
        i: _measure_gap(motion, result, slice(None, ends[i], every))
        for (i, motion), result in zip(motions.items(), found, strict=True)
    }


def _find_end(scene: Scene, motion: Motion, clock: Clock) -> int:
    """The number of samples after which nothing drives two runs apart any more."""
    touching = np.flatnonzero(np.isfinite(motion.contact_place))
    if not touching.size or scene.follows or scene.flow is not None:
        return clock.n_samples
    rest = int(np.ceil(_AFTER / clock.sample_interval))
    return min(clock.n_samples, int(touching[-1]) + 1 + rest)


def _measure_gap(motion: Motion, other: Result, samples: slice) -> float:
    if not isinstance(other, Motion):
        return float("inf")
    own = motion.angle[samples]
    gap = float(np.abs(other.angle[: len(own)] - own).max())
    peak = float(np.abs(motion.angle - motion.angle[0]).max())
    return gap / peak if gap > 0 else 0.0


def run_accurately(
    scenes: Sequence[Scene],
    duration: float,
    sample_interval: float,
    engine: str,
    accuracy: float,
    stop: Event | None = None,
) -> list[Result]:
    """One Motion per scene whose ``error`` is at most ``accuracy``; infinite, which is to say
    unknown, where ``HALVINGS`` of the timestep and ``_NARROWINGS`` of the contact do not get there.

    Every scene is run as :func:`run_in_time` does, once with its contact and once with one of half
    the width; what that changes counts as well. Where both together are too much, the width is
    halved again. Engines that stand for rigid surfaces have no width. What does not get there is
    the motion with the scene's own contact, at the finest steps that it was run with.
    """
    results = run_in_time(scenes, duration, sample_interval, engine, accuracy, stop)
    own = list(results)
    now, todo = list(scenes), [i for i, r in enumerate(results) if isinstance(r, Motion)]
    rigid = get_engine(engine).check is not Contact.check_timestep
    for _ in range(0 if rigid else _NARROWINGS):
        for i in todo:
            now[i] = replace(now[i], contact=now[i].contact.halve())
        found = run_in_time(
            [now[i] for i in todo], duration, sample_interval, engine, accuracy, stop
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


def run_in_time(
    scenes: Sequence[Scene],
    duration: float,
    sample_interval: float,
    engine: str,
    accuracy: float,
    stop: Event | None = None,
) -> list[Result]:
    """One Motion per scene whose ``error`` is at most ``accuracy``, or as small as ``HALVINGS`` of
    the timestep get it.

    However many scenes: those that need finer steps share lanes anew, so that few of these stay
    empty.

    A scene is run with timesteps h and h/2; the greatest difference between the two, over the peak,
    estimates the error of the finer one (the engines are of first order, so that its error is as
    large as its distance from the coarser). Only scenes that are not accurate enough go on to h/4,
    and then to :mod:`feeler.physics.refine`. Two coarse runs may agree by chance, and are believed
    at half of what is asked for; where an object has corners, off which the antenna can slip, at a
    fifth, or if the next two runs agree as well; and where it has several parts, from one of which
    the antenna can jump to the next, only if these do. What is refined past several parts is held
    against a whole run with steps smaller than all others, and what these differ by counts
    ``_DRIFT`` times.
    """
    stop = stop or Event()
    if not scenes:
        return []
    timestep = min(find_coarsest(scene.contact, sample_interval) for scene in scenes)
    clock = Clock(duration=duration, sample_interval=sample_interval, timestep=timestep)
    results = _run_all(scenes, clock, engine, stop)
    todo, agreed, settled = list(range(len(scenes))), set[int](), set[int]()
    once = [min(map(_trust, scene.objects), default=_SURE) for scene in scenes]
    for _ in range(min(_WHOLE, HALVINGS)):
        clock = replace(clock, timestep=clock.timestep / 2)
        for i, fine in zip(
            todo, _run_all([scenes[i] for i in todo], clock, engine, stop), strict=True
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
    if HALVINGS <= _WHOLE:
        return results
    for i in todo:
        results[i] = _refine(scenes[i], results[i], clock, engine, accuracy, stop)
    doubted = [i for i in todo if once[i] == _NEVER and _read_error(results[i]) <= accuracy]
    clock = replace(clock, timestep=timestep / 2 ** (HALVINGS + 1))
    for i, fine in zip(
        doubted, _run_all([scenes[i] for i in doubted], clock, engine, stop), strict=True
    ):
        results[i] = _hold_against(scenes[i], results[i], fine)
    return results


def _refine(
    scene: Scene, coarse: Result, clock: Clock, engine: str, accuracy: float, stop: Event
) -> Result:
    """What refinement finds, unless whole runs promised less error and not enough: what these said
    by chance is unsaid.
    """
    found = refine(
        scene, clock, engine, accuracy, _find_peaks(scene, coarse), HALVINGS - _WHOLE - 1, stop
    )
    before = _read_error(coarse)
    return (
        found if found is not None and (before <= accuracy or found.error < before) else coarse
    )


def _hold_against(scene: Scene, refined: Result, fine: Result) -> Result:
    """The finer motion, if there is one, with the greater of what the refined one and their
    difference say it errs by.
    """
    best = fine if isinstance(fine, Motion) else refined
    error = max(_read_error(refined), _DRIFT * compute_error(scene, refined, fine))
    return replace(best, error=error) if isinstance(best, Motion) else best


def _trust(item: Object) -> float:
    """The share of the accuracy to which two whole runs must agree to be believed at once."""
    if len(item.feature.parts) > 1:
        return _NEVER
    return _SURE if item.feature.unbounded or len(item.feature.parts[0]) == 1 else _SURER


def _run_all(scenes: Sequence[Scene], clock: Clock, engine: str, stop: Event) -> list[Result]:
    found: dict[int, Result] = {}
    for lanes in make_groups(scenes, get_engine(engine)):
        found |= zip(
            lanes, run_group([scenes[i] for i in lanes], clock, engine, stop), strict=True
        )
    return [found[i] for i in range(len(scenes))]


def _find_peaks(scene: Scene, result: Result) -> np.ndarray:
    """How far the motion went; half a turn where it diverged."""
    return (
        compute_peaks(track(scene.antenna, result.angle))
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
    return compute_gap(before, after, compute_peaks(after))
