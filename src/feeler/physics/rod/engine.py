"""The rod as an engine: without inertia, or with."""

from functools import partial

from feeler.physics.engine import Engine
from feeler.physics.rod.stepper import RodStepper

# [C] radii per step: a face without end is never passed through; other shapes should be as thick
STRIDE = 10.0
ROD = Engine(make=RodStepper, timestep=1.0, stride=STRIDE)
ROD_INERTIA = Engine(make=partial(RodStepper, inertia=True), timestep=1.0, stride=STRIDE)
