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


@pytest.mark.parametrize("engine", ["rod", "rod-inertia"])
def test_an_engine_that_went_is_refused_with_those_that_there_are(engine):
    with pytest.raises(
        InvalidInput, match=f"unknown engine '{engine}'; valid: chain-consistent"
    ):
        feeler.touch(ANTENNA, TRIAL, engine=engine, duration=5.0)


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
