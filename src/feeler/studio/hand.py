"""By hand: objects and the antenna's base follow the mouse while the simulation runs."""

import time
from collections.abc import Callable
from threading import Event, Lock
from typing import Any

import numpy as np

from feeler.physics.lanes import Simulations
from feeler.studio.touching import (
    SAMPLE_INTERVAL,
    Readings,
    describe_scene,
    hash_tensor,
    make_simulation,
)
from feeler.studio.wish import TouchWish, read_number

_FRAME = 1 / 60  # s
LONGEST = (
    4000  # [C] samples of one recording; then time stands still, so that memory stays bounded
)
_MAX_SPEED, _MAX_TURN = (
    1.2,
    0.03,
)  # [C] mm/ms and rad/ms; the hand is not followed faster than that
_GLIDE = 6.0  # [C] ms in which a hand at rest would be reached
_STILL = 2e-5  # rad/ms; slower than this everywhere, with nothing in motion, time stands still
Say = Callable[..., None]
Command = tuple[int, int, float, float, float]
"""Sample before which it holds, object (−1: the base), velocity x, y [mm/ms] and turn [rad/ms]."""


class Hand:
    """Where the hand is, and the run that follows it."""

    def __init__(self) -> None:
        self._lock, self._ended = Lock(), Event()
        self._aims: dict[int, tuple[float, float, float]] = {}

    def aim(self, message: dict[str, Any]) -> None:
        """Take where an object (its number, or −1 for the base) should go: x, y [mm] and, for the
        base, turn [rad].
        """
        what = message.get("what")
        if what == "end":
            self._ended.set()
            return
        number = int(read_number(what, "aim.what", -1, 100))
        place = [
            read_number(message.get(name, 0.0), f"aim.{name}", -1e4, 1e4)
            for name in ("x", "y", "turn")
        ]
        with self._lock:
            self._aims[number] = (place[0], place[1], place[2])

    def end(self) -> None:
        """End the run."""
        self._ended.set()

    def begin(self) -> None:
        """A run is asked for: the one before ends, and what is said from now on is for this one."""
        with self._lock:
            self._ended.set()
            self._ended, self._aims = Event(), {}

    def run(self, wish: TouchWish, pace: float, say: Say, stop: Event) -> None:
        """Simulate until the hand lets go; ``pace`` is simulated time per real time."""
        ended = self._ended
        simulation, readings, commands = make_simulation(wish), Readings(), _hold_all(wish)
        _apply(simulation, commands)
        antenna = wish.antenna.make()
        say({"part": "begin", "total": LONGEST, **describe_scene(wish)})
        readings.add(simulation)
        sensed = [readings.angle[antenna.sensors - 1]]
        done, sent, due = 1, 0, 1.0
        while not (stop.is_set() or ended.is_set()):
            began = time.monotonic()
            due = min(due + pace * 1e3 * _FRAME / SAMPLE_INTERVAL, done + 40)
            while done < min(int(due), LONGEST) and not stop.is_set():
                new = self._steer(simulation, done, max(_GLIDE, 1.5e3 * _FRAME * pace))
                commands += new
                _apply(simulation, new)
                if _is_still(simulation, commands):
                    due = float(done)
                    break
                simulation.step(SAMPLE_INTERVAL)
                readings.add(simulation)
                sensed.append(readings.angle[antenna.sensors - 1])
                done += 1
            if readings.rows:
                say({"part": "piece", "first": sent}, **readings.take())
                sent = done
            if done >= LONGEST:
                break
            ended.wait(max(0.0, _FRAME - (time.monotonic() - began)))
        if not stop.is_set():
            tensor = np.array(sensed).T
            end = {
                "part": "end",
                "hash": hash_tensor(tensor),
                "preview": wish.preview,
                "commands": commands,
            }
            say(end)

    def _steer(self, simulation: Simulations, sample: int, glide: float) -> list[Command]:
        """Commands that bring everything nearer to where the hand wants it, where they change."""
        with self._lock:
            aims = dict(self._aims)
        state, found = simulation.state, []
        for what, (x, y, turn) in aims.items():
            if what >= state.place.shape[1]:
                continue
            here = state.base[0] if what < 0 else np.append(state.place[0, what], turn)
            way = (np.array([x, y]) - here[:2]) / glide
            fast = float(np.hypot(*way))
            way *= min(1.0, _MAX_SPEED / fast) if fast > 1e-4 else 0.0
            spin = (
                float(np.clip((turn - here[2]) / glide, -_MAX_TURN, _MAX_TURN))
                if what < 0
                else 0.0
            )
            found.append(
                (sample, what, float(way[0]), float(way[1]), spin if abs(spin) > 1e-5 else 0.0)
            )
        return found


def _hold_all(wish: TouchWish) -> list[Command]:
    """Commands by which nothing moves by itself."""
    return [(1, number, 0.0, 0.0, 0.0) for number in range(1 + len(wish.objects))]


def _apply(simulation: Simulations, commands: list[Command]) -> None:
    """Give commands to a simulation."""
    for _, what, vx, vy, turn in commands:
        if what < 0:
            simulation.move_base(0, (vx, vy), turn)
        else:
            simulation.move_object(0, what, (vx, vy), turn)


def replay(wish: TouchWish, commands: list[Command], n_samples: int) -> dict[str, np.ndarray]:
    """The readings of a run again, to the last bit."""
    simulation, readings = make_simulation(wish), Readings()
    readings.add(simulation)
    waiting = sorted(commands, key=lambda command: command[0])
    for k in range(1, n_samples):
        while waiting and waiting[0][0] <= k:
            _apply(simulation, [waiting.pop(0)])
        simulation.step(SAMPLE_INTERVAL)
        readings.add(simulation)
    return readings.take()


def read_commands(value: Any) -> list[Command]:
    """Commands from a page."""
    items = value if isinstance(value, list) and len(value) <= 20 * LONGEST else []
    found: list[Command] = []
    for item in items:
        row = item if isinstance(item, list) and len(item) == 5 else [None] * 5
        numbers = [read_number(number, "command", -1e5, 1e5) for number in row]
        found.append((int(numbers[0]), int(numbers[1]), numbers[2], numbers[3], numbers[4]))
    return found


def _is_still(simulation: Simulations, commands: list[Command]) -> bool:
    last = {what: (vx, vy, turn) for _, what, vx, vy, turn in commands}
    moving = any(abs(number) > 0 for rates in last.values() for number in rates)
    return not moving and float(np.abs(simulation.state.velocity).max()) < _STILL
