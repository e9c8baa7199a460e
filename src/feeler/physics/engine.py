"""Engines by name, and what every engine offers."""

import logging
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from threading import Timer
from typing import Any, Protocol

import numpy as np
from numba.core.event import Listener, install_listener

from feeler.physics.contact import Contact
from feeler.physics.scene import Scene
from feeler.records import Registry

# What every engine offers: scenes in lanes that are stepped together, and each driven and read
# by itself.


@dataclass(frozen=True, kw_only=True, eq=False)
class State:
    """Where every lane is now; forces are those of the step that led there.

    In space angles are (lane, plane, segment), vectors have three numbers, the base has its place
    and its rotation vector, and its moment is a vector.

    Attributes
    ----------
    angle : np.ndarray
        Hinge angles (lane, segment) [rad].
    velocity : np.ndarray
        Their rates (lane, segment) [rad/ms].
    force : np.ndarray
        Contact force of each object on the antenna (lane, object, 2) [N].
    place : np.ndarray
        Place of each object, its foremost point (lane, object, 2) [mm].
    forward : np.ndarray
        First axis of each object's frame (lane, object, 2).
    object_work : np.ndarray
        Work done on the antenna by each object since time 0 (lane, object) [mJ].
    base : np.ndarray
        Place [mm] and heading [rad] of the base (lane, 3).
    base_force : np.ndarray
        Force of the base on the antenna (lane, 2) [N].
    base_moment : np.ndarray
        Moment of the base on the antenna (lane,) [N·mm], positive as angles are.
    base_work : np.ndarray
        Work done on the antenna by its base since time 0 (lane,) [mJ].
    contact_place : np.ndarray
        Where the contacts act, weighted by force (lane,), as a share of the length; NaN without
        contact.
    sink : np.ndarray
        How deep contacts have sunk at most since time 0 (lane,), over the smaller radius.
    """

    angle: np.ndarray
    velocity: np.ndarray
    force: np.ndarray
    place: np.ndarray
    forward: np.ndarray
    object_work: np.ndarray
    base: np.ndarray
    base_force: np.ndarray
    base_moment: np.ndarray
    base_work: np.ndarray
    contact_place: np.ndarray
    sink: np.ndarray


@dataclass(frozen=True, kw_only=True, eq=False)
class Contacts:
    """The contacts of one lane's last step, (contact, …).

    Attributes
    ----------
    object : np.ndarray
        Number of the object.
    segment : np.ndarray
        Number of the segment, 1 at the base.
    place : np.ndarray
        Arc length from the base as a share of the length.
    point : np.ndarray
        (contact, 2) [mm].
    normal : np.ndarray
        Unit vector (contact, 2) from the object to the antenna.
    distance : np.ndarray
        Gap between the surfaces [mm], negative.
    force : np.ndarray
        Force on the antenna (contact, 2) [N].
    """

    object: np.ndarray
    segment: np.ndarray
    place: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    distance: np.ndarray
    force: np.ndarray

    def __len__(self) -> int:
        return len(self.place)


MICRO = 1e3  # µJ in a mJ: work leaves the engines in µJ
_COLUMNS = {
    "force": (2, 3),
    "work": (2, 2),
    "base": (3, 6),
    "base_force": (2, 3),
    "base_moment": (1, 3),
    "contact_place": (1, 1),
    "sink": (1, 1),
}
"""What a sample holds behind the angles and velocities of all hinges, and how many numbers each is,
in the plane and in space.
"""


def make_row(state: State) -> np.ndarray:
    """A sample (lane, column): angle, velocity, and COLUMNS; forces and works are sums over the
    objects.
    """
    work = np.stack([state.base_work, state.object_work.sum(axis=1)], axis=1)
    lanes, force = len(state.angle), state.force.sum(axis=1)
    base = (state.base, state.base_force, state.base_moment)
    parts = (state.angle, state.velocity, force, work, *base, state.contact_place, state.sink)
    return np.concatenate([part.reshape(lanes, -1) for part in parts], axis=1)


def split_rows(tape: np.ndarray, hinges: tuple[int, ...]) -> dict[str, np.ndarray]:
    """The samples (…, column) by name, as copies (…, number), angles in the shape ``hinges``; what
    COLUMNS counts as one number is (…). Work comes in µJ.
    """
    sizes = {name: size[len(hinges) - 1] for name, size in _COLUMNS.items()}
    n = int(np.prod(hinges))
    ends = np.cumsum([n, n, *sizes.values()])[:-1]
    parts = dict(zip(("angle", "velocity", *sizes), np.split(tape, ends, axis=-1), strict=True))
    found = {
        name: (part[..., 0] if sizes.get(name) == 1 else part).copy()
        for name, part in parts.items()
    }
    for name in ("angle", "velocity"):
        found[name] = found[name].reshape(*tape.shape[:-1], *hinges)
    found["work"] *= MICRO
    return found


