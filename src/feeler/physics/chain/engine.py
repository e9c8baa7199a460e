"""The chain engine's two schemes of contact: MuJoCo's own, and one with the implicit damping in it."""

from functools import partial

from feeler.physics.chain.batch import LANES, ChainStepper
from feeler.physics.engine import Engine

PARITY = Engine(make=partial(ChainStepper, damped=False), timestep=0.02, lanes=LANES)
CONSISTENT = Engine(make=partial(ChainStepper, damped=True), timestep=0.05, lanes=LANES)
