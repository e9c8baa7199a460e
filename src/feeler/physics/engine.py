"""Engines by name. Each is imported when first asked for, so that analysis needs no simulator."""

from collections.abc import Callable
from concurrent.futures import Executor

from feeler.errors import InvalidInput, SimulationDiverged
from feeler.physics.clock import Clock
from feeler.physics.scene import Motion, Scene

TIMESTEP = 0.02  # ms, see docs/convergence.md [C]

Outcome = Motion | SimulationDiverged
Finished = Callable[[int, Outcome], None]


def _run_mujoco(scenes: list[Scene], clock: Clock) -> list[Outcome]:
    from feeler.physics import mujoco

    return [_catch(mujoco.run, scene, clock) for scene in scenes]


def _run_chain(scenes: list[Scene], clock: Clock) -> list[Outcome]:
    from feeler.physics import chain

    return chain.run_batch(
        scenes, duration=clock.duration, sample_interval=clock.sample_interval, timestep=clock.timestep
    )


def _catch(run: Callable[[Scene, Clock], Motion], scene: Scene, clock: Clock) -> Outcome:
    try:
        return run(scene, clock)
    except SimulationDiverged as error:
        return error


ENGINES: dict[str, Callable[[list[Scene], Clock], list[Outcome]]] = {"chain": _run_chain, "mujoco": _run_mujoco}
DEFAULT_ENGINE = "chain"


def get_engine(name: str) -> Callable[[list[Scene], Clock], list[Outcome]]:
    """The function that runs scenes on the engine called ``name``; the error lists the valid names."""
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
    outcome = get_engine(engine)([scene], clock)[0]
    if isinstance(outcome, SimulationDiverged):
        raise outcome
    return outcome


__all__ = ["DEFAULT_ENGINE", "ENGINES", "TIMESTEP", "Executor", "Finished", "Outcome", "get_engine", "run_scene"]
