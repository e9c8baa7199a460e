"""Implausible landmarks noticed from geometry and speed; and made-up tracks with a known answer."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import (
    binary_dilation,
    binary_opening,
    find_objects,
    label,
    median_filter,
    percentile_filter,
)

from feeler.errors import InvalidInput
from feeler.physics.scene import MAX_SAMPLES
from feeler.records import Ge, Gt, Lt, Unit
from feeler.tracking.tracks import LANDMARKS, Tracks
from feeler.validation import checked

# Tracking errors that geometry and speed give away: exchanged landmarks, jumps, wrong names.

# [C] shares of a length: the antenna's for its tip, the body's for head and abdomen
_MAX_REACH = 1.5  # tip to base, over the 90th percentile
_SPIKE = 0.1  # a place off the curve through its neighbours
_EXCHANGED = 0.2  # shortening of both landmarks' paths if their names are exchanged
_JUMP = (0.25, 1.0)  # least and largest step that counts as a jump
_MAX_SPEED = np.deg2rad(5.0)  # [C] rad/ms; no antenna or whisker is as fast as 5000 °/s
_TIMES = 8.0  # [C] over what is usual in the neighbourhood
_TIMES_LARGEST = 2.5  # [C] over what is usual there of the median, and of how paths turn
_NEAR = 8  # [C] frames of a neighbourhood, before and after
STRAY = ("jumps", "too far from its base")  # what single places are left out for
_LONGEST = 1000.0  # [C] ms after which a jump counts as a change of place, not as an error
_FLICK = 12.0  # [C] ms between frames; in a film that is as fast no flick is over in one frame
_GRAINS = (1.0, 0.1, 0.01, 0.001)  # to which coordinates may be rounded
_RUN = (3, 6)  # [C] frames that repeat a place, or lie on a line, without being measured
_REPEATED = 0.05  # [C] share of frames that repeat the one before
_STUCK = (0.05, 0.2)  # [C] of the antenna's length, share of seconds: a tip that stays in place
_TOGETHER = (0.03, 0.2)  # [C] of the antenna's length, share of frames: tips on one place


def leave_out_errors(
    tracks: Tracks,
    *,
    tips: tuple[str, str],
    bases: tuple[str, str],
    head: str = "",
    abdomen: str = "",
    points: Sequence[str] = (),
    max_gap: int,
) -> tuple[Tracks, dict[str, int], list[str]]:
    """Tracks in which places that cannot be are NaN, how many frames that were, by what is wrong
    with them, and what is to be asked about.

    Left out are places that the tracker repeated or interpolated (all of a frame that repeats the
    one before), frames in which the two tips, or head and abdomen, have exchanged their places
    (both jump to where the other one would go on; tips that cross do not), tips that lie farther
    from their base than 1.5 antenna lengths, places off the smooth path of their landmark, and
    excursions: a jump of more than the antenna's (body's) length, or faster than 5000 °/s, and a
    jump back within 1 s. A jump also has to be 8 times what is usual in the frames around it, so
    that a whisk that is filmed slowly is none. Around a jump without return more than ``max_gap``
    frames are left out, so that no motion is interpolated across it.

    Of an antenna alone there are no ``head`` and ``abdomen``; ``points`` are those between its base
    and its tip.
    """
    names = dict.fromkeys((*tips, *bases, head, abdomen, *points))
    place = {name: tracks.of(name).copy() for name in names if name}
    reach = {
        tip: _measure_length(place[tip] - place[base or head], 90)
        for tip, base in zip(tips, bases, strict=True)
        if tip
    }
    body = _measure_length(place[head] - place[abdomen], 50) if head else min(reach.values())
    found: dict[str, int] = {}

    def leave_out(names: tuple[str, ...], wrong: np.ndarray, words: str) -> None:
        for name in names:
            place[name][wrong] = np.nan
        if wrong.any():
            found[words] = int(wrong.sum())

    unmeasured, again = _find_unmeasured(place)
    leave_out(tuple(place), again, "frames that repeat the one before")
    doubts: list[str] = []
    if again.mean() > _REPEATED:
        doubts.append(
            f"{again.mean():.0%} of the frames repeat the one before: film and file have different"
            " frame rates. Give each picture once, and how many there were a second."
        )
    share = {
        name: wrong.sum() / max(np.isfinite(place[name]).all(axis=1).sum(), 1)
        for name, wrong in unmeasured.items()
    }
    held = not head or min(share[head], share[abdomen]) > 0.5  # as in a clamp
    for name, wrong in unmeasured.items():
        if share[name] <= 0.5:
            leave_out((name,), wrong & ~again, f"{name} repeated or interpolated")
        elif name in tips or not held:
            doubts.append(
                f"{name} stands still or moves on a straight line in {share[name]:.0%} of the"
                " frames: was it tracked there?"
            )
    pairs = [((head, abdomen), body)] if head else []
    if all(tips):
        pairs.append((tips, min(reach.values())))
    for (one, other), length in pairs:
        wrong = _find_exchanged(place[one], place[other], length)
        leave_out((one, other), wrong, f"{one} and {other} exchanged")
    for tip, base in zip(tips, bases, strict=True):
        if tip:
            distance = np.linalg.norm(place[tip] - place[base or head], axis=1)
            far = distance > _MAX_REACH * reach[tip]
            leave_out((tip,), far, f"{tip} {STRAY[1]}")
    for name in place:
        length = reach.get(name, body)
        leave_out(
            (name,), _find_jumps(place[name], length, tracks.interval), f"{name} {STRAY[0]}"
        )
        stays = _find_breaks(place[name], length, tracks.interval, max_gap)
        leave_out((name,), stays, f"{name} jumps and stays there")
        if stays.any():
            doubts.append(
                f"{name} jumps and stays where it is then: before or after, something else was"
                " tracked. Look at its track."
            )
    for tip in filter(None, tips if head else ()):
        stuck = _measure_stuck(place[tip], place[head], reach[tip], tracks.interval)
        if stuck > _STUCK[1]:
            doubts.append(
                f"{tip} stays on one place in {stuck:.0%} of the film while {head} moves: does it"
                " touch something there, or was it not tracked?"
            )
    if all(tips):
        apart = np.linalg.norm(place[tips[0]] - place[tips[1]], axis=1)
        near = apart < _TOGETHER[0] * min(reach.values())
        if near.mean() > _TOGETHER[1]:  # not in passing; which is right is not known
            leave_out(tips, near, f"{tips[0]} and {tips[1]} on one place")
    if not found:
        return tracks, found, doubts
    position = tracks.position.copy()
    for name, values in place.items():
        position[:, tracks.landmarks.index(name)] = values
    return tracks.replace(position=position), found, doubts


def _measure_stuck(tip: np.ndarray, head: np.ndarray, length: float, interval: float) -> float:
    """Share of the film's seconds in which a tip (frame, axis) stays where it is in the picture
    while the head moves.
    """
    n = max(min(int(_LONGEST / interval), len(tip)), 1)
    seconds = np.stack([tip, head])[:, : len(tip) // n * n].reshape(2, -1, n, tip.shape[1])
    span = np.linalg.norm(np.ptp(seconds, axis=2), axis=2)
    return float(np.mean((span[1] > _STUCK[0] * length) & (span[0] < 0.5 * span[1])))


def _find_doubts(
    angle: np.ndarray, *, tips: tuple[str, str], head: str, abdomen: str, flat: bool
) -> list[str]:
    """Questions about the landmarks' names and tracks, from angles (side, frame) [rad]."""
    turned = [row[np.isfinite(row)] for row in angle]
    shown = [np.angle(np.exp(1j * row)) for row in turned if row.size]
    doubts = []
    for tip, row in zip(tips, angle, strict=True):
        if wild := int(np.sum(np.abs(np.diff(row)) > np.pi / 2)):
            doubts.append(
                f"the angle of {tip} still jumps by more than 90° in {wild} frames: its track holds"
                " errors that were not left out, and its peak speeds are not to be trusted."
            )
    backward = [float(np.mean(np.abs(row) > np.pi / 2)) for row in shown]
    if min(backward) > 0.5:
        doubts.append(
            f"the antennae point backwards in {min(backward):.0%} of the frames: are {head} and"
            f" {abdomen} exchanged?"
        )
        return doubts  # which turns the sides round as well
    inward = [float(np.mean(np.sin(row) < 0)) for row in shown]
    if flat and all(tips) and len(inward) == 2 and min(inward) > 0.5:
        doubts.append(
            f"{tips[0]} lies on the right and {tips[1]} on the left of the body in"
            f" {min(inward):.0%} of the frames: are the tips exchanged, or is y upwards in the file"
            " (origin='bottom-left'), or the picture a mirror's?"
        )
    return doubts


