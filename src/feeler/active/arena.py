"""An arena: episodes of one task side by side, each with its own noise, begun and moved by
itself.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from feeler.active.task import SAMPLE, ActiveTask, Start
from feeler.errors import InvalidInput
from feeler.physics.lanes import Simulations
from feeler.physics.scene import Scene
from feeler.physics.stepper import MICRO, State
from feeler.records.checked import checked
from feeler.stimulus.base import BaseMotion

_BLOCK = 64  # [C] samples of noise that a lane draws at a time


@checked
class Arena:
    """Episodes of one task in SIMD lanes.

    The first action of an episode sets the speed with which the body arrives, the antenna carried
    along unbent; from then on speed changes by at most ``task.acceleration`` in a millisecond. So
    an episode of one constant speed is a touch at that speed, to the last bit.

    Parameters
    ----------
    workers
        Threads over which the lanes are spread; the numbers do not depend on it.

    Attributes
    ----------
    time : np.ndarray
        Since the beginning (lane,) [ms].
    base : np.ndarray
        Way gone ahead [mm], heading [rad], speed [mm/ms], turn rate [rad/ms] (lane, 4).
    work : np.ndarray
        Work done on the antennas (lane,) [µJ]: what bringing them to the speed of arrival took,
        and all since; what they give back when they are slowed down is taken off.
    fresh : np.ndarray
        Whether (lane,) an episode has begun and not moved yet.
    n_felt : int
        Numbers that a body feels: in space the sensors of one plane after those of the other.
    """

    def __init__(self, task: ActiveTask, n: int = 1, workers: int = 1) -> None:
        self.task, self.n = task, n
        self.sensors = task.first_antenna.sensors - 1
        first = task.begin(np.random.default_rng(0))
        self.simulations = Simulations(
            [first.scene] * n,
            engine=task.engine,
            timestep=first.scene.contact.scale_timestep(task.timestep),
            workers=min(workers, n),
        )
        self.starts = [first] * n
        self.state: State | None = None
        self.time = np.zeros(n)
        self.base = np.zeros((n, 4))
        self.work = np.zeros(n)
        self.fresh = np.ones(n, bool)
        self._paid = np.zeros(n)
        self._rate: list[tuple[float, ...]] = [(0.0, 0.0, 0.0)] * n
        self._heading = np.zeros(n)
        self._rngs = [np.random.default_rng(0)] * n
        self.n_felt = len(task.first_antenna.planes) * len(self.sensors)
        self._window = np.zeros((n, task.window, self.n_felt))
        self._drawn = np.zeros((n, _BLOCK, self.n_felt))
        self._used = np.full(n, _BLOCK)

    def save(self) -> tuple[Any, ...]:
        """This moment of all lanes, for :meth:`load`."""
        kept = (self.base, self.time, self._paid, self.work, self.fresh)
        copies = (array.copy() for array in kept)
        return (self.simulations.snapshot(), [*self._rate], self.state, *copies)

    def load(self, saved: tuple[Any, ...]) -> None:
        """Go back to a moment, to the last bit; what was felt and its noise stay as they are."""
        snapshot, rate, self.state, *kept = saved
        self.simulations.restore(snapshot)
        self._rate = [*rate]
        copies = (array.copy() for array in kept)
        self.base, self.time, self._paid, self.work, self.fresh = copies

    def begin(self, lane: int, rng: np.random.Generator, start: Start | None = None) -> None:
        """Begin an episode in one lane, which draws what it meets (unless given) and its noise from
        ``rng``.
        """
        self.starts[lane] = start = start or self.task.begin(rng)
        self._rngs[lane], self._used[lane], self.fresh[lane] = rng, _BLOCK, True
        self.base[lane] = self.time[lane] = self.work[lane] = 0.0
        self._heading[lane] = start.scene.base[2]
        rest = self._feel(start.scene.initial_angle[None])[0]
        for _ in range(self.task.window):
            self._push([lane], rest[None])

    def _push(self, lanes: Sequence[int], angle: np.ndarray) -> None:
        """A sample (lane, sensor) of some lanes, to which their noise is added."""
        self._window[lanes, :-1] = self._window[lanes, 1:]
        if not self.task.noise.is_gaussian:
            for lane, clean in zip(lanes, angle, strict=True):
                noisy = self.task.noise.add(clean[None, :, None], self._rngs[lane])
                self._window[lane, -1] = noisy[0, :, 0]
            return
        for lane in lanes:
            if self._used[lane] == _BLOCK:
                self._drawn[lane] = self._rngs[lane].standard_normal(self._drawn.shape[1:])
                self._used[lane] = 0
        drawn = self._drawn[lanes, self._used[lanes]]
        self._window[lanes, -1] = angle + self.task.measure_noise(angle) * drawn
        self._used[lanes] += 1

    def _feel(self, angle: np.ndarray) -> np.ndarray:
        """What sensors feel (lane, number) of the hinges' angles (lane, segment), in space (lane,
        plane, segment)."""
        return angle[..., self.sensors].reshape(-1, self.n_felt)

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
        self.time[active] += SAMPLE
        self.base[active, 0] += SAMPLE * self.base[active, 2]
        sound = [lane for lane in active if self.simulations.failed[lane] is None]
        self._push(sound, self._feel(state.angle[sound]))
        if self.task.first_antenna.spatial:  # whose turns are all about z
            self.base[sound, 1] += SAMPLE * self.base[sound, 3]
        else:
            self.base[sound, 1] = state.base[sound, 2] - self._heading[sound]
        spent = state.base_work + np.nansum(state.object_work, axis=1)
        self.work[sound] = (self._paid + MICRO * spent)[sound]

    def _command(self, lane: int, speed: float, turn: float) -> None:
        """Move one base by its action."""
        start = self.starts[lane]
        _, heading, before, _ = self.base[lane].tolist()
        if not self.fresh[lane]:
            change = self.task.acceleration * SAMPLE
            speed = before + min(max(speed - before, -change), change)
        x, y, *up = start.direction
        if heading:  # from +y towards +x
            c, s = math.cos(heading), math.sin(heading)
            x, y = c * x + s * y, c * y - s * x
        self.base[lane, 2:] = speed, turn
        rate = (speed * x, speed * y, *(speed * z for z in up), turn)
        if self.fresh[lane]:
            moving = BaseMotion(velocity=rate[:-1], turn=turn)  # type: ignore[arg-type]  # 2 or 3
            self.simulations.reset(lane, replace(start.scene, base_motion=moving))
            self._paid[lane] = _compute_energy(start.scene, rate)
            self.fresh[lane] = False
        elif rate != self._rate[lane]:
            self.simulations.move_base(lane, rate[:-1], turn)
        self._rate[lane] = rate

    def observe(self) -> dict[str, np.ndarray]:
        """What the bodies know now, in arrays of their own.

        ``angle`` (lane, window, sensor) [rad] holds the last samples of every sensor with their
        noise, the newest last, in space the sensors of one plane after those of the other; ``base``
        (lane, 4) and ``time`` (lane, 1) are the arena's.
        """
        return {
            "angle": self._window.copy(),
            "base": self.base.copy(),
            "time": self.time[:, None].copy(),
        }

    @property
    def felt(self) -> np.ndarray:
        """What the sensors would say without noise (lane, sensor) [rad]."""
        rest = self._feel(np.array([start.scene.initial_angle for start in self.starts]))
        now = rest if self.state is None else self._feel(self.state.angle)
        return np.where(self.fresh[:, None], rest, now)

    @property
    def targets(self) -> np.ndarray:
        """What is asked for (lane,), as it is now."""
        bases = np.zeros((self.n, 3)) if self.state is None else self.state.base
        return np.array(
            [
                self.task.measure(start, np.array(start.scene.base) if fresh else base)
                for start, base, fresh in zip(self.starts, bases, self.fresh, strict=True)
            ]
        )

    @property
    def touching(self) -> np.ndarray:
        """Whether (lane,) the antenna is in contact: what the body is not told."""
        if self.state is None:
            return np.zeros(self.n, bool)
        return np.isfinite(self.state.contact_place) & ~self.fresh

    @property
    def failed(self) -> list[Exception | None]:
        """The error that ended each lane's episode, or None."""
        return [
            None if fresh else error
            for error, fresh in zip(self.simulations.failed, self.fresh, strict=True)
        ]

    @property
    def over(self) -> np.ndarray:
        """Whether (lane,) the time is up."""
        return self.time >= self.task.duration - 1e-9


def _compute_energy(scene: Scene, rate: tuple[float, ...]) -> float:
    """Energy of motion [µJ] of an antenna that is carried along unbent, its segments as points at
    their middle, in space at their centre of mass.
    """
    if scene.antenna.spatial:
        ends = scene.antenna.shape(scene.initial_angle, np.array(scene.base[3:]))
        share = (scene.antenna.mass_centre / scene.antenna.segment_length)[:, None]
        turning = np.cross([0.0, 0.0, -rate[-1]], (1 - share) * ends[:-1] + share * ends[1:])
        square = ((np.array(rate[:-1]) + turning) ** 2).sum(axis=1)
        return MICRO * 0.5 * float(scene.antenna.segment_mass @ square)
    points = scene.antenna.shape(scene.initial_angle, scene.base[2])
    middle = (points[:-1] + points[1:]) / 2
    turned = middle[:, ::-1] * [1.0, -1.0]  # from +y towards +x
    velocity = np.array(rate[:2]) + rate[2] * turned
    return MICRO * 0.5 * float(scene.antenna.segment_mass @ (velocity**2).sum(axis=1))
