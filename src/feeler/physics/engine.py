"""Engines by name. Each is imported when first asked for, so that analysis needs no simulator."""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from threading import Timer

from feeler.physics.contact import Contact
from feeler.physics.scene import Scene
from feeler.physics.stepper import Stepper
from feeler.records.registry import Registry


@dataclass(frozen=True, kw_only=True)
class Engine:
    """A simulator: ``make(scenes, timestep)`` puts up to ``lanes`` scenes of one segment count into
    a Stepper.

    Attributes
    ----------
    timestep : float
        What it takes where nothing else is said [ms], see docs/convergence.md [C].
    check : Callable[[Contact, float], None]
        Refuses a contact that it does not follow, or not with such a timestep [ms].
    stride : float
        How far base and objects may move in a timestep, in radii of the antenna's thinnest segment.
    """

    make: Callable[[Sequence[Scene], float], Stepper]
    timestep: float
    lanes: int = 1
    check: Callable[[Contact, float], None] = Contact.check_timestep
    stride: float = 1.0

    @property
    def module(self) -> str:
        """Where the engine's code begins; results depend on all that it imports."""
        return (self.make.func if isinstance(self.make, partial) else self.make).__module__


ENGINES: Registry[Engine] = Registry(
    "engine",
    {
        "chain-consistent": (
            "feeler.physics.chain.engine:CONSISTENT"
        ),  # damping inside the contact solve
        "chain": "feeler.physics.chain.engine:PARITY",  # MuJoCo's discrete equations, step for step
        "mujoco": "feeler.physics.mujoco:MUJOCO",  # the reference
        "rod": (
            "feeler.physics.rod.engine:ROD"
        ),  # quasi-static: no inertia, implicit steps of any length
        "rod-inertia": "feeler.physics.rod.engine:ROD_INERTIA",  # the same with mass at its nodes
    },
)
"""Every engine by its name."""
DEFAULT_ENGINE = "chain-consistent"


def get_engine(name: str) -> Engine:
    """The engine called ``name``; the error lists the valid names."""
    return ENGINES[name]


def choose_timestep(timestep: float | None, engine: str, *contacts: Contact) -> float:
    """The timestep [ms], by default the engine's own; of engines that follow the contact it is as
    much smaller as the shortest time constant of these contacts is below 0.2 ms.
    """
    if timestep is not None:
        return timestep
    kind = get_engine(engine)
    follows = kind.check is Contact.check_timestep
    steps = [contact.scale_timestep(kind.timestep) for contact in contacts if follows]
    return min(steps, default=kind.timestep)


_LOADING = 1.5  # s; loading compiled code from the cache is faster


_known: set[object] = set()
_told: set[str] = set()


@contextmanager
def announce_compiling(engine: str, lanes: int = 1) -> Iterator[None]:
    """Around an engine's first call for a number of lanes: log that it compiles, if that takes
    longer than LOADING.
    """
    message = (
        f"compiling the {engine} engine for this machine; it happens once and takes some"
        " 15 s, longer while the machine is busy"
    )

    def say() -> None:
        if engine not in _told:
            _told.add(engine)
            logging.getLogger("feeler").warning(message)

    timer = Timer(_LOADING, say)
    timer.daemon = True
    if (engine, lanes) not in _known:
        timer.start()
    try:
        yield
        _known.add((engine, lanes))
    finally:
        timer.cancel()