def _measure_length(vector: np.ndarray, percentile: float) -> float:
    """Percentile of the lengths of vectors (frame, axis); NaN without one."""
    length = np.linalg.norm(vector, axis=1)
    length = length[np.isfinite(length)]
    return float(np.percentile(length, percentile)) if length.size else float("nan")


def _find_exchanged(one: np.ndarray, other: np.ndarray, length: float) -> np.ndarray:
    """Whether two landmarks (frame, axis) have each other's place in a frame (frame,).

    Of the two states between which both jump, the rarer one is wrong.
    """
    wrong = np.zeros(len(one), dtype=bool)
    seen = np.flatnonzero(np.isfinite(one + other).all(axis=1))
    if seen.size < 3 or not length > 0:
        return wrong
    pair, gap = np.stack([one[seen], other[seen]]), np.diff(seen)

    def walk(here: np.ndarray, after: np.ndarray) -> np.ndarray:
        return np.linalg.norm(after - here, axis=-1).sum(axis=0)

    onward = pair[:, :-1].copy()
    onward[:, 1:] += np.diff(pair[:, :-1], axis=1) * np.minimum(gap[1:] / gap[:-1], 2)[:, None]
    least = max(_EXCHANGED * length, 2 * np.percentile(walk(onward, pair[:, 1:]), 90))

    def compare(here: np.ndarray, after: np.ndarray) -> np.ndarray:
        kept, crossed = walk(here, after), walk(here, after[::-1])
        return (kept > 2 * crossed) & (kept - crossed > least)

    event = compare(pair[:, :-1], pair[:, 1:]) | compare(onward, pair[:, 1:])
    state = np.zeros(seen.size, dtype=bool)
    for k in map(int, np.flatnonzero(event)):  # the names before it as they were found to be
        now, was = (pair[:: -1 if state[row] else 1, row] for row in (k, max(k - 1, 0)))
        after = pair[:: -1 if state[k] else 1, k + 1]
        moved = (now - was) * gap[k] / gap[k - 1] if k and gap[k] <= _NEAR else 0 * now
        state[k + 1 :] ^= bool(compare(now + moved, after))
    wrong[seen] = state if state.mean() <= 0.5 else ~state
    return wrong


