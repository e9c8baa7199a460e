"""Every registered engine runs a touch as it stands, and says what it does not follow."""

import numpy as np
import pytest

import feeler
from feeler import Ball, Trial, presets
from feeler.errors import InvalidInput
from feeler.objects import BaseMotion
from feeler.physics.engine import ENGINES, choose_timestep
from feeler.physics.simulation import Simulation

ANTENNA = presets.cockroach()
TRIAL = Trial(feature=Ball(radius=1.5), location=0.5, speed=0.3)


@pytest.mark.further
@pytest.mark.parametrize("engine", list(ENGINES))
def test_touch_runs_with_the_default_timestep_of_each_engine(engine):
    tensors = feeler.touch(ANTENNA, TRIAL, engine=engine, duration=30.0)
    assert tensors.attrs["timestep"] == choose_timestep(None, engine)
    assert 0.01 < float(abs(tensors["angle"]).max()) < 0.06


@pytest.mark.further
@pytest.mark.parametrize(("radius", "speed"), [(1.5, 0.3), (0.5, 0.3), (1.5, 0.06)])
@pytest.mark.parametrize("engine", ["rod", "rod-inertia"])
def test_the_rod_follows_a_ball_until_it_slips_off(engine, radius, speed):
    trial = Trial(feature=Ball(radius=radius), location=0.5, speed=speed, friction=0.0)
    found = {}
    for name in (engine, "chain-consistent"):
        simulation, peaks = Simulation(ANTENNA, trial, engine=name), []
        while simulation.time < 290.0:
            simulation.step(1.0)
            peaks.append(np.abs(simulation.angle).max())
        found[name] = max(peaks), np.argmax(peaks)
    (peak, at), (expected, expected_at) = found.values()
    assert peak == pytest.approx(expected, rel=0.06)
    assert at == pytest.approx(expected_at, rel=0.06)


@pytest.mark.parametrize("engine", ["rod", "rod-inertia"])
def test_a_rod_refuses_the_softness_that_it_does_not_read(engine):
    for make in (
        lambda: feeler.touch(ANTENNA, TRIAL, engine=engine, contact="hard", duration=5.0),
        lambda: Simulation(ANTENNA, TRIAL, engine=engine, contact="hard"),
    ):
        with pytest.raises(InvalidInput, match="neither solref nor solimp"):
            make()


def test_a_rod_without_inertia_refuses_velocities():
    rates = np.full(ANTENNA.n_segments, 1e-3)
    with pytest.raises(InvalidInput, match="velocity= means nothing"):
        Simulation(ANTENNA, engine="rod", velocity=rates)
    Simulation(ANTENNA, engine="rod-inertia", velocity=rates)


@pytest.mark.parametrize("engine", ["chain", "chain-consistent", "mujoco"])
def test_who_follows_the_contact_refuses_steps_that_it_does_not_allow(engine):
    with pytest.raises(InvalidInput, match="too large for the contact's time constant"):
        feeler.touch(ANTENNA, TRIAL, engine=engine, timestep=0.5, duration=5.0)


@pytest.mark.parametrize("engine", list(ENGINES))
def test_a_recorded_base_begins_where_its_path_does(engine):
    time = np.arange(5.0)
    pose = np.column_stack([0.01 * time + 1.0, 0.0 * time + 2.0, 0.0 * time + 0.3])
    simulation = Simulation(ANTENNA, base=BaseMotion(time=time, pose=pose), engine=engine)
    np.testing.assert_allclose(simulation.base, [1.0, 2.0, 0.3], atol=1e-9)
    np.testing.assert_allclose(simulation.shape()[0], [1.0, 2.0], atol=1e-9)
