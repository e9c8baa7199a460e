"""Gradients: the chain run backwards gives what converged central differences give, for every
shape.
"""

from dataclasses import replace

import numpy as np
import pytest

import feeler
from feeler.errors import InvalidInput
from feeler.physics import gradient
from feeler.physics.clock import Clock
from feeler.physics.gradient import FIELDS, pull_back
from feeler.physics.scene import Path, make_scene
from feeler.physics.simulate import expect_motions, simulate

ANTENNA = feeler.presets.cockroach()
CLOCK = Clock(duration=35.0, timestep=0.05)
SHAPES = {
    "ball": (feeler.Ball(radius=1.5), 1e-3),
    "box": (feeler.Box(half_width=1.5, half_height=1.5), 1e-2),
    "triangle": (feeler.Triangle(half_width=1.5, half_height=1.5), 1e-2),
}
WEIGHTS = np.random.default_rng(0).standard_normal((1, CLOCK.n_samples, 140))
STEP = 1e-5  # where the differences have converged; at 1e-3 some are still wrong by a fifth


def make(shape, **fields):
    return make_scene(ANTENNA, feeler.Trial(feature=shape, location=0.7, speed=0.6, **fields))


def differ(scene, name, direction):
    own = getattr(ANTENNA, name)
    moved = [ANTENNA.replace(**{name: own * np.exp(s * STEP * direction)}) for s in (1, -1)]
    up, down = expect_motions(
        simulate([replace(scene, antenna=a) for a in moved], CLOCK, workers=1)
    )
    return np.sum((up.angle - down.angle) * WEIGHTS[0]) / (2 * STEP)


@pytest.mark.parametrize("name", SHAPES)
def test_backwards_gives_what_converged_differences_give(name):
    shape, allowed = SHAPES[name]
    scene, direction = make(shape), np.random.default_rng(1).standard_normal(140)
    found = pull_back([scene], CLOCK, WEIGHTS)
    for field in FIELDS:
        slope = found[field][0] * getattr(ANTENNA, field)
        scale = np.linalg.norm(slope)
        assert np.sum(slope * direction) == pytest.approx(
            differ(scene, field, direction), abs=allowed * scale, rel=allowed
        )


def test_long_runs_are_kept_in_pieces_and_lanes_do_not_matter(monkeypatch):
    scenes = [make(shape) for shape, _ in SHAPES.values()]
    alone = pull_back(scenes[1:2], CLOCK, WEIGHTS)
    monkeypatch.setattr(gradient, "SEGMENT", 250)
    together = pull_back(scenes, CLOCK, np.repeat(WEIGHTS, 3, axis=0))
    for field in FIELDS:
        assert together[field][1] == pytest.approx(
            alone[field][0], rel=1e-7, abs=1e-9 * np.abs(alone[field]).max()
        )


def test_what_does_not_touch_its_sensors_has_no_slope():
    assert not any(
        values.any() for values in pull_back([make(SHAPES["ball"][0])], CLOCK, 0 * WEIGHTS).values()
    )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"base_motion": feeler.BaseMotion(turn=0.01)}, "base at rest"),
        ({"paths": (Path(velocity=((0.1, 0.0),)),)}, "straight lines"),
    ],
)
def test_what_cannot_be_run_backwards_is_refused(change, words):
    with pytest.raises(InvalidInput, match=words):
        pull_back([replace(make(SHAPES["ball"][0]), **change)], CLOCK, WEIGHTS)


def test_weights_of_another_shape_are_refused():
    with pytest.raises(InvalidInput, match="weights must be"):
        pull_back([make(SHAPES["ball"][0])], CLOCK, WEIGHTS[:, :-1])
