"""Recorded episodes: what bodies felt that moved at speeds of their own, to train and test decoders
on.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from feeler.active.arena import Arena
from feeler.active.observer import MENU
from feeler.active.task import SAMPLE, TouchTask
from feeler.checked import checked

LANES = 64  # [C] episodes side by side
HOLD = 25.0  # [C] ms; how long a wandering body keeps a speed, on average

Mover = Callable[[np.ndarray, np.random.Generator], np.ndarray]
"""From the time [ms] and a generator to the speeds (lane,) of a millisecond."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Recorded:
    """Episodes of one task; sensors are without noise, which is drawn when they are used."""

    angle: np.ndarray
    """(episode, sample, sensor) [rad]"""
    base: np.ndarray
    """Way [mm], heading [rad], speed [mm/ms], turn rate [rad/ms] (episode, sample, 4)."""
    target: np.ndarray
    """(episode,)"""
    touching: np.ndarray
    """Whether the antenna is in contact (episode, sample)."""

    def add_noise(self, noise: float, rng: np.random.Generator) -> np.ndarray:
        """What the sensors say (episode, sample, sensor) [rad]."""
        return self.angle + noise * rng.standard_normal(self.angle.shape, dtype=np.float32)

    @property
    def onset(self) -> np.ndarray:
        """Sample of the first contact (episode,), the number of samples where there is none."""
        return np.where(
            self.touching.any(axis=1), self.touching.argmax(axis=1), self.touching.shape[1]
        )


@checked
def record_episodes(
    task: TouchTask,
    n: Annotated[int, "> 0"],
    *,
    speed: float | None = None,
    seed: int = 0,
    workers: Annotated[int, "> 0"] = 1,
    progress: Callable[[int, int], None] | None = None,
) -> Recorded:
    """Let ``n`` bodies feel touches of a task.

    Parameters
    ----------
    speed
        Of all bodies [mm/ms]; default: each wanders, taking another speed of the menu every 25 ms
        or so, so that a decoder trained on it knows that speeds vary.
    """
    rng, lanes = np.random.default_rng([seed, 7]), min(n, LANES)
    arena, parts = Arena(task, lanes, workers), []
    for first in range(0, n, lanes):
        parts.append(_record_lanes(arena, rng, speed, seed, first))
        if progress:
            progress(min(first + lanes, n), n)
    angle, base, target, touching = (
        np.concatenate(column)[:n] for column in zip(*parts, strict=True)
    )
    return Recorded(angle=angle, base=base, target=target, touching=touching)


def _record_lanes(
    arena: Arena, rng: np.random.Generator, speed: float | None, seed: int, first: int
) -> tuple:
    menu, n = np.array(MENU[2:]), arena.n
    for lane in range(n):
        arena.begin(lane, np.random.default_rng([seed, first + lane]))
    now = rng.choice(menu, n) if speed is None else np.full(n, speed)
    felt, bases, touching = [], [], []
    for _ in range(round(arena.task.duration / SAMPLE)):
        if speed is None:
            now = np.where(rng.random(n) < SAMPLE / HOLD, rng.choice(menu, n), now)
        arena.step(np.stack([now, np.zeros(n)], axis=1))
        felt.append(arena.felt)
        bases.append(arena.reading.base)
        touching.append(arena.touching)
    stack = [np.stack(column, axis=1) for column in (felt, bases, touching)]
    return stack[0].astype(np.float32), stack[1].astype(np.float32), arena.targets, stack[2]
