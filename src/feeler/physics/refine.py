"""Small steps only where a run needs them: two runs side by side, one with half of the other's
steps.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from threading import Event
from typing import Any

import numpy as np

from feeler.antenna.antenna import Antenna
from feeler.physics.clock import Clock
from feeler.physics.engine import get_engine
from feeler.physics.run import list_turns, make_motion, record_some
from feeler.physics.scene import Motion, Scene
from feeler.physics.stepper import Stepper, make_row

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


def compute_gap(coarse: _Track, fine: _Track, peaks: np.ndarray) -> float:
    """Greatest difference of angles, or of the tips, over the :func:`compute_peaks`."""
    gaps = [float(np.abs(b - a).max()) for a, b in zip(coarse, fine, strict=True)]
    return max(
        gap / float(size) if size > 0 else 0.0 for gap, size in zip(gaps, peaks, strict=True)
    )


def compute_peaks(found: _Track) -> np.ndarray:
    """(2,): how far the angles go from the first sample [rad], and how far the tip does [mm]."""
    return np.array([np.abs(values - values[0]).max() for values in found])


def refine(
    scene: Scene,
    clock: Clock,
    engine: str,
    accuracy: float,
    peaks: np.ndarray,
    halvings: int,
    stop: Event,
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
        _Pair(scene=scene, clock=clock, engine=engine, halvings=halvings, stop=stop).go(
            accuracy / share, peaks
        )
        for share in _SHARES
    )
    if first is None or found is None:
        return None
    before, after = (track(scene.antenna, motion.angle) for motion in (first, found))
    return replace(
        found, error=max(found.error, compute_gap(before, after, compute_peaks(after)))
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
    stop: Event
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
        own = compute_peaks(self._track(tapes[1][0]))
        error = self._measure(tapes, 0, self.clock.n_samples, own)
        return make_motion(clock, tapes[1][0], self.scene.antenna.rest_angle.shape, error)

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
            k, ended = record_some(
                stepper, tape[:, :stop], k, every, list_turns(stepper), self.stop
            )
        return None if ended else stepper.save(0)

    def _measure(
        self, tapes: list[np.ndarray], start: int, stop: int, peaks: np.ndarray
    ) -> float:
        coarse, fine = (self._track(tape[0, start:stop]) for tape in tapes)
        return compute_gap(coarse, fine, peaks)

    def _get(self, level: int) -> Stepper:
        if level not in self.steppers:
            self.steppers[level] = get_engine(self.engine).make(
                [self.scene], self._halve(level)
            )
        return self.steppers[level]

    def _halve(self, level: int) -> float:
        return self.clock.timestep / 2**level
