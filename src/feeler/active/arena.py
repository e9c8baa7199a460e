"""An arena: episodes of one task side by side, each with its own noise, begun and moved by itself."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from feeler.active.task import SAMPLE, ActiveTask, Start
from feeler.errors import InvalidInput
from feeler.physics.lanes import Simulations
from feeler.physics.scene import Scene
from feeler.physics.stepper import MICRO, State
from feeler.stimulus.base import BaseMotion

BLOCK = 64  # [C] samples of noise that a lane draws at a time


@dataclass(frozen=True, kw_only=True, eq=False)
class Reading:
    """What the bodies know; arrays (lane, …) of their own."""

    angle: np.ndarray
    """The last samples of every sensor with their noise (lane, window, sensor) [rad], the newest
    last.
    """
    base: np.ndarray
    """Way gone ahead [mm], heading [rad], speed [mm/ms] and turn rate [rad/ms] of the base (lane,
    4).
    """
    time: np.ndarray
    """Since the beginning (lane, 1) [ms]."""


class Arena:
    """Episodes of one task in SIMD lanes.

    The first action of an episode sets the speed with which the body arrives, the antenna carried
    along unbent; from then on speed changes by at most ``task.acceleration`` in a millisecond. So
    an episode of one constant speed is a touch at that speed, to the last bit.

    Parameters
    ----------
    workers
        Threads over which the lanes are spread; the numbers do not depend on it.
    """

    def __init__(self, task: ActiveTask, n: int = 1, workers: int = 1) -> None:
        self.task, self.n = task, n
        self.sensors = task.first_antenna.sensors - 1
        first = task.begin(np.random.default_rng(0))
        self.simulations = Simulations(
            [first.scene] * n, engine=task.engine, timestep=task.timestep, workers=min(workers, n)
        )
        self.starts: list[Start] = [first] * n
        self._rngs: list[np.random.Generator] = [np.random.default_rng(0)] * n
        self._noise = np.zeros((n, BLOCK, len(self.sensors)))
        self._used = np.full(n, BLOCK)
        self._window = np.zeros((n, task.window, len(self.sensors)))
        self._base = np.zeros((n, 4))
        self._time, self._paid, self.work = np.zeros(n), np.zeros(n), np.zeros(n)
        """Work done on the antennas (lane,) [µJ]: what bringing them to the speed of arrival took,
        and all since; what they give back when they are slowed down is taken off."""
        self._fresh = np.ones(n, bool)
        self._rate, self._heading = [(0.0, 0.0, 0.0)] * n, np.zeros(n)
        self.state: State | None = None

    def save(self) -> tuple[Any, ...]:
        """This moment of all lanes, for :meth:`load`."""
        kept = (self._base, self._time, self._paid, self.work, self._fresh)
        return (
            self.simulations.snapshot(),
            [*self._rate],
            self.state,
            *(array.copy() for array in kept),
        )

    def load(self, saved: tuple[Any, ...]) -> None:
        """Go back to a moment, to the last bit; what was felt and its noise are left as they are."""
        snapshot, rate, self.state, *kept = saved
        self.simulations.restore(snapshot)
        self._rate = [*rate]
        self._base, self._time, self._paid, self.work, self._fresh = (
            array.copy() for array in kept
        )

    def begin(self, lane: int, rng: np.random.Generator, start: Start | None = None) -> None:
        """Begin an episode in one lane; it draws what it meets (or is given it) and its noise from
        ``rng``.
        """
        self.starts[lane] = self.task.begin(rng) if start is None else start
        self._rngs[lane], self._used[lane], self._fresh[lane] = rng, BLOCK, True
        self._base[lane], self._time[lane], self.work[lane] = 0.0, 0.0, 0.0
        self._heading[lane] = self.starts[lane].scene.base[2]
        rest = self.starts[lane].scene.initial_angle[self.sensors]
        for _ in range(self.task.window):
            self._push([lane], rest)

    def _push(self, lanes: Sequence[int], angle: np.ndarray) -> None:
        """A sample (lane, sensor) of some lanes with its noise."""
        for lane in lanes:
            if self._used[lane] == BLOCK:
                self._noise[lane], self._used[lane] = (
                    self._rngs[lane].standard_normal(self._noise.shape[1:]),
                    0,
                )
        self._window[lanes, :-1] = self._window[lanes, 1:]
        self._window[lanes, -1] = angle + self.task.noise * self._noise[lanes, self._used[lanes]]
        self._used[lanes] += 1

    def check_action(self, action: np.ndarray) -> np.ndarray:
        """Speeds and turn rates (lane, 2), if the bodies may move so; else an error that names the
        first lane.
        """
        action = np.asarray(action, dtype=float)
        if action.shape != (self.n, 2):
            raise InvalidInput(
                f"an action is a speed and a turn rate for each lane, ({self.n}, 2); got"
                f" {action.shape}."
            )
        limits = np.array([self.task.max_speed, self.task.max_turn])
        wrong = np.flatnonzero(~(np.abs(action) <= limits * (1 + 1e-6)).all(axis=1))
        if wrong.size:
            speed, turn = action[wrong[0]]
            raise InvalidInput(
                f"the action of lane {wrong[0]} is outside the space: speed {speed:g} mm/ms (at"
                f" most ±{limits[0]:g}), turn {turn:g} rad/ms (at most ±{limits[1]:g}). Nothing has"
                " moved; clip it."
            )
        return action

    def step(self, action: np.ndarray, lanes: Iterable[int] | None = None) -> None:
        """Go on by a millisecond with actions (lane, 2); ``lanes`` (default all) are those whose
        episodes go on.

        Raises
        ------
        InvalidInput
            An action outside the space; nothing has moved then.
        """
        action = self.check_action(action)
        active = [*range(self.n)] if lanes is None else [int(lane) for lane in lanes]
        for lane, (speed, turn) in zip(active, action[active].tolist(), strict=True):
            self._command(lane, speed, turn)
        self.simulations.step(SAMPLE)
        self.state = state = self.simulations.state
        self._time[active] += SAMPLE
        self._base[active, 0] += SAMPLE * self._base[active, 2]
        sound = [lane for lane in active if self.simulations.failed[lane] is None]
        self._push(sound, state.angle[sound][:, self.sensors])
        self._base[sound, 1] = state.base[sound, 2] - self._heading[sound]
        self.work[sound] = (
            self._paid + MICRO * (state.base_work + np.nansum(state.object_work, axis=1))
        )[sound]

    def _command(self, lane: int, speed: float, turn: float) -> None:
        """Move one base by its action."""
        start, (_, heading, before, _) = self.starts[lane], self._base[lane].tolist()
        if not self._fresh[lane]:
            change = self.task.acceleration * SAMPLE
            speed = before + min(max(speed - before, -change), change)
        x, y = start.direction
        if heading:  # from +y towards +x
            c, s = math.cos(heading), math.sin(heading)
            x, y = c * x + s * y, c * y - s * x
        self._base[lane, 2:] = speed, turn
        rate = (speed * x, speed * y, turn)
        if self._fresh[lane]:
            moving = BaseMotion(velocity=rate[:2], turn=turn)
            self.simulations.reset(lane, replace(start.scene, base_motion=moving))
            self._paid[lane] = _compute_energy_of(start.scene, rate)
            self._fresh[lane] = False
        elif rate != self._rate[lane]:
            self.simulations.move_base(lane, rate[:2], turn)
        self._rate[lane] = rate

    @property
    def reading(self) -> Reading:
        """What the bodies know now."""
        return Reading(
            angle=self._window.copy(), base=self._base.copy(), time=self._time[:, None].copy()
        )

    @property
    def felt(self) -> np.ndarray:
        """What the sensors would say without noise (lane, sensor) [rad]."""
        rest = np.array([start.scene.initial_angle[self.sensors] for start in self.starts])
        return (
            rest
            if self.state is None
            else np.where(self._fresh[:, None], rest, self.state.angle[:, self.sensors])
        )

    @property
    def targets(self) -> np.ndarray:
        """What is asked for (lane,), as it is now."""
        bases = np.zeros((self.n, 3)) if self.state is None else self.state.base
        return np.array([
            self.task.measure(start, np.array(start.scene.base) if fresh else base)
            for start, base, fresh in zip(self.starts, bases, self._fresh, strict=True)
        ])  # fmt: skip

    @property
    def touching(self) -> np.ndarray:
        """Whether (lane,) the antenna is in contact: what the body is not told."""
        return (
            np.zeros(self.n, bool)
            if self.state is None
            else np.isfinite(self.state.contact_place) & ~self._fresh
        )

    @property
    def failed(self) -> list[Exception | None]:
        """The error that ended each lane's episode, or None."""
        return [
            None if fresh else error
            for error, fresh in zip(self.simulations.failed, self._fresh, strict=True)
        ]

    @property
    def over(self) -> np.ndarray:
        """Whether (lane,) the time is up."""
        return self._time >= self.task.duration - 1e-9


def _compute_energy_of(scene: Scene, rate: tuple[float, float, float]) -> float:
    """Of motion [µJ], of an antenna that is carried along unbent."""
    points = scene.antenna.shape(scene.initial_angle, scene.base[2])
    middle = (points[:-1] + points[1:]) / 2
    velocity = np.array(rate[:2]) + rate[2] * middle[:, ::-1] * [1.0, -1.0]  # from +y towards +x
    return MICRO * 0.5 * float(scene.antenna.segment_mass @ (velocity**2).sum(axis=1))
