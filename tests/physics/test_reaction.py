"""What a base does to its antenna: Newton's and Euler's laws over all segments, and statics."""

from dataclasses import replace

import numpy as np
import pytest

from feeler.objects.motion import BaseMotion
from feeler.physics.chain.stepper import ChainStepper
from feeler.physics.mujoco import _compute_reaction
from feeler.physics.run import run_scene
from feeler.physics.scene import Clock, Path

from .scenes import DYNAMIC, touch


@pytest.mark.parametrize("damped", [False, True])
@pytest.mark.parametrize("contact", ["smooth", "hard"])
def test_the_chain_s_reaction_is_newton_s_and_euler_s(damped, contact):
    """From the accelerations that it had, with contacts, gravity and a base that moves and
    turns.
    """
    motion = BaseMotion(velocity=(0.05, -0.02), turn=0.002)
    scene = replace(
        touch(n=20, contact=contact),
        base=(1e-3, 0.0, 0.0),
        base_motion=motion,
        gravity=(1e-3, -9.81e-3),
    )
    h, touched = 0.02, 0
    stepper = ChainStepper([scene], h, damped)
    last = np.array(scene.base_velocity)
    for k in range(300):
        before, rate = stepper.read(), (0.05 + 1e-3 * k, -0.02, 0.002 + 1e-5 * k)
        then = last
        stepper.step(1, {0: np.array([rate])})
        after, last, contacts = stepper.read(), np.array(rate), stepper.read_contacts(0)
        touched += len(contacts) > 0
        force, moment = _compute_reaction(
            scene.antenna,
            before.angle[0],
            before.velocity[0],
            (after.velocity - before.velocity)[0] / h,
            np.array([before.base[0], then, (last - then) / h]),
            np.asarray(scene.gravity),
            contacts.point,
            contacts.force,
        )
        np.testing.assert_allclose(
            after.base_force[0], force, rtol=1e-6, atol=1e-6 * np.hypot(*force)
        )
        assert after.base_moment[0] == pytest.approx(moment, rel=1e-6, abs=1e-12)
    assert touched > 100


@pytest.mark.further
@pytest.mark.parametrize("engine", DYNAMIC)
def test_at_rest_forces_cancel_and_the_base_holds_the_first_spring(engine):
    scene = touch(n=8, size=0.5, contact="smooth", friction=0.5, speed=0.05)
    velocity = scene.objects[0].velocity
    scene = replace(
        scene,
        paths=(Path(velocity=(velocity, (0.0, 0.0)), end=(6.0,)),),
        gravity=(0.0, -9.81e-3),
    )
    found = run_scene(scene, Clock(duration=400, sample_interval=50, timestep=0.05), engine)
    antenna = scene.antenna
    assert np.abs(found.velocity[-1]).max() < 1e-7
    assert np.hypot(*found.force[-1]) > 1e-5
    weight = antenna.segment_mass.sum() * np.array(scene.gravity)
    total = found.base_force[-1] + found.force[-1] + weight
    np.testing.assert_allclose(total, 0.0, atol=1e-4 * np.hypot(*found.force[-1]))
    bend = antenna.stiffness[0] * (antenna.rest_angle[0] - found.angle[-1, 0])
    assert found.base_moment[-1] == pytest.approx(bend, rel=1e-4)
