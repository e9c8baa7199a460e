"""Contact is smooth: difference quotients of a touch converge at second order."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

import feeler
from feeler.physics.run import expect_motions, simulate
from feeler.physics.scene import Clock, make_scene

ANTENNA = feeler.presets.cockroach()
CLOCK = Clock(duration=35.0, timestep=0.05)
SHAPES = [
    feeler.Ball(radius=1.5),
    feeler.Box(half_width=1.5, half_height=1.5),
    feeler.Triangle(half_width=1.5, half_height=1.5),
]


@pytest.mark.parametrize("field", ["stiffness", "damping"])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.kind)
def test_difference_quotients_converge_at_second_order(shape, field):
    scene = make_scene(ANTENNA, feeler.Trial(feature=shape, location=0.7, speed=0.6))
    direction = np.random.default_rng(1).standard_normal(140)

    def differ(step: float) -> np.ndarray:
        own = getattr(ANTENNA, field)
        antennas = [
            ANTENNA.replace(**{field: own * np.exp(s * direction)}) for s in (step, -step)
        ]
        scenes = [replace(scene, antenna=antenna) for antenna in antennas]
        up, down = expect_motions(simulate(scenes, CLOCK, workers=1))
        return (up.angle - down.angle) / (2 * step)

    found = [differ(step) for step in (2e-4, 1e-4, 5e-5, 2.5e-5)]
    assert np.abs(found[-1]).max() > 0.01
    first, _, last = (np.abs(a - b).max() for a, b in itertools.pairwise(found))
    assert first < 1e-7
    assert first > 8 * last  # two halvings: second order gives 16, first order 4
