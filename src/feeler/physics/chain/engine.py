"""The chain engine's two schemes of contact: MuJoCo's own, and one with the implicit damping in
it.
"""

from collections.abc import Sequence
from functools import partial

from feeler.physics.chain.fields import LANES
from feeler.physics.engine import Engine
from feeler.physics.scene import Scene
from feeler.physics.stepper import Stepper


def _make(scenes: Sequence[Scene], timestep: float, *, damped: bool) -> Stepper:
    from feeler.physics.chain.batch import (
        ChainStepper,
    )  # numba is slow to load, and who only asks needs no stepper

    if scenes[0].antenna.spatial:
        from feeler.physics.chain.space.batch import SpaceChainStepper

        return SpaceChainStepper(scenes, timestep, damped)
    return ChainStepper(scenes, timestep, damped)


PARITY = Engine(make=partial(_make, damped=False), timestep=0.02, lanes=LANES)
CONSISTENT = Engine(make=partial(_make, damped=True), timestep=0.05, lanes=LANES)