def _find_unmeasured(place: dict[str, np.ndarray]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Whether each landmark's place (frame,) is the one before, or lies on a line at constant
    speed, for so long that nothing was measured; and whether a frame repeats the one before.

    Of coordinates that are rounded to more than a tenth of their noise only what stood still and
    then jumps is known.
    """
    found: dict[str, np.ndarray] = {}
    repeated: list[np.ndarray] = []
    for name, path in place.items():
        still, straight = np.zeros((2, len(path)), dtype=bool)
        step, bend = (np.abs(np.diff(path, n, axis=0)).max(axis=1) for n in (1, 2))
        least = 1e-9 * np.abs(path[np.isfinite(path)]).max(initial=0.0)
        still[1:] = step <= least
        found[name], rough = binary_opening(still, np.ones(_RUN[0])), bend[bend > least]
        if not rough.size:
            continue
        off = [np.nanmax(np.abs(path / g - np.round(path / g))) for g in _GRAINS]
        grain = next((g for g, by in zip(_GRAINS, off, strict=True) if by < 1e-3), 0.0)
        if grain < 0.1 * np.median(rough):
            straight[1:-1] = bend <= 2 * grain + least
            found[name] |= binary_opening(straight, np.ones(_RUN[1]))
            repeated.append(still)
            continue
        fast = 2 * np.percentile(step[step > least], 95)
        for (run,) in find_objects(label(found[name])[0]):  # into the run, and out of it
            ends = step[[max(run.start - 2, 0), min(run.stop, len(path) - 1) - 1]]
            found[name][run] = bool((ends > fast).any())
    frames = len(next(iter(place.values())))
    return found, np.all(repeated, axis=0) if repeated else np.zeros(frames, dtype=bool)


def _find_jumps(place: np.ndarray, length: float, interval: float) -> np.ndarray:
    """Whether a landmark's place (frame, axis) lies off its path in a frame (frame,)."""
    wrong = np.zeros(len(place), dtype=bool)
    if not length > 0:
        return wrong
    for _ in range(8):  # a spike hides a smaller one beside it
        seen = np.flatnonzero(np.isfinite(place).all(axis=1) & ~wrong)
        if seen.size < 2 * _NEAR:
            break
        path = place[seen]
        new = _find_strays(path, seen, length)
        if not new.any():
            new = _find_excursions(path, seen, length, interval)
        if not new.any():
            break
        wrong[seen[new]] = True
    return wrong


def _find_strays(path: np.ndarray, frame: np.ndarray, length: float) -> np.ndarray:
    """Whether a place (row, axis) lies far from the median of itself and two places before and
    after, and off the curve through the others: of several errors close together, each.
    """
    off = np.linalg.norm(path - median_filter(path, size=(5, 1), mode="nearest"), axis=1)
    off[2:-2][frame[4:] - frame[:-4] >= _NEAR] = 0.0  # it shows nothing across a gap
    odd = (off > _SPIKE * length) & (off > _TIMES_LARGEST * find_usual(off))
    if not odd.any() or (~odd).sum() < 2 * _NEAR:
        return odd & False
    kept, others = frame[~odd], path[~odd]
    away = np.linalg.norm(path - CubicSpline(kept, others)(frame), axis=1)
    turn = np.linalg.norm(
        np.diff(others, 2, axis=0, prepend=others[:1], append=others[-1:]), axis=1
    )
    usual = percentile_filter(turn, 70, size=2 * _NEAR + 1)
    return (
        odd & (away > _SPIKE * length) & (away > _TIMES_LARGEST * np.interp(frame, kept, usual))
    )


def _find_excursions(
    path: np.ndarray, frame: np.ndarray, length: float, interval: float
) -> np.ndarray:
    """Whether a place (row, axis), seen in ``frame`` (row,), lies between a jump and the jump back
    from it.
    """
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    per_frame = step / np.diff(frame)
    least = length * np.clip(_MAX_SPEED * interval, *_JUMP)
    jump = (per_frame > least) & (per_frame > _TIMES * find_usual(per_frame))
    wrong = np.zeros(len(path), dtype=bool)
    last = len(path) - 1
    for k in np.flatnonzero(jump) + 1:  # the first place after the jump
        if wrong[k] or wrong[k - 1]:  # within an excursion, or the jump back from it
            continue
        stop = int(np.searchsorted(frame, frame[k] + _LONGEST / interval, side="right"))
        back = np.linalg.norm(path[k:stop] - path[k - 1], axis=1) < 0.5 * step[k - 1]
        if back.any():
            wrong[k : k + int(np.argmax(back))] = True
        elif k <= 2:  # the film begins with it
            wrong[:k] = True
        elif k > last - 2:
            wrong[k:] = True
    return wrong


def _find_breaks(place: np.ndarray, length: float, interval: float, max_gap: int) -> np.ndarray:
    """Whether a frame (frame,) is near a jump of a landmark's place (frame, axis) that remains."""
    wrong = np.zeros(len(place), dtype=bool)
    frame = np.flatnonzero(np.isfinite(place).all(axis=1))
    if frame.size < 2 * _NEAR or not length > 0:
        return wrong
    step = np.linalg.norm(np.diff(place[frame], axis=0), axis=1) / np.diff(frame)
    least = _SPIKE if interval <= _FLICK else np.clip(_MAX_SPEED * interval, *_JUMP)
    jump = (step > least * length) & (step > _TIMES * find_usual(step))
    jump[1:-1] &= step[1:-1] > _TIMES_LARGEST * np.maximum(step[:-2], step[2:])
    wrong[frame[1:][jump]] = True
    return binary_dilation(wrong, np.ones(2 * (max_gap // 2) + 3))


def find_usual(values: np.ndarray) -> np.ndarray:
    """The larger of the medians (row,) of the values before and of those after."""
    size = _NEAR + 1
    shift = size // 2
    before = median_filter(values, size=size, mode="reflect", origin=shift)
    after = median_filter(values, size=size, mode="reflect", origin=-shift)
    return np.maximum(before, after)


# Made-up tracks with a known answer, always labelled synthetic: for tests, examples and Fig.
# S2's layout.

_FRAME_RATE = (
    30.0  # [C] frames per second, an ordinary security camera; the paper does not state its own
)
_SCALE = 8.0  # [C] px/mm
_BODY_LENGTH = 28.0  # [B] mm, antenna about 1.5 times the body


@checked
def make_synthetic_tracks(
    rng: np.random.Generator,
    *,
    peak_speed: tuple[float, float] = (np.deg2rad(86.67e-3), np.deg2rad(86.67e-3)),
    sweep_rate: Annotated[float, Gt(0)] = 0.5e-3,
    duration: Annotated[float, Gt(0)] = 20_000.0,
    frame_rate: Annotated[float, Gt(0)] = _FRAME_RATE,
    length: Annotated[float, Gt(0)] = 42.0,
    noise: Annotated[float, Ge(0), Unit("px")] = 0.5,
    gap_share: Annotated[float, Ge(0), Lt(1)] = 0.0,
) -> Tracks:
    """A walking, turning body whose antennae sweep sinusoidally, so that every peak speed is known.

    ``θ(t) = θ₀ + A sin(2π f t + φ)`` with A = peak / (2π f): each peak of |dθ/dt| is ``peak_speed``
    (left, right) [rad/ms]. ``sweep_rate`` f [kHz], ``duration`` and ``length`` in ms and mm,
    ``noise`` sd of each coordinate [px], ``gap_share`` share of frames in which a random landmark
    is lost.
    """
    interval = 1e3 / frame_rate
    if not duration / interval <= MAX_SAMPLES:
        raise InvalidInput(
            f"{duration:g} ms at {frame_rate:g} frames a second are more than {MAX_SAMPLES:,}"
            " frames; use a lower rate."
        )
    time = np.arange(round(duration / interval)) * interval
    heading = 0.6 * np.sin(2 * np.pi * time / 15_000.0) + rng.uniform(-np.pi, np.pi)
    forward = np.stack([np.cos(heading), np.sin(heading)], axis=1)
    abdomen = np.cumsum(forward, axis=0) * 0.01 * interval  # walks at 10 mm/s
    head = abdomen + _BODY_LENGTH * forward
    position = np.empty((time.size, len(LANDMARKS), 2))
    position[:, 2], position[:, 3] = head, abdomen
    for side, (peak, outward) in enumerate(zip(peak_speed, (1.0, -1.0), strict=True)):
        phase = rng.uniform(0, 2 * np.pi)
        swing = np.deg2rad(35.0) + peak / (2 * np.pi * sweep_rate) * np.sin(
            2 * np.pi * sweep_rate * time + phase
        )
        direction = heading + outward * swing
        position[:, side] = head + length * np.stack(
            [np.cos(direction), np.sin(direction)], axis=1
        )
    position = _SCALE * position + rng.normal(0.0, noise, position.shape)
    lost = rng.random(time.size) < gap_share
    position[lost, rng.integers(0, len(LANDMARKS), lost.sum())] = np.nan
    return Tracks(position=position, landmarks=LANDMARKS, interval=interval, source="synthetic")
