"""Engines by name. Each is imported when first asked for, so that analysis needs no simulator."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from types import ModuleType

from feeler.errors import InvalidInput, SimulationDiverged
from feeler.physics.clock import Clock
from feeler.physics.scene import Motion, Scene

TIMESTEP = 0.02  # ms, see docs/convergence.md [C]

Outcome = Motion | SimulationDiverged


@dataclass(frozen=True, kw_only=True)
class Engine:
    """A simulator: ``run_group`` simulates scenes that ``make_groups`` put together, in order."""

    run_group: Callable[[Sequence[Scene], Clock], list[Outcome]]
    make_groups: Callable[[Sequence[Scene]], list[list[int]]]


def _mujoco() -> ModuleType:
    from feeler.physics import mujoco

    return mujoco


def _chain() -> ModuleType:
    from feeler.physics.chain import engine

    return engine


def _run_one_by_one(scenes: Sequence[Scene], clock: Clock) -> list[Outcome]:
    def run(scene: Scene) -> Outcome:
        try:
            return _mujoco().run(scene, clock)
        except SimulationDiverged as error:
            return error

    return [run(scene) for scene in scenes]


def _make_chain(scheme: str) -> Engine:
    return Engine(
        run_group=lambda scenes, clock: _chain().run_batch(scenes, clock, scheme=scheme),
        make_groups=lambda scenes: _chain().make_groups(scenes),
    )


ENGINES = {
    "chain-consistent": _make_chain("consistent"),  # damping inside the contact solve: 1 % at the default timestep
    "chain": _make_chain("parity"),  # MuJoCo's discrete equations, step for step
    "mujoco": Engine(run_group=_run_one_by_one, make_groups=lambda scenes: [[i] for i in range(len(scenes))]),
}
DEFAULT_ENGINE = "chain-consistent"


def get_engine(name: str) -> Engine:
    """The engine called ``name``; the error lists the valid names."""
    if name not in ENGINES:
        raise InvalidInput(f"unknown engine {name!r}; valid: {', '.join(ENGINES)}.")
    return ENGINES[name]


def run_scene(scene: Scene, clock: Clock, engine: str = DEFAULT_ENGINE) -> Motion:
    """The motion of one scene.

    Raises
    ------
    SimulationDiverged
        Angles left the finite numbers.
    """
    outcome = get_engine(engine).run_group([scene], clock)[0]
    if isinstance(outcome, Exception):
        raise outcome
    return outcome
