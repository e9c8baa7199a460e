"""Touches to practise on: the observer's sums, with what is felt looked up instead of simulated.

To simulate every known touch under each body's own motion takes 10 ms of a core for one decision,
too much to learn from. Here a touch is simulated at each speed once, x_k(v, w) against the way w
gone ahead; a body that has gone w and moves at v feels x_k(v, w), as if v had been its speed all
the way. So what a change of speed leaves behind, a few milliseconds, is missing, in what is felt
and in what is known alike; all else is the observer's. It is for learning only: policies are judged
by :class:`feeler.active.Observer`.
"""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.special import softmax

from feeler.active.arena import Arena
from feeler.active.observer import MENU, PERIOD, Known
from feeler.active.task import SAMPLE, TouchTask

STEP, REACH = 0.1, 30.0  # [C] mm; places of the way, and how far: from there on nothing changes
SLOWEST = 0.06  # [C] mm/ms; whoever is slower feels as much


class Practice:
    """What all touches of a task feel like, in units of the noise, by speed and place of the way."""

    def __init__(self, task: TouchTask, *, menu: Sequence[float] = MENU) -> None:
        self.task, self.speeds = (
            task,
            np.array([speed for speed in sorted(menu) if speed >= SLOWEST]),
        )
        starts = [task.make_start(k) for k in range(task.pool)]
        self.label = np.array([start.target for start in starts], dtype=int)
        self.way = np.arange(0.0, REACH + STEP / 2, STEP)
        arena = Arena(task, len(starts))
        self.felt = np.zeros(
            (len(self.speeds), len(self.way), len(starts), len(arena.sensors)), np.float32
        )
        self.touched = np.zeros(self.felt.shape[:3], bool)
        for row, speed in enumerate(self.speeds):
            for lane, start in enumerate(starts):
                arena.begin(lane, np.random.default_rng(0), start)
            felt, touched = [arena.felt], [np.zeros(len(starts), bool)]
            for _ in range(int(np.ceil(REACH / speed / SAMPLE))):
                arena.step(np.tile([speed, 0.0], (len(starts), 1)))
                felt.append(arena.felt)
                touched.append(touched[-1] | arena.touching)
            sample = np.rint(self.way / speed / SAMPLE).astype(int)
            self.felt[row], self.touched[row] = (
                np.array(felt)[sample] / task.noise,
                np.array(touched)[sample],
            )


class Practised:
    """Bodies that feel each touch of a practice once and decide every 5 ms; what they know is a
    :class:`feeler.active.Known`.
    """

    def __init__(self, practice: Practice, deadline: float, rng: np.random.Generator) -> None:
        self.practice, self.rng, self.deadline = practice, rng, deadline
        n = len(practice.label)
        self._evidence, self._touched = np.zeros((n, n)), np.zeros((n, n), bool)
        self.time, self._way, self._speed = 0.0, np.zeros(n), np.zeros(n)
        self.known = self._tell()

    def step(self, speed: np.ndarray) -> Known:
        """Go on by a decision at speeds (body,) [mm/ms]."""
        practice, body = self.practice, np.arange(len(self._way))
        change = practice.task.acceleration * SAMPLE if self.time else np.inf
        for _ in range(round(PERIOD / SAMPLE)):
            self._speed = self._speed + np.clip(speed - self._speed, -change, change)
            self._way = self._way + SAMPLE * self._speed
            row = np.abs(self._speed[:, None] - practice.speeds).argmin(axis=1)
            place = np.minimum(np.rint(self._way / STEP).astype(int), len(practice.way) - 1)
            known = practice.felt[row, place]
            felt = known[body, body] + self.rng.standard_normal(
                (len(body), known.shape[2]), np.float32
            )
            self._evidence += np.einsum("bks,bs->bk", known, felt) - 0.5 * (known**2).sum(axis=2)
            self._touched |= practice.touched[row, place]
        self.time += PERIOD
        self.known = self._tell()
        return self.known

    def _tell(self) -> Known:
        practice, weight = self.practice, softmax(self._evidence, axis=1)
        belief = weight @ np.eye(practice.task.n_outputs)[practice.label]
        touching = (weight * self._touched).sum(axis=1)
        return Known(
            time=self.time, left=self.deadline - self.time, belief=belief, touching=touching, way=self._way,
            speed=self._speed, look=_look_no_further,
        )  # fmt: skip


def _look_no_further(speeds: Sequence[float], ms: float) -> np.ndarray:
    raise NotImplementedError("no look ahead in practice.")


def practise(
    practice: Practice, policy: Callable[[Known], object], deadline: float, seed: int = 0
) -> float:
    """Share of right answers that bodies expect at the deadline [ms] who move by a policy."""
    bodies = Practised(practice, deadline, np.random.default_rng(seed))
    while bodies.known.left > 0:
        bodies.step(
            np.broadcast_to(np.asarray(policy(bodies.known), float), bodies.known.way.shape)
        )
    return float(bodies.known.belief.max(axis=1).mean())