class Stepper(Protocol):
    """Scenes in lanes. Commands hold from the next step on; a lane's numbers never depend on its
    neighbours.

    Attributes
    ----------
    advice : str
        What helps where a simulation diverges.
    """

    scenes: list[Scene]
    timestep: float
    advice: str = "Use a smaller timestep, a slower or smaller feature, or a softer contact"

    def step(self, n_steps: int, drives: Mapping[int, np.ndarray] | None = None) -> bool:
        """Take steps in every lane; whether some lane has come to an end.

        ``drives``: by lane, base velocities (step, 3: x, y [mm/ms], turn [rad/ms]) at each step's
        end, in place of the commanded ones.
        """

    def record(
        self,
        tape: np.ndarray,
        sample: int,
        stop: int,
        every: int,
        drives: Mapping[int, np.ndarray] | None = None,
    ) -> tuple[int, bool]:
        """Take ``every`` steps before each sample ``sample`` … ``stop`` − 1, and write its row to
        ``tape`` (lane, sample, column). The first sample that was not written, and whether some
        lane has come to an end, after which nothing goes on.
        """
        for k in range(sample, stop):
            own = slice((k - sample) * every, (k - sample + 1) * every)
            ended = self.step(
                every, {lane: rates[own] for lane, rates in drives.items()} if drives else None
            )
            tape[:, k] = make_row(self.read())
            if ended:
                return k + 1, True
        return stop, False

    def read(self) -> State:
        """The state of every lane, as copies."""

    def read_sink(self) -> np.ndarray:
        """How deep contacts have sunk at most since time 0 (lane,), over the smaller radius."""

    def read_contacts(self, lane: int) -> Contacts:
        """The contacts of a lane's last step."""

    def find_broken(self) -> np.ndarray:
        """Whether each lane (lane,) has come to an end: numbers that are not finite, or
        :meth:`explain` knows.
        """

    def explain(self, lane: int) -> Exception | None:
        """What ended a lane, if the engine knows better than that its numbers are not finite."""
        return None

    def move_base(self, lane: int, velocity: Any, turn: Any) -> None:
        """Command the base: velocity (2,) and turn rate; in space both (3,)."""

    def move_object(self, lane: int, o: int, velocity: Any, turn: Any) -> None:
        """Command an object, likewise."""

    def read_rates(self, lane: int) -> tuple[np.ndarray, np.ndarray]:
        """What base (3,) and objects (object, 3) of a lane are commanded: velocity and turn
        rate; in space (6,) and (object, 6).
        """

    def save(self, lane: int) -> Any:
        """All that a lane's future depends on, but for its scene."""

    def load(self, lane: int, saved: Any) -> None:
        """Put a lane back to where it was saved, to the last bit."""

    def reset(self, lane: int, scene: Scene) -> None:
        """Begin another scene in one lane."""


# Engines by name. Each is imported when first asked for, so that analysis needs no simulator.


@dataclass(frozen=True, kw_only=True)
class Engine:
    """A simulator: ``make(scenes, timestep)`` puts up to ``lanes`` scenes of one segment count into
    a Stepper.

    Attributes
    ----------
    timestep : float
        What it takes where nothing else is said [ms], see docs/convergence.md [C].
    """

    make: Callable[[Sequence[Scene], float], Stepper]
    timestep: float
    lanes: int = 1


ENGINES: Registry[Engine] = Registry(
    "engine",
    {
        "chain-consistent": (
            "feeler.physics.chain.stepper:CONSISTENT"
        ),  # damping inside the contact solve
        "chain": "feeler.physics.chain.stepper:PARITY",  # MuJoCo's equations, step for step
        "mujoco": "feeler.physics.mujoco:MUJOCO",  # the reference
    },
)
"""Every engine by its name."""
DEFAULT_ENGINE = "chain-consistent"


def choose_timestep(timestep: float | None, engine: str, *contacts: Contact) -> float:
    """The timestep [ms], by default the engine's own, as much smaller as the shortest time constant
    of these contacts is below 0.2 ms.
    """
    if timestep is not None:
        return timestep
    usual = ENGINES[engine].timestep
    return min([contact.scale_timestep(usual) for contact in contacts], default=usual)


_LOADING = 1.5  # s; loading compiled code from the cache is faster


_known: set[object] = set()
_told: set[str] = set()


@contextmanager
def announce_compiling(engine: str, lanes: int = 1) -> Iterator[None]:
    """Around an engine's first call for a number of lanes: log that it compiles, if numba compiles
    anything (code that is loaded from its cache is not compiled) and takes longer than LOADING.
    """
    message = (
        f"compiling the {engine} engine for this machine; it happens once and takes some"
        " 15 s, longer while the machine is busy"
    )

    def say() -> None:
        if engine not in _told:
            _told.add(engine)
            logging.getLogger("feeler").warning(message)

    if (engine, lanes) in _known:
        yield
        return
    timer = Timer(_LOADING, say)
    timer.daemon = True
    try:
        with install_listener("numba:compile", _Starter(timer)):
            yield
        _known.add((engine, lanes))
    finally:
        timer.cancel()


class _Starter(Listener):
    """Starts a timer when numba first compiles something."""

    def __init__(self, timer: Timer) -> None:
        self._timer = timer

    def on_start(self, event: Any) -> None:
        if self._timer.ident is None:
            self._timer.start()

    def on_end(self, event: Any) -> None:
        """Nothing: the timer is cancelled when all is done."""
